"""Piecewise polynomials of at most degree 4, which MuJoCo's joint equalities can hold, from those of higher degree."""

from __future__ import annotations

import numpy as np

from mjwrap.osim.description.functions import Array, Piecewise

DEGREE = 4
TOLERANCE = 1e-10  # [rad or m] of an approximated piece


def quartic_pieces(function: Piecewise, low: float, high: float) -> Piecewise:
    """Return a function with pieces of degree 4 at most, with continuous slope, within 1e-10 from `low` to `high`.

    A piece of degree 4 or less is kept as it is. Others are split until quartics that share values and slopes at both
    ends and the value in the middle are close enough; beyond `low` and `high` their last quartics go on.
    """
    rows = function.coefficients
    if not rows[:, DEGREE + 1 :].any():
        return Piecewise(function.breaks, function.origins, rows[:, : DEGREE + 1], function.kind, function.error)
    edges = np.concatenate([[-np.inf], function.breaks, [np.inf]])
    breaks: list[float] = []
    origins: list[float] = []
    coefficients: list[Array] = []
    worst = 0.0
    for piece in range(len(rows)):
        left, right = float(edges[piece]), float(edges[piece + 1])
        if piece:
            breaks.append(left)
        if not rows[piece, DEGREE + 1 :].any():
            origins.append(float(function.origins[piece]))
            coefficients.append(rows[piece, : DEGREE + 1])
            continue
        single = Piecewise(np.zeros(0), function.origins[piece : piece + 1], rows[piece : piece + 1])
        start = max(left, min(low, right - 1e-3))
        stop = min(right, max(high, start + 1e-3))
        ends = _split(single, start, stop)
        for k in range(len(ends) - 1):
            if k:
                breaks.append(ends[k])
            middle, row, error = _quartic(single, ends[k], ends[k + 1])
            origins.append(middle)
            coefficients.append(row)
            worst = max(worst, error)
    padded = np.zeros((len(coefficients), DEGREE + 1))
    for k, row in enumerate(coefficients):
        padded[k, : len(row)] = row
    return Piecewise(
        np.array(breaks), np.array(origins), padded, function.kind, max(function.error, worst)
    )


def _split(function: Piecewise, start: float, stop: float) -> list[float]:
    """Return ends of intervals on which quartics are close enough."""
    if _quartic(function, start, stop)[2] <= TOLERANCE or stop - start < 1e-4:
        return [start, stop]
    middle = 0.5 * (start + stop)
    return _split(function, start, middle)[:-1] + _split(function, middle, stop)


def _quartic(function: Piecewise, start: float, stop: float) -> tuple[float, Array, float]:
    """Return the middle of an interval, the quartic about it (5,), and its largest difference from a function."""
    middle, half = 0.5 * (start + stop), 0.5 * (stop - start)
    ends = np.array([start, stop])
    values, slopes = function(ends), function(ends, 1)
    at_middle = float(function(middle))
    even = 0.5 * (values[0] + values[1]) - at_middle
    odd = 0.5 * (values[1] - values[0])
    fourth = 0.25 * half * (slopes[1] - slopes[0]) - even
    third = 0.5 * (0.5 * half * (slopes[0] + slopes[1]) - odd)
    row = np.array([at_middle, (odd - third) / half, (even - fourth) / half**2, third / half**3, fourth / half**4])
    x = middle + half * np.cos(np.linspace(0.0, np.pi, 21))
    difference = np.polynomial.polynomial.polyval(x - middle, row) - function(x)
    return middle, row, float(np.abs(difference).max())
