"""Routes of muscles with conditional points: sites that belong to the path only while joints are within ranges.

Every combination of present points is a route of its own, of which exactly one holds at each pose.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf.names import name_of

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


def holds(model: mujoco.MjModel, when: Sequence[Presence], qpos: NDArray[np.float64]) -> bool:
    """Return whether a route that holds `when` points are present or absent does so at a pose qpos (nq,)."""

    def inside(each: JointRange) -> bool:
        return bool(each.low <= qpos[model.jnt_qposadr[each.joint]] <= each.high)

    return all(all(map(inside, presence.ranges)) == presence.holds for presence in when)


def routes_that_hold(
    model: mujoco.MjModel, muscles: Sequence[Conditional], qpos: NDArray[np.float64]
) -> dict[int, tuple[bool, ...]]:
    """Return for every muscle with conditional points, by its place, which of its routes hold at a pose qpos (nq,)."""
    return {
        i: tuple(holds(model, route.when, qpos) for route in muscle.routes)
        for i, muscle in enumerate(muscles)
        if any(route.when for route in muscle.routes)
    }


def when_text(model: mujoco.MjModel, when: Sequence[Presence]) -> str:
    """Return in words, with the joints' names, where a route holds; "" for one that always holds."""
    words = [f"{_in_words(model, presence.ranges, presence.holds)}" for presence in when]
    return f", where {' and '.join(words)}" if words else ""


def ranges_text(model: mujoco.MjModel, ranges: Sequence[JointRange]) -> str:
    """Return in words, with the joints' names, that joints are within ranges."""
    names = [name_of(model, mujoco.mjtObj.mjOBJ_JOINT, each.joint) for each in ranges]
    return " and ".join(
        f"{name} is in [{r.low:g}, {r.high:g}]" for name, r in zip(names, ranges, strict=True)
    )


def _in_words(model: mujoco.MjModel, ranges: Sequence[JointRange], holding: bool) -> str:
    text = ranges_text(model, ranges)
    if holding:
        return text
    return text.replace(" is in ", " is not in ") if len(ranges) == 1 else f"not ({text})"


class _Route(Protocol):
    @property
    def when(self) -> tuple[Presence, ...]: ...


class Conditional(Protocol):
    """A declared muscle, as far as conditional points are concerned."""

    @property
    def routes(self) -> Sequence[_Route]: ...


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
