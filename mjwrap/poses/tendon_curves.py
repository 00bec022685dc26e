"""Lengths and slopes of MuJoCo's own tendons at poses, beside the curves of mjwrap's paths."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import MjwrapError
from mjwrap.mjcf.inside import reference_pose
from mjwrap.mjcf.routes import build_routes, tendon_stops
from mjwrap.system import MuscleSystem

Array = NDArray[np.float64]


def native_tendons(muscles: MuscleSystem) -> dict[str, int]:
    """Return the tendon of every muscle whose route is that of its tendon; a placeholder tendon has another one."""
    model, found = muscles.model, dict[str, int]()
    rest = reference_pose(model)
    for muscle in muscles.declarations:
        if muscle.tendon < 0:
            continue
        try:
            stops = tendon_stops(model, rest, muscle.tendon, muscles.side_rule)
            if build_routes(model, muscle.name, stops) == muscle.routes:
                found[muscle.name] = muscle.tendon
        except MjwrapError:  # a tendon that mjwrap cannot read: its tuple has a route of its own
            continue
    return found


def tendon_rows(model: mujoco.MjModel, poses: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return lengths and slopes of all tendons (T, ntendon) at pairs of a pose (nq,) and its derivative (nv,)."""
    data = mujoco.MjData(model)
    length, slope = np.zeros((2, len(poses), model.ntendon))
    rows = np.zeros((model.ntendon, model.nv))
    for k, (qpos, tangent) in enumerate(poses):
        data.qpos[:] = qpos
        mujoco.mj_fwdPosition(model, data)
        home = model if hasattr(model, "ten_J_rownnz") else data  # in newer MuJoCo they are in the model
        layout = home.ten_J_rownnz, home.ten_J_rowadr, home.ten_J_colind.reshape(-1)
        mujoco.mju_sparse2dense(rows, data.ten_J.reshape(-1), *layout)
        length[k], slope[k] = data.ten_length, rows @ tangent
    return length, slope
