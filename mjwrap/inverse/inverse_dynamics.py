"""Generalised forces that a motion needs.

τ = Nᵀ (M q̈ + c − τ_passive − Σ Jᵀ F), N = ∂q/∂q_independent.

M has the armature of the joints, c gravity and the terms of velocity; τ_passive are MuJoCo's springs, dampers, fluid
and compensation of gravity; F are external loads. What joints that follow others need is thereby carried to their
leaders. Equalities are not constraints here, so no force of theirs is in τ; neither are contacts, limits or dry
friction, which depend on what is unknown, nor actuators and muscles, which have to deliver τ.
"""

from __future__ import annotations

import copy

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
from mjwrap.errors import ModelError, StateError
from mjwrap.files import Table
from mjwrap.inverse.coordinates import IndependentCoordinates, refuse_loops
from mjwrap.inverse.external_loads import ExternalLoads, LoadFrames
from mjwrap.inverse.motion import CompleteMotion, Motion
from mjwrap.inverse.threads import in_threads
from mjwrap.mjcf import has_plugin

Array = NDArray[np.float64]
BLOCK = 128  # frames that one thread evaluates in a row, and whose N are in memory at once
_OFF = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT) | int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
_DISCRETE = int(mujoco.mjtEnableBit.mjENBL_INVDISCRETE)
# what makes forces along tendons that MuJoCo's own inverse dynamics has, in some versions of MuJoCo
_TENDON_FORCES = (
    "tendon_stiffness",
    "tendon_stiffnesspoly",
    "tendon_damping",
    "tendon_dampingpoly",
    "tendon_armature",
)


def inverse_dynamics(model: mujoco.MjModel, motion: Motion, loads: ExternalLoads | None = None) -> Table:
    """Return the generalised forces that a motion needs, about the independent coordinates, beside external loads.

    Springs, dampers and armature of joints and tendons, fluid forces and compensation of gravity are part of the model
    and not of the result. Muscles, ligaments and other actuators are left out, as are contacts, joint limits, dry
    friction and the forces of equalities. What is needed at joints that follow others is added to their leaders.

    Args:
        model: the model; it is not changed.
        motion: its motion; velocities and accelerations that are None come from splines.
        loads: external forces, None for none.

    Returns:
        A table with a column for each independent coordinate, named as OpenSim's InverseDynamicsTool does:
        "knee_moment" [N m] about a hinge, "slider_force" [N] along a slide; "root[0]_force", ... of a free joint
        (three forces in the world, three moments about the body's axes), "hip[0]_moment", ... of a ball joint.
        Positive where the coordinate is driven up.

    Raises:
        StateError: motion and model do not fit, or the loads do not cover the motion.
        ModelError: a load acts on an unknown body, a connect or weld closes a loop, or the engine plugin drives the
            model.
    """
    independent = IndependentCoordinates(model)
    values = generalized_forces(model, motion, loads)
    header = {"header": "Inverse Dynamics Generalized Forces", "inDegrees": "no"}
    return Table(motion.time, independent.labels, values, header)


def generalized_forces(
    model: mujoco.MjModel, motion: Motion, loads: ExternalLoads | None = None, jobs: int = 1
) -> Array:
    """Return the values (T, k) of `inverse_dynamics`, in `jobs` threads; columns as of `IndependentCoordinates`."""
    validation.of_type(model, "MjModel", "model", ModelError)
    validation.instance(motion, Motion, "motion", StateError, "a mw.Motion")
    validation.optional(loads, ExternalLoads, "loads", StateError, "mw.ExternalLoads")
    if has_plugin(model):
        raise ModelError(
            "the engine plugin drives the muscles of this model; take mjwrap.plugin.without_plugin(model)"
        )
    refuse_loops(model, "generalised forces about the coordinates that it ties are not determined")
    whole = motion.completed(model)
    independent = IndependentCoordinates(model)
    forces = joint_forces(model, whole, loads, jobs)
    found = np.zeros((len(whole), len(independent.dofs)))
    for first in range(0, len(whole), BLOCK):
        block = slice(first, first + BLOCK)
        found[block] = np.einsum("tvk,tv->tk", independent.matrices(whole.qpos[block]), forces[block])
    return found


def joint_forces(
    model: mujoco.MjModel, motion: CompleteMotion, loads: ExternalLoads | None = None, jobs: int = 1
) -> Array:
    """Return the forces (T, nv) about all degrees of freedom that a motion needs without any constraint."""
    frames = LoadFrames(model, loads or ExternalLoads(()), motion.time)
    evaluate, bare = _rigid_bodies, model
    if _has_more(model):
        evaluate, bare = _whole, _without_constraints(model)
    found = np.zeros((len(motion), model.nv))

    def run(begin: int) -> None:
        data, external = mujoco.MjData(bare), np.zeros(model.nv)
        qpos, qvel, qacc = data.qpos, data.qvel, data.qacc
        for k in range(begin, min(begin + BLOCK, len(motion))):
            qpos[:], qvel[:], qacc[:] = motion.qpos[k], motion.qvel[k], motion.qacc[k]
            evaluate(bare, data, found[k])
            if len(loads or ()):
                external[:] = 0.0
                frames.add(data, k, external)
                found[k] -= external

    in_threads(run, range(0, len(motion), BLOCK), jobs)
    bad = np.argwhere(~np.isfinite(found))
    if len(bad):
        raise StateError(f"the forces at time {motion.time[bad[0][0]]:g} s are not finite")
    return found


def _rigid_bodies(model: mujoco.MjModel, data: mujoco.MjData, out: Array) -> None:
    """Write M q̈ + c − τ_passive, as `_whole` does, without what only tendons, flexes and plugins need."""
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_comVel(model, data)
    mujoco.mj_passive(model, data)
    mujoco.mj_rne(model, data, 1, out)
    out += model.dof_armature * data.qacc - data.qfrc_passive


def _whole(model: mujoco.MjModel, data: mujoco.MjData, out: Array) -> None:
    """Write M q̈ + c − τ_passive as MuJoCo's own inverse dynamics computes it; constraints are disabled."""
    mujoco.mj_inverse(model, data)
    out[:] = data.qfrc_inverse


def _without_constraints(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return a copy without constraints and contacts, whose inverse dynamics is in continuous time."""
    bare = copy.copy(model)
    bare.opt.disableflags |= _OFF
    bare.opt.enableflags &= ~_DISCRETE
    return bare


def _has_more(model: mujoco.MjModel) -> bool:
    """Return whether passive forces need more than the kinematics of bodies and joints."""
    tendons = any(np.any(getattr(model, name, 0.0)) for name in _TENDON_FORCES)
    return tendons or bool(model.nflex or model.nplugin)
