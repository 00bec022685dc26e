"""Test which sites lie inside a wrapped geom: with a side site inside, MuJoCo holds the path inside."""

from __future__ import annotations

from zlib import crc32

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.kernels.layout import AS_WRITTEN
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.mjcf.joint_ranges import joint_range

Array = NDArray[np.float64]
POSES = 64
DEEP = (
    1.0 - AS_WRITTEN
)  # an end is inside if its distance from centre or axis is less than this share of the radius
_SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)  # the type of hinges is larger
_CYLINDER = int(mujoco.mjtGeom.mjGEOM_CYLINDER)


def is_beside(model: mujoco.MjModel, geom: int, site: int) -> bool:
    """Return whether a site cannot move relative to a geom, because their bodies are the same or welded together."""
    first, second = int(model.geom_bodyid[geom]), int(model.site_bodyid[site])
    if first == second:
        return True
    welded = int(model.body_weldid[first]) == int(model.body_weldid[second])
    return welded and (model.nmocap == 0 or int(model.body_rootid[first]) == int(model.body_rootid[second]))


def reference_pose(model: mujoco.MjModel) -> mujoco.MjData:
    """Return the kinematics at qpos0, with joints that follow others where these put them."""
    return _kinematics(model, model.qpos0)


def is_inside_at_keyframes(model: mujoco.MjModel, geom: int, site: int) -> bool:
    """Return whether a site lies inside a geom at every keyframe, as `end_is_inside`; true without keyframes."""
    return all(end_is_inside(model, _kinematics(model, pose), geom, site) for pose in model.key_qpos)


def _kinematics(model: mujoco.MjModel, qpos: Array) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    CoupledJoints(model).place(data.qpos)
    mujoco.mj_kinematics(model, data)
    return data


def end_is_inside(model: mujoco.MjModel, poses: mujoco.MjData, geom: int, site: int) -> bool:
    """Return whether a site lies inside a sphere geom, or a cylinder geom of any length, at the given poses.

    A site that a number with six digits may have put there from the surface is not inside (`layout.AS_WRITTEN`).
    """
    local = _local(poses, geom, site)
    if int(model.geom_type[geom]) == _CYLINDER:
        local = local[:2]
    return bool(np.linalg.norm(local) < DEEP * model.geom_size[geom, 0] < np.inf)


def side_is_inside(model: mujoco.MjModel, poses: mujoco.MjData, geom: int, site: int) -> bool:
    """Return whether a side site counts as inside in MuJoCo: nearer to the geom's centre than the radius.

    This also applies to a cylinder: a side site on its axis that is farther from the centre is not inside.
    """
    return bool(np.linalg.norm(_local(poses, geom, site)) < model.geom_size[geom, 0] < np.inf)


def shares_inside(model: mujoco.MjModel, pairs: list[tuple[int, int]]) -> Array:
    """Return, for pairs of geom and end point (site), the share of poses at which the end is inside (n,).

    Poses: joints at random in their ranges; joints without one, ball and free joints stay at the reference, and
    joints that follow others by an equality are where these put them. Each joint has a random generator of its own,
    seeded by its properties, so that the result is the same if the model is part of a larger one.
    """
    inside = np.zeros(len(pairs))
    if not pairs:
        return inside
    geoms, sites = np.array(pairs).T
    radius, level = model.geom_size[geoms, 0], model.geom_type[geoms] == _CYLINDER
    data, coupled = mujoco.MjData(model), CoupledJoints(model)
    sliding = np.flatnonzero(model.jnt_type >= _SLIDE).tolist()
    joints = np.array([j for j in sliding if joint_range(model, j) is not None], dtype=np.int64)
    low, high = model.jnt_range[joints].T
    what = [model.jnt_range, model.jnt_pos, model.jnt_axis, model.body_pos[model.jnt_bodyid]]
    seeds = [crc32(row.tobytes()) for row in np.concatenate(what, axis=1)[joints]]
    draws = np.array([np.random.default_rng(seed).random(POSES) for seed in seeds]).reshape(-1, POSES)
    for pose in draws.T:
        data.qpos[model.jnt_qposadr[joints]] = low + (high - low) * pose
        coupled.place(data.qpos)
        mujoco.mj_kinematics(model, data)
        offset = data.site_xpos[sites] - data.geom_xpos[geoms]
        along = np.einsum("ni,ni->n", offset, data.geom_xmat[geoms][:, 2::3])
        square = np.einsum("ni,ni->n", offset, offset) - np.where(level, along * along, 0.0)
        inside += square < (DEEP * radius) ** 2
    return inside / POSES


def _local(poses: mujoco.MjData, geom: int, site: int) -> Array:
    offset: Array = poses.site_xpos[site] - poses.geom_xpos[geom]
    return poses.geom_xmat[geom].reshape(3, 3).T @ offset
