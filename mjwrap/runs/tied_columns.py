"""Positions that a table of a motion lacks, of joints that equalities tie to those in the table."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import StateError, TableError
from mjwrap.files.table import Table
from mjwrap.mjcf import name_of
from mjwrap.system.projection import Projection

RECORDED = 1e-3  # [m or rad] error of an equality that a recorded motion may have
_SCALAR = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


def place_tied(
    model: mujoco.MjModel, start: mujoco.MjData, table: Table, qpos: NDArray[np.float64], found: set[int]
) -> list[str]:
    """Set joints that are missing so that the equalities hold, in place; return their names.

    start: data with the equalities. qpos (T, nq): the motion, with the columns `found` from the table and joints that
    follow by couplings in place. Raises `TableError`, which names the time, if no pose satisfies the equalities.
    """
    projection, data = Projection(model), mujoco.MjData(model)
    if not len(qpos) or not projection.equalities.active(start):
        return []
    data.qpos[:], data.eq_active[:] = start.qpos, start.eq_active
    data.mocap_pos[:], data.mocap_quat[:] = start.mocap_pos, start.mocap_quat
    tied = projection.tied(data, qpos[0])[model.jnt_dofadr]
    at = model.jnt_qposadr
    single = [j for j in range(model.njnt) if int(model.jnt_type[j]) in _SCALAR and tied[j]]
    missing = [j for j in single if int(at[j]) not in found]
    if not missing:
        return []
    given = [
        j
        for j in range(model.njnt)
        if int(model.jnt_type[j]) in _SCALAR and int(at[j]) in found and j not in projection.couplings.leader
    ]
    left = np.setdiff1d(np.arange(model.nq), list(found))
    others = np.setdiff1d(list(found), at[given])
    for time, row in zip(table.time, qpos, strict=True):
        data.qpos[others] = row[others]
        try:
            pose = projection.place(data, {j: float(row[at[j]]) for j in given}, RECORDED)
        except StateError as error:
            raise TableError(f"'{table.source}', time {time:g} s: {error}") from None
        data.qpos[:] = pose
        row[left] = pose[left]
    return [name_of(model, mujoco.mjtObj.mjOBJ_JOINT, j) for j in missing]
