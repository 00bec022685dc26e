"""Sizes of muscles and joints, to which thresholds are relative: a model in millimetres is judged as in metres."""

from __future__ import annotations

import itertools
from collections.abc import Iterable

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf import MuscleDeclaration
from mjwrap.mjcf.conditional_points import holds

Array = NDArray[np.float64]
Leg = tuple[
    int, int, float
]  # sites of two neighbouring stops, and the factor of the distance in the muscle's length
LEAST = 1e-6  # smallest size of a muscle, as a share of the model's extent
_SLIDE, _FREE = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_FREE)


def turning_dofs(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Return which degrees of freedom (nv,) are angles; the others are lengths."""
    turning = np.asarray(model.jnt_type[model.dof_jntid] != _SLIDE, dtype=np.bool_)
    for joint in np.flatnonzero(model.jnt_type == _FREE):
        first = int(model.jnt_dofadr[joint])
        turning[first : first + 3] = False
    return turning


def route_size(
    model: mujoco.MjModel, poses: mujoco.MjData, legs: Iterable[Leg], geoms: Iterable[int]
) -> float:
    """Return the size of a route at the given poses [m]: the distances of its stops added up.

    If the stops coincide, it is the size of the largest surface. poses: with kinematics.
    """
    at = poses.site_xpos
    total = sum(weight * float(np.linalg.norm(at[b] - at[a])) for a, b, weight in legs)
    largest = max((float(model.geom_size[geom].max()) for geom in geoms), default=0.0)
    return max(total, largest, LEAST * float(model.stat.extent), 1e-300)


def muscle_size(model: mujoco.MjModel, poses: mujoco.MjData, muscle: MuscleDeclaration) -> float:
    """Return the size of a declared muscle at the given poses [m]."""
    legs: list[Leg] = []
    for route in (r for r in muscle.routes if holds(model, r.when, poses.qpos)):
        legs += [(a, b, route.weight) for a, b in itertools.pairwise(route.sites)]
    return route_size(model, poses, legs, muscle.geoms)
