"""Where surfaces are: nearest point and normal, signed height, and how deep a straight segment dips.

Everything in the frame S of the obstacle. The height is negative inside, positive outside, and to first order the
distance where it is small.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit
from mjwrap.kernels.geometry.closed_forms import capsule_normal
from mjwrap.kernels.geometry.quadric import inverse_squares, onto
from mjwrap.kernels.geometry.user_surface import custom_height, custom_project

KIND, DIM, SIZE, POS, ROT = lay.KIND, lay.DIM, lay.SIZE, lay.POS, lay.ROT


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
def _project_cylinder(radius, x, y, z):
    rho = math.sqrt(x * x + y * y)
    if rho == 0.0:
        return radius, 0.0, z, 1.0, 0.0, 0.0
    nx, ny = x / rho, y / rho
    return radius * nx, radius * ny, z, nx, ny, 0.0


@jit
def _project_sphere(radius, x, y, z):
    rho = math.sqrt(x * x + y * y + z * z)
    if rho == 0.0:
        return radius, 0.0, 0.0, 1.0, 0.0, 0.0
    nx, ny, nz = x / rho, y / rho, z / rho
    return radius * nx, radius * ny, radius * nz, nx, ny, nz


@jit
def _project_quadric(node, k, x, y, z):
    """Return the point on the ray from the centre (or axis), which is near the nearest one for points near by."""
    ia, ib, ic = inverse_squares(node, k)
    if ia * x * x + ib * y * y + ic * z * z == 0.0:
        x = node[k, DIM]
    x, y, z = onto(ia, ib, ic, x, y, z)
    gx, gy, gz = ia * x, ib * y, ic * z
    inverse = 1.0 / math.sqrt(gx * gx + gy * gy + gz * gz)
    return x, y, z, gx * inverse, gy * inverse, gz * inverse


@jit
def _project_torus(major, minor, x, y, z):
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
def _project_cone(radius, slope, x, y, z):
    """Return the nearest point of the nappe, kept off the apex."""
    rho = math.sqrt(x * x + y * y)
    cu, su = 1.0, 0.0
    if rho > 0.0:
        cu, su = x / rho, y / rho
    square = 1.0 / (1.0 + slope * slope)
    over = math.sqrt(square)
    foot = (z + slope * (rho - radius)) * square  # z of the nearest point of the line rho = radius + slope z
    reach = radius + slope * foot
    least = 1e-9 * radius
    if reach < least:
        reach, foot = least, (least - radius) / slope
    return reach * cu, reach * su, foot, over * cu, over * su, -slope * over


@jit
def project(node, k, x, y, z):
    """Return a point of obstacle k's surface near (x, y, z), and the outward normal there; frame S.

    The nearest one but on ellipsoid and elliptic cylinder, where it lies on the ray from the centre or axis.
    """
    kind = node[k, KIND]
    if kind == lay.CYLINDER:
        return _project_cylinder(node[k, DIM], x, y, z)
    if kind == lay.SPHERE:
        return _project_sphere(node[k, DIM], x, y, z)
    if kind == lay.ELLIPSOID or kind == lay.ELLIPTIC_CYLINDER:
        return _project_quadric(node, k, x, y, z)
    if kind == lay.TORUS:
        return _project_torus(node[k, DIM], node[k, DIM + 1], x, y, z)
    if kind == lay.CONE:
        return _project_cone(node[k, DIM], node[k, DIM + 1], x, y, z)
    if kind == lay.CUSTOM:
        return custom_project(k, node, x, y, z)
    radius, half = node[k, DIM], node[k, DIM + 1]
    nx, ny, nz = capsule_normal(radius, half, x, y, z)
    return radius * nx, radius * ny, min(max(z, -half), half) + radius * nz, nx, ny, nz


# -------------------------------------------------------------------------------------------- height


@jit
def height(node, k, x, y, z):
    """Return the signed height of a point of S over obstacle k's surface [m]."""
    kind = node[k, KIND]
    if kind == lay.CYLINDER:
        return math.sqrt(x * x + y * y) - node[k, DIM]
    if kind == lay.SPHERE:
        return math.sqrt(x * x + y * y + z * z) - node[k, DIM]
    if kind == lay.ELLIPSOID or kind == lay.ELLIPTIC_CYLINDER:
        ia, ib, ic = inverse_squares(node, k)
        gx, gy, gz = ia * x, ib * y, ic * z
        square = gx * gx + gy * gy + gz * gz
        if square == 0.0:
            return -node[k, SIZE]
        phi = gx * x + gy * y + gz * z
        return (phi - math.sqrt(phi)) / math.sqrt(square)
    if kind == lay.TORUS:
        rho = math.sqrt(x * x + y * y) - node[k, DIM]
        return math.sqrt(rho * rho + z * z) - node[k, DIM + 1]
    if kind == lay.CONE:
        slope = node[k, DIM + 1]
        reach = node[k, DIM] + slope * z
        rho = math.sqrt(x * x + y * y)
        return (rho - reach) / math.sqrt(1.0 + slope * slope)
    if kind == lay.CUSTOM:
        return custom_height(k, node, x, y, z)
    z -= min(max(z, -node[k, DIM + 1]), node[k, DIM + 1])
    return math.sqrt(x * x + y * y + z * z) - node[k, DIM]
