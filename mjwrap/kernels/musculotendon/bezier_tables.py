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
    LAST_STEP,
    MIDDLE,
    NODES,
    ROUNDING,
    S0,
    S1,
    SCALE,
    WEIGHTS,
    X0,
    XQ,
    XR,
    Y0,
    YQ,
    YR,
    blend,
    invert,
)
from mjwrap.kernels.musculotendon.curve_memory import read

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
    """Return the address of the first corner of a curve, and the number of its corners."""
    before = HEAD + CELLS + WIDTH * int(read(address, PIECES))
    return address + 8 * before, int(read(address, CORNERS))


@jit
def near_inverse(address, y):
    """Return about the x at which a rising curve that starts at 0 has the value y, to start an iteration with."""
    corner, count = corners_of(address)
    starts = corner + 8 * CORNER * count
    share = min(max(y / read(address, GREATEST), 0.0), 1.0) * (STARTS - 1)
    k = min(int(share), STARTS - 2)
    x = read(starts, k)
    return x + (share - k) * (read(starts, k + 1) - x)


@jit
def inverse(address, y):
    """Return x at which a rising curve has the value y, on its end tangents too; where they are flat, that end."""
    corner, count = corners_of(address)
    low = read(corner, Y0)
    if y <= low:
        slope = read(corner, S0)
        return read(corner, X0) + ((y - low) / slope if slope > 0.0 else 0.0)
    for _ in range(count):
        rest = y - read(corner, Y0)
        if rest < read(corner, DY):
            u = invert(read(corner, YQ), read(corner, YR), rest / read(corner, DY), 0.5, ROUNDING)
            x, _ = blend(read(corner, XQ), read(corner, XR), u)
            return read(corner, X0) + read(corner, DX) * x
        corner += 8 * CORNER
    corner -= 8 * CORNER
    rest = y - read(corner, Y0) - read(corner, DY)
    slope = read(corner, S1)
    return read(corner, X0) + read(corner, DX) + (rest / slope if slope > 0.0 else 0.0)


@jit
def _corner_integral(corner, u):
    """Return the integral of y dx over a corner from its start to its parameter u."""
    total = 0.0
    for k in range(NODES.shape[0]):
        s = 0.5 * u * (1.0 + NODES[k])
        y, _ = blend(read(corner, YQ), read(corner, YR), s)
        _, across = blend(read(corner, XQ), read(corner, XR), s)
        total += WEIGHTS[k] * (read(corner, Y0) + read(corner, DY) * y) * across
    return 0.5 * u * read(corner, DX) * total


@jit
def integral(address, x):
    """Return the integral of a curve from the start of its first corner to x, as `bezier.integral`."""
    corner, count = corners_of(address)
    past = x - read(corner, X0)
    if past <= 0.0:
        return past * (read(corner, Y0) + 0.5 * read(corner, S0) * past)
    total = 0.0
    for _ in range(count):
        wanted = (x - read(corner, X0)) / read(corner, DX)
        if wanted < 1.0:
            u = invert(read(corner, XQ), read(corner, XR), wanted, wanted, LAST_STEP)
            return total + _corner_integral(corner, u)
        total += _corner_integral(corner, 1.0)
        corner += 8 * CORNER
    corner -= 8 * CORNER
    past = x - read(corner, X0) - read(corner, DX)
    return total + past * (read(corner, Y0) + read(corner, DY) + 0.5 * read(corner, S1) * past)
