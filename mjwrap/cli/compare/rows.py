"""A comparison as rows of CSV files: every muscle and pose, or those that tell something; and the given tables."""

from __future__ import annotations

import csv
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mjwrap.comparison import AGREE, Outcome
from mjwrap.comparison.judge_geodesic import Fault
from mjwrap.comparison.tables import Beside
from mjwrap.comparison.twins import Batch, Twin
from mjwrap.comparison.verdict import differences, outcomes, slope
from mjwrap.files.atomic import PartFile
from mjwrap.poses.joint_sweeps import PoseSequence
from mjwrap.text import counted

Array = NDArray[np.float64]
_HEADER = (
    "motion", "base", "at", "muscle", "outcome", "length_mujoco", "length_mjwrap", "velocity_mujoco", "velocity_mjwrap",
    "about", "moment_arm_mujoco", "moment_arm_mjwrap", "moment_arm_difference", "fault_mujoco", "fault_mjwrap",
    "status_mjwrap",
)  # fmt: skip
_TABLES = ("time", "muscle", "quantity", "about", "table", "mujoco", "mjwrap")


class PoseRows:
    """A CSV file with a row for every muscle and pose, written while they are compared. SI units.

    Unless `every` pose is asked for, sweeps that do not move a muscle are left out, and so are the poses of sweeps
    around further poses (base > 0) at which both programs are equal. Moment arms are −∂l/∂q: about the joint that is
    swept, else about the one whose moment arm differs most, or is largest. What mjwrap does not have is left blank.
    dofs: the names of the degrees of freedom.
    """

    def __init__(self, output: PartFile, dofs: Sequence[str], every: bool) -> None:
        self._output, self._dofs, self._every = output, list(dofs), every
        self.rows = self.of = 0
        self._writer = csv.writer(output.open_text())
        with output.writing():
            self._writer.writerow(_HEADER)

    def add(self, batch: Batch) -> None:
        """Write one motion."""
        with self._output.writing():
            for twin in batch.twins:
                if twin.mjwrap is not None:
                    self._add(batch.motion, twin)

    def _add(self, motion: PoseSequence, twin: Twin) -> None:
        native, mine = twin.native, twin.mjwrap
        assert mine is not None
        found, gaps = outcomes(twin, motion.continuous), differences(native, mine)
        about, arms = _moment_arms(motion, twin, self._dofs)
        equal = found == Outcome.AGREE
        left_out = np.zeros(len(motion.at), dtype=np.bool_)
        if motion.continuous and not self._every:
            still = not slope(mine, motion)[twin.status == 0].any()  # exactly 0 where no body of it moves
            left_out = equal & (still or motion.base > 0)
        self.of += len(motion.at)
        self.rows += int((~left_out).sum())
        for k in np.flatnonzero(~left_out):
            there = twin.status[k] == 0
            own = [float(x[k]) if there else "" for x in (mine.length, mine.velocity, arms[1], gaps[2])]
            self._writer.writerow([
                motion.name, motion.base, float(motion.at[k]), twin.name, Outcome(int(found[k])).name,
                float(native.length[k]), own[0], float(native.velocity[k]), own[1],
                about[k], float(arms[0, k]), own[2], own[3],
                *(Fault(int(x.fault[k])).name for x in (native, mine)), int(twin.status[k]),
            ])  # fmt: skip

    def close(self) -> str:
        """Finish the file; say how large it is, and what was left out."""
        self._output.publish()
        size = f"{self._output.path.stat().st_size / 1e6:.1f} MB"
        if self.rows == self.of:
            return f"{counted(self.rows, 'row')}, {size}"
        return f"{self.rows} of {self.of} rows, {size}; all of them with --csv-all"


def _moment_arms(motion: PoseSequence, twin: Twin, dofs: list[str]) -> tuple[list[str], Array]:
    """Return about what (T,), and MuJoCo's and mjwrap's moment arms (2, T) [m]."""
    native, mine = twin.native, twin.mjwrap
    assert mine is not None
    count = len(motion.at)
    if motion.continuous:
        return [motion.name] * count, -np.array([slope(native, motion), slope(mine, motion)])
    gap, size = np.abs(mine.jacobian - native.jacobian), np.abs(native.jacobian)
    if not gap.size:
        return [""] * count, np.zeros((2, count))
    place = np.where(gap.max(axis=1) > AGREE, gap.argmax(axis=1), size.argmax(axis=1))
    rows = np.arange(count)
    arms = -np.array([native.jacobian[rows, place], mine.jacobian[rows, place]])
    return [dofs[d] for d in place], arms


def write_tables(output: PartFile, given: Sequence[Beside]) -> None:
    """Write a CSV file with a row for every row and muscle of the given tables, both programs beside it. SI units."""
    writer = csv.writer(output.open_text())
    with output.writing():
        writer.writerow(_TABLES)
        for beside in given:
            for k, time in enumerate(beside.time.tolist()):
                figures = (float(x[k]) for x in (beside.table, beside.mujoco, beside.mjwrap))
                cells = ["" if np.isnan(x) else x for x in figures]
                quantity = "moment arm" if beside.about else "length"
                writer.writerow([time, beside.muscle, quantity, beside.about, *cells])
    output.publish()
