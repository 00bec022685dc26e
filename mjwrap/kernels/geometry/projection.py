"""Nearest point, normal and signed height of each surface; points and vectors turned into the frame of an obstacle.

All functions but the first two work in the frame S of the obstacle; `dispatch.py` chooses among them. The height is
negative inside and positive outside; near the surface it is the distance, to first order.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.geometry.closed_forms import capsule_normal
from mjwrap.kernels.geometry.quadric import inverse_squares, onto

DIM, SIZE, POS, ROT = lay.DIM, lay.SIZE, lay.POS, lay.ROT


@jit
def into_frame(node, k, x, y, z):
    """Return the world point (x, y, z) in the frame of obstacle k."""
    return turn_into_frame(node, k, x - node[k, POS], y - node[k, POS + 1], z - node[k, POS + 2])


@jit
def turn_into_frame(node, k, x, y, z):
    """Return the world vector (x, y, z) in the frame of obstacle k."""
    return (
        node[k, ROT] * x + node[k, ROT + 3] * y + node[k, ROT + 6] * z,
        node[k, ROT + 1] * x + node[k, ROT + 4] * y + node[k, ROT + 7] * z,
        node[k, ROT + 2] * x + node[k, ROT + 5] * y + node[k, ROT + 8] * z,
    )


# ---------------------------------------------------------------------------------------- projection


@jit
def project_cylinder(radius, x, y, z):
    """Return the nearest point of the cylinder and the normal there."""
    rho = math.sqrt(x * x + y * y)
    if rho == 0.0:
        return radius, 0.0, z, 1.0, 0.0, 0.0
    nx, ny = x / rho, y / rho
    return radius * nx, radius * ny, z, nx, ny, 0.0


@jit
def project_sphere(radius, x, y, z):
    """Return the nearest point of the sphere and the normal there."""
    rho = math.sqrt(x * x + y * y + z * z)
    if rho == 0.0:
        return radius, 0.0, 0.0, 1.0, 0.0, 0.0
    nx, ny, nz = x / rho, y / rho, z / rho
    return radius * nx, radius * ny, radius * nz, nx, ny, nz


@jit
def project_quadric(node, k, x, y, z):
    """Return the surface point on the ray from the centre or axis, near the nearest point, and the normal there."""
    ia, ib, ic = inverse_squares(node, k)
    if ia * x * x + ib * y * y + ic * z * z == 0.0:
        x = node[k, DIM]
    x, y, z = onto(ia, ib, ic, x, y, z)
    gx, gy, gz = ia * x, ib * y, ic * z
    inverse = 1.0 / math.sqrt(gx * gx + gy * gy + gz * gz)
    return x, y, z, gx * inverse, gy * inverse, gz * inverse


@jit
def project_torus(major, minor, x, y, z):
    """Return the nearest point of the torus and the normal there."""
    rho = math.sqrt(x * x + y * y)
    cu, su = 1.0, 0.0
    if rho > 0.0:
        cu, su = x / rho, y / rho
    size = math.sqrt((rho - major) ** 2 + z * z)
    cv, sv = 1.0, 0.0
    if size > 0.0:
        cv, sv = (rho - major) / size, z / size
    rho = major + minor * cv
    return rho * cu, rho * su, minor * sv, cv * cu, cv * su, sv


@jit
def project_cone(radius, slope, x, y, z):
    """Return the nearest point of the cone, kept away from the apex, and the normal there."""
    rho = math.sqrt(x * x + y * y)
    cu, su = 1.0, 0.0
    if rho > 0.0:
        cu, su = x / rho, y / rho
    square = 1.0 / (1.0 + slope * slope)
    over = math.sqrt(square)
    # the nearest point of the line rho = radius + slope z
    nearest_z = (z + slope * (rho - radius)) * square
    nearest_rho = radius + slope * nearest_z
    least = 1e-9 * radius
    if nearest_rho < least:
        nearest_rho, nearest_z = least, (least - radius) / slope
    return nearest_rho * cu, nearest_rho * su, nearest_z, over * cu, over * su, -slope * over


@jit
def project_capsule(radius, half, x, y, z):
    """Return the nearest point of the capsule and the normal there."""
    nx, ny, nz = capsule_normal(radius, half, x, y, z)
    return radius * nx, radius * ny, min(max(z, -half), half) + radius * nz, nx, ny, nz


# -------------------------------------------------------------------------------------------- height


@jit
def height_over_cylinder(radius, x, y):
    """Return the distance from a cylinder [m]."""
    return math.sqrt(x * x + y * y) - radius


@jit
def height_over_sphere(radius, x, y, z):
    """Return the distance from a sphere [m]."""
    return math.sqrt(x * x + y * y + z * z) - radius


@jit
def height_over_quadric(node, k, x, y, z):
    """Return the height over an ellipsoid or elliptic cylinder [m]; in the centre it is minus the size."""
    ia, ib, ic = inverse_squares(node, k)
    gx, gy, gz = ia * x, ib * y, ic * z
    square = gx * gx + gy * gy + gz * gz
    if square == 0.0:
        return -node[k, SIZE]
    phi = gx * x + gy * y + gz * z
    return (phi - math.sqrt(phi)) / math.sqrt(square)


@jit
def height_over_torus(major, minor, x, y, z):
    """Return the distance from a torus [m]."""
    rho = math.sqrt(x * x + y * y) - major
    return math.sqrt(rho * rho + z * z) - minor


@jit
def height_over_cone(radius, slope, x, y, z):
    """Return the distance from a cone [m]; the same formula is used beyond the apex."""
    cone_radius = radius + slope * z
    rho = math.sqrt(x * x + y * y)
    return (rho - cone_radius) / math.sqrt(1.0 + slope * slope)


@jit
def height_over_capsule(radius, half, x, y, z):
    """Return the distance from a capsule [m]."""
    z -= min(max(z, -half), half)
    return math.sqrt(x * x + y * y + z * z) - radius
