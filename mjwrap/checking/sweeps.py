"""Every joint over its range: jumps of length or slope, and where no path is found."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.checking.outcome import Check
from mjwrap.continuity import NARROW, odd_intervals, refine_jump
from mjwrap.paths import Status
from mjwrap.poses import PoseMaker
from mjwrap.system import MuscleSystem
from mjwrap.wording import counted

Array = NDArray[np.float64]
Place = Callable[[float], tuple[Array, Array]]  # where a joint is -> pose (nq,), its derivative (nv,)
FINER = 64  # steps in an interval at which something may have jumped
MODELS = (Status.ENDPOINT_INSIDE, Status.OUT_OF_RANGE)  # where the model is such that there is no path


class Paths:
    """The checks that every evaluated pose takes part in: is there a path, and how well does it meet its surfaces?"""

    def __init__(self) -> None:
        self.tangency = Check("tangency", "tangency error", 1e-10)
        self.found = Check("paths", "a path is found where the model allows one", 0.0, "missing paths")
        self.inside = Check("model", "the model allows a path at every pose", 0.0, "missing paths")
        self._without: dict[Status, dict[str, list[str]]] = {}
        self.poses = 0

    def look(self, muscles: MuscleSystem, where: str) -> None:
        """Look at the muscles' last evaluation."""
        status, names = muscles.status, muscles.names
        self.poses += 1
        self.tangency.see(np.where(status == 0, muscles.tangency_error, np.nan), where, names)
        for check in (self.found, self.inside):
            check.count += muscles.n
        for i in np.flatnonzero(status):
            kind = Status(int(status[i]))
            (self.inside if kind in MODELS else self.found).worst += 1.0
            told = f"{where}: {muscles.reason(int(i))}"
            self._without.setdefault(kind, {}).setdefault(names[i], []).append(told)

    def finish(self) -> list[Check]:
        """Return the checks, with a remark for each muscle without a path somewhere."""
        for kind, muscles in self._without.items():
            check = self.inside if kind in MODELS else self.found
            for name, places in sorted(muscles.items(), key=lambda item: -len(item[1])):
                check.remarks.append(
                    f"{name}: no path at {len(places)} of {counted(self.poses, 'pose')}; at {places[0]}"
                )
        return [self.found, self.inside, self.tangency]


class _Walk(NamedTuple):
    """Places evaluated one after the other: at (T,), length, slope and good (T, n), and the branches there."""

    at: Array
    length: Array
    slope: Array
    good: NDArray[np.bool_]
    branches: list[Array]

    def odd(self, i: int) -> list[tuple[int, float | None]]:
        """Return the intervals at which muscle i changes as a smooth curve would not."""
        return odd_intervals(self.at, self.length[:, i], self.slope[:, i], self.good[:, i])


class Sweeper:
    """Sweeps one joint after the other, and finds jumps in the lengths and slopes of all muscles."""

    def __init__(self, muscles: MuscleSystem, data: mujoco.MjData, paths: Paths, jumps: Check) -> None:
        self._muscles, self._data, self._paths, self._jumps = muscles, data, paths, jumps

    def sweep(self, maker: PoseMaker, joint: int, axis: int, samples: int) -> None:
        """Sweep a joint over its range."""
        motion = maker.sweep(joint, samples, axis)
        place, span = maker.maker(joint, axis), float(np.ptp(motion.at))
        self._muscles.reset(self._data)
        walk = self._walk(place, motion.at, motion.name)
        self._jumps.count += self._muscles.n
        odd = [{k for k, _ in walk.odd(i)} for i in range(self._muscles.n)]
        found: list[tuple[int, float]] = []
        for k in sorted(set().union(*odd)):
            # in finer steps, as a smooth motion goes: a leap may land on another branch, where two lie side by side
            self._muscles.set_branch(self._data, walk.branches[k])
            fine = self._walk(place, np.linspace(walk.at[k], walk.at[k + 1], FINER + 1))
            for i in (i for i, places in enumerate(odd) if k in places):
                for jump in self._refine(place, fine, i, span):
                    if all(i != other or abs(jump[0] - at) > 1e-6 * span for other, at in found):
                        found.append((i, jump[0]))
                        self._jumps.worst += 1.0
                        self._jumps.remarks.append(f"{self._muscles.names[i]} at {motion.name} = {jump[1]}")

    def _walk(self, place: Place, at: Array, name: str = "") -> _Walk:
        """Evaluate places in order, each from the branch of the one before; a named walk counts among the poses."""
        muscles, data, n = self._muscles, self._data, self._muscles.n
        length, slope, good = (
            np.zeros((len(at), n)),
            np.zeros((len(at), n)),
            np.zeros((len(at), n), dtype=np.bool_),
        )
        branches: list[Array] = []
        for k, value in enumerate(at.tolist()):
            data.qpos[:], tangent = place(value)
            slope[k] = muscles.length_jacobian(data) @ tangent
            length[k], good[k] = muscles.length, muscles.status == 0
            branches.append(muscles.branch(data))
            if name:
                self._paths.look(muscles, f"{name} = {value:.4f}")
        return _Walk(at, length, slope, good, branches)

    def _refine(self, place: Place, walk: _Walk, i: int, span: float) -> list[tuple[float, str]]:
        """Return where muscle i jumps, and by how much and how many surfaces it touches before and after."""
        muscles, data = self._muscles, self._data
        found: dict[float, str] = {}
        for k, bend in walk.odd(i):

            def probe(at: float, branch: Array = walk.branches[k]) -> tuple[float, float]:
                data.qpos[:], tangent = place(at)
                muscles.set_branch(data, branch)
                jacobian = muscles.length_jacobian(data)
                return float(muscles.length[i]), float(jacobian[i] @ tangent)

            jump = refine_jump(probe, float(walk.at[k]), float(walk.at[k + 1]), span, bend)
            if jump is None:
                continue
            at, size, turn = jump
            touched = []
            for side in (-2.0 * NARROW * span, 2.0 * NARROW * span):
                probe(at + side)
                touched.append(len(muscles.contact_points(i)))
            what = f"length {1e3 * size:+.3f} mm, moment arm {-1e3 * turn:+.3f} mm"
            found[at] = f"{at:.6f}: {what}; touched surfaces {touched[0]}, then {touched[1]}"
        return list(found.items())
