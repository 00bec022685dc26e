"""OpenSim's Ligament: a force times a curve of its length, cubic pieces; it pulls only, and not at its resting length.

Columns of params: 0 force [N], 1 resting length [m], 2 address of the curve: number of pieces, then for each piece its
end, its origin and four coefficients, the constant first, in length / resting length; then the curve's integral from
one up to each piece's start. The first and the last piece have no ends.
"""

from __future__ import annotations

from mjwrap.kernels.compilation.jit import jit, no_inline
from mjwrap.kernels.musculotendon.curve_memory import LEAST_ADDRESS, read

CODE = 5
FORCE, RESTING, CURVE = range(3)
HEAD = 2
END, ORIGIN, FIRST, BEFORE = 0, 1, 2, 6  # places in a piece
WIDTH = 7


@jit
def _piece(address, x):
    """Return the place of the piece that holds at x."""
    at, left = HEAD, int(read(address, 0)) - 1
    while left > 0 and x >= read(address, at + END):
        at += WIDTH
        left -= 1
    return at


@no_inline
def curve(address, x):
    """Return the curve's value at x, the length in resting lengths."""
    at = _piece(address, x)
    s = x - read(address, at + ORIGIN)
    value = read(address, at + FIRST + 3)
    for i in range(2, -1, -1):
        value = value * s + read(address, at + FIRST + i)
    return value


@no_inline
def integral(address, x):
    """Return the curve's integral from 1 to x, negative parts of the curve left out."""
    at = _piece(address, x)
    s = x - read(address, at + ORIGIN)
    value = read(address, at + FIRST + 3) * 0.25
    for i in range(2, -1, -1):
        value = value * s + read(address, at + FIRST + i) / (i + 1.0)
    return value * s + read(address, at + BEFORE)


@jit
def tension(params, m, length):
    """Return the tension [N], zero up to the resting length."""
    address = int(params[m, CURVE])
    if length <= params[m, RESTING] or address < LEAST_ADDRESS:
        return 0.0
    return max(params[m, FORCE] * curve(address, length / params[m, RESTING]), 0.0)


@jit
def energy(params, m, length):
    """Return the stored energy [J], the integral of the tension from the resting length on."""
    address = int(params[m, CURVE])
    if length <= params[m, RESTING] or address < LEAST_ADDRESS:
        return 0.0
    return params[m, FORCE] * params[m, RESTING] * integral(address, length / params[m, RESTING])
