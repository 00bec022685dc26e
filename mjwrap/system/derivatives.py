"""Compute the rate of the length Jacobian of a MuscleSystem along a motion."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap import validation
from mjwrap.errors import GeometryError, PathError, StateError
from mjwrap.kernels.coupling import jacobian_rate, muscle_paths
from mjwrap.kernels.solved import hessian
from mjwrap.mjcf import name_of
from mjwrap.paths.derivatives import FAULTS
from mjwrap.system.results import Results
from mjwrap.system.state import State

Array = NDArray[np.float64]


def length_jacobian_rate(muscles: Results, state: State, direction: ArrayLike | None) -> Array:
    """Return the rate (n, nv) of dl/dq along `direction` (nv,), or along qvel, at the poses of the last evaluation."""
    model, plan, scratch = muscles.model, muscles._plan, state.scratch
    for i in np.flatnonzero(state.status):
        raise PathError(
            f"muscle '{muscles.names[i]}' has no path, so its derivatives do not exist: {muscles.reason(int(i))}"
        )
    if direction is not None:
        given = validation.numbers(direction, "direction", StateError)
        if given.shape != (model.nv,) or not np.isfinite(given).all():
            raise StateError(f"direction must be finite and have shape ({model.nv},), not {given.shape}")
        scratch.qvel[:] = given
        mujoco.mj_comVel(model, scratch)
    longest = max((int(r[muscle_paths.R_HI] - r[muscle_paths.R_LO]) for r in plan.routes), default=0) + 2
    work = (np.empty((longest, 6)), np.empty((longest, 6)), np.empty((longest, 6)))
    points = np.empty((longest, hessian.POINT_ROW))
    jacobian = np.zeros((plan.n, model.nv))
    kinematics = (
        *muscles._dofs, muscles._parent, *_joints(model), muscles._root,
        scratch.cvel, scratch.cdof, scratch.cdof_dot, scratch.subtree_com,
    )  # fmt: skip
    fault, route, slot = jacobian_rate.length_jacobian_rate(
        plan.routes, plan.weights, plan.links, scratch.site_xpos, state.node, state.count, kinematics,
        plan.uses, state.slopes, scratch.qvel, *work, np.arange(longest), points, jacobian,
    )  # fmt: skip
    if fault != hessian.NO_FAULT:
        row = plan.routes[route]
        name = muscles.names[int(row[muscle_paths.R_MUSCLE])]
        where = _slot(model, plan.links, row, slot)
        raise GeometryError(f"muscle '{name}': dl/dq has no rate here: {FAULTS[fault].format(where)}")
    return jacobian


def _joints(model: mujoco.MjModel) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the body of every dof (nv,), and whether it is a rotation of a ball or free joint (nv,)."""
    kind = model.jnt_type[model.dof_jntid]
    first = model.jnt_dofadr[model.dof_jntid]
    ball = kind == int(mujoco.mjtJoint.mjJNT_BALL)
    free = (kind == int(mujoco.mjtJoint.mjJNT_FREE)) & (np.arange(model.nv) >= first + 3)
    return np.asarray(model.dof_bodyid, dtype=np.int64), ball | free


def _slot(model: mujoco.MjModel, links: NDArray[np.int64], route: NDArray[np.int64], slot: int) -> str:
    """Return the name of the site or geom in a slot of a route."""
    lo, hi = route[muscle_paths.R_LO], route[muscle_paths.R_HI]
    if slot in (0, hi - lo + 1):
        site, geom = route[muscle_paths.R_FROM if slot == 0 else muscle_paths.R_TO], -1
    else:
        site, geom = links[lo + slot - 1, muscle_paths.L_SITE], links[lo + slot - 1, muscle_paths.L_GEOM]
    if geom >= 0:
        return f"geom '{name_of(model, mujoco.mjtObj.mjOBJ_GEOM, int(geom))}'"
    return f"site '{name_of(model, mujoco.mjtObj.mjOBJ_SITE, int(site))}'"
