"""The rate of a MuscleSystem's length Jacobian, against quotients of Jacobians along MuJoCo's integration of poses."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from mjcf_reading import Vector
from random_models import random_model, random_state
from test_force_laws import PULLEY

import mjwrap as mw

SEEDS = range(17)
PER_SEED = 3
STEP = 2e-4  # of the coarser quotient [rad, m]
FLOOR = 2e-8  # paths are found to 1e-10 in their directions, over half a step and in about ten terms

ARM = """<mujoco><worldbody>
  <site name="from" pos="-0.1 0.01 0"/>
  <body><joint axis="0 0 1" pos="0 -0.01 0"/><joint type="slide" axis="1 2 3"/>
    <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    <geom name="near" type="cylinder" size="0.03 0.1" euler="10 5 0" contype="0" conaffinity="0" mass="0"/>
    <body pos="0.1 0 0"><joint axis="1 0.2 3"/><joint axis="0 1 0.4" pos="0.01 0.02 0.03"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <geom name="far" type="sphere" size="0.03" pos="0 0.04 0.004" contype="0" conaffinity="0" mass="0"/>
      <body pos="0.1 0 0"><joint axis="0.3 1 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
        <site name="to" pos="0.01 0.05 0.02"/></body></body></body></worldbody>
  <custom><numeric name="mjwrap_m_optimal_force" data="40"/><tuple name="mjwrap_m">
    <element objtype="site" objname="from"/><element objtype="geom" objname="near"/>
    <element objtype="geom" objname="far"/><element objtype="site" objname="to"/>
    <element objtype="numeric" objname="mjwrap_m_optimal_force"/></tuple></custom></mujoco>"""


def states(count: int) -> list[tuple[mujoco.MjModel, mujoco.MjData, mw.MuscleSystem]]:
    """Return random models on bodies of every kind, and one with pulleys, at random states with all paths found."""
    found = []
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        model = mujoco.MjModel.from_xml_string(PULLEY) if seed == 0 else random_model(seed)
        for _ in range(count):
            data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
            muscles.forward(data)
            random_state(model, data, rng)
            muscles.forward(data)
            if not muscles.status.any():
                found.append((model, data, muscles))
    return found


def contacts(muscles: mw.MuscleSystem) -> list[int]:
    """Return how many obstacles each muscle touches."""
    return [len(muscles.contact_points(i)) for i in range(muscles.n)]


def test_rate_of_the_jacobian_at_second_order() -> None:
    ratios = []
    for model, data, muscles in states(PER_SEED):
        rate, touched = muscles.length_jacobian_rate(data), contacts(muscles)
        start = data.qpos.copy()

        sides: list[Vector] = []
        for step in (STEP, -STEP, STEP / 2, -STEP / 2):
            data.qpos[:] = start
            mujoco.mj_integratePos(model, data.qpos, data.qvel, step)
            found = muscles.length_jacobian(data)
            if contacts(muscles) == touched and not muscles.status.any():
                sides.append(found)
        if len(sides) < 4:
            continue  # a contact comes or goes
        coarse, fine = (
            float(np.abs((a - b) / h - rate).max())
            for a, b, h in ((sides[0], sides[1], 2 * STEP), (sides[2], sides[3], STEP))
        )
        assert fine <= coarse / 3.5 + FLOOR
        assert fine <= 1e-2 * np.abs(rate).max() + FLOOR
        if coarse > 100 * FLOOR:
            ratios.append(coarse / fine)
    assert len(ratios) > 40
    assert np.median(ratios) == pytest.approx(4.0, abs=0.02)


def test_the_rate_is_linear_in_the_direction_and_leaves_the_results_alone() -> None:
    for model, data, muscles in states(1):
        rng = np.random.default_rng(5)
        own = muscles.length_jacobian_rate(data)
        length, velocity = muscles.length, muscles.velocity
        qvel = data.qvel.copy()
        one, other = rng.normal(size=(2, model.nv))
        parts = [muscles.length_jacobian_rate(data, direction) for direction in (one, other, 2 * one - other)]
        scale = 1e-12 * max(np.abs(part).max() for part in parts)
        assert np.abs(2 * parts[0] - parts[1] - parts[2]).max() <= scale
        assert np.array_equal(muscles.length_jacobian_rate(data, qvel), own)
        assert np.array_equal(muscles.length, length)
        assert np.array_equal(muscles.velocity, velocity)
        assert np.array_equal(data.qvel, qvel)


def test_hinges_and_slides_have_a_symmetric_second_derivative() -> None:
    """Their coordinates commute, so the rates along single joints are the columns of d2l/dq2."""
    model = mujoco.MjModel.from_xml_string(ARM)
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    rng = np.random.default_rng(6)
    slides = model.jnt_type == int(mujoco.mjtJoint.mjJNT_SLIDE)
    both = 0
    for _ in range(50):
        data.qpos[:] = rng.uniform(-0.1, 0.1, model.nq) * np.where(slides, 0.1, 1.0)
        muscles.forward(data)
        assert not muscles.status.any()
        both += contacts(muscles) == [2]
        hessian = np.array([muscles.length_jacobian_rate(data, joint)[0] for joint in np.eye(model.nv)])
        assert np.abs(hessian).max() > 1e-3
        asymmetry = np.abs(hessian - hessian.T).max()
        assert asymmetry <= 1e-9 * np.abs(hessian).max()  # what the tangency error leaves
    assert both > 25


def test_lengths_accelerate_as_jacobian_and_rate_say() -> None:
    """d2l/dt2 = J qacc + J' qvel along a simulated fall, against second differences of the length."""
    model = mujoco.MjModel.from_xml_string(ARM)
    errors = []
    for timestep in (1e-3, 5e-4):
        model.opt.timestep = timestep
        model.opt.integrator = int(mujoco.mjtIntegrator.mjINT_RK4)
        data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
        data.qvel[:] = (1.0, 0.1, -1.0, 0.5, -0.5)
        lengths, accelerations = [], []
        for k in range(3):
            mujoco.mj_forward(model, data)
            muscles.forward(data)
            lengths.append(muscles.length[0])
            jacobian = muscles.length_jacobian(data) @ data.qacc
            accelerations.append(float((jacobian + muscles.length_jacobian_rate(data) @ data.qvel)[0]))
            if k < 2:
                mujoco.mj_step(model, data)
        quotient = (lengths[2] - 2 * lengths[1] + lengths[0]) / timestep**2
        errors.append(abs(quotient - accelerations[1]))
    assert errors[1] < 1e-3 * abs(accelerations[1])
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.5)


def test_what_has_no_rate_is_named() -> None:
    model = mujoco.MjModel.from_xml_string(ARM.replace('pos="-0.1 0.01 0"', 'pos="0 0.001 0"'))
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    with pytest.raises(mw.PathError, match=r"muscle 'm' has no path, .*site 'from' is inside geom 'near'"):
        muscles.length_jacobian_rate(data)
    straight = ARM.replace(' euler="10 5 0"', "").replace('pos="-0.1 0.01 0"', 'pos="-0.03 0 0"')
    model = mujoco.MjModel.from_xml_string(straight)
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    with pytest.raises(mw.GeometryError, match=r"muscle 'm': .* leaves site 'from' has zero length"):
        muscles.length_jacobian_rate(data)
    model = mujoco.MjModel.from_xml_string(ARM)
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    with pytest.raises(mw.StateError, match=r"direction must be finite and have shape \(5,\)"):
        muscles.length_jacobian_rate(data, np.zeros(4))
