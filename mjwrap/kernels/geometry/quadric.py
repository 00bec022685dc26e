"""Geodesics of the ellipsoid, x^2/a^2 + y^2/b^2 + z^2/c^2 = 1, in Cartesian space, and points of both quadrics.

With g = (x/a^2, y/b^2, z/c^2), half the gradient, S = g.g and T = t.A t, A = diag(1/a^2, 1/b^2, 1/c^2), the geodesic
obeys p'' = -(T/S) g, and Joachimsthal's integral C = T S is constant along it. So p'' = -(C/S^2) g and K = det A / S^2
depend on the position alone. Stoermer's rule integrates p and both Jacobi fields with one division per substep.

Nearest points are here for the elliptic cylinder (1/c = 0) as well; its geodesics are in `elliptic_cylinder.py`.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, inlined, jit
from mjwrap.kernels.geometry.stoermer import (
    ERROR_WEIGHT,
    INVERSE,
    INVERSE_SQUARE,
    LANES,
    MAX_STEPS,
    RATE_WEIGHT,
    ROWS,
    SHRINK_EXPONENT,
    TOLERANCE,
    WEIGHT,
    carray,
    combine,
    stack,
)
from mjwrap.kernels.geometry.vectors import put_curvature, put_end, put_fields, put_start

DIM, S_P, S_T, S_ARC = lay.DIM, lay.S_P, lay.S_T, lay.S_ARC
STEP = 0.8  # first step that is tried, in units of the local length scale
NEAREST_STEPS = 60  # most Newton steps to the nearest point of an ellipsoid; five to ten are normal
OFF_AXIS = 1e-9  # least distance from a middle plane with which a point enters, as a share of the semi-axis


@jit
def inverse_squares(node, k):
    """Return 1/a^2, 1/b^2, 1/c^2 of row k; the last is zero for an elliptic cylinder, whose c is infinite."""
    a, b, c = node[k, DIM], node[k, DIM + 1], node[k, DIM + 2]
    return 1.0 / (a * a), 1.0 / (b * b), 1.0 / (c * c)


@jit
def onto(ia, ib, ic, x, y, z):
    """Return the point scaled from the centre (from the axis, where 1/c = 0) onto the surface."""
    scale = 1.0 / math.sqrt(ia * x * x + ib * y * y + ic * z * z)
    if ic == 0.0:
        return scale * x, scale * y, z
    return scale * x, scale * y, scale * z


@jit
def nearest_on_quadric(node, k, x, y, z):
    """Return the point of an ellipsoid or elliptic cylinder nearest to a point inside it; frame S.

    Each of its coordinates is a^2 x / (a^2 + s), with s < 0 such that the point is on the surface. The equation for s
    is convex and falling, so that Newton's method converges to the root from the left without a safeguard.
    """
    a, b, c = node[k, DIM], node[k, DIM + 1], node[k, DIM + 2]
    ia, ib, ic = inverse_squares(node, k)
    if ic == 0.0:
        c = 1.0
    u, v, w = max(abs(x) / a, OFF_AXIS), max(abs(y) / b, OFF_AXIS), max(abs(z) / c, OFF_AXIS)
    if ic == 0.0:
        w = 0.0
    s = max(a * a * (u - 1.0), b * b * (v - 1.0))
    if ic > 0.0:
        s = max(s, c * c * (w - 1.0))
    p, q, r = u, v, w
    for _ in range(NEAREST_STEPS):
        fa, fb, fc = 1.0 / (1.0 + s * ia), 1.0 / (1.0 + s * ib), 1.0 / (1.0 + s * ic)
        p, q, r = u * fa, v * fb, w * fc
        rest = p * p + q * q + r * r - 1.0
        move = 0.5 * rest / (p * p * ia * fa + q * q * ib * fb + r * r * ic * fc)
        s += move
        if rest <= 4e-16:
            break
    px, py = math.copysign(a * p, x), math.copysign(b * q, y)
    return onto(ia, ib, ic, px, py, z if ic == 0.0 else math.copysign(c * r, z))


@inlined
def _substep(v, first, last, k, cx, cy, cz, d):
    """Take substep k of the columns first..last: g, a, r in rows 0..4 of v, their differences in rows 5..9."""
    for i in range(first, last):
        gx, gy, gz = v[0, i], v[1, i], v[2, i]
        square = gx * gx + (gy * gy + gz * gz)
        on = 0.0 if k > i else 1.0
        size = (on * INVERSE_SQUARE[i]) / (square * square)
        v[5, i] -= size * (cx * gx)
        v[6, i] -= size * (cy * gy)
        v[7, i] -= size * (cz * gz)
        v[8, i] -= size * (d * v[3, i])
        v[9, i] -= size * (d * v[4, i])
        v[0, i] = gx + on * v[5, i]
        v[1, i] = gy + on * v[6, i]
        v[2, i] = gz + on * v[7, i]
        v[3, i] += on * v[8, i]
        v[4, i] += on * v[9, i]


@jit
def _step(h, rate, c, d, gx, gy, gz, ux, uy, uz, a, da, r, dr, ia, ib, ic):
    """Take one step of length h in g, its rate u, and both fields; c, d: constants of the forces.

    rate: 1 over the local length scale. Returns the error estimate, in that scale, and the new state.
    """
    v = carray(stack(), (ROWS, LANES))
    hh = h * h
    cx, cy, cz, d = hh * c * ia, hh * c * ib, hh * c * ic, hh * d
    square = gx * gx + (gy * gy + gz * gz)
    size = 0.5 / (square * square)
    fx, fy, fz, fa, fr = size * (cx * gx), size * (cy * gy), size * (cz * gz), size * (d * a), size * (d * r)
    ux, uy, uz, da, dr = h * ux, h * uy, h * uz, h * da, h * dr
    for i in range(LANES):
        o = INVERSE[i]
        v[5, i] = o * (ux - o * fx)
        v[6, i] = o * (uy - o * fy)
        v[7, i] = o * (uz - o * fz)
        v[8, i] = o * (da - o * fa)
        v[9, i] = o * (dr - o * fr)
        v[0, i] = gx + v[5, i]
        v[1, i] = gy + v[6, i]
        v[2, i] = gz + v[7, i]
        v[3, i] = a + v[8, i]
        v[4, i] = r + v[9, i]
    for k in range(1, 4):
        _substep(v, 0, 8, k, cx, cy, cz, d)
    for k in range(4, 8):
        _substep(v, 4, 8, k, cx, cy, cz, d)
    for i in range(LANES):
        gx, gy, gz = v[0, i], v[1, i], v[2, i]
        square = gx * gx + (gy * gy + gz * gz)
        size = 0.5 * INVERSE_SQUARE[i] / (square * square)
        v[5, i] -= size * (cx * gx)
        v[6, i] -= size * (cy * gy)
        v[7, i] -= size * (cz * gz)
        v[8, i] -= size * (d * v[3, i])
        v[9, i] -= size * (d * v[4, i])
    over = 1.0 / h
    error = max(abs(combine(v, 0, ERROR_WEIGHT)) / ia, abs(combine(v, 1, ERROR_WEIGHT)) / ib)
    error = max(error, abs(combine(v, 2, ERROR_WEIGHT)) / ic)
    error = max(max(error, abs(combine(v, 4, ERROR_WEIGHT))) * rate, abs(combine(v, 3, ERROR_WEIGHT)))
    return (
        error, combine(v, 0, WEIGHT), combine(v, 1, WEIGHT), combine(v, 2, WEIGHT),
        combine(v, 5, RATE_WEIGHT) * over, combine(v, 6, RATE_WEIGHT) * over, combine(v, 7, RATE_WEIGHT) * over,
        combine(v, 3, WEIGHT), combine(v, 8, RATE_WEIGHT) * over,
        combine(v, 4, WEIGHT), combine(v, 9, RATE_WEIGHT) * over,
    )  # fmt: skip


@jit
def _frame(ia, ib, ic, x, y, z, tx, ty, tz):
    """Return n, t made tangent and unit, and kappa, tau, beta at a point of the surface."""
    gx, gy, gz = ia * x, ib * y, ic * z
    inverse = 1.0 / math.sqrt(gx * gx + gy * gy + gz * gz)
    nx, ny, nz = gx * inverse, gy * inverse, gz * inverse
    along = tx * nx + ty * ny + tz * nz
    tx, ty, tz = tx - along * nx, ty - along * ny, tz - along * nz
    size = 1.0 / math.sqrt(tx * tx + ty * ty + tz * tz)
    tx, ty, tz = tx * size, ty * size, tz * size
    bx, by, bz = ty * nz - tz * ny, tz * nx - tx * nz, tx * ny - ty * nx
    kappa = (ia * tx * tx + ib * ty * ty + ic * tz * tz) * inverse
    tau = (ia * tx * bx + ib * ty * by + ic * tz * bz) * inverse
    beta = (ia * bx * bx + ib * by * by + ic * bz * bz) * inverse
    return nx, ny, nz, tx, ty, tz, kappa, tau, beta


@deferred(types.none)
def quadric(k, node):
    """Evaluate the geodesic of row k; positions in world directions relative to the surface's origin."""
    ia, ib, ic = inverse_squares(node, k)
    x, y, z = node[k, S_P], node[k, S_P + 1], node[k, S_P + 2]
    tx, ty, tz = node[k, S_T], node[k, S_T + 1], node[k, S_T + 2]
    nx, ny, nz, tx, ty, tz, kappa, tau, beta = _frame(ia, ib, ic, x, y, z, tx, ty, tz)
    put_start(node, k, x, y, z, tx, ty, tz, nx, ny, nz)
    put_curvature(node, k, lay.W_KP, kappa, tau, beta)
    gx, gy, gz = ia * x, ib * y, ic * z
    square = gx * gx + gy * gy + gz * gz
    c = (ia * tx * tx + ib * ty * ty + ic * tz * tz) * square
    d = ia * ib * ic
    left, gone = node[k, S_ARC], 0.0
    ux, uy, uz = ia * tx, ib * ty, ic * tz
    a, da, r, dr = 1.0, 0.0, 0.0, 1.0
    least = 1.0
    longest = 1e300
    for _ in range(MAX_STEPS):
        if left == 0.0:
            break
        # first and second rate of the gradient: about the reciprocal distance of the complex zeros of S
        pull = (ia * gx * gx + ib * gy * gy + ic * gz * gz) * c / (square * square)
        rate = math.sqrt((ux * ux + uy * uy + uz * uz + pull) / square)
        h = min(STEP / rate, longest)
        if abs(left) <= h:
            h = left
        else:
            h = left / math.ceil(abs(left) / h)
        error, px, py, pz, vx, vy, vz, f, df, g, dg = _step(
            h, rate, c, d, gx, gy, gz, ux, uy, uz, a, da, r, dr, ia, ib, ic
        )
        if not error <= TOLERANCE:
            longest = abs(h) * min(max((0.1 * TOLERANCE / error) ** SHRINK_EXPONENT, 0.2), 0.9)
            continue
        gx, gy, gz, ux, uy, uz, a, da, r, dr = px, py, pz, vx, vy, vz, f, df, g, dg
        gone += h
        least = min(least, r / gone)
        longest = 1e300
        left = 0.0 if h == left else left - h
        square = gx * gx + gy * gy + gz * gz
    x, y, z = gx / ia, gy / ib, gz / ic
    tx, ty, tz = ux / ia, uy / ib, uz / ic
    x, y, z = onto(ia, ib, ic, x, y, z)
    nx, ny, nz, tx, ty, tz, kappa, tau, beta = _frame(ia, ib, ic, x, y, z, tx, ty, tz)
    put_end(node, k, x, y, z, tx, ty, tz, nx, ny, nz)
    put_curvature(node, k, lay.W_KQ, kappa, tau, beta)
    put_fields(node, k, a, da, r, dr, kappa, least)
