"""Wrap objects and paths of an OpenSim model. SI units; angles in rad."""

from __future__ import annotations

from dataclasses import dataclass

from mjwrap.osim.description.bodies import Frame
from mjwrap.osim.description.functions import Piecewise

RANGE_TOLERANCE = (
    1e-5  # [rad or m] by which a conditional point's range is wider in OpenSim 4.6, at both ends
)


@dataclass(frozen=True)
class WrapObject:
    """A surface that paths wrap. A cylinder's and a torus' axis is z of the frame."""

    name: str
    kind: str  # "WrapCylinder", "WrapEllipsoid", "WrapSphere" or "WrapTorus"
    frame: Frame
    # [m] cylinder: radius, length; sphere: radius; ellipsoid: three semi-axes; torus, as in the file: inner_radius (the
    # tube's), outer_radius (the major one)
    dimensions: tuple[float, ...]
    quadrant: str  # "all", "x", "+x", "-x", ...: the side on which paths pass, "all" where both are allowed
    active: bool


@dataclass(frozen=True)
class Condition:
    """A coordinate and the range [rad or m] in which a conditional point belongs to the path, as in the file."""

    coordinate: str
    range: tuple[float, float]

    @property
    def held(self) -> tuple[float, float]:
        """The range in which the point belongs to the path in OpenSim, both ends included."""
        return self.range[0] - RANGE_TOLERANCE, self.range[1] + RANGE_TOLERANCE


@dataclass(frozen=True)
class MovingLocation:
    """x, y and z of a moving point as functions of one coordinate each; no name where the function is constant.

    As in OpenSim, the functions are constant outside the ranges of their coordinates.
    """

    coordinates: tuple[str, str, str]
    functions: tuple[Piecewise, Piecewise, Piecewise]


@dataclass(frozen=True)
class PathPoint:
    """A point of a path: the origin of a frame; of a moving point the frame that its location is given in."""

    name: str
    frame: Frame
    condition: Condition | None = None
    moving: MovingLocation | None = None


@dataclass(frozen=True)
class PathWrap:
    """A wrap object on a path: the segments on which it may act, from point `first` to point `last`, from 0 on."""

    object: str
    first: int
    last: int
    method: str = "hybrid"


@dataclass(frozen=True)
class Path:
    """A path: points in order, and wraps in the order of the file, which is not that along the path."""

    points: tuple[PathPoint, ...]
    wraps: tuple[PathWrap, ...]
    kind: str = "GeometryPath"  # or "Scholz2015GeometryPath", ...
