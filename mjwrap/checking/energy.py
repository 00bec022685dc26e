"""Check the energy in a short motion without losses: the skeleton must gain the work of the muscles."""

from __future__ import annotations

import copy

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.checking.outcome import Check
from mjwrap.errors import ModelError, StateError
from mjwrap.mjcf.conditional_points import routes_that_hold
from mjwrap.mjcf.couplings import read_couplings
from mjwrap.system import CableSystem
from mjwrap.text import counted

Array = NDArray[np.float64]
SECONDS, ACTIVATION, LIMIT = 0.1, 0.1, 1e-6
TIMESTEPS = (5e-4, 2.5e-4, 1.25e-4, 6.25e-5)  # [s]
STILL = 1e-10  # exchanged energy that counts as none, as a share of tension times length
STANDSTILL_FACTOR = 1e6  # factor of the armature with which a joint practically stands still
_HINGE, _SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)


def without_losses(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return a copy without damping, limits, contacts and fluid, so that only actuators change its energy.

    Hinges and slides get the largest inertia of their kind as armature, so that light ones move as slowly as heavy
    ones. Joints that an equality couples to others get so much armature that they stand still, because the constraint
    is disabled.
    """
    model = copy.copy(model)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    model.opt.integrator = int(mujoco.mjtIntegrator.mjINT_RK4)
    model.opt.density = model.opt.viscosity = 0.0
    model.dof_damping[:] = 0.0
    model.tendon_damping[:] = 0.0
    model.body_gravcomp[:] = 0.0
    kinds = model.jnt_type[model.dof_jntid]
    for kind in (_HINGE, _SLIDE):
        dofs = np.flatnonzero(kinds == kind)
        model.dof_armature[dofs] += np.max(model.dof_M0[dofs], initial=0.0)
    coupled = [coupling.joint for coupling in read_couplings(model)]
    model.dof_armature[model.jnt_dofadr[coupled]] *= STANDSTILL_FACTOR
    return model


def check_energy(
    model: mujoco.MjModel, qpos: Array, side_rule: int | None = None, tendons: bool = False
) -> Check:
    """Compare the gain of energy with the muscles' work in a motion from rest at a pose (nq,).

    The remaining difference is the integrator's error, whose order is lower where a path lifts off. So the time step is
    halved until the difference is below the limit, but only a few times.
    """
    check = Check(
        "energy", f"energy gained is the muscles' work, {SECONDS:g} s", LIMIT, "of the exchanged energy"
    )
    for timestep in TIMESTEPS:
        try:
            drift, exchanged = _drift(model, qpos, timestep, side_rule, tendons)
        except (ModelError, StateError) as error:
            check.skipped = str(error)
            return check
        check.worst, check.count = drift, 1
        check.where = f"{exchanged:.3g} J exchanged, time step {1e3 * timestep:g} ms"
        if drift <= LIMIT:
            break
    return check


def _drift(
    model: mujoco.MjModel, qpos: Array, timestep: float, side_rule: int | None, tendons: bool
) -> tuple[float, float]:
    """Return the difference of energy and work relative to the exchanged energy, and this energy [J].

    Raises `ModelError` if the model allows no such motion.
    """
    model = without_losses(model)
    model.opt.timestep = timestep
    muscles = CableSystem(model, side_rule=side_rule, tendons=tendons, pulling=True)
    data, scratch = mujoco.MjData(model), mujoco.MjData(model)
    elastic = [m.name for m in muscles.declarations if m.parameters.states == 2]
    if elastic:
        raise ModelError(
            f"{counted(len(elastic), 'muscle')} with elastic tendons ('{elastic[0]}'), whose steps are implicit"
        )
    taken = [m.actuator for m in muscles.declarations if m.actuator >= 0]
    others = np.setdiff1d(np.arange(model.nactuator), taken)
    model.actuator_gainprm[others] = model.actuator_biasprm[others] = 0.0
    data.qpos[:], data.act[:], muscles.excitation = qpos, ACTIVATION, np.full(muscles.n, ACTIVATION)
    data.ctrl[model.actuator_ctrladr[taken]] = ACTIVATION
    energy, power, moved, most = [], [], 0.0, 0.0
    holding = routes_that_hold(model, muscles.declarations, qpos)
    for k in range(round(SECONDS / timestep) + 1):
        if k:
            muscles.step(data)
        muscles.forward(data)
        for i in np.flatnonzero(muscles.status):
            raise ModelError(f"'{muscles.names[i]}' has no path during the motion: {muscles.reason(int(i))}")
        if routes_that_hold(model, muscles.declarations, data.qpos) != holding:
            raise ModelError("a conditional path point comes or goes during the motion")
        each = -muscles.tension * muscles.velocity
        most = max(most, float(muscles.tension @ muscles.length))
        energy.append(_energy(model, data, scratch))
        power.append(float(each.sum()))
        moved += timestep * float(np.abs(each).sum())
    done = timestep / 3.0 * (power[0] + power[-1] + 4.0 * sum(power[1:-1:2]) + 2.0 * sum(power[2:-1:2]))
    exchanged = max(moved, float(np.ptp(energy)))
    if exchanged <= STILL * most:
        raise ModelError("no energy is exchanged")
    return abs(energy[-1] - energy[0] - done) / exchanged, exchanged


def _energy(model: mujoco.MjModel, data: mujoco.MjData, scratch: mujoco.MjData) -> float:
    scratch.qpos[:], scratch.qvel[:] = data.qpos, data.qvel
    mujoco.mj_fwdPosition(model, scratch)
    mujoco.mj_fwdVelocity(model, scratch)
    mujoco.mj_energyPos(model, scratch)
    mujoco.mj_energyVel(model, scratch)
    return float(scratch.energy.sum())
