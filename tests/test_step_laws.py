"""MuscleSystem.step and apply: the native twin's motion, and other people's forces left alone."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest
from mjcf_reading import Vector
from native_twins import ELBOW, EXPLICIT, INTEGRATORS, PUSH, excite, native_model, pair, start

import mjwrap as mw

# MuJoCo's own muscles enter the implicit integrators' Jacobian; forces in xfrc_applied cannot.
IMPLICIT = [kind for kind in INTEGRATORS.values() if kind not in EXPLICIT]


def difference(integrator: int, timestep: float, path: Path = ELBOW) -> float:
    """Largest difference of state between mjwrap's run and the native twin's over 0.4 s."""
    data, muscles, twin = pair(integrator, timestep, path)
    assert muscles.n == len(twin.ctrl)
    worst = 0.0
    for _ in range(round(0.4 / timestep)):
        excite(data)
        excite(twin)
        muscles.step(data)
        mujoco.mj_step(twin.model, twin)
        for a, b in ((data.qpos, twin.qpos), (data.qvel, twin.qvel), (data.act, twin.act)):
            worst = max(worst, float(np.abs(a - b).max()))
    return worst


@pytest.mark.parametrize("integrator", EXPLICIT)
def test_step_moves_as_the_native_twin_does(integrator: int) -> None:
    assert difference(integrator, 2e-3) < 1e-12


@pytest.mark.myo
@pytest.mark.parametrize("integrator", EXPLICIT)
def test_step_moves_as_the_native_twin_of_a_foreign_model_does(integrator: int) -> None:
    myo_sim = pytest.importorskip("myo_sim")
    assert difference(integrator, 2e-3, Path(myo_sim.get_xml_path("elbow"))) < 1e-12


@pytest.mark.parametrize("integrator", IMPLICIT)
def test_implicit_steps_approach_the_native_twin_at_first_order(integrator: int) -> None:
    """They differ by muscle damping inside MuJoCo's implicit Jacobian, a term of first order in the time step."""
    coarse, fine = difference(integrator, 1e-3), difference(integrator, 2.5e-4)
    assert coarse / fine == pytest.approx(4.0, rel=0.1)


def final_angle(integrator: int, timestep: float) -> float:
    model = mujoco.MjModel.from_xml_path(str(ELBOW.with_name("elbow_conservative.xml")))
    model.opt.integrator, model.opt.timestep = int(integrator), timestep
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    data.qpos[0], data.ctrl[0] = 0.6, 1.0  # below 57 degrees the muscle stays on its cylinder
    muscles.step(data, round(0.16 / timestep))
    assert len(muscles.contact_points(0)) == 1
    return float(data.qpos[0])


@pytest.mark.parametrize(
    ("integrator", "order"),
    [(kind, 4 if kind == INTEGRATORS["mjINT_RK4"] else 1) for kind in INTEGRATORS.values()],
)
def test_step_keeps_the_order_of_the_integrator(integrator: int, order: int) -> None:
    angles = [final_angle(integrator, timestep) for timestep in (8e-3, 4e-3, 2e-3)]
    ratio = (angles[0] - angles[1]) / (angles[1] - angles[2])
    assert math.log2(ratio) == pytest.approx(order, abs=0.15)


@pytest.mark.parametrize("integrator", INTEGRATORS.values())
def test_many_steps_at_once_are_one_after_another(integrator: int) -> None:
    data, muscles, _ = pair(integrator)
    other, same, _ = pair(integrator)
    data.ctrl[:] = other.ctrl[:] = 0.7
    muscles.step(data, nstep=50)
    for _ in range(50):
        same.step(other)
    assert np.array_equal(data.qpos, other.qpos)
    assert np.array_equal(data.qvel, other.qvel)


def test_nothing_acts_where_actuation_is_disabled() -> None:
    for integrator in EXPLICIT:
        data, muscles, twin = pair(integrator)
        for each in (data, twin):
            each.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
            each.act[:] = 1.0
        muscles.step(data, nstep=20)
        mujoco.mj_step(twin.model, twin, nstep=20)
        assert data.qpos == pytest.approx(twin.qpos, abs=1e-15)


# ------------------------------------------------------------------------ forces of others in xfrc_applied


@pytest.mark.parametrize("integrator", EXPLICIT)
def test_step_leaves_the_forces_of_others_to_the_bit_and_lets_them_act(integrator: int) -> None:
    data, muscles, twin = pair(integrator)
    forearm = data.model.body("forearm").id
    for each in (data, twin):
        each.xfrc_applied[forearm] = PUSH
        each.ctrl[:] = 0.6
    for k in range(100):
        muscles.step(data)
        mujoco.mj_step(twin.model, twin)
        assert np.array_equal(data.xfrc_applied, twin.xfrc_applied)
        if k == 50:  # somebody changes their mind
            data.xfrc_applied[forearm] = twin.xfrc_applied[forearm] = -0.4 * PUSH
    assert data.qpos == pytest.approx(twin.qpos, abs=1e-12)


def applied() -> tuple[mujoco.MjData, mw.MuscleSystem, int, Vector]:
    """Data with the forearm pushed by PUSH and by muscles; ours: what the muscles alone apply."""
    data, muscles, _ = pair(EXPLICIT[0])
    data.act[:] = 0.5
    muscles.apply(data)
    ours = data.xfrc_applied.copy()
    muscles.reset(data)
    assert not data.xfrc_applied.any()
    body = data.model.body("forearm").id
    assert np.abs(ours[body]).min() > 0
    data.xfrc_applied[body] = PUSH
    muscles.apply(data)
    return data, muscles, body, ours


def test_apply_adds_to_what_is_there_and_does_not_pile_up() -> None:
    data, muscles, body, ours = applied()
    for _ in range(3):
        assert np.array_equal(data.xfrc_applied[body], PUSH + ours[body])
        muscles.apply(data)
    muscles.reset(data)
    assert np.array_equal(data.xfrc_applied[body], PUSH)
    assert not np.delete(data.xfrc_applied, body, axis=0).any()


def test_apply_keeps_what_others_add() -> None:
    data, muscles, body, ours = applied()
    data.xfrc_applied[body] += 3 * PUSH
    muscles.apply(data)
    # the rows were changed, so the last contribution is subtracted: to rounding
    assert data.xfrc_applied[body] == pytest.approx(4 * PUSH + ours[body], rel=1e-12)
    muscles.reset(data)
    assert data.xfrc_applied[body] == pytest.approx(4 * PUSH, rel=1e-12)


def test_apply_finds_nothing_to_take_back_where_others_zeroed_the_array() -> None:
    data, muscles, _, ours = applied()
    data.xfrc_applied[:] = 0.0
    muscles.apply(data)
    assert np.array_equal(data.xfrc_applied, ours)
    mujoco.mj_resetData(data.model, data)
    muscles.reset(data)
    assert not data.xfrc_applied.any()


def test_apply_keeps_a_mouse_perturbation() -> None:
    """A viewer zeroes the array and assigns the row of the body that the mouse pulls."""
    data, muscles, body, ours = applied()
    mujoco.mj_forward(data.model, data)
    mouse = mujoco.MjvPerturb()
    mouse.select, mouse.active = body, int(mujoco.mjtPertBit.mjPERT_TRANSLATE)
    mouse.refpos[:], mouse.refselpos[:], mouse.scale = data.xpos[body] + 0.1, data.xpos[body] + 0.1, 1.0
    data.xfrc_applied[:] = 0.0
    mujoco.mjv_applyPerturbForce(data.model, data, mouse)
    pulled = data.xfrc_applied[body].copy()
    assert pulled.any()
    muscles.apply(data)
    assert data.xfrc_applied[body] == pytest.approx(pulled + ours[body], rel=1e-12)


def test_apply_before_one_native_step_is_a_step() -> None:
    data, muscles, _ = pair(EXPLICIT[0])
    other, same, _ = pair(EXPLICIT[0])
    data.ctrl[:] = other.ctrl[:] = 0.7
    for _ in range(100):
        muscles.apply(data)
        mujoco.mj_step(data.model, data)
        same.step(other)
    assert data.qpos == pytest.approx(other.qpos, abs=1e-12)


def test_two_data_of_one_model_do_not_know_of_each_other() -> None:
    model = native_model()
    muscles = mw.MuscleSystem(model)
    runs = [start(model), start(model)]
    runs[1].qpos[0], runs[1].qvel[0] = 1.9, -1.0
    alone = []
    for data in runs:
        copy = mujoco.MjData(model)
        mujoco.mj_copyData(copy, model, data)
        copy.ctrl[:] = 0.4
        mw.MuscleSystem(model).step(copy, nstep=60)
        alone.append(copy)
    for _ in range(60):
        for data in runs:
            data.ctrl[:] = 0.4
            muscles.step(data)
    for data, expected in zip(runs, alone, strict=True):
        assert np.array_equal(data.qpos, expected.qpos)
        assert not data.xfrc_applied.any()


def test_release_gives_the_native_muscles_their_forces_back() -> None:
    data, muscles, twin = pair(EXPLICIT[0])
    assert data.model.actuator_forcelimited.all()
    muscles.release()
    for each in (data, twin):
        each.ctrl[:] = 0.8
        mujoco.mj_step(each.model, each, nstep=50)
    assert np.array_equal(data.qpos, twin.qpos)
