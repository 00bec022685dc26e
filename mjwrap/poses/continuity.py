"""Find jumps of a length or its slope along a sweep; halving an interval distinguishes a jump from a steep stretch."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Probe = Callable[[float], tuple[float, float]]  # position in the sweep -> length, slope

LENGTH = 3e-6  # smallest jump in length that is reported, as a share of the muscle's size
SLOPE = (
    3e-5  # smallest jump in slope that is reported, of the muscle's size per radian or, along a slide, of 1
)
NARROW = 1e-9  # width, relative to the sweep's range, at which a jump is distinguished from a steep stretch
LASTING = 0.5  # a jump keeps at least this share of its size while the width is divided by a thousand
MOST = 3  # largest number of intervals that are halved, for each muscle, sweep and kind


class Smallest(NamedTuple):
    """The smallest jumps that are reported: of length [m], and of slope [m/rad, or 1 along a slide]."""

    length: float
    slope: float


def smallest_jumps(size: float, turning: bool) -> Smallest:
    """Return the smallest jumps that are reported of a muscle of this size [m]; turning: the swept joint turns."""
    return Smallest(LENGTH * size, SLOPE * (size if turning else 1.0))


def jump_candidates(
    at: Array, length: Array, slope: Array, good: NDArray[np.bool_], least: Smallest
) -> list[tuple[int, float | None]]:
    """Return the intervals in which length (None) or slope (its bend beside the interval) may jump.

    at, length, slope, good: (T,); good: whether there is a length; least: the smallest jumps that are reported.
    Interval k is from sample k to the next.
    """
    h, m, l = np.diff(at), slope, length
    whole = good[1:] & good[:-1]
    rest = np.where(whole, np.abs(np.diff(l) - 0.5 * h * (m[1:] + m[:-1])), 0.0)
    turn = np.where(whole, np.abs(np.diff(m)), 0.0)
    beside = np.maximum(np.append(turn[1:], 0.0), np.insert(turn[:-1], 0, 0.0))
    bends = 0.5 * (np.append(np.diff(m)[1:], 0.0) + np.insert(np.diff(m)[:-1], 0, 0.0)) / h
    odd_lengths = [int(k) for k in np.argsort(-rest)[:MOST] if rest[k] > 0.5 * least.length]
    odd_slopes = [int(k) for k in np.argsort(-turn)[:MOST] if turn[k] > 2.0 * beside[k] + least.slope]
    found: list[tuple[int, float | None]] = [(k, None) for k in odd_lengths]
    return found + [(k, float(bends[k])) for k in odd_slopes]


def refine_jump(
    probe: Probe, low: float, high: float, span: float, bend: float | None, least: Smallest
) -> tuple[float, float, float] | None:
    """Halve an interval towards its jump; return (place, jump in length, jump in slope), or None if it is smooth.

    bend: None: choose the half whose change of length agrees less with its slopes; a number: choose the half with the
    larger change of slope, less `bend` times the width, which is the change beside the interval. least: the smallest
    jumps that are reported.
    """
    (l0, m0), (l1, m1) = probe(low), probe(high)
    wide: tuple[float, float] | None = None
    while high - low > NARROW * span:
        middle = 0.5 * (low + high)
        lm, mm = probe(middle)
        half = 0.5 * (middle - low)
        left, right = abs(lm - l0 - half * (m0 + mm)), abs(l1 - lm - half * (mm + m1))
        if bend is not None:
            left, right = abs(mm - m0 - 2.0 * half * bend), abs(m1 - mm - 2.0 * half * bend)
        if left >= right:
            high, l1, m1 = middle, lm, mm
        else:
            low, l0, m0 = middle, lm, mm
        smooth = (
            abs(l1 - l0) < least.length if bend is None else abs(m1 - m0 - 2.0 * half * bend) < least.slope
        )
        if smooth:
            return None
        if wide is None and high - low < 1e3 * NARROW * span:
            wide = abs(l1 - l0), abs(m1 - m0)
    assert wide is not None
    length = l1 - l0 if abs(l1 - l0) >= max(least.length, LASTING * wide[0]) else 0.0
    turn = m1 - m0 if abs(m1 - m0) >= max(least.slope, LASTING * wide[1]) else 0.0
    return (0.5 * (low + high), length, turn) if length or turn else None
