"""Geodesics of the torus with major radius R and minor radius r, in the coordinates (rho, z) of the meridian plane.

With rho the distance from the axis and c = rho^2 u' Clairaut's constant, q = c^2/rho^2 and the normal curvature
kappa = (1 - q)/r + q cos v / rho, the geodesic obeys rho'' = q/rho - kappa cos v, z'' = -kappa sin v, and K = cos v /
(r rho). These depend on the position alone, as Stoermer's rule requires. The angle u about the axis is c times the
integral of 1/rho^2, by the trapezoidal rule on the same substeps with the same extrapolation.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, inlined, jit
from mjwrap.kernels.geometry.stoermer import (
    ERROR_WEIGHT,
    INVERSE,
    LANES,
    MAX_STEPS,
    ROWS,
    SHRINK_EXPONENT,
    TOLERANCE,
    WEIGHT,
    carray,
    stack,
)
from mjwrap.kernels.geometry.vectors import put_curvature, put_end, put_fields, put_start

DIM, S_P, S_T, S_ARC = lay.DIM, lay.S_P, lay.S_T, lay.S_ARC
STEP = 0.8  # first step that is tried, in units of the local length scale


@jit
def _force(rho, z, major, ir, c2):
    """Return rho'', z'', -K and 1/rho^2."""
    w = 1.0 / rho
    cv = (rho - major) * ir
    q = c2 * w * w
    kappa = (1.0 - q) * ir + q * w * cv
    return q * w - kappa * cv, -kappa * (z * ir), -ir * w * cv, w * w


@inlined
def _substep(v, first, last, k, hh, p, z, a, r, major, ir, c2):
    """Take substep k of the columns first..last: increments in rows 0..3 of v, their differences in rows 4..7, the
    sum of 1/rho^2 in row 8.
    """
    for i in range(first, last):
        fp, fz, d, w = _force(p + v[0, i], z + v[1, i], major, ir, c2)
        on = 0.0 if k > i else 1.0
        size = on * (INVERSE[i] * INVERSE[i] * hh)
        v[4, i] += size * fp
        v[5, i] += size * fz
        v[6, i] += size * (d * (a + v[2, i]))
        v[7, i] += size * (d * (r + v[3, i]))
        v[8, i] += on * w
        v[0, i] += on * v[4, i]
        v[1, i] += on * v[5, i]
        v[2, i] += on * v[6, i]
        v[3, i] += on * v[7, i]


@jit
def _step(h, p, z, dp, dz, a, da, r, dr, major, ir, c2):
    """Take one step of length h. Returns the error estimate, the new state and the integral of 1/rho^2."""
    v = carray(stack(), (ROWS, LANES))
    hh = h * h
    fp, fz, d, w = _force(p, z, major, ir, c2)
    fp, fz, fa, fr, w = 0.5 * hh * fp, 0.5 * hh * fz, 0.5 * hh * d * a, 0.5 * hh * d * r, 0.5 * w
    hp, hz, ha, hr = h * dp, h * dz, h * da, h * dr
    for i in range(LANES):
        o = INVERSE[i]
        v[4, i] = v[0, i] = o * (hp + o * fp)
        v[5, i] = v[1, i] = o * (hz + o * fz)
        v[6, i] = v[2, i] = o * (ha + o * fa)
        v[7, i] = v[3, i] = o * (hr + o * fr)
        v[8, i] = w
    for k in range(1, 4):
        _substep(v, 0, 8, k, hh, p, z, a, r, major, ir, c2)
    for k in range(4, 8):
        _substep(v, 4, 8, k, hh, p, z, a, r, major, ir, c2)
    sp, sz, sa, sr, su = 0.0, 0.0, 0.0, 0.0, 0.0
    ep, ez, ea, er = 0.0, 0.0, 0.0, 0.0
    vp, vz, va, vr = 0.0, 0.0, 0.0, 0.0
    for i in range(LANES):
        fp, fz, d, w = _force(p + v[0, i], z + v[1, i], major, ir, c2)
        weight = WEIGHT[i]
        n = weight * (i + 1.0)
        size = 0.5 * weight * INVERSE[i] * hh
        vp += n * v[4, i] + size * fp
        vz += n * v[5, i] + size * fz
        va += n * v[6, i] + size * (d * (a + v[2, i]))
        vr += n * v[7, i] + size * (d * (r + v[3, i]))
        su += weight * INVERSE[i] * (v[8, i] + 0.5 * w)
        sp += weight * v[0, i]
        sz += weight * v[1, i]
        sa += weight * v[2, i]
        sr += weight * v[3, i]
        u = ERROR_WEIGHT[i]
        ep += u * v[0, i]
        ez += u * v[1, i]
        ea += u * v[2, i]
        er += u * v[3, i]
    over = 1.0 / h
    error = max(max(abs(ep), abs(ez)), abs(er)) * abs(over)
    return (
        max(error, abs(ea)), p + sp, z + sz, vp * over, vz * over, a + sa, va * over, r + sr, vr * over, h * su,
    )  # fmt: skip


@deferred(types.none)
def torus(k, node):
    """Evaluate the geodesic of row k; positions in world directions relative to the surface's origin."""
    major, minor = node[k, DIM], node[k, DIM + 1]
    ir = 1.0 / minor
    x, y, z = node[k, S_P], node[k, S_P + 1], node[k, S_P + 2]
    tx, ty, tz = node[k, S_T], node[k, S_T + 1], node[k, S_T + 2]
    rho = math.sqrt(x * x + y * y)
    cu, su = x / rho, y / rho
    cv, sv = (rho - major) * ir, z * ir
    put_start(node, k, x, y, z, tx, ty, tz, cv * cu, cv * su, sv)
    around = cu * ty - su * tx  # t along the parallel, and along the meridian in the direction of growing v
    along = cv * tz - sv * (cu * tx + su * ty)
    _put_curvature(node, k, lay.W_KP, around, along, cv, ir, rho)
    c = rho * around
    c2 = c * c
    dp, dz = -sv * along, cv * along
    left, gone, angle = node[k, S_ARC], 0.0, 0.0
    a, da, r, dr = 1.0, 0.0, 0.0, 1.0
    least, least_curvature = 1.0, node[k, lay.W_KP]
    longest = 1e300
    turns = 0.0
    for _ in range(MAX_STEPS):
        if left == 0.0:
            break
        w = 1.0 / rho
        q = c2 * w * w
        h = min(STEP / math.sqrt(max(1.0 - q, 0.0) * ir * ir + ir * w), longest)
        if abs(left) <= h:
            h = left
        else:
            h = left / math.ceil(abs(left) / h)
        error, p1, z1, dp1, dz1, a1, da1, r1, dr1, part = _step(
            h, rho, z, dp, dz, a, da, r, dr, major, ir, c2
        )
        if not error <= TOLERANCE:
            longest = abs(h) * min(max((0.1 * TOLERANCE / error) ** SHRINK_EXPONENT, 0.2), 0.9)
            continue
        if (z >= 0.0) != (z1 >= 0.0) and rho + p1 < 2.0 * major:
            turns += 1.0 if (z >= 0.0) == (left > 0.0) else -1.0
        if h * dp < 0.0 < h * dp1:
            # least distance from the axis within the step: the hole's radius, or c where the geodesic turns before it
            nearest = max(major - minor, abs(c))
            least_curvature = min(least_curvature, (1.0 - c2 * major / nearest**3) * ir)
        rho, z, dp, dz, a, da, r, dr = p1, z1, dp1, dz1, a1, da1, r1, dr1
        angle += part
        gone += h
        least = min(least, r / gone)
        longest = 1e300
        left = 0.0 if h == left else left - h
        w = 1.0 / rho
        q = c2 * w * w
        least_curvature = min(least_curvature, (1.0 - q) * ir + q * w * (rho - major) * ir)
    cv, sv = (rho - major) * ir, z * ir
    over = 1.0 / math.sqrt(cv * cv + sv * sv)
    cv, sv = cv * over, sv * over
    rho, z = major + minor * cv, minor * sv
    angle *= c
    cosine, sine = math.cos(angle), math.sin(angle)
    cu, su = cu * cosine - su * sine, su * cosine + cu * sine
    around, along = c / rho, cv * dz - sv * dp
    over = 1.0 / math.sqrt(around * around + along * along)
    around, along = around * over, along * over
    put_end(
        node, k, rho * cu, rho * su, z,
        -around * su - along * sv * cu, around * cu - along * sv * su, along * cv, cv * cu, cv * su, sv,
    )  # fmt: skip
    _put_curvature(node, k, lay.W_KQ, around, along, cv, ir, rho)
    node[k, lay.W_ANGLE] = turns
    put_fields(node, k, a, da, r, dr, least_curvature, least)


@jit
def _put_curvature(node, k, column, around, along, cv, ir, rho):
    """Write kappa, tau, beta for t = around e_u + along e_v with n = e_u x e_v, so that b = along e_u - around e_v."""
    parallel = cv / rho
    put_curvature(
        node, k, column,
        parallel * around * around + ir * along * along,
        (parallel - ir) * around * along,
        parallel * along * along + ir * around * around,
    )  # fmt: skip
