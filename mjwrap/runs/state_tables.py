"""States of a model over time from a table: positions, velocities and activations by name."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import TableError
from mjwrap.files import Table
from mjwrap.mjcf import act_names, dof_names, name_of, qpos_names
from mjwrap.mjcf.coordinate_functions import read_coordinate_functions
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.runs.angles import check_column, unit_taken
from mjwrap.runs.excitation import control_names
from mjwrap.runs.models import single_joints
from mjwrap.runs.run_table import MUSCLE_KINDS
from mjwrap.runs.tied_columns import place_tied
from mjwrap.system import MuscleSystem
from mjwrap.text import counted

Array = NDArray[np.float64]
_HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)


@dataclass(frozen=True)
class States:
    """States of a model over time.

    Attributes:
        time: (T,) times [s].
        qpos: (T, nq) positions.
        qvel: (T, nv) velocities.
        act: (T, na) activations.
        ctrl: (T, nu) controls.
        own: (T, 2n) activation and fibre length [m] of each muscle, used for muscles whose states are not in `act`.
        remarks: values that are missing from the table, and their substitutes.
    """

    time: Array
    qpos: Array
    qvel: Array
    act: Array
    ctrl: Array
    own: Array
    remarks: tuple[str, ...]

    def put(self, muscles: MuscleSystem, data: mujoco.MjData, k: int) -> None:
        """Write state k to data, and the states of muscles without an actuator to the muscles."""
        data.time = self.time[k]
        data.qpos[:], data.qvel[:], data.act[:], data.ctrl[:] = (
            self.qpos[k],
            self.qvel[k],
            self.act[k],
            self.ctrl[k],
        )
        without = [i for i, muscle in enumerate(muscles.declarations) if muscle.actuator < 0]
        if without:
            own = self.own[k].reshape(-1, 2)
            put_own(muscles, data, {i: (own[i, 0], own[i, 1]) for i in without})
            for i in without:
                muscles.excitation[i] = own[i, 0]  # the activation of a muscle without activation dynamics


def put_own(muscles: MuscleSystem, data: mujoco.MjData, own: Mapping[int, tuple[float, float]]) -> None:
    """Set activation and fibre length [m] of muscles (by number) that have no actuator with states in `act`."""
    branch = muscles.branch(data)
    rows = branch[len(branch) - 2 * muscles.n :].reshape(-1, 2)
    for i, pair in own.items():
        rows[i] = pair
    muscles.set_branch(data, branch)


def read_states(model: mujoco.MjModel, muscles: MuscleSystem, start: mujoco.MjData, table: Table) -> States:
    """Return the states in a table; values missing from it are those of the start.

    Columns: "qpos:JOINT", "qvel:JOINT", "act:ACTUATOR", "ctrl:ACTUATOR", "activation:MUSCLE", "fiber_length:MUSCLE" as
    in tables of `mjwrap run`; "qpos[3]" by index; a joint's name, "JOINT/value", "JOINT/speed", "MUSCLE/activation" and
    "MUSCLE/fiber_length" as in OpenSim's files, with or without a path before them. "act" overrides other columns for
    the same state. Hinges are in rad, or in degrees if the header says so. Velocities that are missing are computed
    as differences of the positions. Joints that are missing and follow others by equalities are where these put them.

    Args:
        model: the model.
        muscles: its muscles.
        start: data with the values for everything that is missing from the table.
        table: the table.

    Returns:
        The states.

    Raises:
        TableError: no column names a joint, the size of an array does not fit the model, or angles are so far outside
            a joint's range that only degrees explain them.
    """
    reader = _Reader(model, muscles, start, table)
    reader.check_widths()
    for column in sorted(table.names, key=lambda name: name.startswith(("act:", "act["))):
        reader.take(column)
    if not reader.found["qpos"]:
        known = ", ".join(qpos_names(model)) or "none"
        raise TableError(f"'{table.source}': no column names a joint; the model has: {known}")
    return reader.states()


class _Reader:
    """Sort columns into the arrays of a state."""

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
        branch = muscles.branch(start)
        self.arrays["own"] = np.tile(branch[len(branch) - 2 * muscles.n :], (len(table.time), 1))
        self.found: dict[str, set[int]] = {kind: set() for kind in self.arrays}
        self.unused: list[str] = []
        self._turned: dict[str, int] = {}  # joints by the columns of their positions
        self._muscles = set(muscles.names)
        self._functions = read_coordinate_functions(model)
        self._joints = single_joints(model)
        self._hinges = {n for n, j in self._joints.items() if int(model.jnt_type[j]) == _HINGE}
        # by muscle: the array and the index in it
        self._places: dict[str, dict[str, tuple[str, int]]] = {"activation": {}, "fiber_length": {}}
        self._of_muscles: set[int] = set()  # indices in act
        for i, muscle in enumerate(muscles.declarations):
            held = int(model.actuator_actnum[muscle.actuator]) if muscle.actuator >= 0 else 0
            own = muscle.actuator < 0
            array, first = ("own", 2 * i) if own else ("act", int(model.actuator_actadr[muscle.actuator]))
            if own or held:
                self._places["activation"][muscle.name] = array, first
                self._of_muscles.update(range(first, first + held))
            if muscle.parameters.states == 2 and (own or held == 2):
                self._places["fiber_length"][muscle.name] = array, first + 1

    def check_widths(self) -> None:
        """Raise `TableError` if an array has more columns than the model's or, in an NPZ file, fewer."""
        for kind, names in self.names.items():
            given = [int(m[1]) for m in (re.fullmatch(rf"{kind}\[(\d+)\]", n) for n in self.table.names) if m]
            count = max(given) + 1 if given else int(kind in self.table.names)
            whole = self.table.source.lower().endswith(".npz")
            if count > len(names) or (count and whole and count != len(names)):
                raise TableError(
                    f"'{self.table.source}': {kind} has {counted(count, 'column')}, the model {len(names)}: "
                    f"{_few(names) or 'none'}"
                )

    def take(self, column: str) -> None:
        """Copy a column to its place in a state."""
        for kind, place, turns in self._readings(column):
            values = self.table[column]
            self.arrays[kind][:, place] = np.radians(values) if turns and self.table.in_degrees else values
            if kind == "qpos" and turns:
                joint = self._joints[self.names[kind][place]]
                check_column(self.model, joint, self.table, column, own=column.startswith("qpos"))
                self._turned[column] = joint
            self.found[kind].add(place)
            return
        if not self._take_function(column):
            self.unused.append(column)

    def _take_function(self, column: str) -> bool:
        """Take a coordinate of which a joint is a function; return whether the column is one."""
        name = column.removesuffix("/value").rpartition("/")[2]
        function = self._functions.get(name)
        if function is None or not function.own:
            return False
        values = self.table[column]
        if function.turns and self.table.in_degrees:
            values = np.radians(values)
        place = int(self.model.jnt_qposadr[function.joint])
        self.arrays["qpos"][:, place] = [function.position(float(value)) for value in values]
        self.found["qpos"].add(place)
        return True

    def _readings(self, column: str) -> Iterator[tuple[str, int, bool]]:
        """Yield the possible places of a column, best first: array, index in it, whether it is a rotation."""
        for kind, names in self.names.items():
            if column.startswith(f"{kind}:") and column.removeprefix(f"{kind}:") in names:
                name = column.removeprefix(f"{kind}:")
                yield kind, names.index(name), self._turns(kind, name)
            number = column.removeprefix(f"{kind}[").removesuffix("]")
            if column == f"{kind}[{number}]" and number.isdigit() and int(number) < len(names):
                yield kind, int(number), self._turns(kind, names[int(number)])
            if column == kind and len(names) == 1:
                yield kind, 0, self._turns(kind, names[0])
        for kind, places in self._places.items():
            muscle = column.removeprefix(f"{kind}:").removesuffix(f"/{kind}").removesuffix(f".{kind}")
            if muscle != column and muscle.rpartition("/")[2] in places:
                yield *places[muscle.rpartition("/")[2]], False
        for ending, kind in (("/speed", "qvel"), ("_u", "qvel"), ("/value", "qpos"), ("", "qpos")):
            joint = column.removesuffix(ending).rpartition("/")[2]
            if column.endswith(ending) and ":" not in column and joint in self.names[kind]:
                yield kind, self.names[kind].index(joint), joint in self._hinges

    def _turns(self, kind: str, name: str) -> bool:
        """Return whether a value of a kind, of a joint, actuator or control, is an angle or a rate of one."""
        return kind in ("qpos", "qvel") and name in self._hinges

    def states(self) -> States:
        """Return the states; velocities that are missing are computed as differences."""
        arrays, model, time = self.arrays, self.model, self.table.time
        unit = unit_taken(model, self.table, self._turned)
        remarks = [unit] if unit else []
        placed = self._place_followers()
        tied = place_tied(model, self.start, self.table, arrays["qpos"], self.found["qpos"])
        if tied:
            dofs = [
                d for d in (int(model.joint(name).dofadr[0]) for name in tied) if d not in self.found["qvel"]
            ]
            arrays["qvel"][:, dofs] = _differences(model, time, arrays["qpos"])[:, dofs]
            remarks.append(
                f"{counted(len(tied), 'position')} missing, of joints that equalities tie to others: {_few(tied)}"
            )
        if placed:
            remarks.append(
                f"{counted(len(placed), 'position')} missing, of joints that follow others: {_few(placed)}"
            )
        left = [
            name
            for i, name in enumerate(self.names["qpos"])
            if i not in self.found["qpos"] and name not in placed and name not in tied
        ]
        if left:
            remarks.append(f"{counted(len(left), 'position')} missing, taken from the start: {_few(left)}")
        if not self.found["qvel"]:
            remarks.append("velocities are differences of the positions")
            arrays["qvel"] = _differences(model, time, arrays["qpos"])
        remarks += self._not_given()
        self.unused = [name for name in self.unused if not self._follows(name)]
        if self.unused:
            remarks.append(f"{counted(len(self.unused), 'column')} not used: {_few(self.unused)}")
        return States(time, **arrays, remarks=tuple(remarks))

    def _place_followers(self) -> list[str]:
        """Set joints that are missing, and follow joints of the table by equalities; return their names."""
        model, qpos, qvel = self.model, self.arrays["qpos"], self.arrays["qvel"]
        couplings = CoupledJoints(model)
        found = {kind: self.found[kind] for kind in ("qpos", "qvel")}
        missing = [
            joint
            for joint in couplings.leader
            if int(model.jnt_qposadr[joint]) not in found["qpos"]
            and any(int(model.jnt_qposadr[head]) in found["qpos"] for head in couplings.heads(joint))
        ]
        at, dofs = model.jnt_qposadr[missing], model.jnt_dofadr[missing]
        slow = [k for k, dof in enumerate(dofs.tolist()) if found["qvel"] and dof not in found["qvel"]]
        for row, speeds in zip(qpos, qvel, strict=True) if missing else ():
            pose, tangent = row.copy(), speeds.copy()
            couplings.place(pose)
            couplings.spread(pose, tangent)
            row[at] = pose[at]
            speeds[dofs[slow]] = tangent[dofs[slow]]
        return [name_of(model, mujoco.mjtObj.mjOBJ_JOINT, joint) for joint in missing]

    def _not_given(self) -> list[str]:
        """Return remarks on states of muscles and actuators that are missing from the table."""
        activations = [(name, *place) for name, place in self._places["activation"].items()]
        activations += [
            (name, "act", i) for i, name in enumerate(self.names["act"]) if i not in self._of_muscles
        ]
        fibers = [(name, *place) for name, place in self._places["fiber_length"].items()]
        remarks = []
        for what, places, instead in (
            ("activation", activations, "taken from the start"),
            ("fibre length", fibers, "taken from the start, or in static equilibrium"),
        ):
            left = [name for name, array, i in places if i not in self.found[array]]
            if left:
                remarks.append(
                    f"{len(left)} of {counted(len(places), what)} missing, {instead}: {_few(left)}"
                )
        return remarks

    def _follows(self, column: str) -> bool:
        """Return whether a column is a result of `mjwrap run`, which follows from the state."""
        kind, mark, name = column.partition(":")
        muscle = name.partition(":")[0] if kind == "moment_arm" else name
        return bool(mark) and kind in (*MUSCLE_KINDS, "moment_arm") and muscle in self._muscles


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
