"""A comparison as rows of CSV files: a row for each muscle and pose, and a row for each row of the given tables."""

from __future__ import annotations

import csv
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mjwrap.comparison import AGREE, Outcome
from mjwrap.comparison.judge_geodesic import Fault
from mjwrap.comparison.paired_evaluation import Batch, MusclePair
from mjwrap.comparison.tables import TableColumn
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
    """A CSV file with a row for each muscle and pose, written during the comparison. SI units.

    Unless `every` is true, sweeps that do not move a muscle are left out, and so are the poses of sweeps around further
    poses (base > 0) at which both programs are equal. Moment arms are −∂l/∂q: about the joint that is swept; at random
    poses about the joint whose moment arm differs most, or is largest. Cells of values that mjwrap does not have are
    empty. dofs: the names of the degrees of freedom.
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
            for pair in batch.pairs:
                if pair.mjwrap is not None:
                    self._add(batch.motion, pair)

    def _add(self, motion: PoseSequence, pair: MusclePair) -> None:
        native, mine = pair.native, pair.mjwrap
        assert mine is not None
        found, gaps = outcomes(pair, motion), differences(native, mine)
        about, arms = _moment_arms(motion, pair, self._dofs)
        equal = found == Outcome.AGREE
        left_out = np.zeros(len(motion.at), dtype=np.bool_)
        if motion.continuous and not self._every:
            still = not slope(mine, motion)[
                pair.status == 0
            ].any()  # exactly 0 if no body of the muscle moves
            left_out = equal & (still or motion.base > 0)
        self.of += len(motion.at)
        self.rows += int((~left_out).sum())
        for k in np.flatnonzero(~left_out):
            there = pair.status[k] == 0
            own = [float(x[k]) if there else "" for x in (mine.length, mine.velocity, arms[1], gaps[2])]
            self._writer.writerow([
                motion.name, motion.base, float(motion.at[k]), pair.name, Outcome(int(found[k])).name,
                float(native.length[k]), own[0], float(native.velocity[k]), own[1],
                about[k], float(arms[0, k]), own[2], own[3],
                *(Fault(int(x.fault[k])).name for x in (native, mine)), int(pair.status[k]),
            ])  # fmt: skip

    def close(self) -> str:
        """Finish the file; return its size and the number of rows left out as text."""
        self._output.publish()
        size = f"{self._output.path.stat().st_size / 1e6:.1f} MB"
        if self.rows == self.of:
            return f"{counted(self.rows, 'row')}, {size}"
        return f"{self.rows} of {self.of} rows, {size}; all of them with --csv-all"


def _moment_arms(motion: PoseSequence, pair: MusclePair, dofs: list[str]) -> tuple[list[str], Array]:
    """Return the joint (T,) of each moment arm, and the moment arms of MuJoCo and mjwrap (2, T) [m]."""
    native, mine = pair.native, pair.mjwrap
    assert mine is not None
    count = len(motion.at)
    if motion.continuous:
        return [motion.name] * count, -np.array([slope(native, motion), slope(mine, motion)])
    gap, size = np.abs(mine.jacobian - native.jacobian), np.abs(native.jacobian)
    if not gap.size:
        return [""] * count, np.zeros((2, count))
    gap, size = gap / pair.arms, size / pair.arms
    place = np.where(gap.max(axis=1) > AGREE, gap.argmax(axis=1), size.argmax(axis=1))
    rows = np.arange(count)
    arms = -np.array([native.jacobian[rows, place], mine.jacobian[rows, place]])
    return [dofs[d] for d in place], arms


def write_tables(output: PartFile, given: Sequence[TableColumn]) -> None:
    """Write a CSV file with a row for each muscle and row of the given tables, with both programs' values. SI units."""
    writer = csv.writer(output.open_text())
    with output.writing():
        writer.writerow(_TABLES)
        for column in given:
            for k, time in enumerate(column.time.tolist()):
                figures = (float(x[k]) for x in (column.table, column.mujoco, column.mjwrap))
                cells = ["" if np.isnan(x) else x for x in figures]
                quantity = "moment arm" if column.about else "length"
                writer.writerow([time, column.muscle, quantity, column.about, *cells])
    output.publish()
