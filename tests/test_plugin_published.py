"""In wrench mode MuJoCo's own arrays and sensors show lengths, velocities and tensions, and nothing pulls twice."""

from __future__ import annotations

import re

import mujoco
import numpy as np
import pytest
from cable_robot import CABLES
from declared_models import ARM, EXTENSOR, MUSCLE
from native_twins import EXPLICIT, INTEGRATORS, excite, native_spec, start
from random_models import ALL, random_state, random_xml
from test_plugin import moving, spec_of

import mjwrap as mw
from mjwrap.mjcf import marks
from mjwrap.plugin import install, read

RK4 = int(INTEGRATORS["mjINT_RK4"])
KINDS = ("actuatorpos", "actuatorvel", "actuatorfrc", "tendonpos", "tendonvel", "tendonactuatorfrc")
NAMES = ("whole", "front", "back")
ENDS = {"whole": ("e0", "{last}"), "front": ("e0", "second"), "back": ("first", "{last}")}


def with_actuators(seed: int) -> tuple[str, np.ndarray, np.ndarray]:
    """A random model whose muscles have actuators of random gear, and every sensor of these; gears, and cutoffs.

    cutoffs (6, 3): of `KINDS`, for each muscle; infinite where a sensor has none.
    """
    xml, rng = random_xml(seed, ALL), np.random.default_rng(seed)
    sites = [int(n) for n in re.findall(r'<site name="e(\d+)"', xml)]
    gears = rng.choice([1.0, -0.7, 2.5], 3)
    cutoffs = np.where(rng.random((6, 3)) < 0.3, rng.uniform(0.1, 20.0, (6, 3)), np.inf)
    tendons = actuators = sensors = ""
    for name, gear in zip(NAMES, gears, strict=True):
        ends = [site.format(last=f"e{max(sites)}") for site in ENDS[name]]
        tendons += f'<spatial name="{name}"><site site="{ends[0]}"/><site site="{ends[1]}"/></spatial>'
        actuators += f'<general name="{name}" tendon="{name}" gear="{float(gear)!r}" ctrlrange="0 1"/>'
        xml = xml.replace(
            f'<tuple name="mjwrap_{name}">',
            f'<tuple name="mjwrap_{name}"><element objtype="actuator" objname="{name}"/>',
        )
    for kind, row in zip(KINDS, cutoffs, strict=True):
        of = "actuator" if kind.startswith("actuator") else "tendon"
        for name, cutoff in zip(NAMES, row, strict=True):
            limit = f' cutoff="{float(cutoff)!r}"' if np.isfinite(cutoff) else ""
            sensors += f'<{kind} {of}="{name}"{limit}/>'
    parts = f"<tendon>{tendons}</tendon><actuator>{actuators}</actuator><sensor>{sensors}</sensor></mujoco>"
    return xml.replace("</mujoco>", parts), gears, cutoffs


def expected(muscles: mw.MuscleSystem, gears: np.ndarray, cutoffs: np.ndarray) -> np.ndarray:
    """What the sensors of `with_actuators` show (6, 3)."""
    length, velocity, tension = muscles.length, muscles.velocity, muscles.tension
    pull = -tension / gears
    shown = np.array([gears * length, gears * velocity, pull, length, velocity, pull])
    return np.clip(shown, -cutoffs, cutoffs)


@pytest.mark.parametrize("integrator", [0, RK4, int(INTEGRATORS["mjINT_IMPLICITFAST"])])
@pytest.mark.parametrize("seed", range(12))
def test_sensors_show_the_muscles(seed: int, integrator: int) -> None:
    """After mj_forward, and after mj_step of the state before it; no generalised force comes from what is shown."""
    xml, gears, cutoffs = with_actuators(seed)
    ours, reference = install(spec_of(xml)), mujoco.MjModel.from_xml_string(xml)
    ours.opt.integrator = reference.opt.integrator = integrator
    muscles, rng = mw.MuscleSystem(reference), np.random.default_rng(seed)
    data, twin, before = mujoco.MjData(ours), mujoco.MjData(reference), mujoco.MjData(reference)
    random_state(reference, twin, rng)
    twin.ctrl[:] = rng.uniform(0.2, 1.0, 3)
    for name in ("qpos", "qvel", "ctrl", "mocap_pos", "mocap_quat"):
        getattr(data, name)[:] = getattr(twin, name)
    for _ in range(5):
        mujoco.mj_forward(ours, data)
        muscles.forward(twin)
        assert not muscles.status.any()
        want = expected(muscles, gears, cutoffs)
        np.testing.assert_allclose(data.sensordata.reshape(6, 3), want, rtol=1e-12, atol=1e-12)
        pull = -muscles.tension / gears
        np.testing.assert_allclose(data.actuator_force, pull, rtol=1e-12)
        np.testing.assert_allclose(data.actuator_length, gears * muscles.length, rtol=1e-12)
        np.testing.assert_allclose(data.ten_length, muscles.length, rtol=1e-12)
        np.testing.assert_allclose(data.ten_velocity, muscles.velocity, rtol=1e-9, atol=1e-12)
        assert not data.qfrc_actuator.any()
        assert np.abs(data.actuator_force).min() > 1.0
        mujoco.mj_step(ours, data)
        np.testing.assert_allclose(data.sensordata.reshape(6, 3), want, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(data.actuator_force, -read(data).tension / gears, rtol=1e-12)
        assert not data.qfrc_actuator.any()
        mujoco.mj_copyData(before, reference, twin)
        muscles.step(twin)
        np.testing.assert_array_equal(data.qpos, twin.qpos)


def test_rollout_records_the_same_sensors() -> None:
    from mujoco import rollout

    xml, _, _ = with_actuators(3)
    model = install(spec_of(xml))
    data, other = mujoco.MjData(model), mujoco.MjData(model)
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    first = np.zeros(size)
    mujoco.mj_getState(model, data, first, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    control = np.random.default_rng(0).uniform(0.2, 1.0, (1, 8, 3))
    _, shown = rollout.rollout(model, other, first[None], control)
    for k in range(8):
        data.ctrl[:] = control[0, k]
        mujoco.mj_step(model, data)
        np.testing.assert_array_equal(np.asarray(shown).reshape(8, -1)[k], data.sensordata)
    assert np.abs(data.sensordata).min() > 0.0


# ---------------------------------------------------------------------------------------- beside native twins


def with_sensors(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """Add the sensors of every muscle and its tendon."""
    kinds = mujoco.mjtSensor.__members__
    for actuator in [a for a in spec.actuators if a.gaintype == mujoco.mjtGain.mjGAIN_MUSCLE]:
        for kind in KINDS:
            of_actuator = kind.startswith("actuator")
            spec.add_sensor(
                name=f"{kind} {actuator.name}",
                type=kinds["mjSENS_" + kind.upper().replace("TENDONACTUATORFRC", "TENDONACTFRC")],
                objtype=mujoco.mjtObj.mjOBJ_ACTUATOR if of_actuator else mujoco.mjtObj.mjOBJ_TENDON,
                objname=actuator.name if of_actuator else actuator.target,
            )
    return spec


@pytest.mark.parametrize("integrator", EXPLICIT)
def test_sensors_read_as_in_the_native_twin(integrator: int) -> None:
    """To rounding, over a second of motion, where MuJoCo's own paths are exact."""
    ours, native = install(with_sensors(native_spec())), with_sensors(native_spec()).compile()
    assert not ours.tendon_num.any()  # MuJoCo computes none of these paths
    datas = []
    for model in (ours, native):
        model.opt.integrator = int(integrator)
        datas.append(start(model))
    data, twin = datas
    for _ in range(500):
        for each in datas:
            excite(each)
            mujoco.mj_step(each.model, each)
        np.testing.assert_allclose(data.sensordata, twin.sensordata, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(data.actuator_length, twin.actuator_length, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(data.actuator_force, twin.actuator_force, rtol=1e-9, atol=1e-9)
    for each in datas:
        mujoco.mj_forward(each.model, each)
    np.testing.assert_allclose(data.sensordata, twin.sensordata, rtol=1e-9, atol=1e-9)
    assert data.sensordata.min() < -10.0


def test_a_muscle_with_a_gear_beside_other_actuators() -> None:
    """Only the muscle is taken over; a servo on another tendon reads and pulls as before."""
    data, twin = (mujoco.MjData(model) for model in (install(spec_of(CABLES)), spec_of(CABLES).compile()))
    for each in (data, twin):
        each.ctrl[:] = 0.6, 0.2, 0.5, 0.5, 0.3
        each.qvel[:] = 0.2
        mujoco.mj_forward(each.model, each)
    np.testing.assert_allclose(data.actuator_force, twin.actuator_force, rtol=1e-9)
    np.testing.assert_allclose(data.actuator_length, twin.actuator_length, rtol=1e-12)
    np.testing.assert_allclose(data.sensordata, twin.sensordata, rtol=1e-9)
    np.testing.assert_allclose(data.qacc, twin.qacc, rtol=1e-8, atol=1e-8)


# --------------------------------------------------------------------------------- where a force stays hidden

FELT = "<sensor><force site='{site}'/><torque site='{site}'/><actuatorfrc actuator='extensor'/></sensor></mujoco>"


def felt(xml: str) -> str:
    site = re.findall(r'<site name="(\w+)"', xml)[-1]
    return xml.replace("</mujoco>", FELT.format(site=site))


def test_force_sensors_feel_a_muscle_once() -> None:
    """If MuJoCo keeps the tendon, its force sensors would add the shown force to the wrenches: it is then not shown."""
    xml = felt(ARM.format(tendon=EXTENSOR, actuator=MUSCLE, custom="", option=""))
    lean = install(spec_of(xml))
    with pytest.warns(UserWarning, match="'extensor': the model has sensors of force or torque"):
        full = install(spec_of(xml), keep_tendons=True)
    datas = [moving(model) for model in (lean, full)]
    for data in datas:
        data.ctrl[:] = 0.7
        mujoco.mj_step(data.model, data, nstep=20)
        mujoco.mj_forward(data.model, data)
    tension = read(datas[0]).tension[0]
    assert datas[0].actuator_force[0] == -tension < -1.0
    assert datas[1].actuator_force[0] == 0.0
    np.testing.assert_array_equal(datas[0].sensordata[:6], datas[1].sensordata[:6])
    assert datas[0].sensordata[6] == -tension
    np.testing.assert_array_equal(datas[0].qacc, datas[1].qacc)


def test_lengths_are_left_alone_where_mujoco_uses_them() -> None:
    """A tendon with a spring has MuJoCo's own length, its actuator mjwrap's."""
    springy = EXTENSOR.replace('name="extensor"', 'name="extensor" stiffness="3"')
    assert springy != EXTENSOR
    xml = ARM.format(tendon=springy, actuator=MUSCLE, custom="", option="")
    data, twin = (moving(model) for model in (install(spec_of(xml)), spec_of(xml).compile()))
    for each in (data, twin):
        mujoco.mj_forward(each.model, each)
    assert data.ten_length[0] == twin.ten_length[0]
    assert data.actuator_length[0] == read(data).length[0]


def test_models_that_were_saved_before_forces_were_shown_still_move() -> None:
    """Their actuators are limited to 0 to 1e-12 N; installing the spec again shows the forces."""
    spec = native_spec()
    new = install(spec)
    for element in spec.actuators:
        element.forcerange = marks.EARLIER_RANGE
    old = spec.compile()
    datas = [start(model) for model in (new, old)]
    for data in datas:
        excite(data)
        mujoco.mj_step(data.model, data, nstep=20)
    np.testing.assert_array_equal(datas[0].qpos, datas[1].qpos)
    assert np.abs(datas[1].actuator_force).max() <= 1e-12
    again = start(install(spec))
    excite(again)
    mujoco.mj_forward(again.model, again)
    assert again.actuator_force.min() < -1.0
