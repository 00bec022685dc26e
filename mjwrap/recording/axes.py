"""Ranges of axes on which the viewer labels at least two ticks.

The viewer labels multiples of powers of ten, if there is enough space between them. A curve between -0.9 and 0.7 would
have the label 0 alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np
import numpy.typing as npt

Bounds = Mapping[str, npt.NDArray[np.float64]]  # least and largest values (2, m) of an entity's m curves

MARGIN = 0.02  # above and below the curves, relative to their range
EDGE = 0.06  # distance of a tick from the end of its axis [steps]; nearer ones have no label
MOST = 9.0  # labelled steps for which a plot has enough space


def tick_range(low: float, high: float) -> tuple[float, float] | None:
    """Return the smallest range around [low, high] with two labelled ticks; None for one value or none."""
    if not (math.isfinite(low) and math.isfinite(high) and high > low):
        return None
    margin = MARGIN * (high - low)
    low, high = low - margin, high + margin
    exponent = math.floor(math.log10(high - low))
    for step in (10.0**exponent, 10.0 ** (exponent + 1)):
        first = math.floor(low / step)
        pairs = ((step * k, step * (k + 1)) for k in range(first, math.floor(high / step) + 1))
        found = min(
            ((min(low, a - EDGE * step), max(high, b + EDGE * step)) for a, b in pairs),
            key=lambda ends: ends[1] - ends[0],
        )
        if found[1] - found[0] <= MOST * step:
            return found
    return low, high


def common_range(
    bounds: Bounds, entities: Iterable[str], shown: object = slice(None)
) -> tuple[float, float] | None:
    """Return the range for the curves of entities, or those of each that are shown; None if nothing is known."""
    parts = [bounds[path][:, shown] for path in entities if path in bounds]  # type: ignore[index]
    parts = [part for part in parts if part.size]
    if not parts:
        return None
    return tick_range(min(float(p[0].min()) for p in parts), max(float(p[1].max()) for p in parts))


def widen(bounds: dict[str, npt.NDArray[np.float64]], name: str, values: npt.NDArray[np.float64]) -> None:
    """Extend the bounds of a table's columns by more rows (T, m); values that are not finite do not count."""
    rows = np.ascontiguousarray(values.T)  # reducing along the long axis is faster
    low, high = rows.min(axis=1), rows.max(axis=1)
    if not (np.isfinite(low).all() and np.isfinite(high).all()):  # seldom, and slower
        low = np.where(np.isfinite(values), values, np.inf).min(axis=0)
        high = np.where(np.isfinite(values), values, -np.inf).max(axis=0)
    if name in bounds:
        low, high = np.minimum(low, bounds[name][0]), np.maximum(high, bounds[name][1])
    bounds[name] = np.stack([low, high])
