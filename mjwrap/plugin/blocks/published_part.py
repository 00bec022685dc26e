"""Write the part of a block that shows the results of muscles that act by wrenches in MuJoCo's own arrays."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf import MuscleDeclaration
from mjwrap.model.arrays import Plan
from mjwrap.plugin.blocks.length_sensors import length_sensors
from mjwrap.plugin.callbacks import publishing as pb
from mjwrap.plugin.mujoco_c.offsets import offsets
from mjwrap.plugin.spec.force_sensors import hidden_forces
from mjwrap.plugin.spec.tendon_uses import shown_tendons, tendon_of

Ints = NDArray[np.int64]


def _shown(
    model: mujoco.MjModel, plan: Plan, muscles: list[MuscleDeclaration], left_out: set[int]
) -> list[list[int]]:
    """Return the rows of `shown` (`callbacks/publishing.py`)."""
    tendons, hidden = shown_tendons(model, muscles), hidden_forces(model, muscles, left_out)
    rows: list[list[int]] = []
    for m, muscle in enumerate(muscles):
        if plan.output[m] >= 0:
            continue  # MuJoCo's own actuator pulls
        output = int(model.actuator_outadr[muscle.actuator]) if muscle.actuator >= 0 else -1
        tendon = tendon_of(model, muscle)
        rows.append([m, output, tendon if tendon in tendons else -1, int(muscle.name not in hidden)])
    return [row for row in rows if row[pb.S_OUTPUT] >= 0 or row[pb.S_TENDON] >= 0]


def published_part(
    model: mujoco.MjModel, plan: Plan, muscles: list[MuscleDeclaration], left_out: set[int]
) -> Ints:
    """Return the part of the block that `callbacks/publishing.py` reads, as 64-bit integers.

    left_out: tendons that the running model leaves out.
    """
    head = np.zeros(pb.HEAD, dtype=np.int64)
    rows = _shown(model, plan, muscles, left_out)
    head[pb.COUNT] = len(rows)
    if not rows:
        return head
    sensors = length_sensors(
        model,
        {row[pb.S_OUTPUT]: k for k, row in enumerate(rows) if row[pb.S_OUTPUT] >= 0},
        {row[pb.S_TENDON]: k for k, row in enumerate(rows) if row[pb.S_TENDON] >= 0},
    )
    head[pb.OUTPUTS], head[pb.TENDONS] = model.nout, model.ntendon
    head[pb.SENSORS], head[pb.SENSOR_NUMBERS] = len(sensors), model.nsensordata
    head[pb.NO_SENSORS] = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    fields = offsets().data | offsets().model
    head[pb.LENGTH : pb.LENGTH + len(pb.FIELDS)] = [fields[name] for name in pb.FIELDS]
    arrays = {
        "shown": np.array(rows, dtype=np.int64),
        "sensor": np.array([s[:3] for s in sensors], dtype=np.int64),
        "limits": np.array([(-s[3], s[3]) for s in sensors], dtype=np.float64),
    }
    pieces = [head]
    for place, name in enumerate(pb.ARRAYS, start=pb.A_SHOWN):
        head[place] = 8 * sum(len(piece) for piece in pieces)
        pieces.append(np.ascontiguousarray(arrays[name]).ravel().view(np.int64))
    return np.concatenate(pieces)
