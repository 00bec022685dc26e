"""Moving and conditional path points in the engine plugin: MuscleSystem's bits, threads, saved states, transmission."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from moving_models import Leg, random_leg
from mujoco import rollout

import mjwrap as mw
from mjwrap.plugin import Muscles, excitations, read

STATE = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)
FORCES = [0.4, 0.7, 0.2, 0.5]


def leg_over_edges(seed: int) -> Leg:
    """Return a leg whose fourth string has conditional points beside wraps, and whose motion crosses their edges."""
    leg = random_leg(seed)
    leg.declare(
        "fourth", "pelvis", "egg:front", "patella?knee -0.2 0.15", "condyle:front", "pes?hip -9 0.1", "shin"
    )
    return leg


def install(text: str, mode: str = "wrench") -> mujoco.MjModel:
    return mw.install(mujoco.MjSpec.from_string(text), mode)


def started(model: mujoco.MjModel, seed: int = 0) -> mujoco.MjData:
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    data.qpos[:2] += rng.uniform(-0.2, 0.2, 2)
    data.qvel[:2] = rng.uniform(0.5, 1.5, 2) * [-1.0, 1.0]
    if model.nplugin:
        for excitation, force in zip(excitations(data).values(), FORCES, strict=True):
            excitation[:] = force
    return data


def state_of(data: mujoco.MjData) -> np.ndarray:
    found = np.empty(mujoco.mj_stateSize(data.model, STATE))
    mujoco.mj_getState(data.model, data, found, STATE)
    return found


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
def test_plugin_and_muscle_system_move_alike_to_the_bit(integrator: str, seed: int) -> None:
    text = leg_over_edges(seed).xml(integrator)
    muscles = mw.MuscleSystem(mujoco.MjModel.from_xml_string(text))
    muscles.excitation[:] = FORCES
    one, two = started(muscles.model, seed), started(install(text), seed)
    ends: set[bool] = set()
    for _ in range(250):
        muscles.step(one)
        mujoco.mj_step(two.model, two)
        ends.add(bool(-0.2 <= one.qpos[1] <= 0.15))
        np.testing.assert_array_equal(one.qpos, two.qpos)
        np.testing.assert_array_equal(one.qvel, two.qvel)
        np.testing.assert_array_equal(one.site_xpos, two.site_xpos)
    shown, drawn = read(two), Muscles(two)
    assert ends == {True, False}
    np.testing.assert_array_equal(shown.length, muscles.length)
    np.testing.assert_array_equal(shown.velocity, muscles.velocity)
    for i in range(4):
        np.testing.assert_array_equal(drawn.points(i), muscles.points(i))
    np.testing.assert_array_equal(one.qfrc_passive, two.qfrc_passive)
    np.testing.assert_array_equal(two.qfrc_applied, 0.0)


def test_threads_of_rollout_give_the_bits_of_a_loop() -> None:
    model = install(leg_over_edges(2).xml("RK4"))
    nenv, nstep = 6, 120
    initial = np.stack([state_of(started(model, seed)) for seed in range(nenv)])
    expected = np.empty((nenv, nstep, initial.shape[1]))
    for env in range(nenv):
        data = started(model, env)
        for k in range(nstep):
            mujoco.mj_step(model, data)
            expected[env, k] = state_of(data)
    for datas in ([started(model, 9)], [started(model, 9), started(model, 8)]):
        for order in (np.arange(nenv), np.arange(nenv)[::-1]):
            found, _ = rollout.rollout(model, datas, initial[order], nstep=nstep)
            np.testing.assert_array_equal(found[np.argsort(order)], expected)


@pytest.mark.parametrize("at", [40, 77, 110, 160])
def test_a_state_saved_in_motion_goes_on_with_the_same_bits(at: int) -> None:
    model = install(leg_over_edges(1).xml())
    data, other = started(model), started(model, 5)
    mujoco.mj_step(model, other, 30)
    mujoco.mj_step(model, data, at)
    saved = state_of(data)
    mujoco.mj_step(model, data, 100)
    mujoco.mj_setState(model, other, saved, STATE)
    mujoco.mj_step(model, other, 100)
    np.testing.assert_array_equal(state_of(other), state_of(data))


def test_a_reset_starts_afresh() -> None:
    model = install(leg_over_edges(3).xml())
    data, new = started(model), mujoco.MjData(model)
    mujoco.mj_step(model, data, 130)
    mujoco.mj_resetData(model, data)
    mujoco.mj_forward(model, data)
    mujoco.mj_forward(model, new)
    np.testing.assert_array_equal(read(data).length, read(new).length)
    np.testing.assert_array_equal(data.qfrc_passive, new.qfrc_passive)


def test_sites_move_where_actuation_is_switched_off() -> None:
    leg = leg_over_edges(0)
    model = install(leg.xml())
    data = started(model)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(
        data.site("patella").xpos, leg.place(model, data, "patella"), rtol=0.0, atol=1e-15
    )
    passive = data.qfrc_passive.copy()
    expected = -model.dof_damping * data.qvel - model.jnt_stiffness * (data.qpos - model.qpos_spring)
    np.testing.assert_allclose(passive, expected, rtol=0.0, atol=1e-12)  # no string pulls


def test_changed_numbers_of_a_model_move_the_point() -> None:
    leg = leg_over_edges(0)
    model = install(leg.xml())
    data = started(model)
    mujoco.mj_forward(model, data)
    before = data.site("shin").xpos.copy()
    numeric = model.numeric("shin_0")
    pieces = int(numeric.data[0])
    numeric.data[2 * pieces :: 4] += 0.01  # the constants
    model.site("shin").pos[1] += 0.02  # an axis along which it does not move
    mujoco.mj_forward(model, data)
    turn = data.body("shank").xmat.reshape(3, 3)
    np.testing.assert_allclose(
        data.site("shin").xpos - before, turn @ [0.01, 0.02, 0.0], rtol=0.0, atol=1e-15
    )


CABLE = """
<tendon><spatial name="cable"><site site="pelvis"/><site site="{over}"/><site site="{end}"/></spatial></tendon>
<actuator><motor name="cable" tendon="cable" ctrlrange="-100 0" gear="2"/></actuator>
"""


@pytest.mark.parametrize("seed", [0, 1])
def test_transmission_has_the_moment_of_moving_points(seed: int) -> None:
    """A motor along a moving route accelerates the leg as a string with the same force that acts by wrenches."""
    leg = random_leg(seed, wraps=False)
    string = mw.MuscleSystem(leg.model())
    string.excitation[:] = [1.0, 0.0, 0.0]
    leg.custom = []
    leg.more = CABLE.format(over="patella", end="shin")
    model = install(leg.xml(), "transmission")
    data, other = mujoco.MjData(model), mujoco.MjData(string.model)
    rng = np.random.default_rng(seed)
    for _ in range(5):
        data.qpos[:2] = other.qpos[:2] = rng.uniform(-0.6, 0.6, 2)
        data.qvel[:] = other.qvel[:] = rng.normal(size=3) * [1.0, 1.0, 0.1]
        jacobian = string.length_jacobian(other)[0]
        string.apply(other)
        data.ctrl[:] = -0.5 * string.tension[0]
        mujoco.mj_forward(model, data)
        mujoco.mj_forward(string.model, other)
        moment = np.zeros((1, model.nv))
        mujoco.mju_sparse2dense(
            moment,
            data.actuator_moment.ravel(),
            data.moment_rownnz,
            data.moment_rowadr,
            data.moment_colind.ravel(),
        )
        np.testing.assert_allclose(moment[0], 2.0 * jacobian, rtol=0.0, atol=1e-15)
        assert data.actuator_length[0] == 2.0 * string.length[0]
        np.testing.assert_allclose(data.actuator_velocity[0], 2.0 * string.velocity[0], rtol=0.0, atol=1e-15)
        np.testing.assert_allclose(data.qacc, other.qacc, rtol=1e-9, atol=1e-9)
        string.reset(other)


def test_transmission_without_a_column_is_refused() -> None:
    leg = Leg()
    leg.bend("front", 0, "knee", 0.02)
    leg.more = CABLE.format(over="back", end="front")
    with pytest.raises(
        mw.ModelError, match="joint 'knee' moves a point of its path, but does not move tendon 'cable'"
    ):
        install(leg.xml(), "transmission")


def test_recorded_moment_arms_contain_moving_points() -> None:
    """Of a MuscleSystem, of the plugin, and of two instances of the plugin in one model."""
    text = random_leg(2).xml()
    muscles = mw.MuscleSystem(mujoco.MjModel.from_xml_string(text))
    data = started(muscles.model, 3)
    muscles.forward(data)
    expected = -muscles.length_jacobian(data)
    pairs = np.repeat(np.arange(3), 3), np.tile(np.arange(3), 3)

    def recorded(results: mw.MuscleSystem | Muscles, poses: mujoco.MjData, first: int) -> np.ndarray:
        history = results.history(1, pairs[0] + first, pairs[1] + first)
        history.put_frame(0, results.poses(poses), None)
        return history.moment_arms(1).reshape(3, 3)

    np.testing.assert_array_equal(recorded(muscles, data, 0), expected)
    alone, parent = mujoco.MjSpec.from_string(text), mujoco.MjSpec()
    parent.option.timestep, parent.option.integrator = alone.option.timestep, alone.option.integrator
    mw.install(alone)
    mw.install(other := mujoco.MjSpec.from_string(text))
    parent.attach(alone, prefix="a_", frame=parent.worldbody.add_frame())
    parent.attach(other, prefix="b_", frame=parent.worldbody.add_frame())
    for model, legs in ((mw.install(mujoco.MjSpec.from_string(text)), 1), (parent.compile(), 2)):
        installed = mujoco.MjData(model)
        installed.qpos[:] = np.tile(data.qpos, legs)
        mujoco.mj_forward(model, installed)
        for leg in range(legs):
            found = recorded(Muscles(installed), installed, 3 * leg)
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-13)


def test_attached_models_keep_their_points() -> None:
    """Two legs under prefixes in one model move as one alone."""
    text, parent = leg_over_edges(1).xml(), mujoco.MjSpec()
    child = mujoco.MjSpec.from_string(text)
    parent.option.timestep, parent.option.integrator = child.option.timestep, child.option.integrator
    for name in ("a_", "b_"):
        parent.attach(mujoco.MjSpec.from_string(text), prefix=name, frame=parent.worldbody.add_frame())
    both, alone = mw.install(parent), started(install(text))
    data = mujoco.MjData(both)
    data.qpos[:], data.qvel[:] = np.tile(alone.qpos, 2), np.tile(alone.qvel, 2)
    for excitation, force in zip(excitations(data).values(), FORCES * 2, strict=True):
        excitation[:] = force
    mujoco.mj_step(both, data, 60)
    mujoco.mj_step(alone.model, alone, 60)
    np.testing.assert_allclose(data.qpos, np.tile(alone.qpos, 2), rtol=0.0, atol=1e-11)
