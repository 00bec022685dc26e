"""Geometry of every surface without the package's kernels, in simple NumPy.

A shape works in the surface's own frame. Its sizes d (..., k) [m] and points x (..., 3) [m] broadcast against
each other, so that one call serves a thousand surfaces. The shape operator W is that of dn = W dp with the
outward normal n: a sphere of radius R has W = I / R.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import mjwrap as mw

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
FARTHEST = 60  # Newton steps to the nearest point of an ellipse; each at least halves the error


def dot(a: Array, b: Array) -> Array:
    """Return the scalar products over the last axis."""
    return np.einsum("...i,...i->...", a, b)


def unit(a: Array) -> Array:
    """Return the unit vectors of a (..., 3)."""
    return a / np.sqrt(dot(a, a))[..., None]


def orthogonal_unit(a: Array) -> Array:
    """Return unit vectors perpendicular to a (..., 3), in an arbitrary direction."""
    least = np.eye(3)[np.abs(a).argmin(-1)]
    cross: Array = np.cross(a, least)
    return unit(cross)


def dyad(a: Array) -> Array:
    """Return a a^T (..., 3, 3)."""
    return a[..., :, None] * a[..., None, :]


class Shape:
    """One kind of surface: the zero level of a function with gradient and Hessian, outward positive."""

    convex = True
    flat = False  # whether the Gaussian curvature vanishes everywhere

    def height(self, d: Array, x: Array) -> Array:
        """Return the distance from the surface, negative inside [m]."""
        raise NotImplementedError

    def level(self, d: Array, x: Array) -> Array:
        """Return a cheap substitute for the height: same sign, never larger, convex along lines if the shape is."""
        return self.height(d, x)

    def gradient(self, d: Array, x: Array) -> Array:
        """Return the gradient (..., 3) of the defining function."""
        raise NotImplementedError

    def hessian(self, d: Array, x: Array) -> Array:
        """Return the Hessian (..., 3, 3) of the defining function."""
        raise NotImplementedError

    def second(self, d: Array, x: Array, v: Array) -> Array:
        """Return the second derivative v.Hv of the defining function along v."""
        return np.einsum("...i,...ij,...j->...", v, self.hessian(d, x), v)

    def bend(self, d: Array) -> Array:
        """Return an approximate bound on the curvature of geodesics, for step lengths [1/m]."""
        return 1.0 / d[..., 0]

    def normal(self, d: Array, x: Array) -> Array:
        """Return the outward unit normal at points of the surface."""
        return unit(self.gradient(d, x))

    def nearest(self, d: Array, x: Array) -> Array:
        """Return the nearest point of the surface."""
        return x - self.height(d, x)[..., None] * self.normal(d, x)

    def shape_operator(self, d: Array, x: Array) -> Array:
        """Return W (..., 3, 3) at points of the surface [1/m]; it maps tangents to tangents and the normal to zero."""
        g = self.gradient(d, x)
        size = np.sqrt(dot(g, g))[..., None, None]
        flat = np.eye(3) - dyad(g / size[..., 0])
        return flat @ (self.hessian(d, x) / size) @ flat

    def bending(self, d: Array, x: Array, t: Array) -> Array:
        """Return the normal curvature t.Wt of unit tangents [1/m]."""
        g = self.gradient(d, x)
        return self.second(d, x, t) / np.sqrt(dot(g, g))

    def gauss(self, d: Array, x: Array) -> Array:
        """Return the Gaussian curvature [1/m^2]: the product of the two eigenvalues of W in the tangent plane."""
        w = self.shape_operator(d, x)
        trace = np.einsum("...ii->...", w)
        return 0.5 * (trace**2 - np.einsum("...ij,...ji->...", w, w))


class Sphere(Shape):
    """d: radius."""

    def height(self, d: Array, x: Array) -> Array:
        """See `Shape`."""
        return np.sqrt(dot(x, x)) - d[..., 0]

    def gradient(self, d: Array, x: Array) -> Array:
        """See `Shape`."""
        return unit(x)

    def hessian(self, d: Array, x: Array) -> Array:
        """See `Shape`."""
        return (np.eye(3) - dyad(unit(x))) / np.sqrt(dot(x, x))[..., None, None]


class Ellipsoid(Shape):
    """d: three semi-axes; an infinite third one makes an elliptic cylinder."""

    def inverse(self, d: Array) -> Array:
        """Return 1 / a^2 for the three semi-axes."""
        return 1.0 / d[..., :3] ** 2

    def level(self, d: Array, x: Array) -> Array:
        """Scale the surface until it meets x: each of its points moves by at least the smallest semi-axis."""
        inverse = self.inverse(d)
        return (np.sqrt((x * x * inverse).sum(-1)) - 1.0) / np.sqrt(inverse.max(-1))

    def height(self, d: Array, x: Array) -> Array:
        """See `Shape`."""
        offset = x - self.nearest(d, x)
        return np.sign(self.level(d, x)) * np.sqrt(dot(offset, offset))

    def gradient(self, d: Array, x: Array) -> Array:
        """See `Shape`."""
        return x * self.inverse(d)

    def hessian(self, d: Array, x: Array) -> Array:
        """See `Shape`."""
        return self.inverse(d)[..., None] * np.eye(3)

    def second(self, d: Array, x: Array, v: Array) -> Array:
        """See `Shape`."""
        return (self.inverse(d) * v * v).sum(-1)

    def bend(self, d: Array) -> Array:
        """See `Shape`."""
        inverse = np.sort(self.inverse(d), axis=-1)
        finite = np.where(inverse[..., 0] > 0.0, inverse[..., 0], inverse[..., 1])
        return inverse[..., 2] / np.sqrt(finite)

    def nearest(self, d: Array, x: Array) -> Array:
        """Return x / (1 + m / a^2) with the multiplier m that puts it on the surface; Newton's method, from below."""
        inverse = np.broadcast_to(self.inverse(d), x.shape)
        with np.errstate(divide="ignore", invalid="ignore"):
            lowest = np.where(inverse > 0.0, (np.sqrt(inverse) * np.abs(x) - 1.0) / inverse, -np.inf)
        m = lowest.max(-1)
        for _ in range(FARTHEST):
            share = 1.0 + m[..., None] * inverse
            over = (inverse * x * x / share**2).sum(-1) - 1.0
            if (over <= 1e-15).all():
                break
            slope = 2.0 * (inverse**2 * x * x / share**3).sum(-1)
            m = m + np.where(over > 0.0, over / np.where(slope > 0.0, slope, 1.0), 0.0)
        return x / (1.0 + m[..., None] * inverse)


class EllipticCylinder(Ellipsoid):
    """d: two semi-axes, half length."""

    flat = True

    def inverse(self, d: Array) -> Array:
        """Return 1 / a^2 with an infinite third semi-axis."""
        return np.concatenate([1.0 / d[..., :2] ** 2, np.zeros_like(d[..., :1])], -1)


class Torus(Shape):
    """d: major radius, minor radius."""

    convex = False

    def _tube(self, d: Array, x: Array) -> tuple[Array, Array, Array, Array]:
        """Return distance from the axis, the unit vector away from it, and the offset from the tube's middle."""
        rho = np.hypot(x[..., 0], x[..., 1])
        away = np.stack([x[..., 0] / rho, x[..., 1] / rho, np.zeros_like(rho)], -1)
        offset = (rho - d[..., 0])[..., None] * away
        offset[..., 2] = x[..., 2]
        return rho, away, offset, np.sqrt(dot(offset, offset))

    def height(self, d: Array, x: Array) -> Array:
        """See `Shape`."""
        return np.hypot(np.hypot(x[..., 0], x[..., 1]) - d[..., 0], x[..., 2]) - d[..., 1]

    def gradient(self, d: Array, x: Array) -> Array:
        """See `Shape`."""
        _, _, offset, size = self._tube(d, x)
        return offset / size[..., None]

    def hessian(self, d: Array, x: Array) -> Array:
        """Return the curvature of the tube's circle plus that of the ring around the axis."""
        rho, away, offset, size = self._tube(d, x)
        around = np.stack([-away[..., 1], away[..., 0], np.zeros_like(rho)], -1)
        normal = offset / size[..., None]
        meridian = np.cross(around, normal)
        ring = dot(normal, away) / rho
        return dyad(meridian) / size[..., None, None] + ring[..., None, None] * dyad(around)

    def second(self, d: Array, x: Array, v: Array) -> Array:
        """Return the same without the matrices: (v^2 - (v.n)^2 - (v.u)^2) / w + (v.u)^2 (n.away) / rho, u around."""
        rho, away, offset, size = self._tube(d, x)
        around = (v[..., 1] * away[..., 0] - v[..., 0] * away[..., 1]) ** 2
        upright = (dot(v, offset) / size) ** 2
        return (dot(v, v) - upright - around) / size + around * (rho - d[..., 0]) / (size * rho)

    def bend(self, d: Array) -> Array:
        """See `Shape`."""
        return np.maximum(1.0 / d[..., 1], 1.0 / (d[..., 0] - d[..., 1]))


class Cone(Shape):
    """d: radius at z = 0, slope dr/dz, half length; only one side of the apex."""

    flat = True

    def apex(self, d: Array) -> Array:
        """Return the height z of the apex [m]."""
        return -d[..., 0] / d[..., 1]

    def height(self, d: Array, x: Array) -> Array:
        """Return the distance; beyond the apex that is the distance from the apex."""
        rho, rise = np.hypot(x[..., 0], x[..., 1]), x[..., 2] - self.apex(d)
        along = rho * np.abs(d[..., 1]) + rise * np.sign(d[..., 1])
        return np.where(
            along > 0.0,
            (rho - d[..., 0] - d[..., 1] * x[..., 2]) / np.hypot(1.0, d[..., 1]),
            np.hypot(rho, rise),
        )

    def gradient(self, d: Array, x: Array) -> Array:
        """See `Shape`."""
        rho = np.hypot(x[..., 0], x[..., 1])
        slope = np.broadcast_to(d[..., 1], rho.shape)
        return np.stack([x[..., 0] / rho, x[..., 1] / rho, -slope], -1) / np.hypot(1.0, slope)[..., None]

    def hessian(self, d: Array, x: Array) -> Array:
        """See `Shape`."""
        rho = np.hypot(x[..., 0], x[..., 1])
        around = np.stack([-x[..., 1] / rho, x[..., 0] / rho, np.zeros_like(rho)], -1)
        return dyad(around) / (rho * np.hypot(1.0, d[..., 1]))[..., None, None]


class Cylinder(Cone):
    """d: radius, half length."""

    def height(self, d: Array, x: Array) -> Array:
        """See `Shape`."""
        return np.hypot(x[..., 0], x[..., 1]) - d[..., 0]

    def gradient(self, d: Array, x: Array) -> Array:
        """See `Shape`."""
        return super().gradient(self._straight(d), x)

    def hessian(self, d: Array, x: Array) -> Array:
        """See `Shape`."""
        return super().hessian(self._straight(d), x)

    def _straight(self, d: Array) -> Array:
        """Return the sizes of a cone without a slope."""
        return np.stack([d[..., 0], np.zeros_like(d[..., 0])], -1)


class Capsule(Shape):
    """d: radius, half length; its curvature jumps where the half spheres begin."""

    def _offset(self, d: Array, x: Array) -> Array:
        """Return the offset from the nearest point of the middle line."""
        offset = np.array(np.broadcast_to(x, np.broadcast_shapes(x.shape, d[..., :1].shape)))
        offset[..., 2] -= np.clip(offset[..., 2], -d[..., 1], d[..., 1])
        return offset

    def height(self, d: Array, x: Array) -> Array:
        """See `Shape`."""
        offset = self._offset(d, x)
        return np.sqrt(dot(offset, offset)) - d[..., 0]

    def gradient(self, d: Array, x: Array) -> Array:
        """See `Shape`."""
        return unit(self._offset(d, x))

    def hessian(self, d: Array, x: Array) -> Array:
        """Return the sphere's Hessian, without the part along the axis on the cylinder."""
        offset = self._offset(d, x)
        size = np.sqrt(dot(offset, offset))[..., None, None]
        straight = np.abs(x[..., 2]) <= d[..., 1]
        axis = dyad(np.array([0.0, 0.0, 1.0])) * straight[..., None, None]
        return (np.eye(3) - dyad(unit(offset)) - axis) / size


SHAPES: dict[type, Shape] = {
    mw.Cylinder: Cylinder(),
    mw.Sphere: Sphere(),
    mw.Ellipsoid: Ellipsoid(),
    mw.EllipticCylinder: EllipticCylinder(),
    mw.Torus: Torus(),
    mw.Cone: Cone(),
    mw.Capsule: Capsule(),
}


def sizes(surface: Any) -> Array:
    """Return the sizes of a surface in the order of its shape [m], from its public attributes alone."""
    match surface:
        case mw.Cylinder():
            return np.array([surface.radius, surface.half_length])
        case mw.Sphere():
            return np.array([surface.radius])
        case mw.Ellipsoid():
            return np.array(surface.radii)
        case mw.EllipticCylinder():
            return np.array([*surface.radii, surface.half_length])
        case mw.Torus():
            return np.array([surface.major_radius, surface.minor_radius])
        case mw.Cone():
            bottom, top, half = surface.bottom_radius, surface.top_radius, surface.half_length
            return np.array([0.5 * (bottom + top), 0.5 * (top - bottom) / half, half])
        case mw.Capsule():
            return np.array([surface.radius, surface.half_length])
    raise TypeError(f"there is no shape for {surface!r}")


def half_length(surface: Any) -> float:
    """Return the largest |z| at which a surface may be touched [m]."""
    if isinstance(surface, mw.Cylinder | mw.EllipticCylinder | mw.Cone):
        return float(surface.half_length)
    return np.inf
