"""Motions over the knots of couplings: coupling error, energy, and the exact motion in independent coordinates."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np
import pytest
from coupling_models import Knee, gait_knee, installed, knee, start
from coupling_reduction import Reduction

from mjwrap.mjcf.couplings import CoupledJoints

MODELS: dict[str, Callable[[float, str], Knee]] = {
    "gait": gait_knee,
    "random": lambda timestep, integrator: knee(0, timestep, integrator),
}


@pytest.mark.parametrize("integrator", ["RK4", "implicitfast", "Euler", "implicit"])
def test_the_coupling_error_stays_below_five_micrometres(integrator: str) -> None:
    """At 1 ms, with solref of two time steps and a knee at 6 rad/s; it falls with the square of the time step."""
    worst = []
    for timestep in (1e-3, 2e-4):
        made = gait_knee(timestep, integrator)
        model = installed(made)
        data, couplings = start(made, model), CoupledJoints(made.model)
        slides = [model.joint(name).id for name in ("slide_x", "slide_z", "glide")]
        largest, pieces = 0.0, set()
        for _ in range(round(0.3 / timestep)):
            mujoco.mj_step(model, data)
            errors = couplings.residuals(data.qpos)
            largest = max(largest, *(abs(errors[joint]) for joint in slides))
            pieces.add(data.eq_active.tobytes())
        assert len(pieces) >= 10
        worst.append(largest)
    assert worst[0] < 5e-6
    assert worst[1] < 0.06 * worst[0]


def energy(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    twin = mujoco.MjData(model)
    twin.qpos[:], twin.qvel[:] = data.qpos, data.qvel
    mujoco.mj_forward(model, twin)
    mujoco.mj_energyPos(model, twin)
    mujoco.mj_energyVel(model, twin)
    return float(twin.energy.sum())


@pytest.mark.parametrize("name", MODELS)
def test_a_passive_motion_is_the_exact_one_and_keeps_its_energy(name: str) -> None:
    """0.3 s under RK4, over many knots; both errors fall with the square of the time step."""
    errors, drifts = [], []
    for timestep in (1e-3, 2e-4):
        made = MODELS[name](timestep, "RK4")
        model, exact = installed(made), Reduction(made)
        data = start(made, model)
        wanted = exact.motion(np.append(data.qpos[exact.free], data.qvel[exact.free]), 0.3)
        before = energy(model, data)
        mujoco.mj_step(model, data, nstep=round(0.3 / timestep))
        found = np.append(data.qpos[exact.free], data.qvel[exact.free])
        errors.append(np.abs(found - wanted)[: len(exact.free)].max())
        drifts.append(abs(energy(model, data) - before))
    assert errors[0] < 5e-5
    assert errors[1] < 2e-6
    assert errors[1] < 0.06 * errors[0]
    assert drifts[0] < 1e-4
    assert drifts[1] < 0.06 * drifts[0]
