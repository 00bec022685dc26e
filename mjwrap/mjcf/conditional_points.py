"""Routes of muscles with conditional points: sites that belong to the path only while joints are within ranges.

Every combination of present points is a route of its own, of which exactly one holds at each pose.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

MOST = 64  # alternatives of one piece of string
_MOST_PATTERNS = 1 << 16  # combinations of joint positions that are looked at


class JointRange(NamedTuple):
    """A range of a joint's qpos, both ends included [rad or m]; joint: MuJoCo's id."""

    joint: int
    low: float
    high: float


class Presence(NamedTuple):
    """Whether a conditional point belongs to a route: whether all its ranges hold."""

    ranges: tuple[JointRange, ...]
    holds: bool

    def __repr__(self) -> str:
        ranges = " and ".join(f"joint {r.joint} in [{r.low:g}, {r.high:g}]" for r in self.ranges)
        return f"{'' if self.holds else 'not '}({ranges})"


class TooManyAlternatives(Exception):
    """So many combinations of conditional points exist; `count` is at least their number."""

    def __init__(self, count: int) -> None:
        super().__init__(f"{count} combinations")
        self.count = count


def alternatives(points: Sequence[tuple[JointRange, ...]]) -> list[tuple[Presence, ...]]:
    """Return the combinations of conditional points that some pose has; points: the ranges of each, all different.

    Along each joint the ranges have finitely many ends; at one of these, or between two neighbours, every combination
    that is possible occurs. Raises `TooManyAlternatives` if there are more than `MOST`.
    """
    joints = dict.fromkeys(each.joint for ranges in points for each in ranges)
    wanted = list(dict.fromkeys(each for ranges in points for each in ranges))
    held: list[list[frozenset[JointRange]]] = []  # for each joint: sets of ranges that hold together
    for joint in joints:
        own = [each for each in wanted if each.joint == joint]
        sets = dict.fromkeys(
            frozenset(each for each in own if each.low <= q <= each.high) for q in _places(own)
        )
        held.append(list(sets))
    patterns = 1
    for sets in held:
        patterns *= len(sets)
    if patterns > _MOST_PATTERNS:
        raise TooManyAlternatives(patterns)
    found: dict[tuple[bool, ...], None] = {}
    for chosen in itertools.product(*held):
        holding = frozenset[JointRange]().union(*chosen)
        found[tuple(all(each in holding for each in ranges) for ranges in points)] = None
    if len(found) > MOST:
        raise TooManyAlternatives(len(found))
    return [
        tuple(Presence(ranges, holds) for ranges, holds in zip(points, pattern, strict=True))
        for pattern in found
    ]


def _places(ranges: list[JointRange]) -> list[float]:
    """Return positions of a joint at which every set of ranges that can hold together does: ends, and between them."""
    ends = sorted({end for each in ranges for end in (each.low, each.high)})
    between = [0.5 * (a + b) for a, b in itertools.pairwise(ends)]
    width = 1.0 + abs(ends[0]) + abs(ends[-1])
    return [ends[0] - width, *ends, *between, ends[-1] + width]
