"""States of a model over time, from a table: positions, velocities and activations by name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import MuscleSystem, Table
from mjwrap.cli.errors import UserError
from mjwrap.cli.models import single_joints
from mjwrap.cli.samples import KINDS
from mjwrap.excitation import control_names
from mjwrap.mjcf import act_names, dof_names, qpos_names
from mjwrap.wording import counted

Array = NDArray[np.float64]
_HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)


@dataclass(frozen=True)
class States:
    """States (T, ...): time [s], qpos, qvel, act, ctrl; remarks: what was not said, and what took its place."""

    time: Array
    qpos: Array
    qvel: Array
    act: Array
    ctrl: Array
    remarks: tuple[str, ...]

    def put(self, data: mujoco.MjData, k: int) -> None:
        """Put state k into data."""
        data.time = self.time[k]
        data.qpos[:], data.qvel[:], data.act[:], data.ctrl[:] = (
            self.qpos[k],
            self.qvel[k],
            self.act[k],
            self.ctrl[k],
        )


def read_states(model: mujoco.MjModel, muscles: MuscleSystem, start: mujoco.MjData, table: Table) -> States:
    """Return the states that a table holds; what it does not name stays as at the start.

    Columns: "qpos:JOINT", "qvel:JOINT", "act:ACTUATOR", "ctrl:ACTUATOR", "activation:MUSCLE" as `mjwrap run` writes
    them; "qpos[3]" by number; a joint's name, "JOINT/value", "JOINT/speed" and "MUSCLE/activation" as in OpenSim's
    files, with the path before them or without. Rotations are in rad, or in degrees where the header says so. Without
    velocities they are the differences of the positions. `UserError` where no column names a joint.
    """
    reader = _Reader(model, muscles, start, table)
    for column in table.names:
        reader.take(column)
    if not reader.found["qpos"]:
        known = ", ".join(qpos_names(model)) or "none"
        raise UserError(f"'{table.source}': no column names a joint; the model has: {known}")
    return reader.states()


class _Reader:
    """Sorts columns into the arrays of a state."""

    def __init__(
        self, model: mujoco.MjModel, muscles: MuscleSystem, start: mujoco.MjData, table: Table
    ) -> None:
        self.model, self.table, self.start = model, table, start
        self.names = {
            "qpos": qpos_names(model), "qvel": dof_names(model), "act": act_names(model), "ctrl": control_names(model),
        }  # fmt: skip
        self.arrays = {
            kind: np.tile(getattr(start, kind), (len(table.time), 1)).astype(np.float64)
            for kind in self.names
        }
        self.found: dict[str, set[int]] = {kind: set() for kind in self.names}
        self.unused: list[str] = []
        self._hinges = {n for n, j in single_joints(model).items() if int(model.jnt_type[j]) == _HINGE}
        self._states_of = {
            muscle.name: int(model.actuator_actadr[muscle.actuator])
            for muscle in muscles.declarations
            if muscle.actuator >= 0 and model.actuator_actnum[muscle.actuator]
        }

    def take(self, column: str) -> None:
        """Put a column where it belongs."""
        for kind, place, turns in self._readings(column):
            values = self.table[column]
            self.arrays[kind][:, place] = np.radians(values) if turns and self.table.in_degrees else values
            self.found[kind].add(place)
            return
        self.unused.append(column)

    def _readings(self, column: str) -> Iterator[tuple[str, int, bool]]:
        """Yield where a column may belong, best first: array, place in it, whether it is a rotation."""
        for kind, names in self.names.items():
            if column.startswith(f"{kind}:") and column.removeprefix(f"{kind}:") in names:
                yield kind, names.index(column.removeprefix(f"{kind}:")), False
            number = column.removeprefix(f"{kind}[").removesuffix("]")
            if column == f"{kind}[{number}]" and number.isdigit() and int(number) < len(names):
                yield kind, int(number), False
        muscle = column.removeprefix("activation:").removesuffix("/activation").removesuffix(".activation")
        muscle = muscle.rpartition("/")[2]
        if muscle != column and muscle in self._states_of:
            yield "act", self._states_of[muscle], False
        for ending, kind in (("/speed", "qvel"), ("_u", "qvel"), ("/value", "qpos"), ("", "qpos")):
            joint = column.removesuffix(ending).rpartition("/")[2]
            if column.endswith(ending) and ":" not in column and joint in self.names[kind]:
                yield kind, self.names[kind].index(joint), joint in self._hinges

    def states(self) -> States:
        """Return what was sorted, velocities from differences where there are none."""
        arrays, model, time = self.arrays, self.model, self.table.time
        remarks = []
        left = [name for i, name in enumerate(self.names["qpos"]) if i not in self.found["qpos"]]
        if left:
            remarks.append(f"{counted(len(left), 'position')} as at the start: {_few(left)}")
        if not self.found["qvel"]:
            remarks.append("velocities are differences of the positions")
            arrays["qvel"] = _differences(model, time, arrays["qpos"])
        if len(self.found["act"]) < model.na:
            remarks.append(
                f"{model.na - len(self.found['act'])} of {counted(model.na, 'activation')} not given: as at the start"
            )
        self.unused = [name for name in self.unused if name.partition(":")[0] not in KINDS]
        if self.unused:
            remarks.append(f"{counted(len(self.unused), 'column')} not about the state: {_few(self.unused)}")
        return States(time, **arrays, remarks=tuple(remarks))


def _few(names: list[str]) -> str:
    return ", ".join(names[:5]) + (", ..." if len(names) > 5 else "")


def _differences(model: mujoco.MjModel, time: Array, qpos: Array) -> Array:
    """Return velocities (T, nv) from positions (T, nq): second order inside, first order at the ends."""
    found = np.zeros((len(time), model.nv))
    for k in range(len(time)):
        a, b = max(k - 1, 0), min(k + 1, len(time) - 1)
        if b == a:
            continue
        if b - a == 1:
            mujoco.mj_differentiatePos(model, found[k], time[b] - time[a], qpos[a], qpos[b])
            continue
        before, after = np.zeros(model.nv), np.zeros(model.nv)
        h, g = time[k] - time[a], time[b] - time[k]
        mujoco.mj_differentiatePos(model, before, h, qpos[a], qpos[k])
        mujoco.mj_differentiatePos(model, after, g, qpos[k], qpos[b])
        found[k] = (g * before + h * after) / (h + g)
    return found
