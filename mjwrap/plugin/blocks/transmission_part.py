"""Write the part of a block that gives actuators length, velocity and moment along mjwrap's paths."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf import MuscleDeclaration
from mjwrap.model.arrays import Plan
from mjwrap.model.kinematic_tree import last_dofs
from mjwrap.model.moment_columns import check_moment_columns
from mjwrap.plugin.blocks.length_sensors import length_sensors
from mjwrap.plugin.callbacks import transmission as tr
from mjwrap.plugin.mujoco_c.offsets import offsets
from mjwrap.plugin.spec.tendon_uses import shown_tendons

Ints = NDArray[np.int64]


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
