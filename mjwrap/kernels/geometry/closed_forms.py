"""Geodesics in closed form, with their Jacobi fields: cylinder, cone, sphere, capsule.

Darboux frame (t, n, b = t x n); kappa = t.Wt, tau = t.Wb, beta = b.Wb with the shape operator W, dn = W dp.
a, r are the Jacobi fields: a'' = -K a, a(0) = 1, a'(0) = 0; r(0) = 0, r'(0) = 1 ("How a geodesic moves" in
docs/derivation.md).
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, jit
from mjwrap.kernels.geometry.vectors import put_curvature, put_end, put_fields, put_start

DIM, S_P, S_T, S_ARC = lay.DIM, lay.S_P, lay.S_T, lay.S_ARC
W_KP, W_KQ = lay.W_KP, lay.W_KQ


@jit
def cylinder(k, node):
    """Helix on the unrolled cylinder (K = 0): a = 1, r = s."""
    radius = node[k, DIM]
    inverse = 1.0 / radius
    nx, ny, z = node[k, S_P] * inverse, node[k, S_P + 1] * inverse, node[k, S_P + 2]
    tx, ty, tz = node[k, S_T], node[k, S_T + 1], node[k, S_T + 2]
    s = node[k, S_ARC]
    around = nx * ty - ny * tx
    angle = s * around * inverse
    c, d = math.cos(angle), math.sin(angle)
    mx, my = c * nx - d * ny, d * nx + c * ny
    put_start(node, k, radius * nx, radius * ny, z, tx, ty, tz, nx, ny, 0.0)
    put_end(node, k, radius * mx, radius * my, z + s * tz, c * tx - d * ty, d * tx + c * ty, tz, mx, my, 0.0)
    kappa, tau, beta = around * around * inverse, around * tz * inverse, tz * tz * inverse
    put_curvature(node, k, W_KP, kappa, tau, beta)
    put_curvature(node, k, W_KQ, kappa, tau, beta)
    put_fields(node, k, 1.0, 0.0, s, 1.0, kappa, 1.0)


@jit
def sphere(k, node):
    """Great circle (K = 1/R^2): a = cos(s/R), r = R sin(s/R)."""
    radius = node[k, DIM]
    inverse = 1.0 / radius
    nx, ny, nz = node[k, S_P] * inverse, node[k, S_P + 1] * inverse, node[k, S_P + 2] * inverse
    tx, ty, tz = node[k, S_T], node[k, S_T + 1], node[k, S_T + 2]
    angle = node[k, S_ARC] * inverse
    c, d = math.cos(angle), math.sin(angle)
    mx, my, mz = c * nx + d * tx, c * ny + d * ty, c * nz + d * tz
    put_start(node, k, radius * nx, radius * ny, radius * nz, tx, ty, tz, nx, ny, nz)
    put_end(
        node, k, radius * mx, radius * my, radius * mz, c * tx - d * nx, c * ty - d * ny, c * tz - d * nz,
        mx, my, mz,
    )  # fmt: skip
    put_curvature(node, k, W_KP, inverse, 0.0, inverse)
    put_curvature(node, k, W_KQ, inverse, 0.0, inverse)
    past = 1.0 if abs(angle) < math.pi else -1.0
    put_fields(node, k, c, -d * inverse, radius * d, c, inverse, past)


@jit
def cone_angle(slope):
    """Return cosine and sine of the angle between the rulings and the axis."""
    over = 1.0 / math.sqrt(1.0 + slope * slope)
    return over, abs(slope) * over


@deferred(types.none)
def cone(k, node):
    """Straight line on the unrolled cone (K = 0): a = 1, r = s.

    m is the distance from the apex along a ruling; a plane angle of the unrolled cone is the angle about the axis
    times the sine of the half angle. The curvature across a ruling is cos / rho.
    """
    slope = node[k, DIM + 1]
    cosine, sine = cone_angle(slope)
    away = 1.0 if slope > 0.0 else -1.0  # direction along z that leads away from the apex
    apex = -node[k, DIM] / slope
    x, y, z = node[k, S_P], node[k, S_P + 1], node[k, S_P + 2]
    tx, ty, tz = node[k, S_T], node[k, S_T + 1], node[k, S_T + 2]
    s = node[k, S_ARC]
    rho = math.sqrt(x * x + y * y)
    cu, su = x / rho, y / rho
    out = cu * tx + su * ty
    around = cu * ty - su * tx
    along = sine * out + away * cosine * tz
    m = rho / sine
    qx, qy = m + s * along, s * around
    m_q = math.sqrt(qx * qx + qy * qy)
    turn = math.atan2(qy, qx) / sine
    node[k, lay.W_ANGLE] = turn
    c, d = math.cos(turn), math.sin(turn)
    put_start(node, k, x, y, z, tx, ty, tz, cosine * cu, cosine * su, -away * sine)
    _curvature(node, k, W_KP, around, along, cosine / rho)
    cu, su = c * cu - d * su, d * cu + c * su
    over = 1.0 / m_q
    along, around = (along * qx + around * qy) * over, (around * qx - along * qy) * over
    rho = m_q * sine
    out = sine * along
    put_end(
        node, k, rho * cu, rho * su, apex + away * cosine * m_q,
        out * cu - around * su, out * su + around * cu, away * cosine * along,
        cosine * cu, cosine * su, -away * sine,
    )  # fmt: skip
    _curvature(node, k, W_KQ, around, along, cosine / rho)
    put_fields(node, k, 1.0, 0.0, s, 1.0, node[k, W_KQ], 1.0)


@jit
def _curvature(node, k, column, around, along, across):
    """Write kappa, tau, beta where only the direction around the axis is curved; n is outward, b = t x n.

    around = t.e_u and along = t.e_m, with e_u around the axis and e_m away from the apex; b.e_u is along, with a sign.
    """
    away = 1.0 if node[k, DIM + 1] > 0.0 else -1.0
    b_around = away * along
    put_curvature(
        node, k, column, across * around * around, across * around * b_around, across * b_around * b_around
    )


@deferred(types.none)
def capsule(k, node):
    """Helices on the cylinder and great circles on the caps in turn; the Jacobi fields are continuous at the seams."""
    radius, half = node[k, DIM], node[k, DIM + 1]
    inverse = 1.0 / radius
    x, y, z = node[k, S_P], node[k, S_P + 1], node[k, S_P + 2]
    tx, ty, tz = node[k, S_T], node[k, S_T + 1], node[k, S_T + 2]
    nx, ny, nz = capsule_normal(radius, half, x, y, z)
    put_start(node, k, x, y, z, tx, ty, tz, nx, ny, nz)
    _put_capsule(node, k, W_KP, half, inverse, z, nx, ny, nz, tx, ty, tz)
    left = node[k, S_ARC]
    sign = 1.0 if left >= 0.0 else -1.0
    left = abs(left)
    tx, ty, tz = sign * tx, sign * ty, sign * tz
    a, da, r, dr = 1.0, 0.0, 0.0, 1.0
    gone, least = 0.0, 1.0
    least_curvature = node[k, W_KP]
    for _ in range(64):
        on_cap = abs(z) > half or (abs(z) == half and z * tz > 0.0)
        if not on_cap:
            around = nx * ty - ny * tx
            h = left
            if tz > 0.0:
                h = min(h, (half - z) / tz)
            elif tz < 0.0:
                h = min(h, (-half - z) / tz)
            angle = h * around * inverse
            c, d = math.cos(angle), math.sin(angle)
            nx, ny, tx, ty = c * nx - d * ny, d * nx + c * ny, c * tx - d * ty, d * tx + c * ty
            z = math.copysign(half, tz) if h < left else z + h * tz
            a, r = a + h * da, r + h * dr
            least_curvature = min(least_curvature, around * around * inverse)
        else:
            side = math.copysign(1.0, z)
            h = left
            # height over the seam: R (n_z cos w + t_z sin w), zero again at the angle where it comes back
            back = math.atan2(-side * nz, side * tz) % math.pi
            if back <= 1e-15:
                back = math.pi
            h = min(h, radius * back)
            angle = h * inverse
            c, d = math.cos(angle), math.sin(angle)
            nx, ny, nz, tx, ty, tz = (
                c * nx + d * tx, c * ny + d * ty, c * nz + d * tz, c * tx - d * nx, c * ty - d * ny, c * tz - d * nz,
            )  # fmt: skip
            z = side * half + radius * nz
            if h < left:
                over = 1.0 / math.sqrt(nx * nx + ny * ny)
                nx, ny, nz, z = nx * over, ny * over, 0.0, side * half
            a, da = c * a + radius * d * da, -d * inverse * a + c * da
            r, dr = c * r + radius * d * dr, -d * inverse * r + c * dr
            least_curvature = min(least_curvature, inverse)
        left -= h
        gone += h
        if gone > 0.0:
            least = min(least, r / gone)
        if on_cap and angle >= math.pi:
            least = min(least, -1.0)
        if left <= 0.0:
            break
    tx, ty, tz = sign * tx, sign * ty, sign * tz
    if abs(z) <= half:
        nz = 0.0
    put_end(node, k, radius * nx, radius * ny, z, tx, ty, tz, nx, ny, nz)
    _put_capsule(node, k, W_KQ, half, inverse, z, nx, ny, nz, tx, ty, tz)
    put_fields(node, k, a, sign * da, sign * r, dr, least_curvature, least)


@jit
def capsule_normal(radius, half, x, y, z):
    """Return the outward normal nearest to a point: away from the nearest point of the axis."""
    z -= min(max(z, -half), half)
    size = math.sqrt(x * x + y * y + z * z)
    if size == 0.0:
        return 1.0, 0.0, 0.0
    inverse = 1.0 / size
    return x * inverse, y * inverse, z * inverse


@jit
def _put_capsule(node, k, column, half, inverse, z, nx, ny, nz, tx, ty, tz):
    """Write the curvature of a capsule: a sphere's beyond the seams, a cylinder's between them."""
    if abs(z) > half:
        put_curvature(node, k, column, inverse, 0.0, inverse)
        return
    around = nx * ty - ny * tx
    put_curvature(node, k, column, around * around * inverse, around * tz * inverse, tz * tz * inverse)
