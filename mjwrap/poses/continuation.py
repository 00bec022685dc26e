"""Continuation of paths along a sweep, each pose starting from the path at the previous one; finds jumps."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf.conditional_points import routes_that_hold
from mjwrap.mjcf.inside import reference_pose
from mjwrap.poses.continuity import Smallest, jump_candidates, refine_jump, smallest_jumps
from mjwrap.poses.sizes import muscle_size
from mjwrap.poses.ties import moment_arm_break
from mjwrap.system import MuscleSystem

Array = NDArray[np.float64]
Place = Callable[[float], tuple[Array, Array]]  # position of a joint -> pose (nq,), its derivative (nv,)
Found = tuple[float, float, float]  # position of a jump, its size in length and in slope
FINER = 64  # number of steps into which an interval with a possible jump is divided


class SweepTrace(NamedTuple):
    """Places evaluated one after the other: at (T,), length, slope and good (T, n), and the branches there."""

    at: Array
    length: Array
    slope: Array
    good: NDArray[np.bool_]
    branches: list[Array]

    def jump_candidates(self, i: int, least: Smallest) -> list[tuple[int, float | None]]:
        """Return the intervals in which muscle i may jump: it changes more than a smooth curve."""
        return jump_candidates(self.at, self.length[:, i], self.slope[:, i], self.good[:, i], least)


class PathFollower:
    """Follow the paths of a MuscleSystem from pose to pose, in an mjData of its model."""

    def __init__(self, muscles: MuscleSystem, data: mujoco.MjData) -> None:
        self._muscles, self._data = muscles, data
        rest = reference_pose(muscles.model)
        self._sizes = [muscle_size(muscles.model, rest, muscle) for muscle in muscles.declarations]

    def move_to(self, start: Array, goal: Array, steps: int = 20) -> None:
        """Start cold at a pose (nq,), and move to another pose in small steps, on the branches of the first one."""
        model, data = self._muscles.model, self._data
        self._muscles.reset(data)
        difference = np.zeros(model.nv)
        mujoco.mj_differentiatePos(model, difference, 1.0, start, goal)
        for k in range(steps):
            qpos = start.copy()
            mujoco.mj_integratePos(model, qpos, difference, k / steps)
            data.qpos[:] = qpos
            self._muscles.forward(data)

    def trace(self, place: Place, at: Array, look: Callable[[float], object] | None = None) -> SweepTrace:
        """Evaluate positions in order, each from the branch of the previous one; look: called after each."""
        muscles, data, n = self._muscles, self._data, self._muscles.n
        length, slope = np.zeros((len(at), n)), np.zeros((len(at), n))
        good, branches = np.zeros((len(at), n), dtype=np.bool_), []
        for k, value in enumerate(at.tolist()):
            data.qpos[:], tangent = place(value)
            slope[k] = muscles.length_jacobian(data) @ tangent
            length[k], good[k] = muscles.length, muscles.status == 0
            branches.append(muscles.branch(data))
            if look is not None:
                look(value)
        return SweepTrace(at, length, slope, good, branches)

    def jumps(
        self, place: Place, trace: SweepTrace, turning: bool, only: Iterable[int] | None = None
    ) -> list[tuple[int, Found]]:
        """Return the jumps along a trace: muscle, and position, size in length [m] and size in slope.

        turning: whether the swept joint turns; only: the muscles to test, all if None. A possible jump is tested again
        in finer steps, as in a smooth motion: a large step may end on another branch where two branches are close to
        each other.
        """
        span, found = float(np.ptp(trace.at)), list[tuple[int, Found]]()
        finer: dict[int, SweepTrace] = {}
        for i in range(self._muscles.n) if only is None else only:
            least = smallest_jumps(self._sizes[i], turning)
            for k, bend in trace.jump_candidates(i, least):
                if self._refine(place, trace, i, k, bend, span, least) is None:
                    continue
                if k not in finer:
                    self._muscles.set_branch(self._data, trace.branches[k])
                    finer[k] = self.trace(place, np.linspace(trace.at[k], trace.at[k + 1], FINER + 1))
                for j, turn in finer[k].jump_candidates(i, least):
                    jump = self._refine(place, finer[k], i, j, turn, span, least)
                    if jump and all(i != m or abs(jump[0] - other[0]) > 1e-6 * span for m, other in found):
                        found.append((i, jump))
        return found

    def _refine(
        self,
        place: Place,
        trace: SweepTrace,
        i: int,
        k: int,
        bend: float | None,
        span: float,
        least: Smallest,
    ) -> Found | None:
        def probe(at: float) -> tuple[float, float]:
            self._data.qpos[:], tangent = place(at)
            self._muscles.set_branch(self._data, trace.branches[k])
            jacobian = self._muscles.length_jacobian(self._data)
            return float(self._muscles.length[i]), float(jacobian[i] @ tangent)

        return refine_jump(probe, float(trace.at[k]), float(trace.at[k + 1]), span, bend, least)

    def moment_arm_break(self, place: Place, trace: SweepTrace, i: int, at: float) -> str:
        """Return why muscle i has no continuous moment arm at a position, starting from the trace; empty if it has."""
        self.touched(place, trace, i, at)
        return moment_arm_break(self._muscles, self._data, i, self._sizes[i])

    def is_conditional_edge(self, place: Place, i: int, before: float, after: float) -> bool:
        """Return whether a conditional point of muscle i comes or goes between two positions."""
        model, muscle = self._muscles.model, self._muscles.declarations[i : i + 1]
        at = [routes_that_hold(model, muscle, place(value)[0]) for value in (before, after)]
        return at[0] != at[1]

    def touched(self, place: Place, trace: SweepTrace, i: int, at: float) -> int:
        """Return the number of surfaces that muscle i touches at a position, starting from the trace."""
        k = int(np.searchsorted(trace.at, at)) - 1
        self._muscles.set_branch(self._data, trace.branches[max(k, 0)])
        self._data.qpos[:] = place(at)[0]
        self._muscles.forward(self._data)
        return len(self._muscles.contact_points(i))
