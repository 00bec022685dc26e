"""The built-in wrapping surfaces: frozen, validated descriptions without a pose.

A surface has sizes and the properties listed in `surface.py`; the mathematics is in `mjwrap/kernels`. Axes of
revolution are local z, as in MuJoCo.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mjwrap.errors import GeometryError
from mjwrap.kernels import layout
from mjwrap.surfaces.surface import Array, Surface, axes, positive
from mjwrap.validation import is_number

FLATTEST_CONE = (
    1e-3  # smallest slope: a cone that is closer to a cylinder is inaccurate because of its far apex
)
UNBOUNDED = 4.0  # half length, in radii, with which an infinite cylinder is drawn


def _ball(count: int) -> tuple[Array, Array]:
    """Return radii and heights (count,) of circles on the unit sphere, from pole to pole."""
    rise = np.linspace(-0.5 * math.pi, 0.5 * math.pi, count)
    radii = np.cos(rise)
    radii[[0, -1]] = 0.0
    return radii, np.sin(rise)


def _tube(radius: float, half: float, given: float | None, wide: float, count: int) -> tuple[Array, Array]:
    """Return radii and heights (count,) of a cylinder's circles; an infinite one gets the given half length."""
    if not math.isfinite(half):
        half = UNBOUNDED * wide if given is None else given
    return np.full(count, radius), np.linspace(-half, half, count)


@dataclass(frozen=True)
class Cylinder(Surface):
    """A circular cylinder about local z.

    radius [m], finite and positive; half_length [m], positive: a range of validity, infinite unless given. A path whose
    contact lies beyond it is found all the same and reported as `OUT_OF_RANGE`. `GeometryError` for other sizes.
    """

    radius: float
    half_length: float = math.inf
    kind: ClassVar[int] = layout.CYLINDER
    closed_form: ClassVar[bool] = True
    branched: ClassVar[bool] = True
    held_about: ClassVar[float] = layout.ABOUT_AXIS
    geom_columns: ClassVar[tuple[tuple[int, int], ...]] = (
        (0, layout.DIM),
        (0, layout.SIZE),
        (1, layout.Z_LIMIT),
    )
    numeric: ClassVar[str] = "cylinder_size"
    numeric_sizes: ClassVar[str] = "radius half_length"
    numeric_least: ClassVar[int] = 1

    def __post_init__(self) -> None:
        positive(self, "radius", self.radius)
        positive(self, "half_length", self.half_length, unbounded=True)

    @property
    def dims(self) -> tuple[float, ...]:
        """Radius and half length [m]."""
        return float(self.radius), float(self.half_length)

    @property
    def columns(self) -> tuple[float, ...]:
        """The radius [m]."""
        return (float(self.radius),)

    @property
    def z_limit(self) -> float:
        """The half length [m]."""
        return float(self.half_length)

    def profile(self, count: int, half_length: float | None) -> tuple[Array, Array]:
        """See `Surface`."""
        return _tube(float(self.radius), self.half_length, half_length, self.radius, count)


@dataclass(frozen=True)
class Sphere(Surface):
    """A sphere about the local origin.

    radius [m], finite and positive, else `GeometryError`.
    """

    radius: float
    kind: ClassVar[int] = layout.SPHERE
    closed_form: ClassVar[bool] = True
    one_sided: ClassVar[bool] = True
    held_about: ClassVar[float] = layout.ABOUT_POINT
    geom_columns: ClassVar[tuple[tuple[int, int], ...]] = ((0, layout.DIM), (0, layout.SIZE))
    numeric: ClassVar[str] = "sphere_size"
    numeric_sizes: ClassVar[str] = "radius"
    numeric_least: ClassVar[int] = 1

    def __post_init__(self) -> None:
        positive(self, "radius", self.radius)

    @property
    def dims(self) -> tuple[float, ...]:
        """The radius [m]."""
        return (float(self.radius),)

    def profile(self, count: int, half_length: float | None) -> tuple[Array, Array]:
        """See `Surface`."""
        radii, height = _ball(count)
        return self.radius * radii, self.radius * height


@dataclass(frozen=True)
class Ellipsoid(Surface):
    """An ellipsoid about the local origin.

    radii (3,) [m]: semi-axes along local x, y, z, finite and positive, else `GeometryError`.
    """

    radii: tuple[float, float, float]
    kind: ClassVar[int] = layout.ELLIPSOID
    ellipse_sections: ClassVar[bool] = True
    numeric: ClassVar[str] = "ellipsoid_size"
    numeric_sizes: ClassVar[str] = "radius_x radius_y radius_z"
    numeric_least: ClassVar[int] = 3

    def __post_init__(self) -> None:
        axes(self, "radii", self.radii, 3)

    @property
    def dims(self) -> tuple[float, ...]:
        """The three semi-axes [m]."""
        return self.radii

    @property
    def size(self) -> float:
        """The smallest semi-axis [m]."""
        return min(self.radii)

    @classmethod
    def from_numeric(cls, *values: float) -> Ellipsoid:
        """See `Surface`."""
        x, y, z = values
        return cls((x, y, z))

    @property
    def stretch(self) -> tuple[float, float]:
        """Both semi-axes of the section [m]."""
        return self.radii[0], self.radii[1]

    def profile(self, count: int, half_length: float | None) -> tuple[Array, Array]:
        """See `Surface`."""
        radii, height = _ball(count)
        return radii, self.radii[2] * height


@dataclass(frozen=True)
class EllipticCylinder(Surface):
    """A cylinder about local z with an elliptic section.

    radii (2,) [m]: semi-axes along local x and y, finite and positive; half_length [m]: a range of validity, as for
    `Cylinder`. `GeometryError` for other sizes.
    """

    radii: tuple[float, float]
    half_length: float = math.inf
    kind: ClassVar[int] = layout.ELLIPTIC_CYLINDER
    closed_form: ClassVar[bool] = True
    branched: ClassVar[bool] = True
    numeric: ClassVar[str] = "elliptic_cylinder_size"
    numeric_sizes: ClassVar[str] = "radius_x radius_y half_length"
    numeric_least: ClassVar[int] = 2

    def __post_init__(self) -> None:
        axes(self, "radii", self.radii, 2)
        positive(self, "half_length", self.half_length, unbounded=True)

    @property
    def dims(self) -> tuple[float, ...]:
        """Both semi-axes and the half length [m]."""
        return (*self.radii, float(self.half_length))

    @property
    def size(self) -> float:
        """The smaller semi-axis [m]."""
        return min(self.radii)

    @classmethod
    def from_numeric(cls, *values: float) -> EllipticCylinder:
        """See `Surface`."""
        x, y, *half = values
        return cls((x, y), *half)

    @property
    def columns(self) -> tuple[float, ...]:
        """Both semi-axes, and infinity for the third [m]: the kernels treat it as an ellipsoid."""
        return (*self.radii, math.inf)

    @property
    def z_limit(self) -> float:
        """The half length [m]."""
        return float(self.half_length)

    @property
    def stretch(self) -> tuple[float, float]:
        """Both semi-axes of the section [m]."""
        return self.radii[0], self.radii[1]

    def profile(self, count: int, half_length: float | None) -> tuple[Array, Array]:
        """See `Surface`."""
        return _tube(1.0, self.half_length, half_length, max(self.radii), count)


@dataclass(frozen=True)
class Torus(Surface):
    """A ring about local z, in the plane of local x and y.

    major_radius [m]: of the circle in the middle of the tube; minor_radius [m]: of the tube, smaller than the major
    one. `GeometryError` for other sizes.
    """

    major_radius: float
    minor_radius: float
    kind: ClassVar[int] = layout.TORUS
    branched: ClassVar[bool] = True
    touches: ClassVar[int] = 2  # a string can bridge the hole and touch the ring before and after it
    numeric: ClassVar[str] = "torus_size"
    numeric_sizes: ClassVar[str] = "major_radius minor_radius"
    numeric_least: ClassVar[int] = 2

    def __post_init__(self) -> None:
        major = positive(self, "major_radius", self.major_radius)
        if positive(self, "minor_radius", self.minor_radius) >= major:
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

    def profile(self, count: int, half_length: float | None) -> tuple[Array, Array]:
        """See `Surface`."""
        turn = np.linspace(0.0, 2.0 * math.pi, count)
        turn[-1] = 0.0
        return self.major_radius + self.minor_radius * np.cos(turn), self.minor_radius * np.sin(turn)


@dataclass(frozen=True)
class Cone(Surface):
    """A circular cone about local z, or a tapered cylinder.

    Args:
        bottom_radius: radius at z = -half_length [m], not negative.
        top_radius: radius at z = half_length [m], not negative and not equal to the other (the slope is at least 1e-3:
            use `Cylinder` instead).
        half_length: [m], finite and positive: a range of validity, as for `Cylinder`, that never reaches beyond the
            apex.

    Raises:
        GeometryError: a size is not possible.
    """

    bottom_radius: float
    top_radius: float
    half_length: float
    kind: ClassVar[int] = layout.CONE
    closed_form: ClassVar[bool] = True
    branched: ClassVar[bool] = True
    numeric: ClassVar[str] = "cone_size"
    numeric_sizes: ClassVar[str] = "bottom_radius top_radius half_length"
    numeric_least: ClassVar[int] = 3

    def __post_init__(self) -> None:
        for name in ("bottom_radius", "top_radius"):
            value = getattr(self, name)
            if not is_number(value) or value != 0.0:
                positive(self, name, value)
        positive(self, "half_length", self.half_length)
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

    @property
    def columns(self) -> tuple[float, ...]:
        """Radius at z = 0 [m] and slope."""
        return self.dims[:2]

    @property
    def z_limit(self) -> float:
        """The half length [m]."""
        return float(self.half_length)

    def profile(self, count: int, half_length: float | None) -> tuple[Array, Array]:
        """See `Surface`."""
        height = np.linspace(-self.half_length, self.half_length, count)
        return np.linspace(self.bottom_radius, self.top_radius, count), height


@dataclass(frozen=True)
class Capsule(Surface):
    """A cylinder about local z that ends in two half spheres.

    radius [m]; half_length [m]: from the centre to the centre of each half sphere, as in MuJoCo. Finite and positive,
    else `GeometryError`.
    """

    radius: float
    half_length: float
    kind: ClassVar[int] = layout.CAPSULE
    geom_columns: ClassVar[tuple[tuple[int, int], ...]] = (
        (0, layout.DIM),
        (1, layout.DIM + 1),
        (0, layout.SIZE),
    )
    numeric: ClassVar[str] = "capsule_size"
    numeric_sizes: ClassVar[str] = "radius half_length"
    numeric_least: ClassVar[int] = 2

    def __post_init__(self) -> None:
        positive(self, "radius", self.radius)
        positive(self, "half_length", self.half_length)

    @property
    def dims(self) -> tuple[float, ...]:
        """Radius and half length [m]."""
        return float(self.radius), float(self.half_length)

    def profile(self, count: int, half_length: float | None) -> tuple[Array, Array]:
        """See `Surface`."""
        radii, height = _ball(count)
        return self.radius * radii, self.radius * height + self.half_length * np.sign(height)


# Every built-in surface. MJCF declarations and tests take their lists from here.
SURFACES: tuple[type[Surface], ...] = (
    Sphere,
    Cylinder,
    Ellipsoid,
    EllipticCylinder,
    Torus,
    Cone,
    Capsule,
)
