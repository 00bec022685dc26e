"""The engine plugin: mj_step moves a model as MuscleSystem.step does, whoever steps it, wherever its state goes."""

from __future__ import annotations

import copy
import subprocess
import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import test_path_failures
from declared_models import ARM, EXTENSOR, HILL, HOLDER, MUSCLE, ROW, declared, element
from mujoco import rollout
from native_twins import ELBOW, EXPLICIT, INTEGRATORS, PUSH, excite, native_model, native_spec, start
from newer_mujoco import WAYS, batch, needs_kept_states

import mjwrap as mw
from mjwrap.errors import ModelError
from mjwrap.plugin import excitations, install, load, native, read

ROOT = Path(__file__).resolve().parent.parent
STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
RK4 = int(INTEGRATORS["mjINT_RK4"])


def elastic_arm() -> str:
    """The arm with two muscles on elastic tendons over every surface in a row, one of them without an actuator."""
    texts = {"law": "degroote_fregly_2016", "tendon_model": "elastic"}
    values = HILL | {"max_isometric_force": 100.0, "tendon_slack_length": 0.4}
    driven = declared([element("actuator", "extensor"), *ROW], values, texts=texts)
    free = declared(ROW, values, muscle="free", texts=texts)
    return ARM.format(tendon=EXTENSOR, actuator=HOLDER, custom=driven + free, option="")


SCENES = {
    "elbow": ELBOW.read_text(),
    "arm": ARM.format(tendon=EXTENSOR, actuator=MUSCLE, custom="", option=""),
    "elastic arm": elastic_arm(),
    "held inside": ARM.replace(
        'name="elbow_side" pos="-0.05 0 0"', 'name="elbow_side" pos="-0.005 0 0"'
    ).format(tendon=EXTENSOR, actuator=MUSCLE, custom="", option=""),
    "lost paths": test_path_failures.SCENE,  # a muscle that has no path for some of the time
}


def spec_of(xml: str) -> mujoco.MjSpec:
    return mujoco.MjSpec.from_string(xml)


def moving(model: mujoco.MjModel, seed: int = 0) -> mujoco.MjData:
    data = mujoco.MjData(model)
    rng = np.random.default_rng(seed)
    data.qpos[:] += rng.uniform(0.0, 0.2, model.nq)
    data.qvel[:] = rng.uniform(-0.5, 0.5, model.nv)
    if model.nplugin > 0:
        for excitation in excitations(data).values():
            excitation[:] = 0.6
    return data


def state_of(data: mujoco.MjData) -> np.ndarray[Any, Any]:
    out = np.empty(mujoco.mj_stateSize(data.model, STATE))
    mujoco.mj_getState(data.model, data, out, STATE)
    return out


# ------------------------------------------------------------------------------------------------- motion


@pytest.mark.parametrize("integrator", INTEGRATORS.values())
@pytest.mark.parametrize("scene", SCENES)
def test_mj_step_moves_as_muscle_system_does(scene: str, integrator: int) -> None:
    """The same kernels see the same numbers in the same order, so the states are equal to the bit."""
    ours, reference = install(spec_of(SCENES[scene])), spec_of(SCENES[scene]).compile()
    for model in (ours, reference):
        model.opt.integrator = int(integrator)
    ours.actuator_forcerange[:] = 0.0  # an actuator with a constant gain leaves 1e-12 N
    data, twin, muscles = moving(ours), moving(reference), mw.MuscleSystem(reference)
    twin.xfrc_applied[1] = data.xfrc_applied[1] = PUSH
    muscles.excitation[:] = 0.6
    strongest = 0.0
    for _ in range(150):
        excite(data)
        excite(twin)
        mujoco.mj_step(ours, data)
        muscles.step(twin)
        np.testing.assert_array_equal(data.qpos, twin.qpos)
        np.testing.assert_array_equal(data.act, twin.act)
        np.testing.assert_array_equal(data.xfrc_applied, twin.xfrc_applied)
        strongest = max(strongest, muscles.tension.min())
    assert strongest > 1.0
    assert bool(muscles.failures.any()) == (scene == "lost paths")
    result = read(data)
    assert result.names == muscles.names
    for name in ("length", "velocity", "tension", "activation", "fiber_length", "status", "failures"):
        np.testing.assert_array_equal(getattr(result, name), getattr(muscles, name))


@pytest.mark.parametrize("integrator", EXPLICIT)
def test_mj_step_moves_as_the_native_twin_does(integrator: int) -> None:
    """Cylinders and MuJoCo's own muscle law: what MuJoCo computes exactly itself."""
    native = native_model()
    ours = install(native_spec())
    for model in (native, ours):
        model.opt.integrator = int(integrator)
    data, twin = start(ours), start(native)
    for _ in range(500):
        excite(data)
        excite(twin)
        mujoco.mj_step(ours, data)
        mujoco.mj_step(native, twin)
    np.testing.assert_allclose(data.qpos, twin.qpos, rtol=0.0, atol=1e-12)  # rounding over 500 steps
    np.testing.assert_allclose(data.qvel, twin.qvel, rtol=0.0, atol=1e-11)


@pytest.mark.parametrize("mode", ["wrench", "transmission"])
@pytest.mark.parametrize("keep", [True, False])
def test_what_stays_native_is_named_and_pulls_on(keep: bool, mode: str) -> None:
    joint = '<muscle name="joint" joint="elbow" force="5" lengthrange="-1 1"/>'
    spec = spec_of(ARM.format(tendon=EXTENSOR, actuator=MUSCLE + joint, custom="", option=""))
    expected = mw.MuscleSystem(spec.compile()).native
    model = install(spec, mode, keep_tendons=keep)
    before = model.actuator_forcerange.copy(), model.tendon_num.copy()
    assert native(model) == expected == {"joint": "it does not pull a tendon"}
    assert np.array_equal(model.actuator_forcerange, before[0])
    assert np.array_equal(model.tendon_num, before[1])
    data = mujoco.MjData(model)
    data.act[:] = 1.0
    mujoco.mj_forward(model, data)
    assert read(data).names == ["extensor"]
    assert data.actuator_force[1] < -1.0


def test_runge_kutta_keeps_its_fourth_order() -> None:
    """Error after 0.16 s of a motion without kinks, for steps of 8 and 4 ms: 16 times smaller at half the step."""

    def angle(timestep: float) -> float:
        model = load(ELBOW.with_name("elbow_conservative.xml"))
        model.opt.integrator, model.opt.timestep = RK4, timestep
        data = mujoco.MjData(model)
        data.qpos[0], data.ctrl[0] = 0.6, 1.0
        mujoco.mj_step(model, data, nstep=round(0.16 / timestep))
        return float(data.qpos[0])

    exact = angle(2.5e-4)
    coarse, fine = (abs(angle(h) - exact) for h in (8e-3, 4e-3))
    assert 12.0 < coarse / fine < 20.0


# -------------------------------------------------------------------------------------------- who steps it


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("scene", SCENES)
def test_the_bits_do_not_depend_on_who_steps(scene: str, way: str) -> None:
    check_bits(install(spec_of(SCENES[scene])), way)


def check_bits(model: mujoco.MjModel, way: str) -> None:
    """A loop and rollout or batch on one and two threads, environments in any order: all states are the same."""
    nenv, nstep = 6, 120
    initial = np.stack([state_of(moving(model, seed)) for seed in range(nenv)])
    control = np.random.default_rng(1).uniform(0.0, 1.0, (nenv, nstep, model.nu))
    expected = np.empty((nenv, nstep, initial.shape[1]))
    for env in range(nenv):
        data = moving(model, env)
        for k in range(nstep):
            data.ctrl[:] = control[env, k]
            mujoco.mj_step(model, data)
            expected[env, k] = state_of(data)
    if way == "batch":
        check_batch(model, control, expected)
        return
    used = mujoco.MjData(model)
    mujoco.mj_step(model, used, nstep=7)
    mujoco.mj_forward(model, used)
    for datas in ([used], [used, moving(model, 99)]):
        for order in (np.arange(nenv), np.arange(nenv)[::-1]):
            found, _ = rollout.rollout(model, datas, initial[order], control[order])
            np.testing.assert_array_equal(found[np.argsort(order)], expected)


def check_batch(model: mujoco.MjModel, control: np.ndarray, expected: np.ndarray) -> None:
    nenv, nstep, _ = control.shape
    starts = [moving(model, env) for env in range(nenv)]
    for threads in (1, 2):
        pool = batch.Batch(model, nenv, nthread=threads)
        for name in ("qpos", "qvel", "plugin_state"):
            getattr(pool, name)[:] = [getattr(data, name) for data in starts]
        recorded = pool.rollout(nstep, control, record=[int(STATE)])[int(STATE)]
        np.testing.assert_array_equal(recorded, expected)


def test_a_restored_state_goes_on_with_the_same_bits() -> None:
    """Also in another mjData, and in one whose xfrc_applied holds what the last mj_forward put there."""
    model = install(spec_of(SCENES["arm"]))
    data = moving(model)
    data.ctrl[:] = 0.7
    mujoco.mj_step(model, data, nstep=50)
    saved = state_of(data)
    mujoco.mj_step(model, data, nstep=50)
    expected = state_of(data)
    other = moving(model, 5)
    other.ctrl[:] = 0.7
    mujoco.mj_forward(model, other)
    for target in (data, other, mujoco.MjData(model)):
        target.ctrl[:] = 0.7
        mujoco.mj_setState(model, target, saved, STATE)
        mujoco.mj_step(model, target, nstep=50)
        np.testing.assert_array_equal(state_of(target), expected)


def test_a_state_that_holds_xfrc_applied_is_restored_without_doubling_the_muscles() -> None:
    """After mj_forward the muscles' forces are in xfrc_applied, and in a state that is saved with it."""
    model, everything = install(spec_of(SCENES["arm"])), mujoco.mjtState.mjSTATE_INTEGRATION
    data = moving(model)
    data.xfrc_applied[2] = PUSH
    mujoco.mj_forward(model, data)
    saved = np.empty(mujoco.mj_stateSize(model, everything))
    mujoco.mj_getState(model, data, saved, everything)
    for target in (mujoco.MjData(model), moving(model, 3), data):
        mujoco.mj_forward(model, target)
        mujoco.mj_setState(model, target, saved, everything)
        mujoco.mj_step(model, target)
        expected = np.zeros((model.nbody, 6))
        expected[2] = PUSH
        np.testing.assert_array_equal(target.xfrc_applied, expected)


def test_copies_of_data_and_model_go_their_own_way() -> None:
    model = install(spec_of(SCENES["elastic arm"]))
    data = moving(model)
    data.ctrl[:] = 0.4
    mujoco.mj_step(model, data, nstep=20)
    mujoco.mj_forward(model, data)
    twin, fresh = copy.copy(data), mujoco.MjData(copy.copy(model))
    mujoco.mj_copyData(fresh, model, data)
    mujoco.mj_step(model, data, nstep=20)
    for other in (twin, fresh):
        mujoco.mj_step(other.model, other, nstep=20)
        np.testing.assert_array_equal(state_of(other), state_of(data))
        np.testing.assert_array_equal(other.xfrc_applied, np.zeros((model.nbody, 6)))


def test_a_reset_forgets_everything() -> None:
    model = install(spec_of(SCENES["elastic arm"]))
    data, fresh = moving(model, 4), mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=30)
    mujoco.mj_forward(model, data)
    mujoco.mj_resetData(model, data)
    for each in (data, fresh):
        mujoco.mj_step(model, each, nstep=5)
    np.testing.assert_array_equal(state_of(data), state_of(fresh))


def test_models_of_equal_shape_do_not_mix() -> None:
    """Two models that differ in one number, stepped in turn, move as each does alone."""
    models = [install(spec_of(SCENES["arm"].replace('force="400"', f'force="{f}"'))) for f in (400, 200)]
    together = [moving(model) for model in models]
    alone = [moving(model) for model in models]
    for data in (*together, *alone):
        data.ctrl[:] = 0.9
    for _ in range(50):
        for data in together:
            mujoco.mj_step(data.model, data)
    for data in alone:
        mujoco.mj_step(data.model, data, nstep=50)
    for one, other in zip(together, alone, strict=True):
        np.testing.assert_array_equal(state_of(one), state_of(other))
    assert not np.array_equal(together[0].qpos, together[1].qpos)


# ------------------------------------------------------------------------------------------------ the model


def test_a_saved_model_runs_as_before(tmp_path: Path) -> None:
    """As XML, as MJB, and compiled again from the spec."""
    spec = spec_of(SCENES["elbow"])
    model = install(spec)
    reference = moving(model)
    mujoco.mj_step(model, reference, nstep=60)
    mujoco.mj_saveModel(model, str(tmp_path / "arm.mjb"))
    (tmp_path / "arm.xml").write_text(spec.to_xml())
    as_xml = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    for other, tolerance in ((load(tmp_path / "arm.mjb"), 0.0), (spec.compile(), 0.0), (as_xml, 1e-4)):
        data = moving(other)
        mujoco.mj_step(other, data, nstep=60)
        np.testing.assert_allclose(data.qpos, reference.qpos, rtol=0.0, atol=tolerance)  # XML has six digits


@needs_kept_states
def test_a_model_compiled_again_keeps_its_state() -> None:
    spec = spec_of(SCENES["elbow"])
    model = install(spec)
    reference = moving(model)
    mujoco.mj_step(model, reference, nstep=60)
    model, data = spec.recompile(model, reference)
    np.testing.assert_array_equal(data.plugin_state, reference.plugin_state)


@pytest.mark.parametrize("when", ["before", "after"])
def test_a_muscle_model_attached_twice(when: str) -> None:
    """Each copy moves as the model does alone, whether it was upgraded before or after it was attached."""
    alone = install(spec_of(SCENES["arm"]))
    parent = mujoco.MjSpec()
    parent.option.timestep = alone.opt.timestep
    for prefix, place in (("left/", [0.0, 0.0, 0.0]), ("right/", [0.0, 3.0, 0.0])):
        child = spec_of(SCENES["arm"])
        if when == "before":
            install(child)
        parent.attach(child, frame=parent.worldbody.add_frame(pos=place), prefix=prefix)
    both = parent.compile() if when == "before" else install(parent)
    assert both.nplugin == (2 if when == "before" else 1)
    data, reference = mujoco.MjData(both), mujoco.MjData(alone)
    data.ctrl[:], reference.ctrl[:] = 0.8, 0.8
    mujoco.mj_step(both, data, nstep=100)
    mujoco.mj_step(alone, reference, nstep=100)
    np.testing.assert_allclose(data.qpos, np.tile(reference.qpos, 2), rtol=0.0, atol=1e-12)


def test_what_cannot_be_installed_is_named() -> None:
    with pytest.raises(mw.ModelError, match="no muscle"):
        install(
            mujoco.MjSpec.from_string("<mujoco><worldbody><body><geom size='1'/></body></worldbody></mujoco>")
        )
    with pytest.raises(mw.ModelError, match="modes: wrench, transmission"):
        install(spec_of(SCENES["arm"]), mode="push")
    with pytest.raises(mw.ModelError, match="expected an MjSpec"):
        install(native_model())  # type: ignore[arg-type]


def test_a_model_changed_after_install_is_refused_by_name(capfd: pytest.CaptureFixture[str]) -> None:
    spec = spec_of(SCENES["arm"])
    install(spec)
    spec.actuator("extensor").name = "renamed"
    with pytest.raises(ValueError, match="plugin"):
        spec.compile()
    assert "no longer has the muscle 'extensor'" in capfd.readouterr().err
    assert install(spec).nplugin == 1


@pytest.mark.parametrize("garbage", [np.nan, np.inf, -1e300, 7.0])
def test_a_state_that_means_nothing_is_survived(garbage: float) -> None:
    """Anybody may write to plugin_state; a reset cures it."""
    model = install(spec_of(SCENES["elastic arm"]))
    data, fresh = mujoco.MjData(model), mujoco.MjData(model)
    data.plugin_state[:] = garbage
    mujoco.mj_forward(model, data)
    mujoco.mj_resetData(model, data)
    for each in (data, fresh):
        mujoco.mj_step(model, each, nstep=3)
    np.testing.assert_array_equal(state_of(data), state_of(fresh))


def test_tendons_that_only_show_the_way_are_left_out(tmp_path: Path) -> None:
    """The motion stays the same, and a model without them still knows where its muscles run."""
    lean, full = install(spec_of(SCENES["arm"])), install(spec_of(SCENES["arm"]), keep_tendons=True)
    assert lean.tendon_num.tolist() == [0]
    assert full.tendon_num.tolist() == [6]
    curves = [int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtGain.mjGAIN_MUSCLE)]  # nor is a force computed
    assert [int(model.actuator_gaintype[0]) for model in (lean, full)] == curves
    mujoco.mj_saveModel(lean, str(tmp_path / "lean.mjb"))
    datas = [moving(model) for model in (lean, full, copy.copy(lean), load(tmp_path / "lean.mjb"))]
    for data in datas:
        data.ctrl[:] = 0.6
        mujoco.mj_step(data.model, data, nstep=50)
        np.testing.assert_array_equal(state_of(data), state_of(datas[0]))
        assert data.actuator_force[0] < -1.0
        assert data.qfrc_actuator[0] == 0.0 < data.act[0]
    assert full.ntendon == 1
    assert datas[0].ten_length[0] == datas[1].ten_length[0] > 0.0
    assert not datas[0].ten_J.any()
    assert datas[1].ten_J.any()


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ('<spatial name="extensor">', '<spatial name="extensor" stiffness="1">'),
        ('<spatial name="extensor">', '<spatial name="extensor" range="0 2" limited="true">'),
        ("</mujoco>", '<sensor><tendonpos tendon="extensor" nsample="3" delay="0.004"/></sensor></mujoco>'),
        ("</mujoco>", '<equality><tendon tendon1="extensor"/></equality></mujoco>'),
        ("</actuator>", '<motor tendon="extensor"/></actuator>'),
        ("<muscle ", '<muscle damping="1" '),
    ],
)
def test_tendons_that_somebody_needs_stay(before: str, after: str) -> None:
    assert install(spec_of(SCENES["arm"].replace(before, after))).tendon_num.tolist() == [6]


def test_another_process_runs_the_callbacks_from_the_cache() -> None:
    """Twice in a row, so that the second has nothing to compile; the data live until the process ends."""
    code = (
        f"import mujoco, mjwrap as mw; model = mw.load({str(ELBOW)!r}); data = mujoco.MjData(model); "
        "mujoco.mj_step(model, data, nstep=20); print(data.qpos[0].hex())"
    )
    model = load(ELBOW)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=20)
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-X", "faulthandler", "-c", code], cwd=ROOT, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        assert done.stdout.split() == [data.qpos[0].hex()]
        assert "compiling" not in done.stderr


def test_an_installed_model_has_no_muscle_system() -> None:
    model = mw.install(mujoco.MjSpec.from_file(str(ELBOW)))
    with pytest.raises(mw.ModelError, match="engine plugin already drives the muscles"):
        mw.MuscleSystem(model)


def test_a_saved_model_has_its_mode(tmp_path: Path) -> None:
    model = install(spec_of(SCENES[next(iter(SCENES))]))
    file = tmp_path / "m.mjb"
    mujoco.mj_saveModel(model, str(file))
    for mode in (None, "wrench"):
        assert load(file, mode).nplugin == 1
    for mode, told in (("transmission", "was saved with mode 'wrench'"), ("sideways", "does not exist")):
        with pytest.raises(ModelError, match=told):
            load(file, mode)
