"""The shortest and the longest geodesic path of every muscle over the ranges of all joints."""

from __future__ import annotations

import copy
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap import validation
from mjwrap.calibration.ascent import Ascent, ascend
from mjwrap.calibration.joints import JointSpace
from mjwrap.errors import ModelError
from mjwrap.mjcf import names as all_names
from mjwrap.paths import Status
from mjwrap.poses.angles import check_range
from mjwrap.system import MuscleSystem, twin_of

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
TOLERANCE = 1e-6  # relative to the muscle's length: a search ends if the gradient predicts a smaller gain
ITERATIONS = 200


@dataclass(frozen=True)
class LengthRange:
    """The shortest and longest length of a muscle over the ranges of the joints that move it.

    Attributes:
        muscle: its name.
        shortest: shortest length [m]; NaN if no pose had a path.
        longest: longest length [m]; NaN if no pose had a path.
        shortest_pose: (nq,) qpos at the shortest length.
        longest_pose: (nq,) qpos at the longest length.
        poses: number of evaluated poses in which this muscle was moved.
        without_path: number of these without a path, by status.
        held: joints without a range that would move the muscle; they stay as in the base pose.
    """

    muscle: str
    shortest: float
    longest: float
    shortest_pose: Array = field(repr=False, compare=False)
    longest_pose: Array = field(repr=False, compare=False)
    poses: int
    without_path: Mapping[str, int]
    held: tuple[str, ...] = ()


class _Lengths:
    """The lengths of all muscles at arbitrary poses, and the extremes found so far."""

    def __init__(self, muscles: MuscleSystem, space: JointSpace) -> None:
        self.space = space
        self.muscles = muscles
        self._data = mujoco.MjData(muscles.model)
        self.shortest, self.longest = np.full(muscles.n, np.inf), np.full(muscles.n, -np.inf)
        self.extreme_u = np.zeros((2, muscles.n, space.k))
        self.poses = np.zeros(muscles.n, dtype=np.int64)
        self.without: list[Counter[str]] = [Counter() for _ in range(muscles.n)]

    def evaluate(self, u: Array, counted: Bools, gradients: bool) -> tuple[Array, Array, Array]:
        """Return lengths (n,), NaN without a path, ∂l/∂q (n, nv) if asked for, and d(pose)/du (nv, k)."""
        muscles, data = self.muscles, self._data
        data.qpos[:] = self.space.pose(u)
        muscles.reset(data)  # so that a length depends only on its pose, not on previous poses
        if gradients:
            jacobian = muscles.length_jacobian(data)
            tangent = self.space.tangent(u, data.qpos)
        else:
            muscles.forward(data)
            jacobian = tangent = np.empty((0, 0))
        length, status = muscles.length, muscles.status
        self.poses += counted
        for i in np.flatnonzero((status != 0) & counted):
            self.without[i][Status(status[i]).name] += 1
        length[status != 0] = np.nan
        shorter, longer = length < self.shortest, length > self.longest  # false for NaN
        self.shortest[shorter], self.longest[longer] = length[shorter], length[longer]
        self.extreme_u[0, shorter] = u
        self.extreme_u[1, longer] = u
        return length, jacobian, tangent


class _Search:
    """One search: for the longest (sign 1) or shortest (-1) length of a muscle, over the variables that move it."""

    def __init__(self, space: JointSpace, muscle: int, sign: float, start: Array, moved: Bools) -> None:
        self.muscle, self.sign, self.moved = muscle, sign, moved
        self._rest = start
        self._space = space
        self._ascent: Ascent | None = None
        self.at = start[moved]

    def begin(self, length: float) -> None:
        """Set the first point to evaluate."""
        self._ascent = ascend(self.at, self._project, TOLERANCE * length, ITERATIONS)
        self.at = next(self._ascent)

    def _project(self, part: Array) -> Array:
        u = self._rest.copy()
        u[self.moved] = part
        return self._space.project(u)[self.moved]

    def advance(self, length: float, gradient: Array) -> bool:
        """Receive the length and its gradient (k,) at the last point; return whether there is another point."""
        assert self._ascent is not None
        try:
            self.at = self._ascent.send((self.sign * length, self.sign * gradient[self.moved]))
        except StopIteration:
            return False
        return True


def length_ranges(
    muscles: MuscleSystem,
    *,
    names: Sequence[str] | None = None,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    base: ArrayLike | None = None,
    starts: int = 8,
    samples: int = 512,
    seed: int = 0,
) -> dict[str, LengthRange]:
    """Find the shortest and the longest length of every muscle over the ranges of all joints that move it.

    The joints are moved together. Random poses are drawn, half of them in corners of the ranges. From the best of
    them the length is maximised and minimised along its gradient, in each direction with at most as many searches as
    there are variables that move the muscle. Joints that are coupled by equality constraints follow. A search cannot
    prove that there is no longer path; more starts and samples make one less likely. Neither the model nor `muscles`
    is changed.

    Args:
        muscles: the muscles.
        names: names of muscles; None for all.
        ranges: (low, high) [rad or m] by joint, for a ball joint (0, largest angle), in place of the model's.
        base: (nq,) pose in which joints without a range stay (`LengthRange.held`); qpos0 if None.
        starts: largest number of searches in each direction.
        samples: number of poses drawn for each start.
        seed: of the random poses.

    Returns:
        The length range of each muscle, by name.

    Raises:
        ModelError: a name is unknown, a range is not possible or only degrees can explain it, or `muscles` is not a
            MuscleSystem.
    """
    if not isinstance(muscles, MuscleSystem):
        validation.of_type(muscles, "MuscleSystem", "muscles", ModelError)
    if names is not None:
        validation.sequence(names, "names", ModelError, "a list of names of muscles, or None")
    validation.optional(ranges, Mapping, "ranges", ModelError, "a dict of (low, high) by joint")
    starts, samples = (
        validation.whole(value, 1, name, ModelError)
        for name, value in (("starts", starts), ("samples", samples))
    )
    validation.whole(seed, 0, "seed", ModelError)
    names = None if names is None else list(names)
    for name in names or ():
        validation.instance(name, str, "each of names", ModelError, "the name of a muscle")
        if name not in muscles.names:
            raise ModelError(
                f"no muscle '{name}' with a geodesic path; muscles: {', '.join(muscles.names) or 'none'}"
            )
    model = copy.copy(muscles.model)
    chosen = [i for i, name in enumerate(muscles.names) if names is None or name in names]
    space = JointSpace(model, model.qpos0 if base is None else base, ranges or {})
    joints = all_names(model, mujoco.mjtObj.mjOBJ_JOINT, model.njnt)
    for name, (low, high) in (ranges or {}).items():
        check_range(model, joints.index(name), low, high)
    moved, held = space.moves(muscles.declarations)
    lengths = _Lengths(twin_of(muscles, model), space)
    searches = _starts(lengths, chosen, moved, starts, samples, np.random.default_rng(seed))
    _climb(lengths, searches)
    found = {}
    for i in chosen:
        if lengths.poses[i] > lengths.without[i].total():
            ends = float(lengths.shortest[i]), float(lengths.longest[i])
            low, high = (space.pose(u) for u in lengths.extreme_u[:, i])
        else:
            ends = np.nan, np.nan
            low = high = np.full(model.nq, np.nan)
        poses, without = int(lengths.poses[i]), dict(lengths.without[i])
        found[muscles.names[i]] = LengthRange(muscles.names[i], *ends, low, high, poses, without, held[i])
    return found


def _starts(
    lengths: _Lengths, chosen: list[int], moved: Bools, starts: int, samples: int, rng: np.random.Generator
) -> list[_Search]:
    """Return the searches: `starts` times from the best of `samples` random poses; the first include the base pose."""
    space, everyone = lengths.space, np.ones(lengths.muscles.n, dtype=np.bool_)
    if not space.k:
        lengths.evaluate(space.neutral(), everyone, gradients=False)
        return []
    blocks = min(starts, int(moved[chosen].sum(axis=1).max(initial=1)))
    drawn = np.array([[space.draw(rng, corner=i % 2 == 0) for i in range(samples)] for _ in range(blocks)])
    drawn[0, -1] = space.neutral()
    table = np.array([[lengths.evaluate(u, everyone, gradients=False)[0] for u in block] for block in drawn])
    searches: list[_Search] = []
    for i in chosen:
        count = min(blocks, int(moved[i].sum()))
        for number in range(count):
            places, values = drawn[number::count].reshape(-1, space.k), table[number::count, :, i].ravel()
            if np.isnan(values).all():
                continue
            for sign in (-1.0, 1.0):
                best = places[int(np.nanargmax(sign * values))]
                searches.append(_Search(space, i, sign, best, moved[i]))
    return searches


def _climb(lengths: _Lengths, searches: list[_Search]) -> None:
    """Run all searches; searches that move different joints share evaluations."""
    space = lengths.space
    waiting = sorted(searches, key=lambda s: -int(s.moved.sum()))
    masks = np.array([s.moved for s in waiting]).reshape(len(waiting), space.k)
    left = np.ones(len(waiting), dtype=np.bool_)
    busy = np.zeros(space.k, dtype=np.bool_)
    running: list[_Search] = []
    u = space.neutral()
    while running or left.any():
        while len(fit := np.flatnonzero(left & ~(masks & busy).any(axis=1))):
            search = waiting[int(fit[0])]
            search.begin(float(lengths.longest[search.muscle]))
            running.append(search)
            left[fit[0]] = False
            busy |= search.moved
        counted = np.zeros(lengths.muscles.n, dtype=np.bool_)
        for search in running:
            u[search.moved] = search.at
            counted[search.muscle] = True
        length, jacobian, tangent = lengths.evaluate(u, counted, gradients=True)
        going = []
        for search in running:
            gradient = jacobian[search.muscle] @ tangent
            if search.advance(float(length[search.muscle]), gradient):
                going.append(search)
            else:
                busy[search.moved] = False
        running = going
