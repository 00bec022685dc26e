"""Tells which sites lie inside a geom that a tendon wraps: a side site there makes MuJoCo hold the path inside."""

from __future__ import annotations

from zlib import crc32

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
POSES = 64
_SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)  # hinges come after it
_CYLINDER = int(mujoco.mjtGeom.mjGEOM_CYLINDER)


def is_beside(model: mujoco.MjModel, geom: int, site: int) -> bool:
    """Return whether a site never moves relative to a geom, as their bodies are the same or welded together."""
    first, second = int(model.geom_bodyid[geom]), int(model.site_bodyid[site])
    if first == second:
        return True
    welded = int(model.body_weldid[first]) == int(model.body_weldid[second])
    return welded and (model.nmocap == 0 or int(model.body_rootid[first]) == int(model.body_rootid[second]))


def end_is_inside(model: mujoco.MjModel, poses: mujoco.MjData, geom: int, site: int) -> bool:
    """Return whether a string that ends at a site ends inside a sphere, or a cylinder of any length, at these poses."""
    local = _local(poses, geom, site)
    if int(model.geom_type[geom]) == _CYLINDER:
        local = local[:2]
    return bool(np.linalg.norm(local) < model.geom_size[geom, 0] < np.inf)


def side_is_inside(model: mujoco.MjModel, poses: mujoco.MjData, geom: int, site: int) -> bool:
    """Return whether a side site is inside as MuJoCo judges it: nearer than the radius to the geom's centre.

    That holds for a cylinder too: a side site on its axis, but farther along, is not inside.
    """
    return bool(np.linalg.norm(_local(poses, geom, site)) < model.geom_size[geom, 0] < np.inf)


def shares_inside(model: mujoco.MjModel, pairs: list[tuple[int, int]]) -> Array:
    """Return for pairs of geom and end point (site) at which share of poses the end is inside (n,).

    Poses: joints anywhere in their ranges; those without limits, ball and free joints stay at the reference. Each joint
    draws by itself, seeded by what it is, so that the answer stays the same where the model is part of a larger one.
    """
    inside = np.zeros(len(pairs))
    if not pairs:
        return inside
    geoms, sites = np.array(pairs).T
    radius, level = model.geom_size[geoms, 0], model.geom_type[geoms] == _CYLINDER
    data = mujoco.MjData(model)
    joints = np.flatnonzero(np.asarray(model.jnt_limited, dtype=bool) & (model.jnt_type >= _SLIDE))
    low, high = model.jnt_range[joints].T
    what = [model.jnt_range, model.jnt_pos, model.jnt_axis, model.body_pos[model.jnt_bodyid]]
    seeds = [crc32(row.tobytes()) for row in np.concatenate(what, axis=1)[joints]]
    draws = np.array([np.random.default_rng(seed).random(POSES) for seed in seeds]).reshape(-1, POSES)
    for pose in draws.T:
        data.qpos[model.jnt_qposadr[joints]] = low + (high - low) * pose
        mujoco.mj_kinematics(model, data)
        offset = data.site_xpos[sites] - data.geom_xpos[geoms]
        along = np.einsum("ni,ni->n", offset, data.geom_xmat[geoms][:, 2::3])
        square = np.einsum("ni,ni->n", offset, offset) - np.where(level, along * along, 0.0)
        inside += square < radius * radius
    return inside / POSES


def _local(poses: mujoco.MjData, geom: int, site: int) -> Array:
    offset: Array = poses.site_xpos[site] - poses.geom_xpos[geom]
    return poses.geom_xmat[geom].reshape(3, 3).T @ offset
