"""Poses at which no path has a continuous moment arm: ties of equally long ways round a sphere, and kinks.

A string that is held inside a geom, as with MuJoCo's side site inside, has to come back to the geom as soon as one of
its ends has left it; there is a kink.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from mjwrap.kernels import layout
from mjwrap.kernels.coupling import muscle_paths
from mjwrap.mjcf.conditional_points import holds
from mjwrap.paths import Status
from mjwrap.surfaces import Sphere
from mjwrap.system import MuscleSystem

TIE = "the line between its neighbours passes through a sphere's centre, so that all ways round are equally long"
KINK = "two of its stops coincide, or an end lies on the surface in which the string is held"
NEAR = 1e-6  # largest angle from a tie [rad], and distance from a kink as a share of the muscle's size


def moment_arm_break(muscles: MuscleSystem, data: mujoco.MjData, i: int, size: float) -> str:
    """Return why muscle i, of this size [m], has no moment arm at the last evaluation, of data; empty if it has one."""
    last, plan = muscles._evaluation(), muscles._plan
    for c in np.flatnonzero(plan.routes[:, muscle_paths.R_MUSCLE] == i):
        for row in last.node[plan.routes[c, muscle_paths.R_LO] : plan.routes[c, muscle_paths.R_HI]]:
            if row[layout.KIND] == layout.SPHERE and row[layout.S_MODE] == layout.TOUCHED:
                radius = float(row[layout.DIM])
                straight = (float(row[layout.W_L]), float(row[layout.W_LQ]))
                swept = float(row[layout.S_ARC]) / radius + sum(math.atan(l / radius) for l in straight)
                if not row[layout.INSIDE] and abs(swept - math.pi) <= NEAR:
                    return TIE
    poses = muscles.poses(data)
    model = muscles.model
    for route in (r for r in muscles.declarations[i].routes if holds(model, r.when, poses.qpos)):
        if (np.linalg.norm(np.diff(poses.site_xpos[route.sites], axis=0), axis=1) <= NEAR * size).any():
            return KINK
        for node, *ends in route.geom_ends():
            if node.inside and any(_on_surface(model, poses, node.geom, end, size) for end in ends):
                return KINK
    return ""


def lacks_minimum(muscles: MuscleSystem, data: mujoco.MjData, i: int) -> bool:
    """Return whether muscle i has no path at the last evaluation, of data, as no way round a sphere is shortest."""
    if muscles.status[i] != Status.NOT_MINIMAL:
        return False
    poses = muscles.poses(data)
    for route in (r for r in muscles.declarations[i].routes if holds(muscles.model, r.when, poses.qpos)):
        for node, *ends in route.geom_ends():
            if isinstance(node.surface, Sphere) and not node.inside:
                a, b = (poses.site_xpos[end] - poses.geom_xpos[node.geom] for end in ends)
                size = float(np.linalg.norm(a) * np.linalg.norm(b))
                if a @ b < 0.0 and float(np.linalg.norm(np.cross(a, b))) <= NEAR * size:
                    return True
    return False


def _on_surface(model: mujoco.MjModel, poses: mujoco.MjData, geom: int, site: int, size: float) -> bool:
    """Return whether a site lies on the surface of a sphere or endless cylinder geom."""
    local = poses.geom_xmat[geom].reshape(3, 3).T @ (poses.site_xpos[site] - poses.geom_xpos[geom])
    if int(model.geom_type[geom]) == int(mujoco.mjtGeom.mjGEOM_CYLINDER):
        local = local[:2]
    return abs(float(np.linalg.norm(local)) - float(model.geom_size[geom, 0])) <= NEAR * size
