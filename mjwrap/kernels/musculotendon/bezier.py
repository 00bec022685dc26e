"""Curves of quintic Bézier corners (Millard et al. 2013, doi 10.1115/1.4023390): y(x), its slope and its integral.

A corner joins (x0, y0, slope) to (x1, y1, slope); its end tangents meet at C, and with c = 0.1 + 0.8 curviness the
control points are P0, P0 + c (C − P0) twice, P1 + c (C − P1) twice, P1. Relative to P0, in units of P1 − P0, a
coordinate is 5 u (1 − u)³ (1 + u) q + 5 u³ (1 − u)(2 − u) r + u⁵, with q and r the coordinates of the inner points.
Outside its corners a curve continues along its end tangents.

y(x) has no closed form, and inverting x(u) at every evaluation is slow. So `tabulate` inverts it once, up to rounding,
and fits a polynomial to the slope on each of some hundred pieces. Pieces are halved until the error is 1e-11 of the
slope, or 5e-15 of the corner's steepest slope. `evaluate` takes value and slope from the integral of the polynomial.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mjwrap.kernels.compilation.jit import jit

LAST_STEP = 1e-9  # largest last Newton step, for slopes that are not near zero
ROUNDING = 1e-16
MAX_STEPS = 80  # most Newton steps and bisections in an inversion; two are normal
DEGREE = 9  # degree of the polynomial for a piece's value; that for its slope has one less
NARROWEST = 2.0**-10  # half width of the narrowest piece, as a share of the width of its corner
CELLS = 2048  # number of equal parts of a curve's range in which the piece is looked up
# Error of a piece's slope, relative to the slope and to the steepest slope of its corner.
RELATIVE_TOL, SLOPE_TOL = 1e-11, 5e-15

Corner = tuple[float, float, float, float, float, float]  # x0, y0, slope at 0, x1, y1, slope at 1
Array = NDArray[np.float64]
X0, DX, XQ, XR, Y0, DY, YQ, YR, S0, S1 = range(10)  # columns of a corner
MIDDLE, SCALE, FIRST = range(3)  # columns of a piece: middle, 1 / half width, then DEGREE + 1 coefficients


def corners(ends: list[Corner], curviness: list[float]) -> Array:
    """Return the constants (n, 10) of a curve's corners, from left to right."""
    rows = []
    for (x0, y0, s0, x1, y1, s1), bent in zip(ends, curviness, strict=True):
        c = 0.1 + 0.8 * bent
        x_c = (y1 - y0 - x1 * s1 + x0 * s0) / (s0 - s1)
        y_c = (x_c - x1) * s1 + y1
        x_part, y_part = (x_c - x0) / (x1 - x0), (y_c - y0) / (y1 - y0)
        inner = (c * x_part, 1.0 - c * (1.0 - x_part)), (c * y_part, 1.0 - c * (1.0 - y_part))
        rows.append((x0, x1 - x0, *inner[0], y0, y1 - y0, *inner[1], s0, s1))
    return np.array(rows)


def coordinate(q, r, u):
    """Return a coordinate of a corner at u in [0, 1], from 0 to 1, and its slope in u."""
    v = 1.0 - u
    uu, vv = u * u, v * v
    b, d = 5.0 * u * vv * v * (1.0 + u), 5.0 * vv * (1.0 - 2.0 * u - 5.0 * uu)
    e, f = 5.0 * uu * u * v * (2.0 - u), 5.0 * uu * (6.0 - 12.0 * u + 5.0 * uu)
    return q * b + r * e + uu * uu * u, q * d + r * f + 5.0 * uu * uu


blend = jit(coordinate)  # for numbers; the plain function takes arrays and needs no compilation at import


def tabulate(curve: Array) -> tuple[Array, NDArray[np.int16]]:
    """Return a curve's pieces (n, 2 + DEGREE + 1), and the number of the first in each of CELLS equal parts.

    The first and last pieces are the straight ones outside the corners; the first one's scale is the number of cells in
    a unit of x. No cell has more than two pieces.
    """
    pieces = pieces_of(curve)
    start, inner, end = pieces[0], pieces[1:-1], pieces[-1]
    width = end[MIDDLE] - start[MIDDLE]
    start[SCALE] = CELLS / width
    ends = np.concatenate([inner[1:, MIDDLE] - 1.0 / inner[1:, SCALE], end[None, MIDDLE]])
    edges = start[MIDDLE] + width / CELLS * np.arange(CELLS)
    if np.diff(ends).min() * start[SCALE] < 1.0:
        raise ValueError("a piece is narrower than a cell")
    cells = 1 + np.searchsorted(ends[:-1], edges, side="right")
    return pieces, cells.astype(np.int16)


def pieces_of(curve: Array) -> Array:
    """Return a curve's pieces (n, 2 + DEGREE + 1); the first and the last are the straight ones outside the corners."""
    return np.vstack([_straight(curve[0], 0.0), _pieces(curve), _straight(curve[-1], 1.0)])


def _straight(corner: Array, u: float) -> Array:
    """Return the straight piece that continues a corner along its end tangent."""
    piece = np.zeros(FIRST + DEGREE + 1)
    piece[MIDDLE], piece[SCALE] = corner[X0] + u * corner[DX], 1.0
    piece[FIRST] = corner[Y0] + u * corner[DY]
    piece[FIRST + 1] = corner[S1] if u else corner[S0]
    return piece


def _pieces(curve: Array) -> Array:
    """Return the pieces of all corners, from left to right, halved until each is close enough."""
    nodes = np.cos(np.arange(DEGREE) * np.pi / (DEGREE - 1))  # with both ends, so that pieces are continuous
    tests = np.linspace(-1.0, 1.0, 11)
    spots = np.concatenate([[0.0], nodes, tests])
    fit = np.linalg.inv(np.vander(nodes, increasing=True)).T
    powers = np.vander(tests, DEGREE, increasing=True).T
    _, slope = _curve(curve[:, None], np.broadcast_to(np.linspace(0.0, 1.0, 65), (len(curve), 65)))
    steepest = np.abs(slope).max(axis=1)
    which, middle, half = np.arange(len(curve)), np.full(len(curve), 0.5), 0.5  # in widths of the corner
    done = []
    while which.size:
        value, slope = _curve(curve[which, None], middle[:, None] + half * spots)
        there = slope[:, 1 + DEGREE :]
        rising = slope[:, 1 : 1 + DEGREE] @ fit  # coefficients of the slope
        off = np.abs(rising @ powers - there) - RELATIVE_TOL * np.abs(there)
        good = (off <= SLOPE_TOL * steepest[which, None]).all(axis=1) | (half <= NARROWEST)
        width = half * curve[which, DX]
        rising *= width[:, None] / np.arange(1, DEGREE + 1)
        x = curve[which, X0] + middle * curve[which, DX]
        done.append(np.column_stack([x, 1.0 / width, value[:, 0], rising])[good])
        half *= 0.5
        which = np.repeat(which[~good], 2)
        middle = (middle[~good, None] + half * np.array([-1.0, 1.0])).ravel()
    found = np.concatenate(done)
    return found[np.argsort(found[:, MIDDLE])]


def sampled(curve: Array, count: int) -> tuple[Array, Array]:
    """Return x and y of a curve at `count` parts of the width of each corner, from left to right."""
    parts = np.broadcast_to(np.linspace(0.0, 1.0, count), (len(curve), count))
    y, _ = _curve(curve[:, None], parts)
    return (curve[:, X0, None] + curve[:, DX, None] * parts).ravel(), y.ravel()


def _curve(corner: Array, part: Array) -> tuple[Array, Array]:
    """Return y and dy/dx at parts (n, k) of the widths of corners (n, 1, 10).

    x(u) is inverted by Newton's steps, kept in a bracket.
    """
    _, dx, xq, xr, y0, dy, yq, yr, _, _ = np.moveaxis(corner, -1, 0)
    part = np.clip(part, 0.0, 1.0)
    low, high, u = np.zeros_like(part), np.ones_like(part), part
    for _ in range(MAX_STEPS):
        value, slope = coordinate(xq, xr, u)
        low, high = np.where(value < part, u, low), np.where(value < part, high, u)
        new = u + (part - value) / slope
        new = np.where((new >= low) & (new <= high), new, 0.5 * (low + high))
        last = np.abs(new - u).max() <= LAST_STEP
        u = new
        if last:
            break
    y, up = coordinate(yq, yr, u)
    return y0 + dy * y, dy * up / (dx * coordinate(xq, xr, u)[1])


@jit
def invert(q, r, wanted, start, enough):
    """Return u in [0, 1] at which a rising coordinate has the wanted value, by Newton steps in a bracket.

    The last step is at most `enough`; where the slope is not zero the error left is its square.
    """
    low, high, u = 0.0, 1.0, start
    for _ in range(MAX_STEPS):
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
def evaluate(pieces, cells, x):
    """Return y and dy/dx at x of a curve in the form that `tabulate` returns."""
    last = pieces.shape[0] - 1
    past = x - pieces[0, MIDDLE]
    cell = past * pieces[0, SCALE]
    if cell < 0.0:
        return pieces[0, FIRST] + pieces[0, FIRST + 1] * past, pieces[0, FIRST + 1]
    if cell >= CELLS:
        return pieces[last, FIRST] + pieces[last, FIRST + 1] * (x - pieces[last, MIDDLE]), pieces[
            last, FIRST + 1
        ]
    k = cells[int(cell)]
    t = (x - pieces[k, MIDDLE]) * pieces[k, SCALE]
    if t > 1.0:
        k += 1
        t = (x - pieces[k, MIDDLE]) * pieces[k, SCALE]
    # even and odd powers separately: y = even + t odd, both polynomials in t squared
    square = t * t
    even, odd = pieces[k, FIRST + DEGREE - 1], pieces[k, FIRST + DEGREE]
    d_even = d_odd = 0.0
    for i in range(FIRST + DEGREE - 3, FIRST - 1, -2):
        d_even = d_even * square + even
        even = even * square + pieces[k, i]
        d_odd = d_odd * square + odd
        odd = odd * square + pieces[k, i + 1]
    slope = odd + 2.0 * t * (d_even + t * d_odd)
    return even + t * odd, slope * pieces[k, SCALE]


@jit
def inverse(curve, y):
    """Return x at which a curve that rises between its ends has the value y; outside its range x of the nearer end."""
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
    """Return the integral of a curve from the start of its first corner to x, exact up to rounding."""
    past = x - curve[0, X0]
    if past <= 0.0:
        return past * (curve[0, Y0] + 0.5 * curve[0, S0] * past)
    total = 0.0
    for i in range(curve.shape[0]):
        wanted = (x - curve[i, X0]) / curve[i, DX]
        if wanted < 1.0:
            return total + corner_integral(
                curve, i, invert(curve[i, XQ], curve[i, XR], wanted, wanted, LAST_STEP)
            )
        total += corner_integral(curve, i, 1.0)
    last = curve.shape[0] - 1
    past = x - curve[last, X0] - curve[last, DX]
    return total + past * (curve[last, Y0] + curve[last, DY] + 0.5 * curve[last, S1] * past)
