"""Sums and compositions of piecewise polynomials, for locations that a joint moves."""

from __future__ import annotations

from collections.abc import Sequence
from math import comb

import numpy as np

from mjwrap.osim.description.functions import Piecewise, constant

UNBOUNDED = 1e10  # stands for an end that a range does not have


def shifted(function: Piecewise, piece: int, origin: float, width: int) -> np.ndarray:
    """Return the coefficients (width,) of one piece about another origin."""
    given = function.coefficients[piece]
    step = origin - function.origins[piece]
    out = np.zeros(width)
    for k, value in enumerate(given):
        for j in range(k + 1):
            out[j] += value * comb(k, j) * step ** (k - j)
    return out


def weighted_sum(functions: Sequence[Piecewise], weights: Sequence[float], offset: float) -> Piecewise:
    """Return offset + the sum of weights times functions of the same variable."""
    parts = [(function, weight) for function, weight in zip(functions, weights, strict=True) if weight != 0.0]
    if len(parts) == 1 and parts[0][1] == 1.0:
        only = parts[0][0]
        if offset == 0.0:
            return only
        moved = only.coefficients.copy()
        moved[:, 0] += offset
        return Piecewise(only.breaks, only.origins, moved, only.kind, only.error)
    if not parts:
        return constant(offset)
    breaks = np.unique(np.concatenate([function.breaks for function, _ in parts]))
    width = max(function.coefficients.shape[1] for function, _ in parts)
    middles = _inner_points(breaks)
    origins = np.array([float(parts[0][0].origins[parts[0][0].piece(x)]) for x in middles])
    rows = np.zeros((len(middles), width))
    for row, (x, origin) in enumerate(zip(middles, origins, strict=True)):
        for function, weight in parts:
            rows[row] += weight * shifted(function, int(function.piece(x)), origin, width)
    rows[:, 0] += offset
    error = sum(abs(weight) * function.error for function, weight in parts)
    return Piecewise(breaks, origins, rows, parts[0][0].kind, error)


def _inner_points(breaks: np.ndarray) -> np.ndarray:
    """Return one point inside each piece between breaks, and one beyond each end."""
    if not len(breaks):
        return np.zeros(1)
    return np.concatenate([[breaks[0] - 1.0], 0.5 * (breaks[1:] + breaks[:-1]), [breaks[-1] + 1.0]])


def composed(outer: Piecewise, inner: Piecewise) -> Piecewise:
    """Return outer(inner(q)); exact where the inner function is a straight line."""
    if not inner.is_linear:
        return _composed_by_pieces(outer, inner)
    at_zero = float(inner(0.0))
    slope = float(inner(0.0, 1))
    if slope == 0.0:
        return Piecewise(np.zeros(0), np.zeros(1), np.array([[float(outer(at_zero))]]))
    breaks, origins = (outer.breaks - at_zero) / slope, (outer.origins - at_zero) / slope
    rows = outer.coefficients * slope ** np.arange(outer.coefficients.shape[1])
    if slope < 0.0:
        breaks, origins, rows = breaks[::-1], origins[::-1], rows[::-1]
    return Piecewise(breaks.copy(), origins.copy(), rows.copy(), outer.kind, outer.error)


def _composed_by_pieces(outer: Piecewise, inner: Piecewise) -> Piecewise:
    """Return outer(inner(q)) between the breaks of both functions, exactly: the degrees multiply."""
    edges = set(map(float, inner.breaks))
    for value in outer.breaks:
        edges.update(_crossings(inner, float(value)))
    breaks = np.array(sorted(edges))
    middles = _inner_points(breaks)
    degree = (outer.coefficients.shape[1] - 1) * (inner.coefficients.shape[1] - 1)
    origins, rows = np.zeros(len(middles)), np.zeros((len(middles), degree + 1))
    for k, x in enumerate(middles):
        own, other = int(inner.piece(x)), int(outer.piece(inner(x)))
        origins[k] = inner.origins[own]
        base = np.polynomial.Polynomial(inner.coefficients[own]) - outer.origins[other]
        total = np.polynomial.Polynomial(outer.coefficients[other])(base)
        rows[k, : len(total.coef)] = total.coef
    return Piecewise(breaks, origins, rows, outer.kind, outer.error)


def preimage(inner: Piecewise, low: float, high: float) -> tuple[float, float] | None:
    """Return the interval of q in which inner(q) is in [low, high]; None where it is not one interval."""
    edges = sorted({*map(float, inner.breaks), *_crossings(inner, low), *_crossings(inner, high)})
    held = [low <= float(inner(x)) <= high for x in _inner_points(np.array(edges))]
    bounds = [-UNBOUNDED, *edges, UNBOUNDED]
    inside = [k for k, good in enumerate(held) if good]
    if not inside or inside[-1] - inside[0] + 1 != len(inside):
        return None
    return bounds[inside[0]], bounds[inside[-1] + 1]


def _crossings(function: Piecewise, value: float) -> list[float]:
    """Return all x where a function has a value."""
    found: list[float] = []
    for piece in range(len(function.origins)):
        low = float(function.breaks[piece - 1]) if piece else -np.inf
        high = float(function.breaks[piece]) if piece < len(function.breaks) else np.inf
        row = function.coefficients[piece].copy()
        row[0] -= value
        for root in np.roots(row[::-1]):
            x = float(root.real) + float(function.origins[piece])
            if abs(root.imag) < 1e-12 and low < x < high:
                found.append(x)
    return found


def flattened(function: Piecewise) -> list[float]:
    """Return a function as the data of a numeric: P, breaks (P - 1), origins (P), coefficients row by row."""
    rows = function.coefficients
    used = max(1, int(np.max(np.nonzero(np.any(rows != 0.0, axis=0))[0], initial=0)) + 1)
    return [len(rows), *function.breaks, *function.origins, *rows[:, :used].ravel()]
