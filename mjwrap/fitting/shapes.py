"""Signed distances of points to surfaces, with nearest points, normals and derivatives for a fit.

Everything is in the surface's own frame. If a surface changes by a small displacement of its points, the distance of an
outside point changes by minus the normal component of the displacement at the nearest point. So derivatives need no
difference quotients. Unlike the classes in `mjwrap.surfaces`, cylinders and cones are infinite here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjwrap.surfaces import (
    Capsule,
    Cone,
    Cylinder,
    Ellipsoid,
    EllipticCylinder,
    Sphere,
    Surface,
    Torus,
)

Array = NDArray[np.float64]
NEWTON = 60  # largest number of iterations; usually eight are enough


class Nearest(NamedTuple):
    """For points (m, 3): signed distance (m,), outside positive; nearest point and outward normal there (m, 3); slide.

    slide (m, k): normal displacement of the nearest point for each size.
    """

    distance: Array
    point: Array
    normal: Array
    slide: Array


class Shape(NamedTuple):
    """A class of surfaces for a fit.

    nearest: (points, sizes) -> Nearest; turns, shifts: the local axes about and along which a motion changes the
    surface, so that a fit may move it; build: (sizes, half length) -> surface; ratios: sizes that are not lengths;
    free_sign: sizes that may be negative.
    """

    name: str
    nearest: Callable[[Array, Array], Nearest]
    turns: tuple[int, ...]
    shifts: tuple[int, ...]
    sizes: int
    build: Callable[[Array, float], Surface]
    ratios: tuple[int, ...] = ()
    free_sign: tuple[int, ...] = ()

    @property
    def unknowns(self) -> int:
        """Number of unknowns of a fit, and so the smallest number of points."""
        return len(self.turns) + len(self.shifts) + self.sizes


def _unit(vectors: Array) -> tuple[Array, Array]:
    """Return lengths (m,) and unit vectors; the first axis for a zero vector."""
    length = np.linalg.norm(vectors, axis=1)
    fallback = np.zeros(vectors.shape[1])
    fallback[0] = 1.0
    zero = length == 0.0
    return length, np.where(zero[:, None], fallback, vectors / np.where(zero, 1.0, length)[:, None])


def _flat(vectors: Array) -> Array:
    """Return plane vectors (m, 2) as (m, 3)."""
    return np.column_stack([vectors, np.zeros(len(vectors))])


def _sphere(x: Array, sizes: Array) -> Nearest:
    far, normal = _unit(x)
    return Nearest(far - sizes[0], sizes[0] * normal, normal, np.ones((len(x), 1)))


def _cylinder(x: Array, sizes: Array) -> Nearest:
    far, across = _unit(x[:, :2])
    normal = _flat(across)
    distance = far - sizes[0]
    return Nearest(distance, x - distance[:, None] * normal, normal, np.ones((len(x), 1)))


def _quadric(x: Array, semi: Array) -> Nearest:
    """Ellipse (m, 2) or ellipsoid (m, 3): the nearest point is semi^2 x / (t + semi^2), on the surface for one t.

    t is the largest root of |semi x / (t + semi^2)| = 1. Newton's method on the reciprocal, which is nearly linear,
    approaches it from below and never overshoots. Points on the medial axis have no unique nearest point and are moved
    off it.
    """
    square, least = semi * semi, int(np.argmin(semi))
    far = np.abs(x)
    far[:, least] = np.maximum(far[:, least], 1e-14 * semi[least])
    t = -square[least] + semi[least] * far[:, least]
    for _ in range(NEWTON):
        w = semi * far / (t[:, None] + square)
        norm = np.linalg.norm(w, axis=1)
        step = norm * norm * (norm - 1.0) / (w * w / (t[:, None] + square)).sum(axis=1)
        t = t + step
        if np.abs(step).max(initial=0.0) <= 1e-15 * square.max():
            break
    point = np.copysign(square * far / (t[:, None] + square), x)
    steepness, normal = _unit(point / square)
    return Nearest(t * steepness, point, normal, normal * point / semi)


def _elliptic_cylinder(x: Array, sizes: Array) -> Nearest:
    section = _quadric(x[:, :2], sizes)
    point = np.column_stack([section.point, x[:, 2]])
    return Nearest(section.distance, point, _flat(section.normal), section.slide)


def _torus(x: Array, sizes: Array) -> Nearest:
    major, minor = sizes
    _, outward = _unit(x[:, :2])
    outward = _flat(outward)
    far, normal = _unit(x - major * outward)
    point = major * outward + minor * normal
    slide = np.column_stack([(normal * outward).sum(axis=1), np.ones(len(x))])
    return Nearest(far - minor, point, normal, slide)


def _cone(x: Array, sizes: Array) -> Nearest:
    middle, slope = sizes
    cosine = 1.0 / np.sqrt(1.0 + slope * slope)
    far, across = _unit(x[:, :2])
    normal = cosine * np.column_stack([across, np.full(len(x), -slope)])
    distance = cosine * (far - middle - slope * x[:, 2])
    point = x - distance[:, None] * normal
    return Nearest(distance, point, normal, cosine * np.column_stack([np.ones(len(x)), point[:, 2]]))


def _capsule(x: Array, sizes: Array) -> Nearest:
    radius, half = sizes
    axis = np.zeros_like(x)
    axis[:, 2] = np.clip(x[:, 2], -half, half)
    far, normal = _unit(x - axis)
    ends = np.where(np.abs(x[:, 2]) > half, np.sign(x[:, 2]), 0.0)
    slide = np.column_stack([np.ones(len(x)), ends * normal[:, 2]])
    return Nearest(far - radius, axis + radius * normal, normal, slide)


def _build_cone(sizes: Array, half: float) -> Cone:
    reach = abs(sizes[1]) * half
    bottom, top = float(sizes[0] - sizes[1] * half), float(sizes[0] + sizes[1] * half)
    tip = 1e-12 * (abs(sizes[0]) + reach)  # an end within rounding of the apex
    return Cone(0.0 if abs(bottom) < tip else bottom, 0.0 if abs(top) < tip else top, half)


SPHERE = Shape("a sphere", _sphere, (), (0, 1, 2), 1, lambda s, _: Sphere(float(s[0])))
CYLINDER = Shape("a cylinder", _cylinder, (0, 1), (0, 1), 1, lambda s, half: Cylinder(float(s[0]), half))
ELLIPSOID = Shape(
    "an ellipsoid",
    _quadric,
    (0, 1, 2),
    (0, 1, 2),
    3,
    lambda s, _: Ellipsoid((float(s[0]), float(s[1]), float(s[2]))),
)
ELLIPTIC_CYLINDER = Shape(
    "an elliptic cylinder", _elliptic_cylinder, (0, 1, 2), (0, 1), 2,
    lambda s, half: EllipticCylinder((float(s[0]), float(s[1])), half),
)  # fmt: skip
TORUS = Shape("a torus", _torus, (0, 1), (0, 1, 2), 2, lambda s, _: Torus(float(s[0]), float(s[1])))
CONE = Shape("a cone", _cone, (0, 1), (0, 1), 2, _build_cone, (1,), (0, 1))
CAPSULE = Shape("a capsule", _capsule, (0, 1), (0, 1, 2), 2, lambda s, _: Capsule(float(s[0]), float(s[1])))
SHAPES = {
    Sphere: SPHERE,
    Cylinder: CYLINDER,
    Ellipsoid: ELLIPSOID,
    EllipticCylinder: ELLIPTIC_CYLINDER,
    Torus: TORUS,
    Cone: CONE,
    Capsule: CAPSULE,
}
