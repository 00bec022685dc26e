"""Wrapping surfaces: frozen, validated descriptions without a pose.

A surface knows its sizes and its row in the kernels' table (`kind`, `dims`, `size`); the mathematics is in
`mjwrap/kernels`. Axes of revolution are local z, as in MuJoCo.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from mjwrap import validation
from mjwrap.errors import GeometryError
from mjwrap.kernels import layout

FLATTEST_CONE = 1e-3  # smallest slope: a cone that is closer to a cylinder loses digits to its far apex


@dataclass(frozen=True)
class Surface:
    """A smooth closed or unbounded surface in its own frame."""

    kind: ClassVar[int]
    hollow: ClassVar[bool] = False  # whether a taut string may bridge a hollow of it and so touch it twice

    @property
    def dims(self) -> tuple[float, ...]:
        """Sizes in the order of the kernels' DIM columns [m]."""
        raise NotImplementedError(f"{type(self).__name__} has no sizes")

    @property
    def size(self) -> float:
        """A length by which steps on the surface are limited, about its smallest radius of curvature [m]."""
        return self.dims[0]


def _positive(surface: Surface, name: str, value: Any, unbounded: bool = False) -> float:
    """Return a size as a float; raise `GeometryError` unless it is positive and, if not `unbounded`, finite."""
    return validation.positive(value, f"{type(surface).__name__}: {name}", GeometryError, "m", unbounded)


def _axes(surface: Surface, name: str, value: Any, count: int) -> None:
    """Store a row of `count` positive sizes as a tuple of floats."""
    try:
        values = tuple(value)
    except TypeError:
        values = ()
    if len(values) != count:
        raise GeometryError(f"{type(surface).__name__}: {name} must be {count} sizes [m], not {value!r}")
    object.__setattr__(surface, name, tuple(_positive(surface, name, x) for x in values))


@dataclass(frozen=True)
class Cylinder(Surface):
    """A circular cylinder about local z.

    radius [m], finite and positive; half_length [m], positive: a range of validity, infinite unless given. A path whose
    contact lies beyond it is found all the same and reported as `OUT_OF_RANGE`. `GeometryError` for other sizes.
    """

    radius: float
    half_length: float = math.inf
    kind: ClassVar[int] = layout.CYLINDER

    def __post_init__(self) -> None:
        _positive(self, "radius", self.radius)
        _positive(self, "half_length", self.half_length, unbounded=True)

    @property
    def dims(self) -> tuple[float, ...]:
        """Radius and half length [m]."""
        return float(self.radius), float(self.half_length)


@dataclass(frozen=True)
class Sphere(Surface):
    """A sphere about the local origin.

    radius [m], finite and positive, else `GeometryError`.
    """

    radius: float
    kind: ClassVar[int] = layout.SPHERE

    def __post_init__(self) -> None:
        _positive(self, "radius", self.radius)

    @property
    def dims(self) -> tuple[float, ...]:
        """The radius [m]."""
        return (float(self.radius),)


@dataclass(frozen=True)
class Ellipsoid(Surface):
    """An ellipsoid about the local origin.

    radii (3,) [m]: semi-axes along local x, y, z, finite and positive, else `GeometryError`.
    """

    radii: tuple[float, float, float]
    kind: ClassVar[int] = layout.ELLIPSOID

    def __post_init__(self) -> None:
        _axes(self, "radii", self.radii, 3)

    @property
    def dims(self) -> tuple[float, ...]:
        """The three semi-axes [m]."""
        return self.radii

    @property
    def size(self) -> float:
        """The smallest semi-axis [m]."""
        return min(self.radii)


@dataclass(frozen=True)
class EllipticCylinder(Surface):
    """A cylinder about local z with an ellipse for its section.

    radii (2,) [m]: semi-axes along local x and y, finite and positive; half_length [m]: a range of validity, as of
    `Cylinder`. `GeometryError` for other sizes.
    """

    radii: tuple[float, float]
    half_length: float = math.inf
    kind: ClassVar[int] = layout.ELLIPTIC_CYLINDER

    def __post_init__(self) -> None:
        _axes(self, "radii", self.radii, 2)
        _positive(self, "half_length", self.half_length, unbounded=True)

    @property
    def dims(self) -> tuple[float, ...]:
        """Both semi-axes and the half length [m]."""
        return (*self.radii, float(self.half_length))

    @property
    def size(self) -> float:
        """The smaller semi-axis [m]."""
        return min(self.radii)


@dataclass(frozen=True)
class Torus(Surface):
    """A ring about local z, in the plane of local x and y.

    major_radius [m]: of the circle in the middle of the tube; minor_radius [m]: of the tube, smaller than the major
    one. `GeometryError` for other sizes.
    """

    major_radius: float
    minor_radius: float
    kind: ClassVar[int] = layout.TORUS
    hollow: ClassVar[bool] = True

    def __post_init__(self) -> None:
        major = _positive(self, "major_radius", self.major_radius)
        if _positive(self, "minor_radius", self.minor_radius) >= major:
            raise GeometryError(
                f"Torus: minor_radius must be smaller than major_radius, not {self.minor_radius!r} of {major!r} [m]"
            )

    @property
    def dims(self) -> tuple[float, ...]:
        """Major and minor radius [m]."""
        return float(self.major_radius), float(self.minor_radius)

    @property
    def size(self) -> float:
        """The radius of the tube [m]."""
        return float(self.minor_radius)


@dataclass(frozen=True)
class Cone(Surface):
    """A circular cone about local z, or a tapered cylinder.

    bottom_radius, top_radius [m]: at z = -half_length and z = half_length, not negative and not equal (the slope at
    least
    1e-3: use `Cylinder` instead); half_length [m], finite and positive: a range of validity, as of `Cylinder`, that
    never reaches beyond the apex. `GeometryError` for other sizes.
    """

    bottom_radius: float
    top_radius: float
    half_length: float
    kind: ClassVar[int] = layout.CONE

    def __post_init__(self) -> None:
        for name in ("bottom_radius", "top_radius"):
            if getattr(self, name) != 0.0:
                _positive(self, name, getattr(self, name))
        _positive(self, "half_length", self.half_length)
        if abs(self.dims[1]) < FLATTEST_CONE:
            raise GeometryError(
                f"Cone: radii {self.bottom_radius!r} and {self.top_radius!r} over a length of "
                f"{2.0 * self.half_length!r} [m] are a cylinder's; the slope must be at least {FLATTEST_CONE}"
            )

    @property
    def dims(self) -> tuple[float, ...]:
        """Radius at z = 0 [m], slope dr/dz, half length [m]."""
        slope = (float(self.top_radius) - float(self.bottom_radius)) / (2.0 * float(self.half_length))
        return 0.5 * (float(self.top_radius) + float(self.bottom_radius)), slope, float(self.half_length)


@dataclass(frozen=True)
class Capsule(Surface):
    """A cylinder about local z that ends in two half spheres.

    radius [m]; half_length [m]: from the centre to the centre of each half sphere, as in MuJoCo. Finite and positive,
    else `GeometryError`.
    """

    radius: float
    half_length: float
    kind: ClassVar[int] = layout.CAPSULE

    def __post_init__(self) -> None:
        _positive(self, "radius", self.radius)
        _positive(self, "half_length", self.half_length)

    @property
    def dims(self) -> tuple[float, ...]:
        """Radius and half length [m]."""
        return float(self.radius), float(self.half_length)
