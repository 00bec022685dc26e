"""Takes muscles through a sweep as a smooth motion would, each pose from the path of the one before; finds jumps."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.poses.continuity import jump_candidates, refine_jump
from mjwrap.system import MuscleSystem

Array = NDArray[np.float64]
Place = Callable[[float], tuple[Array, Array]]  # where a joint is -> pose (nq,), its derivative (nv,)
Found = tuple[float, float, float]  # where a jump is, in length and in slope
FINER = 64  # steps in an interval at which something may have jumped


class SweepTrace(NamedTuple):
    """Places evaluated one after the other: at (T,), length, slope and good (T, n), and the branches there."""

    at: Array
    length: Array
    slope: Array
    good: NDArray[np.bool_]
    branches: list[Array]

    def jump_candidates(self, i: int) -> list[tuple[int, float | None]]:
        """Return the intervals at which muscle i changes as a smooth curve would not."""
        return jump_candidates(self.at, self.length[:, i], self.slope[:, i], self.good[:, i])


class PathFollower:
    """Takes the muscles of a MuscleSystem from place to place in an mjData of its model."""

    def __init__(self, muscles: MuscleSystem, data: mujoco.MjData) -> None:
        self._muscles, self._data = muscles, data

    def move_to(self, start: Array, goal: Array, steps: int = 20) -> None:
        """Begin afresh at a pose (nq,), and go to another one on the branch that the muscles have there."""
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
        """Evaluate places in order, each from the branch of the one before; look: called after each."""
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
        self, place: Place, trace: SweepTrace, only: Iterable[int] | None = None
    ) -> list[tuple[int, Found]]:
        """Return which muscles jump along a walk, and where, by how much in length [m] and slope.

        only: the muscles to look at, all if None. What looks like a jump from one place of the walk is looked at again
        in finer steps, as a smooth motion goes: a leap may land on another branch, where two lie side by side.
        """
        span, found = float(np.ptp(trace.at)), list[tuple[int, Found]]()
        finer: dict[int, SweepTrace] = {}
        for i in range(self._muscles.n) if only is None else only:
            for k, bend in trace.jump_candidates(i):
                if self._refine(place, trace, i, k, bend, span) is None:
                    continue
                if k not in finer:
                    self._muscles.set_branch(self._data, trace.branches[k])
                    finer[k] = self.trace(place, np.linspace(trace.at[k], trace.at[k + 1], FINER + 1))
                for j, turn in finer[k].jump_candidates(i):
                    jump = self._refine(place, finer[k], i, j, turn, span)
                    if jump and all(i != m or abs(jump[0] - other[0]) > 1e-6 * span for m, other in found):
                        found.append((i, jump))
        return found

    def _refine(
        self, place: Place, trace: SweepTrace, i: int, k: int, bend: float | None, span: float
    ) -> Found | None:
        def probe(at: float) -> tuple[float, float]:
            self._data.qpos[:], tangent = place(at)
            self._muscles.set_branch(self._data, trace.branches[k])
            jacobian = self._muscles.length_jacobian(self._data)
            return float(self._muscles.length[i]), float(jacobian[i] @ tangent)

        return refine_jump(probe, float(trace.at[k]), float(trace.at[k + 1]), span, bend)

    def touched(self, place: Place, trace: SweepTrace, i: int, at: float) -> int:
        """Return how many surfaces muscle i touches at a place, come to in a straight walk from the one before."""
        k = int(np.searchsorted(trace.at, at)) - 1
        self._muscles.set_branch(self._data, trace.branches[max(k, 0)])
        self._data.qpos[:] = place(at)[0]
        self._muscles.forward(self._data)
        return len(self._muscles.contact_points(i))
