"""Every joint over its range: jumps of length or slope, and where no path is found."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.checking.outcome import Check
from mjwrap.continuity import NARROW, Probe, odd_intervals, refine_jump
from mjwrap.paths import Status
from mjwrap.poses import PoseMaker
from mjwrap.system import MuscleSystem

Array = NDArray[np.float64]
MODELS = (Status.ENDPOINT_INSIDE, Status.OUT_OF_RANGE)  # where the model is such that there is no path


class Paths:
    """The checks that every evaluated pose takes part in: is there a path, and how well does it meet its surfaces?"""

    def __init__(self) -> None:
        self.tangency = Check("tangency", "tangency error", 1e-10)
        self.found = Check("paths", "a path is found where the model allows one", 0.0, "without")
        self.inside = Check("model", "the model allows a path at every pose", 0.0, "without")
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
                    f"{name}: no path at {len(places)} of {self.poses} poses; at {places[0]}"
                )
        return [self.found, self.inside, self.tangency]


def sweep_joint(
    muscles: MuscleSystem, data: mujoco.MjData, maker: PoseMaker, joint: int, axis: int, samples: int, paths: Paths,
    jumps: Check,
) -> None:  # fmt: skip
    """Sweep a joint, and look for jumps in the lengths and slopes of all muscles."""
    motion = maker.sweep(joint, samples, axis)
    length, slope = np.zeros((2, samples, muscles.n))
    status = np.zeros((samples, muscles.n), dtype=np.int64)
    muscles.reset(data)
    branches = []
    for k in range(samples):
        data.qpos[:] = motion.qpos[k]
        jacobian = muscles.length_jacobian(data)
        length[k], slope[k], status[k] = muscles.length, jacobian @ motion.tangent[k], muscles.status
        branches.append(muscles.branch(data))
        paths.look(muscles, f"{motion.name} = {motion.at[k]:.4f}")
    jumps.count += muscles.n
    sweep = _Sweep(muscles, data, maker.maker(joint, axis), motion.at, branches)
    for i, name in enumerate(muscles.names):
        for found in _jumps(sweep, i, length[:, i], slope[:, i], status[:, i] == 0):
            jumps.remarks.append(f"{name} at {motion.name} = {found}")
            jumps.worst += 1.0


class _Sweep(NamedTuple):
    """A sweep that has been evaluated: at (T,), and the branches at its samples."""

    muscles: MuscleSystem
    data: mujoco.MjData
    place: Callable[[float], tuple[Array, Array]]
    at: Array
    branches: list[Array]


def _jumps(sweep: _Sweep, i: int, length: Array, slope: Array, good: NDArray[np.bool_]) -> list[str]:
    """Say where muscle i jumps, by how much, and how many surfaces it touches before and after."""
    span = float(np.ptp(sweep.at))
    found: dict[float, str] = {}
    for k, bend in odd_intervals(sweep.at, length, slope, good):
        probe = _probe(sweep, k, i)
        jump = refine_jump(probe, float(sweep.at[k]), float(sweep.at[k + 1]), span, bend)
        if jump is None or any(abs(jump[0] - other) < 1e3 * NARROW * span for other in found):
            continue
        at, size, turn = jump
        touched = []
        for side in (-2.0 * NARROW * span, 2.0 * NARROW * span):
            probe(at + side)
            touched.append(len(sweep.muscles.contact_points(i)))
        what = f"length {1e3 * size:+.3f} mm, moment arm {-1e3 * turn:+.3f} mm"
        found[at] = f"{at:.6f}: {what}; {touched[0]} surfaces touched, then {touched[1]}"
    return list(found.values())


def _probe(sweep: _Sweep, k: int, i: int) -> Probe:
    """Return a probe that comes to every place from the branch at sample k."""

    def probe(at: float) -> tuple[float, float]:
        sweep.data.qpos[:], tangent = sweep.place(at)
        sweep.muscles.set_branch(sweep.data, sweep.branches[k])
        jacobian = sweep.muscles.length_jacobian(sweep.data)
        return float(sweep.muscles.length[i]), float(jacobian[i] @ tangent)

    return probe
