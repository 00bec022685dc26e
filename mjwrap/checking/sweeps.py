"""Every joint over its range: jumps of length or slope, and where no path is found."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.checking.outcome import Check
from mjwrap.continuity import NARROW, Probe, odd_intervals, refine_jump
from mjwrap.paths import Status
from mjwrap.poses import Motion, PoseMaker
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
    for i in range(muscles.n):
        for at, size, turn in _jumps(
            muscles, data, maker, (joint, axis), motion, branches, i, length, slope, status
        ):
            what = f"length {1e3 * size:+.3f} mm, moment arm {-1e3 * turn:+.3f} mm"
            jumps.remarks.append(f"{muscles.names[i]} at {motion.name} = {at:.6f}: {what}")
            jumps.worst += 1.0


def _jumps(
    muscles: MuscleSystem, data: mujoco.MjData, maker: PoseMaker, swept: tuple[int, int], motion: Motion,
    branches: list[Array], i: int, length: Array, slope: Array, status: NDArray[np.int64],
) -> list[tuple[float, float, float]]:  # fmt: skip
    """Return where muscle i jumps along a sweep, and by how much [m, m/rad]."""
    place = maker.maker(*swept)
    found: list[tuple[float, float, float]] = []
    for k, bend in odd_intervals(motion.at, length[:, i], slope[:, i], status[:, i] == 0):
        probe = _probe(muscles, data, place, branches[k], i)
        ends = float(motion.at[k]), float(motion.at[k + 1])
        jump = refine_jump(probe, *ends, float(np.ptp(motion.at)), bend)
        span = float(np.ptp(motion.at))
        if jump is not None and all(abs(jump[0] - other[0]) > 1e3 * NARROW * span for other in found):
            found.append(jump)
    return found


def _probe(
    muscles: MuscleSystem,
    data: mujoco.MjData,
    place: Callable[[float], tuple[Array, Array]],
    branch: Array,
    i: int,
) -> Probe:
    """Return a probe that comes to every place from the branch at the sample before."""

    def probe(at: float) -> tuple[float, float]:
        data.qpos[:], tangent = place(at)
        muscles.set_branch(data, branch)
        jacobian = muscles.length_jacobian(data)
        return float(muscles.length[i]), float(jacobian[i] @ tangent)

    return probe
