"""Check forces against lengths: virtual work, balance, power."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.checking.outcome import Check
from mjwrap.mjcf import dof_names
from mjwrap.system import MuscleSystem
from mjwrap.system.point_forces import forces_on_joints

Array = NDArray[np.float64]


def work_check() -> Check:
    """Return the check that the generalised force of all muscles is −Σ F ∂l/∂q."""
    return Check("virtual_work", "generalised force is -F dl/dq", 1e-9, "of its parts")


def balance_check() -> Check:
    """Return the check that the forces and moments of every muscle add up to zero."""
    return Check("balance", "forces and moments of each muscle balance", 1e-12, "of F, of F l")


def power_check() -> Check:
    """Return the check that the power of every muscle's forces, those on joints that move its points too, is −F l̇."""
    return Check("power", "power of each muscle's forces is -F dl/dt", 1e-9, "of its parts")


def evaluate_forces(
    muscles: MuscleSystem, data: mujoco.MjData, where: str, checks: tuple[Check, Check, Check]
) -> None:
    """Apply the muscles' forces at the state in `data`, from a cold start, and record the errors.

    Muscles without a path are left out: after a cold start they have no last valid force.
    """
    work, balance, power = checks
    model = muscles.model
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    data.xfrc_applied[:], data.qfrc_applied[:] = 0.0, 0.0
    muscles.reset(data)
    muscles.apply(data)
    tension, velocity, names, good = muscles.tension, muscles.velocity, muscles.names, ~muscles.held
    found, parts = data.qfrc_applied.copy(), np.abs(data.qfrc_applied)
    for body in np.flatnonzero(data.xfrc_applied.any(axis=1)):
        force, moment, each = data.xfrc_applied[body, :3], data.xfrc_applied[body, 3:], np.zeros(model.nv)
        mujoco.mj_applyFT(model, data, force, moment, data.xipos[body], int(body), each)
        found += each
        parts += np.abs(each)
    for i in np.flatnonzero(good & (tension > 0.0)):
        pulls = muscles.forces(int(i))
        points = np.array([point for _, point, _ in pulls])
        forces = np.array([force for _, _, force in pulls])
        centre = points.mean(axis=0)
        reach = max(float(np.abs(points - centre).max()), 1e-6)
        moment = np.abs(np.cross(points - centre, forces).sum(axis=0)).max() / (tension[i] * reach)
        balance.see(
            max(float(np.abs(forces.sum(axis=0)).max()) / tension[i], float(moment)), where, [names[i]]
        )
        speeds = np.array([_speed(model, data, body, point) for body, point, _ in pulls])
        each = np.append(np.einsum("kj,kj->k", forces, speeds), forces_on_joints(muscles, int(i)) @ data.qvel)
        size = max(float(np.abs(each).sum()), 1e-9 * tension[i])
        power.see(abs(float(each.sum()) + tension[i] * velocity[i]) / size, where, [names[i]])
    muscles.reset(data)  # removes the forces
    jacobian = muscles.length_jacobian(data)
    pull = np.where(good, tension, 0.0)
    scale = float(parts.max(initial=0.0))
    if scale > 0.0:
        gap = np.abs(found + jacobian.T @ pull)
        work.see(gap / np.maximum(parts, 1e-6 * scale), where, dof_names(model))


def _speed(model: mujoco.MjModel, data: mujoco.MjData, body: int, point: Array) -> Array:
    """Return the velocity (3,) of a point of a body [m/s]."""
    spin, base = data.cvel[body, :3], data.cvel[body, 3:]
    return base + np.cross(spin, point - data.subtree_com[model.body_rootid[body]])
