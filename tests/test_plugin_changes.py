"""Numbers of a model that change while it runs count at the next step, as in MuJoCo, for every mjData and model."""

from __future__ import annotations

import copy
from collections.abc import Callable

import mujoco
import numpy as np
import pytest
from declared_models import ARM, EXTENSOR, HILL, declared, element
from mujoco import rollout
from native_twins import ELBOW, EXPLICIT, excite, native_model, start
from newer_mujoco import WAYS, batch, needs_batch
from test_plugin import SCENES, STATE, moving, spec_of, state_of

from mjwrap.plugin import install

Change = Callable[[mujoco.MjModel], None]


def rows() -> str:
    """A muscle over an ellipsoid, a finite cylinder and a capsule of the model, and a sphere of its own."""
    path = [element("site", "origin"), element("geom", "egg"), element("geom", "elbow", 1)]
    path += [element("geom", "ulna"), element("site", "middle")]
    own = '<numeric name="mjwrap_m_sphere_size" data="0.02"/>'
    path += [
        element("geom", "ball"),
        element("numeric", "mjwrap_m_sphere_size"),
        element("site", "insertion"),
    ]
    made = own + declared(path, HILL | {"max_isometric_force": 150.0})
    arm = ARM.replace('pos="0 0 0.6"', 'pos="-0.002 0 0.1"').replace(
        '"0.05 0 0 0.25 0 0"', '"0.08 0 0 0.09 0 0"'
    )
    return arm.format(tendon="", actuator="", custom=made, option="")


EARLY = """<general name="extensor" tendon="extensor" gaintype="muscle" biastype="muscle" dyntype="filter" dynprm=".05"
  actearly="true" lengthrange="0.3 0.6" gainprm="0.75 1.05 400 200 0.5 1.6 1.5 1.3 1.2"
  biasprm="0.75 1.05 400 200 0.5 1.6 1.5 1.3 1.2"/>"""
SCENE = {
    **SCENES,
    "rows": rows(),
    "scaled": SCENES["arm"].replace('force="400"', 'scale="100"'),
    "early": ARM.format(tendon=EXTENSOR, actuator=EARLY, custom="", option=""),
}


def set_to(name: str, index: object, value: float) -> Change:
    def change(model: mujoco.MjModel) -> None:
        getattr(model, name)[index] = value

    return change


def scale(name: str, index: object, factor: float) -> Change:
    def change(model: mujoco.MjModel) -> None:
        getattr(model, name)[index] *= factor

    return change


def geom(name: str, column: int, factor: float) -> Change:
    def change(model: mujoco.MjModel) -> None:
        model.geom_size[model.geom(name).id, column] *= factor

    return change


CHANGES = {
    "peak force": ("arm", scale("actuator_gainprm", (0, 2), 0.5)),
    "passive force": ("arm", set_to("actuator_biasprm", (0, 0), 1.0)),
    "shortening speed": ("arm", scale("actuator_gainprm", (0, 6), 2.0)),
    "length range": ("arm", scale("actuator_lengthrange", 0, 1.2)),
    "gear": ("arm", scale("actuator_gear", (0, 0), 0.9)),
    "control range": ("elastic arm", set_to("actuator_ctrlrange", (0, 1), 0.1)),
    "site": ("arm", set_to("site_pos", (0, 0), -0.03)),
    "cylinder": ("arm", geom("elbow", 0, 1.3)),
    "sphere": ("arm", geom("ball", 0, 0.6)),
    "place of a geom": ("arm", set_to("geom_pos", (0, 0), 0.005)),
    "ellipsoid": ("rows", geom("egg", 0, 8.0)),
    "capsule": ("rows", geom("ulna", 0, 1.5)),
    "size in a numeric": ("rows", scale("numeric_data", 0, 0.5)),
    "slack length": ("elastic arm", scale("numeric_data", slice(2, None, 3), 1.05)),
    "time constant of an early activation": ("early", set_to("actuator_dynprm", (0, 0), 0.2)),
    "scale and acc0": ("scaled", scale("actuator_acc0", 0, 3.0)),
}


@pytest.mark.parametrize("case", CHANGES)
def test_a_changed_number_counts_from_the_next_step(case: str) -> None:
    """The run goes on as new data of a model that was so changed before, from the same state."""
    scene, change = CHANGES[case]
    model, other = install(spec_of(SCENE[scene])), install(spec_of(SCENE[scene]))
    change(other)
    data, unchanged, reference = moving(model), moving(model), mujoco.MjData(other)
    for each in (data, unchanged):
        for _ in range(40):
            excite(each)
            mujoco.mj_step(model, each)
    state = state_of(data)
    mujoco.mj_setState(other, reference, state, STATE)
    mujoco.mj_forward(model, data)
    for _ in range(60):
        excite(unchanged)
        mujoco.mj_step(model, unchanged)
    change(model)
    for _ in range(60):
        for each in (data, reference):
            excite(each)
            mujoco.mj_step(each.model, each)
    np.testing.assert_array_equal(state_of(data), state_of(reference))
    assert np.abs(data.qpos - unchanged.qpos).max() > 1e-6


@pytest.mark.parametrize("integrator", EXPLICIT)
def test_changed_numbers_do_what_they_do_to_the_native_twin(integrator: int) -> None:
    """Also where gain and bias get different parameters, as when only the active force fades."""
    spec = mujoco.MjSpec.from_file(str(ELBOW))
    for declaration in list(spec.tuples):
        spec.delete(declaration)
    ours, native = install(spec), native_model()
    data, twin = start(ours), start(native)
    for model in (ours, native):
        model.opt.integrator = int(integrator)
    rng = np.random.default_rng(3)
    for episode in range(6):
        factors = rng.uniform(0.7, 1.3, (4, native.nu))
        for model in (ours, native):
            model.actuator_gainprm[:, 2] = np.abs(model.actuator_gainprm[:, 2]) * factors[0]
            model.actuator_biasprm[:, 7] *= factors[1]
            model.actuator_lengthrange[:, 1] *= 1.0 + 0.1 * (factors[2] - 1.0)
            model.actuator_gear[:, 0] *= 1.0 + 0.1 * (factors[3] - 1.0)
            model.site_pos[:, 2] += 1e-3 * rng.normal() if model is ours else 0.0
            model.geom_size[:, 0] *= 1.0 - 0.02 * (episode % 2)
        native.site_pos[:] = ours.site_pos
        for each in (data, twin):
            for _ in range(50):
                excite(each)
                mujoco.mj_step(each.model, each)
        np.testing.assert_allclose(data.qpos, twin.qpos, rtol=0.0, atol=1e-11)  # rounding, over 300 steps


def variants(scene: str, count: int) -> list[mujoco.MjModel]:
    """Models that differ in forces, sizes and declared numbers."""
    model, rng = install(spec_of(SCENE[scene])), np.random.default_rng(5)
    models = [copy.copy(model) for _ in range(count)]
    for each in models:
        each.actuator_gainprm[:, 2] *= rng.uniform(0.5, 1.5)
        each.geom_size[:] *= rng.uniform(0.9, 1.1)
        each.numeric_data[:] *= rng.uniform(0.97, 1.03, each.numeric_data.shape)
    return models


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("scene", ["arm", "elastic arm"])
def test_one_mjdata_serves_many_models(scene: str, way: str) -> None:
    """In rollout over a list of models, or in a Batch with a model for each simulation, on one and two threads."""
    models = variants(scene, 5)
    datas = [moving(model, seed) for seed, model in enumerate(models)]
    initial = np.stack([state_of(data) for data in datas])
    control = np.random.default_rng(1).uniform(0.0, 1.0, (5, 40, models[0].nu))
    expected = np.empty((5, 40, initial.shape[1]))
    for data, controls, states in zip(datas, control, expected, strict=True):
        for k in range(40):
            data.ctrl[:] = controls[k]
            mujoco.mj_step(data.model, data)
            states[k] = state_of(data)
    if way == "rollout":
        for workers in ([mujoco.MjData(models[2])], [mujoco.MjData(models[0]), mujoco.MjData(models[4])]):
            found, _ = rollout.rollout(models, workers, initial, control)
            np.testing.assert_array_equal(found, expected)
        return
    for threads in (1, 2):
        pool = batch.Batch(models[0], 5, nthread=threads)
        pool.set_models(models)
        for seed, model in enumerate(models):
            data = moving(model, seed)
            for name in ("qpos", "qvel", "plugin_state"):
                getattr(pool, name)[seed] = getattr(data, name)
        for k in range(40):
            pool.ctrl[:] = control[:, k]
            pool.step()
        np.testing.assert_array_equal(pool.qpos, expected[:, -1, 1 : 1 + models[0].nq])


@needs_batch
def test_a_batch_has_numbers_of_its_own_for_each_simulation() -> None:
    model = install(spec_of(SCENE["arm"]))
    forces = np.array([100.0, 400.0, 800.0])
    pool = batch.Batch(model, 3, nthread=2)
    pool.expand("actuator_gainprm")[:, 0, 2] = forces
    alone = []
    for force in forces:
        other = install(spec_of(SCENE["arm"]))
        other.actuator_gainprm[0, 2] = force
        data = mujoco.MjData(other)
        data.ctrl[:] = 0.5
        mujoco.mj_step(other, data, nstep=50)
        alone.append(data.qpos.copy())
    pool.ctrl[:] = 0.5
    for _ in range(50):
        pool.step()
    np.testing.assert_array_equal(pool.qpos, alone)


def test_a_change_without_sense_is_told_and_not_followed(capfd: pytest.CaptureFixture[str]) -> None:
    """The muscles stay as they were, it is said once, and the next change that makes sense counts."""
    model = install(spec_of(SCENE["elastic arm"]))
    data, reference = moving(model), moving(model)
    mujoco.mj_step(model, reference, nstep=40)
    before = model.numeric_data.copy()
    mujoco.mj_step(model, data, nstep=20)
    model.numeric_data[:] = -1.0
    mujoco.mj_step(model, data, nstep=20)
    said = capfd.readouterr().err
    assert said.count("a change of the model is ignored") == 1
    assert "must be finite and positive, not -1.0" in said
    np.testing.assert_array_equal(state_of(data), state_of(reference))
    model.numeric_data[:] = before
    for each in (data, reference):
        mujoco.mj_step(model, each, nstep=20)
    np.testing.assert_array_equal(state_of(data), state_of(reference))
    assert capfd.readouterr().err == ""
