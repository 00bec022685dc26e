"""Write the part of a block that gives actuators length, velocity and moment along mjwrap's paths."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import ModelError
from mjwrap.kernels.coupling import muscle_paths
from mjwrap.mjcf import MuscleDeclaration, name_of
from mjwrap.model.arrays import Plan
from mjwrap.model.kinematic_tree import last_dofs, moving_dofs
from mjwrap.plugin.blocks.length_sensors import length_sensors
from mjwrap.plugin.callbacks import transmission as tr
from mjwrap.plugin.mujoco_c.offsets import offsets
from mjwrap.plugin.spec.tendon_uses import shown_tendons

Ints = NDArray[np.int64]
OBJ = mujoco.mjtObj


def _columns(model: mujoco.MjModel, actuator: int) -> set[int]:
    """Return the dofs for which MuJoCo stores the moment of an actuator: those that move its tendon's bodies."""
    tendon = int(model.actuator_trnid[actuator, 0])
    first = int(model.ten_J_rowadr[tendon])
    return {int(dof) for dof in model.ten_J_colind[first : first + int(model.ten_J_rownnz[tendon])]}


def check_moment_columns(model: mujoco.MjModel, plan: Plan, muscles: list[MuscleDeclaration]) -> None:
    """Raise `ModelError` if the path of a muscle depends on a dof for which MuJoCo stores no moment of its actuator."""
    moves = moving_dofs(model)
    for route in plan.routes:
        muscle = muscles[int(route[muscle_paths.R_MUSCLE])]
        if plan.output[route[muscle_paths.R_MUSCLE]] < 0:
            continue
        stops = plan.links[route[muscle_paths.R_LO] : route[muscle_paths.R_HI], muscle_paths.L_BODY].tolist()
        bodies = [int(route[muscle_paths.R_FROM_BODY]), *stops, int(route[muscle_paths.R_TO_BODY])]
        moved = {body: set(np.flatnonzero(moves[body]).tolist()) for body in bodies}
        stored = _columns(model, muscle.actuator) | set.intersection(*moved.values())
        for body, dofs in moved.items():
            if not dofs <= stored:
                tendon = name_of(model, OBJ.mjOBJ_TENDON, int(model.actuator_trnid[muscle.actuator, 0]))
                raise ModelError(
                    f"muscle '{muscle.name}': its path runs over body '{name_of(model, OBJ.mjOBJ_BODY, body)}', which "
                    f"tendon '{tendon}' does not touch, so MuJoCo does not store its moment there; let the tendon "
                    f"pass a site on that body, or use mode 'wrench'"
                )


def transmission_part(model: mujoco.MjModel, plan: Plan, muscles: list[MuscleDeclaration]) -> Ints:
    """Return the part of the block that `callbacks/transmission.py` reads, as 64-bit integers."""
    head = np.zeros(tr.HEAD, dtype=np.int64)
    head[tr.COUNT] = np.count_nonzero(plan.output >= 0)
    if not head[tr.COUNT]:
        return head
    check_moment_columns(model, plan, muscles)
    shown = shown_tendons(model, muscles)
    pulled = [int(model.actuator_trnid[m.actuator, 0]) if m.actuator >= 0 else -1 for m in muscles]
    tendons = np.array(
        [t if out >= 0 and t in shown else -1 for t, out in zip(pulled, plan.output, strict=True)],
        dtype=np.int64,
    )
    by_output = {int(out): m for m, out in enumerate(plan.output) if out >= 0}
    sensors = length_sensors(
        model, by_output, {int(tendon): m for m, tendon in enumerate(tendons) if tendon >= 0}
    )
    head[tr.DOFS], head[tr.OUTPUTS], head[tr.MOMENTS] = model.nv, model.nout, model.nJmom
    head[tr.TENDONS], head[tr.TENDON_MOMENTS] = model.ntendon, model.nJten
    head[tr.SENSORS], head[tr.SENSOR_NUMBERS] = len(sensors), model.nsensordata
    head[tr.NO_SENSORS] = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    fields = offsets().data | offsets().model
    head[tr.CDOF : tr.CDOF + len(tr.FIELDS)] = [fields[name] for name in tr.FIELDS]
    arrays: dict[str, Any] = {
        "output": plan.output,
        "tendon": tendons,
        "tendon_row": np.where(tendons >= 0, model.ten_J_rowadr[tendons], 0).astype(np.int64),
        "last_dof": last_dofs(model),
        "dof_parentid": np.array(model.dof_parentid, dtype=np.int64),
        "row": np.zeros(model.nv),
        "sensor": np.array([s[:3] for s in sensors], dtype=np.int64),
        "limits": np.array([(-s[3], s[3]) for s in sensors]),
    }
    pieces = [head]
    for place, name in enumerate(tr.ARRAYS, start=tr.A_OUTPUT):
        head[place] = 8 * sum(len(piece) for piece in pieces)
        pieces.append(np.ascontiguousarray(arrays[name]).ravel().view(np.int64))
    return np.concatenate(pieces)
