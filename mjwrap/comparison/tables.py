"""Compare lengths and moment arms from another program with those of MuJoCo and mjwrap at the same poses.

OpenSim's MuscleAnalysis writes such tables: lengths of all muscles over time, and moment arms about one coordinate in
each file. Models of the same person in two programs seldom have the same zero of length, so the difference is
reported with and without its mean.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.comparison.motion import pristine
from mjwrap.comparison.paired_evaluation import Comparer
from mjwrap.errors import TableError
from mjwrap.files import Table
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.system import CableSystem, MuscleSystem

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TableDifference:
    """The difference of one program from a table for one muscle: program minus table, over all rows with a path.

    Attributes:
        muscle: name of the muscle.
        program: "MuJoCo" or "mjwrap".
        quantity: "length" [m] or "moment arm" [m].
        about: the joint of the moment arm, or "".
        rows: number of rows that count.
        mean: mean difference [m].
        rms: root mean square of the difference [m].
        spread: root mean square about the mean [m].
        largest: largest difference [m].
        time: time of the largest difference [s].
        value: the program's value at this time [m].
        table: the table's value at this time [m].
    """

    muscle: str
    program: str
    quantity: str
    about: str
    rows: int
    mean: float
    rms: float
    spread: float
    largest: float
    time: float
    value: float
    table: float


class TableColumn(NamedTuple):
    """A column of a table, and the values of both programs, (T,) each: nan where a program has no path.

    about: the joint of the moment arms [m], or "" for lengths [m].
    """

    muscle: str
    about: str
    time: Array
    table: Array
    mujoco: Array
    mjwrap: Array


def compare_tables(
    model: mujoco.MjModel,
    time: Array,
    qpos: Array,
    lengths: Table | None = None,
    moment_arms: Mapping[str, Table] | None = None,
    *,
    side_rule: int | None = None,
    each: Callable[[TableColumn], object] | None = None,
) -> list[TableDifference]:
    """Compare MuJoCo's tendons and mjwrap's paths with tables of another program, muscle by muscle.

    A column belongs to the muscle of its name; a path before the name and the prefixes of `mjwrap run --columns` are
    ignored. Values of a table are compared at its own times, at poses that are interpolated linearly in the motion. A
    tendon that is only a placeholder for another route is not compared.

    Args:
        model: the model.
        time: (T,) times of the motion [s].
        qpos: (T, nq) the motion.
        lengths: a table of lengths [m].
        moment_arms: tables of moment arms [m] by the joint's name, positive where the muscle's tension increases the
            coordinate. As in OpenSim, joints that follow the joint by an equality move with it.
        side_rule: of mjwrap's paths, as for `MuscleSystem`.
        each: called with the curves of every muscle in the tables.

    Returns:
        The differences.

    Raises:
        TableError: a table has none of the muscles, or rows outside the motion.
    """
    model = pristine(model)
    found: list[TableDifference] = []
    if lengths is not None:
        found += _compare(model, time, qpos, lengths, "", side_rule, each)
    for joint, table in (moment_arms or {}).items():
        found += _compare(model, time, qpos, table, joint, side_rule, each)
    return found


def _compare(
    model: mujoco.MjModel, time: Array, qpos: Array, table: Table, joint: str, side_rule: int | None,
    each: Callable[[TableColumn], object] | None,
) -> list[TableDifference]:  # fmt: skip
    dof = _dof(model, joint) if joint else -1
    muscles = CableSystem(model, side_rule=side_rule)
    known = [*muscles.names, *muscles.native]
    columns = {_muscle_of(name, joint): table[name] for name in table.names}
    if not set(columns) & set(known):
        raise TableError(
            f"'{table.source}' has no column for any of the muscles; columns: {', '.join(list(columns)[:8])}; "
            f"muscles: {', '.join(known[:8])}"
        )
    slack = 1e-6 * float(np.ptp(time))  # times are written with a few digits
    if table.time[0] < time[0] - slack or table.time[-1] > time[-1] + slack:
        raise TableError(
            f"'{table.source}' goes from {table.time[0]:g} to {table.time[-1]:g} s, the motion from {time[0]:g} to "
            f"{time[-1]:g} s"
        )
    poses = np.stack([np.interp(table.time, time, column) for column in qpos.T], axis=1)
    comparer, couplings = Comparer(muscles, known), CoupledJoints(model)
    native = {name: t for name, t in _tendons(muscles).items() if name not in comparer.left_out}
    values = {("MuJoCo", name): np.full(len(poses), np.nan) for name in native}
    values |= {("mjwrap", name): np.full(len(poses), np.nan) for name in muscles.names}
    for k, pose in enumerate(poses):
        length, _, jacobian = comparer.native_at(pose, np.zeros(model.nv))
        own_length, _, own_jacobian, status = comparer.mjwrap_at(pose, np.zeros(model.nv))
        along = _direction(couplings, pose, dof, model.nv) if dof >= 0 else None
        for name, tendon in native.items():
            values["MuJoCo", name][k] = length[tendon] if along is None else -jacobian[tendon] @ along
        for i, name in enumerate(muscles.names):
            if status[i] == 0:
                values["mjwrap", name][k] = own_length[i] if along is None else -own_jacobian[i] @ along
    absent = np.full(len(poses), np.nan)
    for name in known:
        if name in columns and each is not None:
            both = [values.get((program, name), absent) for program in ("MuJoCo", "mjwrap")]
            each(TableColumn(name, joint, table.time, columns[name], *both))
    told = [
        _difference(name, program, joint, table.time, value, columns[name])
        for (program, name), value in values.items()
        if name in columns and np.isfinite(value - columns[name]).any()
    ]
    return sorted(told, key=lambda d: (known.index(d.muscle), d.program))


def _direction(couplings: CoupledJoints, pose: Array, dof: int, nv: int) -> Array:
    """Return dq (nv,) as a degree of freedom moves with all that follow it; alone if it follows another one."""
    place = np.flatnonzero(couplings.independent == dof)
    return couplings.matrix(pose)[:, place[0]] if place.size else np.eye(nv)[dof]


def _difference(
    muscle: str, program: str, joint: str, time: Array, value: Array, wanted: Array
) -> TableDifference:
    good = np.isfinite(value - wanted)
    gap = (value - wanted)[good]
    k = int(np.argmax(np.abs(gap)))
    at = tuple(float(x[good][k]) for x in (time, value, wanted))
    rms, quantity = float(np.sqrt(np.mean(gap**2))), "moment arm" if joint else "length"
    return TableDifference(
        muscle,
        program,
        quantity,
        joint,
        len(gap),
        float(gap.mean()),
        rms,
        float(np.std(gap)),
        float(gap[k]),
        *at,
    )


def _tendons(muscles: MuscleSystem) -> dict[str, int]:
    """Return the tendon of every muscle that has one, those that stay native among them."""
    model = muscles.model
    found = {m.name: m.tendon for m in muscles.declarations if m.tendon >= 0}
    for name in muscles.native:
        actuator = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
        if actuator >= 0 and int(model.actuator_trntype[actuator]) == int(mujoco.mjtTrn.mjTRN_TENDON):
            found[name] = int(model.actuator_trnid[actuator, 0])
    return found


def _muscle_of(column: str, joint: str) -> str:
    """Return the muscle that a column is of: /forceset/MUSCLE, length:MUSCLE, moment_arm:MUSCLE:JOINT."""
    if not joint:
        return column.rsplit("/", 1)[-1].removeprefix("length:")
    return column.rsplit("/", 1)[-1].removeprefix("moment_arm:").removesuffix(f":{joint}")


def _dof(model: mujoco.MjModel, joint: str) -> int:
    """Return the degree of freedom of a hinge or slide."""
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
    single = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    if index < 0 or int(model.jnt_type[index]) not in single:
        names = [model.joint(j).name for j in range(model.njnt) if int(model.jnt_type[j]) in single]
        raise TableError(
            f"no hinge or slide '{joint}' for a table of moment arms; joints: {', '.join(names)}"
        )
    return int(model.jnt_dofadr[index])
