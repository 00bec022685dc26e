"""Curves of quintic Bézier corners (Millard et al. 2013, doi 10.1115/1.4023390): y(x) and its slope.

A corner joins (x0, y0, slope) to (x1, y1, slope); its end tangents meet at C, and with c = 0.1 + 0.8 curviness the
control points are P0, P0 + c (C − P0) twice, P1 + c (C − P1) twice, P1. Counted from P0 in units of P1 − P0, a
coordinate is then 5 u (1 − u)³ (1 + u) q + 5 u³ (1 − u)(2 − u) r + u⁵ with q, r those of the inner points: two numbers
a coordinate.
Outside its corners a curve goes on along its end tangents.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mjwrap.kernels._jit import jit

BINS = 32  # of each corner, for the start of the inversion: a cubic each, at most 1e-5 off
CLOSE = 1e-9  # last Newton step where the slope is far from zero
ROUNDING = 1e-16
MOST = 80  # Newton steps and bisections in an inversion; two steps are normal

Corner = tuple[float, float, float, float, float, float]  # x0, y0, slope at 0, x1, y1, slope at 1
X0, DX, XQ, XR, Y0, DY, YQ, YR, S0, S1 = range(10)  # columns of a corner


def corners(ends: list[Corner], curviness: list[float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the constants (n, 10) of a curve's corners, from left to right, and the cubics (n, BINS, 4) of u(x)."""
    rows = []
    for (x0, y0, s0, x1, y1, s1), bent in zip(ends, curviness, strict=True):
        c = 0.1 + 0.8 * bent
        x_c = (y1 - y0 - x1 * s1 + x0 * s0) / (s0 - s1)
        y_c = (x_c - x1) * s1 + y1
        x_part, y_part = (x_c - x0) / (x1 - x0), (y_c - y0) / (y1 - y0)
        inner = (c * x_part, 1.0 - c * (1.0 - x_part)), (c * y_part, 1.0 - c * (1.0 - y_part))
        rows.append((x0, x1 - x0, *inner[0], y0, y1 - y0, *inner[1], s0, s1))
    cubics = np.array([_cubics(row[XQ], row[XR]) for row in rows])
    return np.array(rows), cubics


def _cubics(q: float, r: float) -> NDArray[np.float64]:
    """Return the Hermite cubics of u over equal bins of the corner's x, in the bin's own variable 0..1."""
    u = np.zeros(BINS + 1)
    slope = np.zeros(BINS + 1)
    for i in range(BINS + 1):
        u[i] = invert(q, r, i / BINS, i / BINS, ROUNDING)
        slope[i] = 1.0 / blend(q, r, u[i])[1] / BINS
    rise = u[1:] - u[:-1]
    second = 3.0 * rise - 2.0 * slope[:-1] - slope[1:]
    return np.stack([u[:-1], slope[:-1], second, slope[:-1] + slope[1:] - 2.0 * rise], axis=1)


@jit
def blend(q, r, u):
    """Return a coordinate of a corner at u in [0, 1], counted from one end in units of both ends, and its slope."""
    v = 1.0 - u
    uu, vv = u * u, v * v
    b, d = 5.0 * u * vv * v * (1.0 + u), 5.0 * vv * (1.0 - 2.0 * u - 5.0 * uu)
    e, f = 5.0 * uu * u * v * (2.0 - u), 5.0 * uu * (6.0 - 12.0 * u + 5.0 * uu)
    return q * b + r * e + uu * uu * u, q * d + r * f + 5.0 * uu * uu


@jit
def invert(q, r, wanted, start, enough):
    """Return u in [0, 1] at which a rising coordinate has the wanted value: Newton's steps, kept in a bracket.

    The last step is at most `enough`; where the slope is not zero the error left is its square.
    """
    low, high, u = 0.0, 1.0, start
    for _ in range(MOST):
        value, slope = blend(q, r, u)
        miss = wanted - value
        if miss > 0.0:
            low = u
        else:
            high = u
        new = u + miss / slope if slope > 0.0 else -1.0
        if not low <= new <= high:
            new = 0.5 * (low + high)
        step = abs(new - u)
        u = new
        if step <= enough:
            break
    return u


@jit
def evaluate(curve, cubics, x):
    """Return y and dy/dx of a curve at x."""
    last = curve.shape[0] - 1
    if x <= curve[0, X0]:
        return curve[0, Y0] + curve[0, S0] * (x - curve[0, X0]), curve[0, S0]
    i = 0
    while i <= last and x >= curve[i, X0] + curve[i, DX]:
        i += 1
    if i > last:
        slope = curve[last, S1]
        return curve[last, Y0] + curve[last, DY] + slope * (x - curve[last, X0] - curve[last, DX]), slope
    wanted = (x - curve[i, X0]) / curve[i, DX]
    place = min(max(wanted, 0.0), 1.0) * BINS
    k = min(int(place), BINS - 1)
    t = place - k
    start = cubics[i, k, 0] + t * (cubics[i, k, 1] + t * (cubics[i, k, 2] + t * cubics[i, k, 3]))
    u = invert(curve[i, XQ], curve[i, XR], wanted, min(max(start, 0.0), 1.0), CLOSE)
    _, across = blend(curve[i, XQ], curve[i, XR], u)
    y, up = blend(curve[i, YQ], curve[i, YR], u)
    return curve[i, Y0] + curve[i, DY] * y, curve[i, DY] * up / (curve[i, DX] * across)


@jit
def inverse(curve, y):
    """Return x at which a curve that rises everywhere between its ends has the value y; its end's x beyond them."""
    last = curve.shape[0] - 1
    if y <= curve[0, Y0]:
        return curve[0, X0]
    i = 0
    while i <= last and y >= curve[i, Y0] + curve[i, DY]:
        i += 1
    if i > last:
        return curve[last, X0] + curve[last, DX]
    u = invert(curve[i, YQ], curve[i, YR], (y - curve[i, Y0]) / curve[i, DY], 0.5, ROUNDING)
    x, _ = blend(curve[i, XQ], curve[i, XR], u)
    return curve[i, X0] + curve[i, DX] * x


NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)  # exact to degree 9: of y dx/du


@jit
def corner_integral(curve, i, u):
    """Return the integral of y dx over corner i from its start to its parameter u."""
    total = 0.0
    for k in range(NODES.shape[0]):
        s = 0.5 * u * (1.0 + NODES[k])
        y, _ = blend(curve[i, YQ], curve[i, YR], s)
        _, across = blend(curve[i, XQ], curve[i, XR], s)
        total += WEIGHTS[k] * (curve[i, Y0] + curve[i, DY] * y) * across
    return 0.5 * u * curve[i, DX] * total


@jit
def integral(curve, x):
    """Return the integral of a curve from the start of its first corner to x: exact but for rounding."""
    past = x - curve[0, X0]
    if past <= 0.0:
        return past * (curve[0, Y0] + 0.5 * curve[0, S0] * past)
    total = 0.0
    for i in range(curve.shape[0]):
        wanted = (x - curve[i, X0]) / curve[i, DX]
        if wanted < 1.0:
            return total + corner_integral(
                curve, i, invert(curve[i, XQ], curve[i, XR], wanted, wanted, CLOSE)
            )
        total += corner_integral(curve, i, 1.0)
    last = curve.shape[0] - 1
    past = x - curve[last, X0] - curve[last, DX]
    return total + past * (curve[last, Y0] + curve[last, DY] + 0.5 * curve[last, S1] * past)
