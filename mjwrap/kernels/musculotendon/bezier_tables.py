"""Tables of Bezier curves in memory, which compiled code reads by their address.

As in `bezier.py` a curve is a polynomial on each of some hundred pieces. A table is an array of doubles: the numbers of
pieces and of corners, the first piece's start, the number of cells in a unit of x, the greatest force of `near_inverse`
and its slope; then for each of CELLS equal parts of the range the first piece in it; then pieces, corners, and x at
STARTS equal steps of y from 0 to the greatest force.
"""

from __future__ import annotations

import numpy as np

from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.musculotendon import bezier
from mjwrap.kernels.musculotendon.bezier import (
    DEGREE,
    DX,
    DY,
    FIRST,
    MIDDLE,
    S0,
    S1,
    SCALE,
    X0,
    Y0,
)
from mjwrap.kernels.musculotendon.curve_memory import read, rows

CELLS = 256
STARTS = 65
PIECES, CORNERS, START, RATE, GREATEST = range(5)
HEAD = 8
WIDTH = FIRST + DEGREE + 1  # numbers of a piece
CORNER = 10  # numbers of a corner


def table(curve: bezier.Array) -> bezier.Array:
    """Return the table of a curve from its corners; the curve has to rise, or only its values are read."""
    pieces = bezier.pieces_of(curve)
    start, width = pieces[0, MIDDLE], pieces[-1, MIDDLE] - pieces[0, MIDDLE]
    inner = pieces[1:-1]
    ends = np.concatenate([inner[1:, MIDDLE] - 1.0 / inner[1:, SCALE], pieces[-1:, MIDDLE]])
    edges = start + width / CELLS * np.arange(CELLS)
    cells = 1 + np.searchsorted(ends[:-1], edges, side="right")
    x, y = bezier.sampled(curve, 1001)
    greatest = float(y[-1])
    starts = np.interp(np.linspace(0.0, greatest, STARTS), np.maximum.accumulate(y), x)
    head = np.zeros(HEAD)
    head[: GREATEST + 1] = len(pieces), len(curve), start, CELLS / width, greatest
    return np.concatenate([head, cells.astype(float), pieces.ravel(), curve.ravel(), starts])


@jit
def evaluate(address, x):
    """Return y and dy/dx of a curve at x; outside its corners it goes on along its end tangents."""
    past = x - read(address, START)
    cell = past * read(address, RATE)
    first = HEAD + CELLS
    if cell < 0.0:
        slope = read(address, first + FIRST + 1)
        return read(address, first + FIRST) + slope * past, slope
    if not cell < CELLS:
        last = first + WIDTH * (int(read(address, PIECES)) - 1)
        slope = read(address, last + FIRST + 1)
        return read(address, last + FIRST) + slope * (x - read(address, last + MIDDLE)), slope
    at = first + WIDTH * int(read(address, HEAD + int(cell)))
    t = (x - read(address, at + MIDDLE)) * read(address, at + SCALE)
    while t > 1.0:
        at += WIDTH
        t = (x - read(address, at + MIDDLE)) * read(address, at + SCALE)
    # even and odd powers separately: y = even + t odd, both polynomials in t squared
    square = t * t
    even, odd = read(address, at + FIRST + DEGREE - 1), read(address, at + FIRST + DEGREE)
    d_even = d_odd = 0.0
    for i in range(FIRST + DEGREE - 3, FIRST - 1, -2):
        d_even = d_even * square + even
        even = even * square + read(address, at + i)
        d_odd = d_odd * square + odd
        odd = odd * square + read(address, at + i + 1)
    slope = odd + 2.0 * t * (d_even + t * d_odd)
    return even + t * odd, slope * read(address, at + SCALE)


@jit
def corners_of(address):
    """Return the corners of a curve (n, 10)."""
    count = int(read(address, CORNERS))
    before = HEAD + CELLS + WIDTH * int(read(address, PIECES))
    return rows(address + 8 * before, (count, CORNER))


@jit
def near_inverse(address, y):
    """Return about the x at which a rising curve that starts at 0 has the value y, to start an iteration with."""
    places = HEAD + CELLS + WIDTH * int(read(address, PIECES)) + CORNER * int(read(address, CORNERS))
    share = min(max(y / read(address, GREATEST), 0.0), 1.0) * (STARTS - 1)
    k = min(int(share), STARTS - 2)
    x = read(address, places + k)
    return x + (share - k) * (read(address, places + k + 1) - x)


@jit
def inverse(address, y):
    """Return x at which a rising curve has the value y, also on its end tangents; the nearer end where they are flat."""
    corners = corners_of(address)
    last = corners.shape[0] - 1
    low, high = corners[0, Y0], corners[last, Y0] + corners[last, DY]
    x = bezier.inverse(corners, y)
    if y < low and corners[0, S0] > 0.0:
        x = corners[0, X0] + (y - low) / corners[0, S0]
    if y > high and corners[last, S1] > 0.0:
        x = corners[last, X0] + corners[last, DX] + (y - high) / corners[last, S1]
    return x
