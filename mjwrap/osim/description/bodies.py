"""Bodies, frames, joints, coordinates and constraints of an OpenSim model. SI units; angles in rad."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjwrap.osim.description.functions import Piecewise

Array = NDArray[np.float64]
GROUND = "ground"


@dataclass(frozen=True)
class Frame:
    """A frame fixed to a body: position (3,) [m] and rotation matrix (3, 3) of the frame in the body's frame."""

    body: str  # "ground" or the name of a body
    position: Array
    rotation: Array
    name: str = ""  # as in the file, of an offset frame; empty for the body's own frame


@dataclass(frozen=True)
class Mesh:
    """A drawn shape on a body: a file (.vtp, .stl, .obj), or a primitive without one."""

    name: str
    frame: Frame
    file: str  # as written in the file; empty for a primitive
    scale: Array  # (3,)
    primitive: str = ""  # "Brick", "Sphere", "Cylinder", "Ellipsoid", ... where there is no file
    size: tuple[float, ...] = ()  # half lengths, radii, radius and half height, as OpenSim lists them
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    opacity: float = 1.0


@dataclass(frozen=True)
class Body:
    """A rigid body; inertia (3, 3) about its centre of mass, in the body's frame [kg m^2]."""

    name: str
    mass: float  # [kg]
    mass_center: Array  # (3,) [m]
    inertia: Array
    meshes: tuple[Mesh, ...] = ()


@dataclass(frozen=True)
class Coordinate:
    """A coordinate of a joint [rad or m]."""

    name: str
    joint: str
    motion: str  # "rotational", "translational" or "coupled"
    default: float
    default_speed: float
    range: tuple[float, float]
    clamped: bool
    locked: bool
    prescribed: Piecewise | None = None  # a function of time that is switched on
    free_to_satisfy_constraints: bool = False  # its default does not count when constraints are assembled


@dataclass(frozen=True)
class Axis:
    """One of the six motions of a joint: by value(coordinates) along or about an axis (3,)."""

    axis: Array
    coordinates: tuple[str, ...]  # names; none for a constant
    function: Piecewise  # of the only coordinate; a constant where there is none


@dataclass(frozen=True)
class Joint:
    """A joint: its child frame is moved in the parent frame, then turned about three body-fixed axes.

    As in the file, the child may be the body nearer to ground, and several joints may have one child.
    All joints are written so, pin, ball, free and the others too: an axis without motion has a constant function.
    EllipsoidJoint and ScapulothoracicJoint have `radii`: their translation is radii * (z of the turned frame), so that
    the origin stays on an ellipsoid. The fourth coordinate of a ScapulothoracicJoint then turns the child frame about
    the axis (-sin, cos, 0)(winging_direction) through (winging_origin, 0), both in the turned frame.
    """

    name: str
    kind: str  # the class in the file: CustomJoint, WeldJoint, PinJoint, ...
    parent: Frame
    child: Frame
    coordinates: tuple[Coordinate, ...]
    rotations: tuple[
        Axis, Axis, Axis
    ]  # in the order in which they turn; each axis in the frame turned so far
    translations: tuple[Axis, Axis, Axis]  # axes in the parent frame
    radii: Array | None = None  # (3,) of EllipsoidJoint and ScapulothoracicJoint [m]
    winging_origin: Array | None = None  # (2,) of a ScapulothoracicJoint [m]
    winging_direction: float = 0.0  # of a ScapulothoracicJoint [rad]


@dataclass(frozen=True)
class Coupler:
    """dependent = scale * function(independent)."""

    name: str
    dependent: str
    independent: tuple[str, ...]
    function: Piecewise  # of the only independent coordinate
    scale: float = 1.0


@dataclass(frozen=True)
class PointConstraint:
    """Two points (3,) of two bodies coincide."""

    name: str
    first: Frame
    second: Frame


@dataclass(frozen=True)
class WeldConstraint:
    """Two frames coincide."""

    name: str
    first: Frame
    second: Frame


@dataclass(frozen=True)
class DistanceConstraint:
    """Two points (the origins of two frames) keep a distance [m]."""

    name: str
    first: Frame
    second: Frame
    distance: float


@dataclass(frozen=True)
class PointOnLineConstraint:
    """A point of one body stays on a line of another: through the origin of `line`, along `direction` (3,) in it."""

    name: str
    line: Frame
    direction: Array
    point: Frame


Constraint = Coupler | PointConstraint | WeldConstraint | DistanceConstraint | PointOnLineConstraint
