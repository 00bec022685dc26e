"""Fit surfaces of every shape; a result has the surface, its pose, the points' distances, and MJCF elements."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from mjwrap import validation
from mjwrap.errors import GeometryError
from mjwrap.fitting import shapes
from mjwrap.fitting.least_squares import LOST, growth, solve
from mjwrap.fitting.shapes import Array, Shape
from mjwrap.fitting.symmetry import canonical_frame
from mjwrap.paths import Obstacle
from mjwrap.surfaces import Capsule, Cylinder, Ellipsoid, Sphere, Surface

_GEOMS = {Sphere: "sphere", Cylinder: "cylinder", Ellipsoid: "ellipsoid", Capsule: "capsule"}
MARK = 0.001  # [m] radius of the sphere geom that carries a shape for which MuJoCo has no geom


@dataclass(frozen=True, eq=False)
class Fit:
    """A surface fitted to points, in the points' frame.

    Attributes:
        surface: the surface. Cylinders and cones are as long as the range of the points.
        pos: (3,) origin of its frame [m].
        quat: (4,) orientation of its frame, w, x, y, z.
        distances: (m,) distances of the points from it [m], positive outside. Cylinders and cones count as infinite
            here.
        growth: factor by which a small error of the points can grow on parts of the surface without points; about 1 if
            the points cover all of it.
    """

    surface: Surface
    pos: tuple[float, ...]
    quat: tuple[float, ...]
    distances: Array
    growth: float

    @property
    def rms(self) -> float:
        """Root mean square distance of the points from the surface [m]."""
        return float(np.sqrt(np.mean(self.distances**2)))

    @property
    def max_distance(self) -> float:
        """Largest distance of a point from the surface, on either side [m]."""
        return float(np.abs(self.distances).max())

    def obstacle(self, hint: tuple[float, ...] | None = None) -> Obstacle:
        """Return the surface as an `Obstacle` of `solve_path`; hint as there."""
        return Obstacle(self.surface, self.pos, self.quat, hint)

    def geom_xml(self, name: str) -> str:
        """Return the <geom> that carries the surface, for the body whose frame the points are in."""
        shape = _GEOMS.get(type(self.surface), "sphere")
        size = _values(self.surface) if type(self.surface) in _GEOMS else [MARK]
        return (
            f'<geom name="{name}" type="{shape}" size="{_text(size)}" pos="{_text(self.pos)}" '
            f'quat="{_text(self.quat)}" contype="0" conaffinity="0" mass="0"/>'
        )

    def numeric_xml(self, name: str) -> str:
        """Return the <numeric> that gives the geom its shape, for <custom>; "" if the geom itself has the shape."""
        if type(self.surface) in _GEOMS:
            return ""
        return f'<numeric name="{self._numeric(name)}" data="{_text(_values(self.surface))}"/>'

    def elements_xml(self, name: str) -> str:
        """Return the elements for a muscle's <tuple> that make it wrap over the surface."""
        if type(self.surface) in _GEOMS:
            end = ' prm="1"' * isinstance(self.surface, Cylinder)
            return f'<element objtype="geom" objname="{name}"{end}/>'
        return f'<element objtype="geom" objname="{name}"/><element objtype="numeric" objname="{self._numeric(name)}"/>'

    def _numeric(self, name: str) -> str:
        key = re.sub("(?<!^)(?=[A-Z])", "_", type(self.surface).__name__).lower()
        return f"mjwrap_{name}_{key}_size"


def fit_sphere(points: ArrayLike, *, scale: float | None = None) -> Fit:
    """Fit a sphere to points; see `fit_ellipsoid`."""
    return _fit(shapes.SPHERE, points, scale)


def fit_cylinder(points: ArrayLike, *, scale: float | None = None) -> Fit:
    """Fit a circular cylinder, as long as the range of the points; see `fit_ellipsoid`."""
    return _fit(shapes.CYLINDER, points, scale)


def fit_ellipsoid(points: ArrayLike, *, scale: float | None = None) -> Fit:
    """Fit an ellipsoid to points (m, 3) [m], by least squares on their distances from it.

    scale [m]: points farther from the surface than this distance get less weight (Cauchy's loss), so that spurs and
    grooves of a bone do not distort it; None: all points have the same weight. Raises `GeometryError` for points that
    are not finite, too few (an ellipsoid needs nine), in a plane or on a line, or on so small a part of the surface
    that they do not determine the rest.
    """
    return _fit(shapes.ELLIPSOID, points, scale)


def fit_elliptic_cylinder(points: ArrayLike, *, scale: float | None = None) -> Fit:
    """Fit a cylinder with an elliptic section, as long as the range of the points; see `fit_ellipsoid`."""
    return _fit(shapes.ELLIPTIC_CYLINDER, points, scale)


def fit_torus(points: ArrayLike, *, scale: float | None = None) -> Fit:
    """Fit a torus, to the whole ring or to a saddle-shaped part such as a notch; see `fit_ellipsoid`."""
    return _fit(shapes.TORUS, points, scale)


def fit_cone(points: ArrayLike, *, scale: float | None = None) -> Fit:
    """Fit a cone or tapered cylinder, as long as the range of the points; see `fit_ellipsoid`."""
    return _fit(shapes.CONE, points, scale)


def fit_capsule(points: ArrayLike, *, scale: float | None = None) -> Fit:
    """Fit a capsule; see `fit_ellipsoid`."""
    return _fit(shapes.CAPSULE, points, scale)


def _fit(shape: Shape, points: ArrayLike, scale: float | None) -> Fit:
    x = _checked(shape, points, scale)
    mean = x.mean(axis=0)
    unit = float(np.sqrt(((x - mean) ** 2).sum(axis=1).mean()))
    if unit <= 1e-9 * float(np.abs(x).max()):
        raise GeometryError(f"fit of {shape.name}: all {len(x)} points are the same")
    scaled = (x - mean) / unit
    try:
        found, half = canonical_frame(solve(shape, scaled, None if scale is None else scale / unit), scaled)
        increase = growth(found, scaled, half)
        lengths = np.ones(shape.sizes)
        lengths[[i for i in range(shape.sizes) if i not in shape.ratios]] = unit
        surface = shape.build(found.sizes * lengths, half * unit)
    except GeometryError as error:
        wrong = str(error)
        if not wrong.startswith("fit of "):
            wrong = f"fit of {shape.name}: the points do not have this shape ({wrong})"
        raise GeometryError(wrong) from None
    if increase > LOST:
        raise GeometryError(
            f"fit of {shape.name}: the points do not determine it; take points from more of the surface, or a shape "
            f"with fewer sizes"
        )
    quat = np.roll(Rotation.from_matrix(found.rotation).as_quat(canonical=True), 1)
    return Fit(
        surface,
        tuple((mean + unit * found.origin).tolist()),
        tuple(quat.tolist()),
        unit * found.nearest(scaled).distance,
        increase,
    )


def _checked(shape: Shape, points: ArrayLike, scale: float | None) -> Array:
    try:
        x = np.asarray(points, dtype=np.float64)
    except (TypeError, ValueError):
        x = np.zeros(0)
    if x.ndim != 2 or x.shape[-1] != 3:
        raise GeometryError(f"fit of {shape.name}: points must have shape (m, 3), not {np.shape(points)}")
    if not np.isfinite(x).all():
        raise GeometryError(
            f"fit of {shape.name}: point {int(np.argmin(np.isfinite(x).all(axis=1)))} is not finite"
        )
    if len(x) < shape.unknowns:
        raise GeometryError(f"fit of {shape.name}: it needs at least {shape.unknowns} points, not {len(x)}")
    if scale is not None:
        validation.positive(scale, f"fit of {shape.name}: scale", GeometryError, "m")
    return x


def _values(surface: Any) -> list[float]:
    """Return the sizes of a surface in the order of its class."""
    values = np.hstack([getattr(surface, field.name) for field in fields(surface)])
    return [float(value) for value in values]


def _text(values: ArrayLike) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(values))
