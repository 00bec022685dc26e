"""The pieces of couplings are switched at every evaluation: the plugin and MuscleSystem beside a slow oracle."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from coupling_models import Knee, installed, knee, start
from coupling_oracle import step
from mujoco import rollout
from newer_mujoco import batch, needs_batch

import mjwrap as mw
from mjwrap.mjcf.couplings import CoupledJoints

DISABLE, ENABLE = mujoco.mjtDisableBit, mujoco.mjtEnableBit
FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS
INTEGRATORS = ["RK4", "implicitfast", "Euler", "implicit"]


def run_with_oracle(
    made: Knee, model: mujoco.MjModel, plain: mujoco.MjModel, steps: int, seed: int = 0
) -> int:
    """Step both, and require equal bits throughout; return how often a piece was switched."""
    data, twin = start(made, model, seed), start(made, plain, seed)
    seen, switches = data.eq_active.copy(), 0
    for _ in range(steps):
        mujoco.mj_step(model, data)
        step(plain, twin, lambda: made.set_active(plain, twin))
        np.testing.assert_array_equal(data.qpos, twin.qpos)
        np.testing.assert_array_equal(data.qvel, twin.qvel)
        np.testing.assert_array_equal(data.eq_active, twin.eq_active)
        switches += int(not np.array_equal(seen, data.eq_active))
        seen = data.eq_active.copy()
    assert data.time > 0.9 * steps * model.opt.timestep  # it was not reset
    return switches


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_the_plugin_equals_the_oracle(integrator: str) -> None:
    for seed in range(4):
        made = knee(seed, integrator=integrator)
        assert run_with_oracle(made, installed(made), made.model, 300, seed) >= 3


SOLVERS = [mujoco.mjtSolver.mjSOL_PGS, mujoco.mjtSolver.mjSOL_CG, mujoco.mjtSolver.mjSOL_NEWTON]


@pytest.mark.parametrize("sleep", [False, True])
@pytest.mark.parametrize("islands", [True, False])
@pytest.mark.parametrize("solver", SOLVERS)
def test_the_solver_sees_rows_of_the_right_piece(
    solver: mujoco.mjtSolver, islands: bool, sleep: bool
) -> None:
    """With contacts, limits of islands and sleeping trees; both kinds of Jacobian."""
    for jacobian in (mujoco.mjtJacobian.mjJAC_DENSE, mujoco.mjtJacobian.mjJAC_SPARSE):
        # MuJoCo itself has no sleeping trees with equalities of tendons
        made = knee(1, integrator="implicitfast", floor=True, wheel=not sleep)
        models = installed(made), made.model
        for model in models:
            model.opt.solver, model.opt.jacobian = solver, jacobian
            model.opt.disableflags &= ~int(DISABLE.mjDSBL_CONTACT)
            if not islands:
                model.opt.disableflags |= int(DISABLE.mjDSBL_ISLAND)
            if sleep:
                model.opt.enableflags |= int(ENABLE.mjENBL_SLEEP)
        assert run_with_oracle(made, *models, 250) >= 3


def same_evaluation(a: mujoco.MjData, b: mujoco.MjData) -> None:
    for name in (
        "eq_active",
        "efc_J",
        "efc_pos",
        "efc_vel",
        "efc_aref",
        "efc_D",
        "efc_id",
        "efc_force",
        "qacc",
    ):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)
    assert (a.nefc, a.ne, a.nisland, a.ncon) == (b.nefc, b.ne, b.nisland, b.ncon)


def test_every_evaluation_at_a_new_pose_has_its_own_piece() -> None:
    """`mj_forward` alone, the first one after a reset or a restored state, and `mj_inverse`."""
    made = knee(2, integrator="RK4", floor=True)
    model, plain = installed(made), made.model
    data, twin, rng = mujoco.MjData(model), mujoco.MjData(plain), np.random.default_rng(0)
    couplings = CoupledJoints(plain)
    saved = np.empty(mujoco.mj_stateSize(model, FULL))
    different = set()
    for k in range(60):
        pose = model.qpos0.copy()
        pose[:8] = rng.uniform(-1.8, 0.4, 8)
        couplings.place(pose)
        pose[:8] += rng.normal(0.0, 1e-5, 8)
        speed = rng.normal(size=model.nv)
        if k % 3 == 1:
            mujoco.mj_resetData(model, data)
            mujoco.mj_resetData(plain, twin)
        data.qpos[:], data.qvel[:] = pose, speed
        if k % 3 == 2:
            mujoco.mj_getState(model, data, saved, FULL)
            data = mujoco.MjData(model)
            mujoco.mj_setState(model, data, saved, FULL)
            twin = mujoco.MjData(plain)
        twin.qpos[:], twin.qvel[:] = pose, speed
        made.set_active(plain, twin)
        different.add(twin.eq_active.tobytes())
        mujoco.mj_forward(model, data)
        mujoco.mj_forward(plain, twin)
        same_evaluation(data, twin)
        assert data.maxuse_arena >= twin.maxuse_arena
        data.qacc[:] = twin.qacc[:] = rng.normal(size=model.nv)
        mujoco.mj_inverse(model, data)
        mujoco.mj_inverse(plain, twin)
        np.testing.assert_array_equal(data.qfrc_inverse, twin.qfrc_inverse)
    assert len(different) > 30


@pytest.mark.parametrize("muscle", [False, True])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_muscle_system_equals_the_plugin(integrator: str, muscle: bool) -> None:
    for seed in range(3):
        made = knee(seed, integrator=integrator, muscle=muscle)
        model, plain = installed(made), made.model
        muscles = mw.MuscleSystem(plain)
        data, twin = start(made, model, seed), start(made, plain, seed)
        data.ctrl[:] = twin.ctrl[:] = 0.6
        pieces = set()
        for _ in range(200):
            mujoco.mj_step(model, data)
            muscles.step(twin)
            np.testing.assert_array_equal(data.qpos, twin.qpos)
            np.testing.assert_array_equal(data.eq_active, twin.eq_active)
            pieces.add(data.eq_active.tobytes())
        assert len(pieces) > 2


def test_apply_before_each_step_switches_for_this_step() -> None:
    made = knee(1, integrator="Euler", muscle=True)
    plain = made.model
    muscles = mw.MuscleSystem(plain)
    applied, stepped = start(made, plain), start(made, plain)
    applied.ctrl[:] = stepped.ctrl[:] = 0.4
    for _ in range(150):
        muscles.apply(applied)
        mujoco.mj_step(plain, applied)
        muscles.advance(applied)
    muscles.step(stepped, 150)
    np.testing.assert_allclose(applied.qpos, stepped.qpos, rtol=0, atol=1e-12)
    assert not np.array_equal(applied.eq_active, plain.eq_active0)


def state(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    found = np.empty(mujoco.mj_stateSize(model, FULL))
    mujoco.mj_getState(model, data, found, FULL)
    return found


@pytest.mark.parametrize("muscle", [False, True])
def test_rollout_and_batch_have_the_same_bits(muscle: bool) -> None:
    made = knee(4, integrator="RK4", muscle=muscle)
    model = installed(made)
    count, steps = 6, 80
    starts = [start(made, model, seed) for seed in range(count)]
    initial = np.array([state(model, data) for data in starts])
    control = np.random.default_rng(1).uniform(0.0, 1.0, (count, steps, model.nu))
    expected = np.empty((count, steps, initial.shape[1]))
    for env, data in enumerate(starts):
        for k in range(steps):
            data.ctrl[:] = control[env, k]
            mujoco.mj_step(model, data)
            expected[env, k] = state(model, data)
    used = start(made, model, 9)
    mujoco.mj_step(model, used, nstep=60)  # its pieces are others
    for datas in ([used], [used, mujoco.MjData(model)]):
        for order in (np.arange(count), np.arange(count)[::-1]):
            found, _ = rollout.rollout(
                model, datas, initial[order], control[order] if muscle else None, nstep=steps
            )
            np.testing.assert_array_equal(found[np.argsort(order)], expected)


@needs_batch
def test_a_batch_on_two_threads_has_the_same_bits() -> None:
    made = knee(4, integrator="RK4", muscle=True)
    model = installed(made)
    count, steps = 4, 80
    control = np.random.default_rng(1).uniform(0.0, 1.0, (count, steps, model.nu))
    pool = batch.Batch(model, count, nthread=2)
    starts = [start(made, model, seed) for seed in range(count)]
    for name in ("qpos", "qvel", "plugin_state"):
        getattr(pool, name)[:] = [getattr(data, name) for data in starts]
    recorded = pool.rollout(steps, control, record=[int(FULL)])[int(FULL)]
    for env, data in enumerate(starts):
        for k in range(steps):
            data.ctrl[:] = control[env, k]
            mujoco.mj_step(model, data)
            np.testing.assert_array_equal(recorded[env, k], state(model, data))


def test_a_restored_state_goes_on_with_the_same_bits() -> None:
    made = knee(3, integrator="RK4", muscle=True)
    model = installed(made)
    model.opt.disableflags |= int(DISABLE.mjDSBL_WARMSTART)  # no part of this state
    data = start(made, model)
    mujoco.mj_step(model, data, nstep=70)
    saved = state(model, data)
    mujoco.mj_step(model, data, nstep=70)
    expected = state(model, data)
    assert len({start(made, model).eq_active.tobytes(), data.eq_active.tobytes()}) == 2
    for target in (data, mujoco.MjData(model)):
        mujoco.mj_setState(model, target, saved, FULL)
        mujoco.mj_step(model, target, nstep=70)
        np.testing.assert_array_equal(state(model, target), expected)


def test_a_coupling_that_is_switched_off_stays_off() -> None:
    made = knee(1, integrator="RK4")
    model, plain = installed(made), made.model
    muscles = mw.MuscleSystem(plain)
    off = [model.equality(f"twist_{p}").id for p in range(7)]
    data, twin = start(made, model), start(made, plain)
    data.eq_active[off] = twin.eq_active[off] = 0
    for _ in range(100):
        mujoco.mj_step(model, data)
        muscles.step(twin)
    assert not data.eq_active[off].any()
    assert data.ne == 4
    np.testing.assert_array_equal(data.qpos, twin.qpos)


@pytest.mark.parametrize("flags", [["ACTUATION"], ["SPRING", "DAMPER"], ["ACTUATION", "DAMPER"], []])
def test_runge_kutta_switches_at_every_stage_whatever_is_disabled(flags: list[str]) -> None:
    made = knee(0, integrator="RK4", muscle=True)
    plain, model = made.model, made.model
    for each in (plain, model):
        each.opt.disableflags |= sum(int(getattr(DISABLE, f"mjDSBL_{name}")) for name in flags)
    muscles = mw.MuscleSystem(plain)
    data, twin = start(made, plain), start(made, model)
    calls: list[float] = []
    mujoco.set_mjcb_passive(lambda m, d: calls.append(d.time))
    try:
        for _ in range(120):
            muscles.step(data)
        called = len(calls)
        for _ in range(120):
            step(model, twin, lambda: made.set_active(model, twin))
    finally:
        mujoco.set_mjcb_passive(None)
    assert called in (480, 0)
    assert (called == 0) == ("SPRING" in flags)
    np.testing.assert_allclose(data.qpos, twin.qpos, rtol=0, atol=0 if "ACTUATION" in flags else 1e-3)
    assert not np.array_equal(data.eq_active, model.eq_active0)


def test_runge_kutta_with_nothing_enabled_is_refused() -> None:
    plain = knee(0, integrator="RK4").model
    plain.opt.disableflags |= sum(
        int(getattr(DISABLE, f"mjDSBL_{n}")) for n in ("ACTUATION", "SPRING", "DAMPER")
    )
    muscles = mw.MuscleSystem(plain)
    with pytest.raises(mw.StateError, match="pieces of the model's couplings cannot be switched"):
        muscles.step(mujoco.MjData(plain))


def test_plain_mujoco_stays_on_the_piece_of_the_default_pose() -> None:
    made = knee(0)
    plain = made.model
    data = start(made, plain)
    mujoco.mj_step(plain, data, nstep=100)
    np.testing.assert_array_equal(data.eq_active, plain.eq_active0)
    assert max(map(abs, CoupledJoints(plain).residuals(data.qpos).values())) > 1e-4


def test_couplings_alone_are_installed_saved_and_taken_out(tmp_path) -> None:
    made = knee(0, integrator="RK4")
    model = installed(made)
    expected = start(made, model)
    mujoco.mj_step(model, expected, nstep=100)
    path = tmp_path / "knee.mjb"
    mujoco.mj_saveModel(model, str(path), None)
    for again in (mw.load(path), mujoco.MjModel.from_binary_path(str(path))):
        data = start(made, again)
        mujoco.mj_step(again, data, nstep=100)
        np.testing.assert_array_equal(data.qpos, expected.qpos)
    assert mw.plugin.read(expected).names == []
    before = mw.plugin.without_plugin(model)
    data = start(made, before)
    mw.MuscleSystem(before).step(data, 100)
    np.testing.assert_array_equal(data.qpos, expected.qpos)


def test_an_installed_model_switches_after_attach_with_a_prefix() -> None:
    made = knee(0, integrator="Euler", timestep=0.002, muscle=True)
    child = mujoco.MjSpec.from_string(made.xml)
    mw.install(child)
    parent = mujoco.MjSpec()
    parent.attach(child, prefix="left_", frame=parent.worldbody.add_frame())
    model, alone = parent.compile(), installed(made)
    model.opt.disableflags = alone.opt.disableflags
    data, expected = mujoco.MjData(model), start(made, alone)
    data.qvel[:] = expected.qvel
    mujoco.mj_step(model, data, nstep=120)
    mujoco.mj_step(alone, expected, nstep=120)
    np.testing.assert_array_equal(data.eq_active, expected.eq_active)
    np.testing.assert_allclose(data.qpos, expected.qpos, rtol=0, atol=1e-12)
    assert not np.array_equal(data.eq_active, model.eq_active0)


def test_changed_knots_take_effect() -> None:
    made = knee(0, integrator="RK4")
    model = installed(made)
    data = start(made, model)
    mujoco.mj_forward(model, data)
    first = model.numeric("mjwrap_coupling_twist_knots")
    at = int(first.id)
    low = float(data.qpos[model.joint("knee").qposadr[0]]) - 3.0
    model.numeric_data[model.numeric_adr[at] : model.numeric_adr[at] + 6] = low + 0.1 * np.arange(6)
    mujoco.mj_forward(model, data)
    assert [bool(data.eq_active[model.equality(f"twist_{p}").id]) for p in range(7)] == [False] * 6 + [True]


def test_a_wrong_tuple_is_refused_by_install() -> None:
    made = knee(0)
    spec = mujoco.MjSpec.from_string(made.xml)
    spec.numeric("mjwrap_coupling_twist_knots").data = [1.0, 0.0]
    with pytest.raises(mw.ModelError, match="tuple 'mjwrap_coupling_twist': numeric"):
        mw.install(spec)
