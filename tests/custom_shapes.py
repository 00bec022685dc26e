"""Surfaces that users might write, and their rows for the kernels."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mjwrap.kernels import layout as lay
from mjwrap.kernels.geometry import user_surface
from mjwrap.surfaces.rows import write_surface
from mjwrap.surfaces.user import CustomSurface, ImplicitSurface, ParametricSurface

Array = NDArray[np.float64]

RADII = 0.05, 0.035, 0.025
RING, TUBE = 0.04, 0.012
RADIUS = 0.03


def sphere(x, y, z):
    return x * x + y * y + z * z - RADIUS**2


def cylinder(x, y, z):
    return math.hypot(x, y) - RADIUS


def rolled(u, v):
    """A cylinder whose parameters are an angle and a length."""
    return RADIUS * math.cos(u), RADIUS * math.sin(u), v


def ellipsoid(x, y, z):
    a, b, c = RADII
    return (x / a) ** 2 + (y / b) ** 2 + (z / c) ** 2 - 1.0


def ellipsoid_gradient(x, y, z):
    a, b, c = RADII
    return 2.0 * x / a**2, 2.0 * y / b**2, 2.0 * z / c**2


def ellipsoid_hessian(x, y, z):
    a, b, c = RADII
    return (2.0 / a**2, 0.0, 0.0), (0.0, 2.0 / b**2, 0.0), (0.0, 0.0, 2.0 / c**2)


def charted_ellipsoid(u, v):
    a, b, c = RADII
    return a * math.cos(u) * math.cos(v), b * math.sin(u) * math.cos(v), c * math.sin(v)


def distance_from_axis(w):
    return RING + TUBE * math.cos(w)


def torus(u, v):
    rho = distance_from_axis(v)
    return rho * math.cos(u), rho * math.sin(u), TUBE * math.sin(v)


def torus_derivatives(u, v):
    c, s, d = math.cos(u), math.sin(u), math.cos(v)
    rho, e = distance_from_axis(v), math.sin(v)
    return (
        (-rho * s, rho * c, 0.0),
        (-TUBE * e * c, -TUBE * e * s, TUBE * d),
        (-rho * c, -rho * s, 0.0),
        (TUBE * e * s, -TUBE * e * c, 0.0),
        (-TUBE * d * c, -TUBE * d * s, -TUBE * e),
    )


def ring(x, y, z):
    return (math.sqrt(x * x + y * y) - RING) ** 2 + z * z - TUBE**2


def superellipsoid(x, y, z):
    return abs(x / 0.05) ** 4.0 + math.pow(y / 0.04, 4.0) + (z / 0.03) ** 2 - 1.0


def creased(x, y, z):
    """Its fourth derivatives are infinite at x = 0 and y = 0."""
    return abs(x / 0.05) ** 3.5 + abs(y / 0.04) ** 3.5 + (z / 0.03) ** 2 - 1.0


def bean(x, y, z):
    """An ellipsoid bent along x."""
    w = y - 6.0 * x * x
    return (x / 0.05) ** 2 + (w / 0.025) ** 2 + (z / 0.03) ** 2 - 1.0


def waist(u, v):
    """A tube with a waist, of elliptic section, along y."""
    size = 0.025 + 0.006 * math.cos(60.0 * v)
    return 1.2 * size * math.sin(u), v, size * math.cos(u)


MAKERS: dict[str, Callable[[], CustomSurface]] = {
    "implicit ellipsoid": lambda: ImplicitSurface(ellipsoid, (0.06, 0.04, 0.03)),
    "implicit ellipsoid by hand": lambda: ImplicitSurface(
        ellipsoid, (0.06, 0.04, 0.03), gradient=ellipsoid_gradient, hessian=ellipsoid_hessian
    ),
    "parametric torus": lambda: ParametricSurface(torus, (0.0, math.tau), (0.0, math.tau)),
    "parametric torus by hand": lambda: ParametricSurface(
        torus, (0.0, math.tau), (-math.pi, math.pi), derivatives=torus_derivatives
    ),
    "implicit torus": lambda: ImplicitSurface(ring, (0.06, 0.06, 0.02)),
    "parametric cylinder": lambda: ParametricSurface(rolled, (0.0, math.tau), (-0.2, 0.2)),
    "superellipsoid": lambda: ImplicitSurface(superellipsoid, (0.06, 0.05, 0.04)),
    "bean": lambda: ImplicitSurface(bean, (0.06, 0.06, 0.04)),
    "waist": lambda: ParametricSurface(waist, (0.0, math.tau), (-0.1, 0.1)),
}


def place(surface: CustomSurface, node: Array) -> Array:
    """Write a surface to all rows."""
    write_surface(surface, node)
    return node


def random_rows(surface: CustomSurface, count: int, rng: np.random.Generator) -> Array:
    """Return rows with random geodesics on a surface, in the world frame."""
    node = place(surface, np.zeros((count, lay.ROW)))
    node[:, lay.ROT : lay.ROT + 9] = np.eye(3).ravel()
    for k in range(count):
        point = user_surface.custom_project(k, node, *rng.normal(size=3) * 0.03)
        tangent = np.cross(point[3:], rng.normal(size=3))
        node[k, lay.S_P : lay.S_P + 3] = point[:3]
        node[k, lay.S_T : lay.S_T + 3] = tangent / np.linalg.norm(tangent)
        node[k, lay.S_ARC] = rng.uniform(0.2, 2.5) * min(surface.size, 0.03)
    return node


def followed(node: Array) -> Array:
    """Return the rows with their geodesics evaluated."""
    for k in range(len(node)):
        user_surface.custom_geodesic(k, node)
    return node
