"""The table of a run: its columns, and its rows, in memory or in a file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import TableError
from mjwrap.files import RowWriter, Table
from mjwrap.files.atomic import PartFile
from mjwrap.files.writing import save_npz
from mjwrap.mjcf import act_names, dof_names, qpos_names
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.runs.excitation import control_names
from mjwrap.system import MuscleSystem
from mjwrap.system.moment_arms import arms_of_all_dofs, moved_muscles

Array = NDArray[np.float64]
MUSCLE_KINDS = ("activation", "fiber_length", "length", "velocity", "tension")
KINDS = ("qpos", "qvel", "act", "ctrl", *MUSCLE_KINDS, "moment_arm")
DEFAULT_KINDS = ("qpos", "qvel", "act", "ctrl", *MUSCLE_KINDS)


class Column(NamedTuple):
    """The columns of one kind: their names, and the function that reads their numbers at a sample."""

    names: list[str]
    read: Callable[[mujoco.MjData], Array]


def check_kinds(kinds: Iterable[str]) -> list[str]:
    """Return the kinds without repetition; `TableError`, which lists `KINDS`, for an unknown one."""
    found = list(dict.fromkeys(kinds))
    for kind in found:
        if kind not in KINDS:
            raise TableError(f"no kind '{kind}'; kinds: {', '.join(KINDS)}")
    return found


def columns(model: mujoco.MjModel, muscles: MuscleSystem, kinds: Sequence[str]) -> list[Column]:
    """Return the columns of the given kinds, each called KIND:NAME; SI units. Moment arms have couplings included."""
    found = []
    for kind in kinds:
        if kind == "moment_arm":
            found.append(_moment_arms(model, muscles))
            continue
        names = {"qpos": qpos_names, "qvel": dof_names, "act": act_names, "ctrl": control_names}
        named = muscles.names if kind in MUSCLE_KINDS else names[kind](model)
        owner = muscles if kind in MUSCLE_KINDS else None
        found.append(Column([f"{kind}:{name}" for name in named], _reader(owner, kind)))
    return found


def _reader(owner: MuscleSystem | None, kind: str) -> Callable[[mujoco.MjData], Array]:
    return lambda data: getattr(data if owner is None else owner, kind)


def _moment_arms(model: mujoco.MjModel, muscles: MuscleSystem) -> Column:
    """Return the moment arms of every muscle about the joints that move it, as `MuscleSystem.moment_arms` does."""
    dofs, couplings = dof_names(model), CoupledJoints(model)
    rows, places = np.nonzero(moved_muscles(model, couplings, muscles.declarations))
    names = [f"moment_arm:{muscles.names[i]}:{dofs[d]}" for i, d in zip(rows, places, strict=True)]

    def read(data: mujoco.MjData) -> Array:
        return arms_of_all_dofs(couplings, muscles.length_jacobian(data), data.qpos)[rows, places]

    return Column(names, read)


class RunTable:
    """Collect a row for every sample of a run in memory.

    kinds: names of `KINDS`; the function `columns` gives their columns. Raises `TableError` for an unknown kind.
    """

    def __init__(
        self, model: mujoco.MjModel, muscles: MuscleSystem, kinds: Iterable[str] = DEFAULT_KINDS
    ) -> None:
        self._columns = columns(model, muscles, check_kinds(kinds))
        self.names = tuple(name for column in self._columns for name in column.names)
        self._kept: list[tuple[float, Array]] = []

    def log(self, data: mujoco.MjData) -> None:
        """Store the present state; the muscles must have been evaluated at it."""
        self._kept.append((float(data.time), self._row(data)))

    def _row(self, data: mujoco.MjData) -> Array:
        return np.concatenate([np.empty(0), *(column.read(data) for column in self._columns)])

    def table(self) -> Table:
        """Return the table of all samples so far."""
        times = np.array([time for time, _ in self._kept])
        rows = np.array([row for _, row in self._kept]).reshape(len(times), len(self.names))
        return Table(times, self.names, rows)


class RunTableFile(RunTable):
    """Write a `RunTable` to a file: text during the run, so that a long run needs no memory; NPZ at the end."""

    def __init__(
        self,
        output: PartFile,
        model: mujoco.MjModel,
        muscles: MuscleSystem,
        kinds: Iterable[str] = DEFAULT_KINDS,
    ) -> None:
        super().__init__(model, muscles, kinds)
        self._output = output
        self._writer: RowWriter | None = None
        suffix = output.path.suffix.lower()
        if suffix != ".npz":
            with output.writing():
                self._writer = RowWriter(output.open_text(), suffix, self.names)

    def log(self, data: mujoco.MjData) -> None:
        """Write the present state; the muscles must have been evaluated at it."""
        if self._writer is None:
            super().log(data)
            return
        row = self._row(data)
        with self._output.writing():
            self._writer.add(data.time, row)

    def close(self) -> None:
        """Complete the file and give it its name."""
        with self._output.writing():
            if self._writer is not None:
                self._writer.finish()
            else:
                save_npz(self._output.part, self.table())
        self._output.publish()
