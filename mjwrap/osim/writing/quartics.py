"""Piecewise polynomials of at most degree 4, which MuJoCo's joint equalities can hold, from those of higher degree."""

from __future__ import annotations

import itertools
from typing import Protocol

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from mjwrap.osim.description.functions import Array, Piecewise, linear
from mjwrap.osim.writing.piece_algebra import shifted

DEGREE = 4
TOLERANCE = 1e-10  # [rad or m] of an approximated piece
IDENTITY = linear(1.0)
MOST_PIECES = 400  # of one fit


def quartic_pieces(function: Piecewise, low: float, high: float, tolerance: float = TOLERANCE) -> Piecewise:
    """Return a function with pieces of degree 4 at most, with continuous slope, close from `low` to `high`.

    A piece of degree 4 or less is kept as it is. Others are split until quartics that share values and slopes at both
    ends and the value in the middle are close enough; beyond `low` and `high` their last quartics go on.
    """
    rows = function.coefficients
    if not rows[:, DEGREE + 1 :].any():
        return Piecewise(
            function.breaks, function.origins, rows[:, : DEGREE + 1], function.kind, function.error
        )
    edges = np.concatenate([[-np.inf], function.breaks, [np.inf]])
    made = _Made(tolerance)
    for piece in range(len(rows)):
        left, right = float(edges[piece]), float(edges[piece + 1])
        if rows[piece, DEGREE + 1 :].any():
            single = Piecewise(np.zeros(0), function.origins[piece : piece + 1], rows[piece : piece + 1])
            start = max(left, min(low, right - 1e-3))
            made.fit(single, left, start, min(right, max(high, start + 1e-3)))
        else:
            made.add(left, float(function.origins[piece]), rows[piece, : DEGREE + 1])
    return made.function(function.kind, function.error)


def inverse_pieces(
    function: Piecewise,
    low: float,
    high: float,
    tolerance: float = TOLERANCE,
    outer: Piecewise = IDENTITY,
) -> Piecewise | None:
    """Return the inverse of a function that rises, or falls, from `low` to `high`; None where it does neither.

    With `outer`, another function of the same variable, return outer(inverse).

    Straight lines are inverted exactly, and the rest within the tolerance. Beyond the
    values at `low` and `high` the last pieces go on.
    """
    breaks = np.union1d(function.breaks, outer.breaks)
    breaks = breaks[(breaks > low) & (breaks < high)]
    knots = np.concatenate([[low], breaks, [high]])
    slopes = function(np.concatenate([np.linspace(a, b, 50) for a, b in itertools.pairwise(knots)]), 1)
    if slopes.max() * slopes.min() <= 0.0 or np.abs(slopes).min() < 1e-3 * np.abs(slopes).max():
        return None
    if slopes[0] < 0.0:
        knots = knots[::-1]
    made = _Made(tolerance)
    for k in range(len(knots) - 1):
        middle = 0.5 * (knots[k] + knots[k + 1])
        piece = int(function.piece(middle))
        row, origin = function.coefficients[piece], float(function.origins[piece])
        over = int(outer.piece(middle))
        wide = shifted(outer, over, origin, outer.coefficients.shape[1])
        start, stop = float(function(knots[k])), float(function(knots[k + 1]))
        left = start if k else -np.inf
        if row[2:].any() or wide[DEGREE + 1 :].any():
            made.fit(
                _Inverse(row, wide, float(knots[k]) - origin, float(knots[k + 1]) - origin), left, start, stop
            )
        else:
            made.add(left, float(row[0]), wide / row[1] ** np.arange(len(wide)))
    return made.function(function.kind, 0.0)


class Smooth(Protocol):
    """A function of one variable with a slope."""

    def __call__(self, x: Array, derivative: int = 0, /) -> Array:
        """Return y or its slope at x (n,)."""
        ...


class _Inverse:
    """outer(inverse) of two polynomials in the same step, between two steps, by a table and Newton's method."""

    def __init__(self, row: Array, outer: Array, start: float, stop: float) -> None:
        self._row, self._slope = row, polyder(row)
        self._outer, self._outer_slope = outer, polyder(outer)
        steps = np.linspace(start, stop, 65)
        order = np.argsort(polyval(steps, row))
        self._steps, self._table = steps[order], polyval(steps, row)[order]

    def __call__(self, x: Array, derivative: int = 0, /) -> Array:
        """Return the value or its slope at x (n,)."""
        step = np.interp(x, self._table, self._steps)
        for _ in range(5):
            step = step - (polyval(step, self._row) - x) / polyval(step, self._slope)
        if derivative:
            return np.asarray(polyval(step, self._outer_slope) / polyval(step, self._slope), dtype=np.float64)
        return np.asarray(polyval(step, self._outer), dtype=np.float64)


class _Made:
    """Pieces in the making."""

    def __init__(self, tolerance: float) -> None:
        self.tolerance = tolerance
        self.breaks: list[float] = []
        self.origins: list[float] = []
        self.rows: list[Array] = []
        self.worst = 0.0

    def add(self, left: float, origin: float, row: Array) -> None:
        """Add a piece that starts at `left`, which does not count for the first one."""
        if self.rows:
            self.breaks.append(left)
        self.origins.append(origin)
        self.rows.append(row)

    def fit(self, function: Smooth, left: float, start: float, stop: float) -> None:
        """Add quartics that follow a function from `start` to `stop`; the first one holds from `left` on."""
        ends = np.array([start, stop])
        while True:
            middles, rows, errors = _quartics(function, ends)
            if errors.max() <= self.tolerance or len(middles) >= MOST_PIECES:
                break
            # An error falls with the fifth power of the width.
            parts = np.clip((errors / self.tolerance) ** 0.2 + 1.0, 1.0, 8.0).astype(int)
            parts[errors <= self.tolerance] = 1
            cut = [np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(ends[:-1], ends[1:], parts, strict=True)]
            ends = np.concatenate([*cut, ends[-1:]])
        for k in range(len(middles)):
            self.add(float(ends[k]) if k else left, float(middles[k]), rows[k])
        self.worst = max(self.worst, float(errors.max()))

    def function(self, kind: str, error: float) -> Piecewise:
        """Return the function that the pieces make."""
        padded = np.zeros((len(self.rows), max(map(len, self.rows))))
        for k, row in enumerate(self.rows):
            padded[k, : len(row)] = row
        return Piecewise(np.array(self.breaks), np.array(self.origins), padded, kind, max(error, self.worst))


def _quartics(function: Smooth, ends: Array) -> tuple[Array, Array, Array]:
    """Return middles (n,) of intervals between ends (n + 1,), quartics about them (n, 5), and their errors (n,)."""
    middles, half = 0.5 * (ends[:-1] + ends[1:]), 0.5 * np.diff(ends)
    values, slopes, at_middle = function(ends), function(ends, 1), function(middles)
    even = 0.5 * (values[:-1] + values[1:]) - at_middle
    odd = 0.5 * np.diff(values)
    fourth = 0.25 * half * np.diff(slopes) - even
    third = 0.5 * (0.5 * half * (slopes[:-1] + slopes[1:]) - odd)
    rows = np.stack(
        [at_middle, (odd - third) / half, (even - fourth) / half**2, third / half**3, fourth / half**4], 1
    )
    steps = half[:, None] * np.cos(np.linspace(0.0, np.pi, 15))
    wanted = function((middles[:, None] + steps).ravel()).reshape(steps.shape)
    found = np.zeros_like(steps)
    for k in range(DEGREE, -1, -1):
        found = found * steps + rows[:, k : k + 1]
    return middles, rows, np.abs(found - wanted).max(axis=1)
