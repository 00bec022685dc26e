"""Geodesics of the elliptic cylinder in closed form: straight lines on the unrolled surface, by elliptic integrals.

A section with semi-axes a >= b is (a cos u, b sin u), with u from the tip (a, 0) on; u is also the angle about the axis
in the affine image in which the section is round. From the tip to u the arc is, in Carlson's symmetric integrals,

    F(u) = b (S R_F(C², D², 1) + q S³ R_D(C², D², 1) / 3),    S = sin u, C = cos u, q = a²/b² - 1, D² = 1 + q S²,

of which all terms are positive (DLMF 19.25.9): no digits cancel, however flat the section is. Carlson's duplication
computes both integrals in one loop (DLMF 19.36). Arcs are measured from the nearest tip, since the normal turns fastest
there. K = 0, so that a = 1 and r = s. Derivation and bound of the error: "Geodesics" in docs/derivation.md.
"""

from __future__ import annotations

import math

import numpy as np
from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, jit
from mjwrap.kernels.geometry.vectors import put_curvature, put_end, put_fields, put_start

DIM, S_P, S_T, S_ARC = lay.DIM, lay.S_P, lay.S_T, lay.S_ARC

SPREAD = (
    0.005  # the series of Carlson's integrals is exact to rounding if its arguments differ by a smaller share
)
MAX_DUPLICATIONS = 60  # twelve are normal at an aspect of 1e6
MAX_INVERSIONS = 60  # most steps to the angle of an arc; two or three are normal
SHORT_ARC = (
    0.8  # an arc over a smaller angle, times b/a, is integrated by Gauss' rule: a difference has no digits
)
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)


@jit
def _arc_from_tip(a, b, c, s):
    """Return F(u), the signed arc from the tip (a, 0) to u, |u| <= pi / 2 [m]; c, s: cosine and sine of u; a >= b."""
    q = (a - b) * (a + b) / (b * b)
    x, y, z = c * c, 1.0 + q * s * s, 1.0
    # duplication: x, y, z grow equal; `total` is the part of R_D that is split off on the way
    total, power = 0.0, 1.0
    mean = (x + y + z) * (1.0 / 3.0)
    for _ in range(MAX_DUPLICATIONS):
        if max(abs(x - mean), max(abs(y - mean), abs(z - mean))) < SPREAD * mean:
            break
        rx, ry, rz = math.sqrt(x), math.sqrt(y), math.sqrt(z)
        shift = rx * ry + rz * (rx + ry)
        total += power / (rz * (z + shift))
        power *= 0.25
        x, y, z = 0.25 * (x + shift), 0.25 * (y + shift), 0.25 * (z + shift)
        mean = (x + y + z) * (1.0 / 3.0)
    # R_F by its series (DLMF 19.36.1)
    over = 1.0 / mean
    dx, dy = 1.0 - x * over, 1.0 - y * over
    dz = -(dx + dy)
    e2, e3 = dx * dy - dz * dz, dx * dy * dz
    first = (
        1.0 - e2 * (0.1 - e2 / 24.0 + e3 * (3.0 / 44.0) + e2 * e2 * (5.0 / 208.0)) + e3 / 14.0
    ) / math.sqrt(mean)
    # R_D by its series (DLMF 19.36.2), in which z counts three times
    mean = 0.2 * (x + y + 3.0 * z)
    over = 1.0 / mean
    dx, dy = 1.0 - x * over, 1.0 - y * over
    dz = -(dx + dy) * (1.0 / 3.0)
    product, square = dx * dy, dz * dz
    e2, e3 = product - 6.0 * square, (3.0 * product - 8.0 * square) * dz
    e4, e5 = 3.0 * (product - square) * square, product * square * dz
    series = (
        1.0 - e2 * (3.0 / 14.0) + e3 / 6.0 + e2 * e2 * (9.0 / 88.0) - e4 * (3.0 / 22.0) - e2 * e3 * (9.0 / 52.0)
        + e5 * (3.0 / 26.0) - e2 * e2 * e2 / 16.0 + e3 * e3 * (3.0 / 40.0) + e2 * e4 * (3.0 / 20.0)
    )  # fmt: skip
    second = power * series / (mean * math.sqrt(mean)) + 3.0 * total
    return b * s * (first + q * s * s * second * (1.0 / 3.0))


@jit
def _angle_of_arc(a, b, arc, quarter):
    """Return the angle u with F(u) = arc [rad], |arc| <= quarter = F(pi / 2); Halley's method within a bracket."""
    wanted = abs(arc)
    if wanted == 0.0:
        return 0.0
    # exact for a circle's quarter, for small u, and for b = 0: chord = 2 sin(u / 2)
    k = 0.5 * math.sqrt((a - b) * (a + b))
    flat = (0.5 * quarter * quarter - b * b - k * quarter) / (quarter * quarter)
    chord = wanted / math.sqrt(b * b + wanted * (k + wanted * flat))
    u = 2.0 * math.asin(min(0.5 * chord, math.sqrt(0.5)))
    low, high = 0.0, 0.5 * math.pi
    for _ in range(MAX_INVERSIONS):
        c, s = math.cos(u), math.sin(u)
        rate = math.sqrt(b * b * c * c + a * a * s * s)
        step = (_arc_from_tip(a, b, c, s) - wanted) / rate
        if step > 0.0:
            high = min(high, u)
        else:
            low = max(low, u)
        bend = 0.5 * (a - b) * (a + b) * s * c / (rate * rate)  # half of F'' / F'
        step /= max(1.0 - step * bend, 0.5)
        before = u
        u -= step
        if not low <= u <= high:
            u = 0.5 * (low + high)
        # the error left is of third order in the step
        width = b / a + before
        if abs(step) <= 1e-6 * width or high - low <= 1e-15 * high:
            break
    return math.copysign(u, arc)


@jit
def ellipse_arc(a, b, start, turn):
    """Return the length of (a cos w, b sin w) from w = start over the signed angle `turn`; a and b in any order [m]."""
    if a < b:
        a, b, start = b, a, start - 0.5 * math.pi
    if abs(turn) * a <= SHORT_ARC * b:
        half = 0.5 * turn
        total = 0.0
        for i in range(_NODES.shape[0]):
            w = start + half * (1.0 + _NODES[i])
            x, y = a * math.sin(w), b * math.cos(w)
            total += _WEIGHTS[i] * math.sqrt(x * x + y * y)
        return abs(half) * total
    stop = start + turn
    m, n = math.floor(start / math.pi + 0.5), math.floor(stop / math.pi + 0.5)
    c, s = math.cos(start - m * math.pi), math.sin(start - m * math.pi)
    d, t = math.cos(stop - n * math.pi), math.sin(stop - n * math.pi)
    arc = _arc_from_tip(a, b, d, t) - _arc_from_tip(a, b, c, s)
    if n != m:
        arc += 2.0 * (n - m) * _arc_from_tip(a, b, 0.0, 1.0)
    return abs(arc)


@deferred(types.none)
def elliptic_cylinder(k, node):
    """Evaluate the geodesic of row k; positions in world directions relative to the surface's origin."""
    a, b = node[k, DIM], node[k, DIM + 1]
    x, y, z = node[k, S_P], node[k, S_P + 1], node[k, S_P + 2]
    tx, ty, tz = node[k, S_T], node[k, S_T + 1], node[k, S_T + 2]
    # x along the longer semi-axis
    swapped = a < b
    if swapped:
        a, b, x, y, tx, ty = b, a, y, -x, ty, -tx
    c, s = x / a, y / b
    over = 1.0 / math.sqrt(c * c + s * s)
    c, s = c * over, s * over
    rate = math.sqrt(a * a * s * s + b * b * c * c)
    over = 1.0 / rate
    nx, ny = b * c * over, a * s * over
    around = nx * ty - ny * tx  # t along the section's tangent (-ny, nx)
    over = 1.0 / math.sqrt(around * around + tz * tz)
    around, tz = around * over, tz * over
    arc = node[k, S_ARC] * around
    bend = a * b / (rate * rate * rate)
    _put(node, k, swapped, False, x, y, z, nx, ny, around, tz)
    put_curvature(node, k, lay.W_KP, bend * around * around, bend * around * tz, bend * tz * tz)
    # from the tip that is nearest to P, then from the one nearest to Q
    side = 1.0 if c >= 0.0 else -1.0
    start = math.atan2(side * s, side * c)
    target = _arc_from_tip(a, b, side * c, side * s) + arc
    quarter = _arc_from_tip(a, b, 0.0, 1.0)
    halves = math.floor(0.5 * target / quarter + 0.5)
    stop = _angle_of_arc(a, b, target - 2.0 * halves * quarter, quarter)
    node[k, lay.W_ANGLE] = halves * math.pi + stop - start
    if halves % 2.0 != 0.0:
        side = -side
    c, s = side * math.cos(stop), side * math.sin(stop)
    rate = math.sqrt(a * a * s * s + b * b * c * c)
    over = 1.0 / rate
    _put(
        node, k, swapped, True, a * c, b * s, z + node[k, S_ARC] * tz, b * c * over, a * s * over, around, tz
    )
    bend = a * b / (rate * rate * rate)
    kappa = bend * around * around
    put_curvature(node, k, lay.W_KQ, kappa, bend * around * tz, bend * tz * tz)
    put_fields(node, k, 1.0, 0.0, node[k, S_ARC], 1.0, kappa, 1.0)


@jit
def _put(node, k, swapped, end, x, y, z, nx, ny, around, tz):
    """Write point, tangent and normal at P, or with `end` at Q; `swapped`: x and y are exchanged back first."""
    if swapped:
        x, y, nx, ny = -y, x, -ny, nx
    if end:
        put_end(node, k, x, y, z, -around * ny, around * nx, tz, nx, ny, 0.0)
    else:
        put_start(node, k, x, y, z, -around * ny, around * nx, tz, nx, ny, 0.0)
