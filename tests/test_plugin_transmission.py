"""Transmission: MuJoCo's own actuators act along mjwrap's paths, and all that MuJoCo does with them stays right."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from cable_robot import CABLES, drive
from declared_models import ARM, EXTENSOR, HILL, MUSCLE, PULLEYS, ROW, declared, element, tendon_jacobian
from native_twins import ELBOW, INTEGRATORS, excite, native_spec, start
from newer_mujoco import WAYS, needs_felt_tendons
from test_path_failures import RADIUS, SCENE
from test_plugin import STATE, check_bits, moving, spec_of, state_of

import mjwrap as mw
from mjwrap.plugin import Muscles, excitations, install, read

RK4 = int(INTEGRATORS["mjINT_RK4"])
# a MuJoCo muscle whose end is in a thick cylinder for some of the time, and too deep for some of that, beside
# muscles of mjwrap's laws, which act by wrenches
THICK = SCENE.replace(f'type="cylinder" size="{RADIUS}', 'type="cylinder" size="0.07').replace(
    '"0 0.05 0"', '"0 0.09 0"'
)
LOST = THICK.replace(
    "<tendon>",
    '<tendon><spatial name="round"><site site="origin"/><geom geom="cylinder" sidesite="above"/>'
    '<site site="insertion"/></spatial>',
).replace("<actuator>", '<actuator><muscle name="lost" tendon="round" force="40" lengthrange="0.1 0.3"/>')

TWINS = {
    "elbow": (native_spec, start, excite),
    "cables": (lambda: spec_of(CABLES), mujoco.MjData, drive),
}
SHOWN = {
    "qpos": 1e-12, "qvel": 1e-11, "act": 0.0, "actuator_length": 1e-13, "actuator_velocity": 1e-11,
    "actuator_force": 1e-9, "qfrc_actuator": 1e-9, "sensordata": 1e-9, "ten_length": 1e-13, "ten_velocity": 1e-11,
}  # fmt: skip


def twins(name: str, integrator: int = 0) -> tuple[mujoco.MjData, mujoco.MjData]:
    """Data of a model in transmission mode, and of its native twin."""
    make, begin, _ = TWINS[name]
    models = install(make(), mode="transmission"), make().compile()
    for model in models:
        model.opt.integrator = integrator
    return begin(models[0]), begin(models[1])


def lost_paths() -> mujoco.MjModel:
    return install(spec_of(LOST), mode="transmission")


# ------------------------------------------------------------------------------------------------- motion


@pytest.mark.parametrize("integrator", INTEGRATORS.values())
@pytest.mark.parametrize("name", TWINS)
def test_everything_moves_and_reads_as_in_the_native_twin(name: str, integrator: int) -> None:
    """For 1 s, to rounding: the paths are the same, and the forces MuJoCo's in both."""
    data, twin = twins(name, integrator)
    control = TWINS[name][2]
    touched = set()
    for _ in range(round(1.0 / data.model.opt.timestep)):
        for each in (data, twin):
            control(each)
            mujoco.mj_step(each.model, each)
        touched.add(tuple(twin.ten_wrapnum))
        for field, tolerance in SHOWN.items():
            np.testing.assert_allclose(
                getattr(data, field), getattr(twin, field), rtol=0.0, atol=tolerance, err_msg=field
            )
    assert len(touched) > 1  # strings have lifted off and come back
    assert not data.model.tendon_num.any()  # MuJoCo computed none of these paths
    np.testing.assert_allclose(
        tendon_jacobian(data.model, data), tendon_jacobian(twin.model, twin), atol=1e-12
    )
    muscles = read(data)
    assert muscles.transmitted.all()
    gear = twin.model.actuator_gear[:, 0]
    np.testing.assert_allclose(muscles.length, twin.actuator_length / gear, atol=1e-12)
    np.testing.assert_allclose(muscles.tension, -gear * twin.actuator_force, atol=1e-9)


@pytest.mark.parametrize("name", TWINS)
def test_parts_of_a_step_do_as_in_the_native_twin(name: str) -> None:
    """mj_step1 and mj_step2, mj_forward, mj_inverse, and MuJoCo's own derivatives of a step."""
    data, twin = twins(name, int(INTEGRATORS["mjINT_IMPLICITFAST"]))
    found: list[list[Any]] = []
    for each in (data, twin):
        model = each.model
        for _ in range(20):
            mujoco.mj_step1(model, each)
            TWINS[name][2](each)
            mujoco.mj_step2(model, each)
        mujoco.mj_forward(model, each)
        results = [np.copy(each.qpos), np.copy(each.qacc), np.copy(each.sensordata)]
        mujoco.mj_inverse(model, each)
        results.append(np.copy(each.qfrc_inverse))
        n = 2 * model.nv + model.na
        slopes = np.zeros((n, n)), np.zeros((n, model.nu))
        mujoco.mjd_transitionFD(model, each, 1e-5, True, *slopes, None, None)
        found.append([*results, *slopes])
    for ours, theirs in zip(*found, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-8, atol=1e-8)  # differences over 1e-5
    assert np.abs(found[0][-1]).max() > 1e-3


@pytest.mark.parametrize("mode", ["wrench", "transmission"])
@pytest.mark.parametrize(
    ("integrator", "order"), [("EULER", 1), ("RK4", 4), ("IMPLICIT", 1), ("IMPLICITFAST", 1)]
)
def test_both_modes_come_to_the_native_motion_with_the_order_of_the_integrator(
    mode: str, integrator: str, order: int
) -> None:
    """A constant tension over one cylinder: errors after 0.16 s fall by 2**order where the step is halved."""
    path = ELBOW.with_name("elbow_conservative.xml")

    def angle(model: mujoco.MjModel, timestep: float, kind: int) -> float:
        model.opt.integrator, model.opt.timestep = kind, timestep
        data = mujoco.MjData(model)
        data.qpos[0], data.ctrl[0] = 0.6, 1.0
        mujoco.mj_step(model, data, nstep=round(0.16 / timestep))
        return float(data.qpos[0])

    spec = mujoco.MjSpec.from_file(str(path)) if mode == "wrench" else native_spec(path)
    ours, exact = install(spec, mode=mode), angle(native_spec(path).compile(), 2.5e-4, RK4)
    kind = int(INTEGRATORS[f"mjINT_{integrator}"])
    coarse, fine = (abs(angle(ours, h, kind) - exact) for h in (8e-3, 4e-3))
    assert 0.75 * 2**order < coarse / fine < 1.25 * 2**order


@pytest.mark.parametrize("integrator", ["IMPLICIT", "IMPLICITFAST"])
def test_by_wrenches_muscles_lack_only_the_implicit_damping(integrator: str) -> None:
    """So the motion tends to the native one with the first order of these integrators."""

    def difference(timestep: float) -> float:
        models = install(native_spec()), native_spec().compile()
        datas = []
        for model in models:
            model.opt.integrator, model.opt.timestep = int(INTEGRATORS[f"mjINT_{integrator}"]), timestep
            datas.append(start(model))
            datas[-1].ctrl[:] = 0.4
            mujoco.mj_step(model, datas[-1], nstep=round(0.2 / timestep))
        return float(np.abs(datas[0].qpos - datas[1].qpos).max())

    coarse, fine = difference(2e-3), difference(1e-3)
    assert 1.6 < coarse / fine < 2.5
    assert fine > 1e-6


# ---------------------------------------------------------------------------------- who steps, and state


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("xml", [CABLES, LOST], ids=["cables", "lost paths"])
def test_the_bits_do_not_depend_on_who_steps(xml: str, way: str) -> None:
    check_bits(install(spec_of(xml), mode="transmission"), way)


@pytest.mark.parametrize("integrator", [0, RK4])
def test_where_no_path_is_found_the_last_good_one_counts(integrator: int) -> None:
    """Length, velocity and tension stand still, nothing is ever NaN, and a state saved there goes on with its bits."""
    model = lost_paths()
    model.opt.integrator = integrator
    data, other = mujoco.MjData(model), mujoco.MjData(model)
    held, longest = 0, 0
    for step in range(200):
        before = np.copy(data.actuator_length), np.copy(data.actuator_velocity)
        data.ctrl[:] = 0.5
        mujoco.mj_step(model, data)
        muscles = read(data)
        lost = muscles.names.index("lost")
        assert np.isfinite(data.qacc).all()
        assert np.isfinite(data.actuator_force).all()
        without = Muscles(data).held[lost]
        assert not without or muscles.status[lost] == mw.Status.ENDPOINT_INSIDE
        if without and held:
            np.testing.assert_array_equal(
                (data.actuator_length[0], data.actuator_velocity[0]), [b[0] for b in before]
            )
            assert data.actuator_force[0] < 0.0
            assert data.actuator_moment.any()
        held = held + 1 if without else 0
        longest = max(longest, held)
        if held == 3:
            saved = state_of(data)
        if step == 160:
            expected = state_of(data)
    assert 10 < longest < read(data).failures[lost] < 150
    mujoco.mj_setState(model, other, saved, STATE)
    while not np.isclose(other.time, expected[0]):
        other.ctrl[:] = 0.5
        mujoco.mj_step(model, other)
    np.testing.assert_array_equal(state_of(other), expected)


def test_a_cold_start_without_a_path_pulls_with_nothing() -> None:
    data = mujoco.MjData(lost_paths())
    data.qpos[0], data.ctrl[:] = -0.08, 1.0
    mujoco.mj_forward(data.model, data)
    assert read(data).status[0] != 0
    assert data.actuator_length[0] == data.actuator_velocity[0] == 0.0
    first = data.moment_rowadr[0]
    assert not data.actuator_moment[first : first + data.moment_rownnz[0]].any()
    assert np.isfinite(data.qacc).all()


@pytest.mark.parametrize("garbage", [np.nan, -1e300])
def test_a_state_that_means_nothing_gives_numbers(garbage: float) -> None:
    data = mujoco.MjData(lost_paths())
    data.qpos[0] = -0.08
    data.plugin_state[:] = garbage
    mujoco.mj_forward(data.model, data)
    assert np.isfinite(data.actuator_moment).all()
    assert np.isfinite(data.actuator_length).all()


# ------------------------------------------------------------------------------------------- laws and paths


def test_muscles_of_other_laws_act_by_wrenches_beside_them() -> None:
    """The same motion as by wrenches alone; their actuators stay silent, those of MuJoCo's muscles pull."""
    custom = declared(ROW, HILL | {"max_isometric_force": 100.0}, muscle="free")
    xml = ARM.format(tendon=EXTENSOR, actuator=MUSCLE, custom=custom, option="")
    datas = [moving(install(spec_of(xml), mode=mode)) for mode in ("transmission", "wrench")]
    strongest = 0.0
    for _ in range(100):
        for data in datas:
            data.ctrl[:] = 0.7
            excitations(data)["free"][:] = 0.6
            mujoco.mj_step(data.model, data)
        strongest = max(strongest, read(datas[0]).tension.min())
    assert strongest > 1.0
    np.testing.assert_allclose(datas[0].qpos, datas[1].qpos, rtol=0.0, atol=1e-12)
    muscles, others = (read(data) for data in datas)
    assert dict(zip(muscles.names, muscles.transmitted, strict=True)) == {"extensor": True, "free": False}
    assert not others.transmitted.any()
    np.testing.assert_allclose(muscles.tension, others.tension, rtol=1e-9)
    np.testing.assert_allclose(datas[1].actuator_force, datas[0].actuator_force, rtol=1e-9)
    assert datas[0].actuator_force[0] < 0.0


@pytest.mark.parametrize("tendon", [EXTENSOR, PULLEYS])
def test_moments_are_the_derivatives_of_lengths(tendon: str) -> None:
    """Of a row of three surfaces, which MuJoCo cannot have, and of a path with pulleys; all times the gear."""
    custom = declared([element("actuator", "extensor"), *ROW]) if tendon == EXTENSOR else ""
    xml = ARM.format(tendon=tendon, actuator=MUSCLE.replace("/>", ' gear="3"/>'), custom=custom, option="")
    model, plain = install(spec_of(xml), mode="transmission"), spec_of(xml).compile()
    muscles = mw.MuscleSystem(plain)
    rng = np.random.default_rng(0)
    for _ in range(20):
        data, twin = mujoco.MjData(model), mujoco.MjData(plain)
        data.qpos[:] = twin.qpos[:] = rng.uniform(-0.3, 0.6, model.nq)
        data.qvel[:] = rng.normal(size=model.nv)
        mujoco.mj_forward(model, data)
        muscles.reset(twin)
        moment = np.zeros((1, model.nv))
        mujoco.mju_sparse2dense(
            moment, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
        )
        np.testing.assert_allclose(moment, 3.0 * muscles.length_jacobian(twin), rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(data.actuator_length, 3.0 * muscles.length, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(data.actuator_velocity, moment @ data.qvel, rtol=0.0, atol=1e-12)


def test_a_moment_without_room_is_named() -> None:
    """The tendon ends on the forearm, but the path goes to the hand."""
    tendon = '<spatial name="extensor"><site site="origin"/><site site="middle"/></spatial>'
    row = [element("actuator", "extensor"), *ROW]
    spec = spec_of(ARM.format(tendon=tendon, actuator=MUSCLE, custom=declared(row), option=""))
    with pytest.raises(
        mw.ModelError, match=r"body 'hand', which tendon 'extensor' does not touch.*mode 'wrench'"
    ):
        install(spec, mode="transmission")
    assert install(spec, mode="wrench").nplugin == 1


def test_tendons_show_the_path_unless_mujoco_itself_uses_them() -> None:
    """A tendon with a spring keeps MuJoCo's own length; sensors of the past keep their tendon too."""
    xml = ARM.format(tendon=EXTENSOR, actuator=MUSCLE, custom="", option="")
    sensors = '<sensor><tendonpos tendon="extensor"/><actuatorpos actuator="extensor"/></sensor></mujoco>'
    measured = xml.replace("</mujoco>", sensors)
    late = measured.replace(
        '<tendonpos tendon="extensor"', '<tendonpos tendon="extensor" delay="0.01" nsample="10"'
    )
    sprung = measured.replace('<spatial name="extensor">', '<spatial name="extensor" stiffness="1">')
    damped = measured.replace("<muscle ", '<muscle damping="1" ')
    lengths = []
    for changed, stops in ((measured, 0), (late, 6), (sprung, 6), (damped, 6)):
        model = install(spec_of(changed), mode="transmission")
        data = mujoco.MjData(model)
        data.qpos[:] = (
            -1.2,
            0.3,
        )  # where MuJoCo 4 has the string on the other side of the cylinder, and 3.17 not
        mujoco.mj_forward(model, data)
        assert model.tendon_num.tolist() == [stops]
        length = float(read(data).length[0])
        assert data.sensordata[1] == data.actuator_length[0] == length
        lengths.append(length)
        native = spec_of(changed).compile()
        twin = mujoco.MjData(native)
        twin.qpos[:] = data.qpos
        mujoco.mj_forward(native, twin)
        shown = float(data.ten_length[0])
        if changed in (measured, late):
            assert shown == length
            assert data.sensordata[0] == (length if changed is measured else twin.sensordata[0])
        else:
            assert shown == data.sensordata[0] == twin.ten_length[0]
    assert len(set(lengths)) == 1


@needs_felt_tendons
def test_sensors_of_force_keep_the_tendons() -> None:
    """MuJoCo lets them feel its actuators along its own tendons, which are right here."""
    datas = []
    for mode in (None, "wrench", "transmission"):
        spec = native_spec()
        spec.body("forearm").add_site(name="joint")
        for kind in (mujoco.mjtSensor.mjSENS_FORCE, mujoco.mjtSensor.mjSENS_TORQUE):
            spec.add_sensor(type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="joint")
        data = start(spec.compile() if mode is None else install(spec, mode=mode))
        data.ctrl[:] = 0.5
        mujoco.mj_step(data.model, data, nstep=20)
        datas.append(data)
    native, wrench, transmission = datas
    assert not wrench.model.tendon_num.any()
    assert transmission.model.tendon_num.all()
    assert np.abs(native.sensordata[:3]).max() > 100.0
    for data in (wrench, transmission):
        np.testing.assert_allclose(data.sensordata, native.sensordata, rtol=0.0, atol=1e-8)


def test_muscles_without_a_force_keep_their_strength() -> None:
    """MuJoCo derives it from acc0, which mj_setConst computes along its own path: the tendon has to be there."""
    model = install(
        spec_of(ARM.format(tendon=EXTENSOR, actuator=MUSCLE.replace("400", "-1"), custom="", option="")),
        mode="transmission",
    )
    before = float(model.actuator_acc0[0])
    mujoco.mj_setConst(model, mujoco.MjData(model))
    assert model.actuator_acc0[0] == before > 0.0


def test_actuation_switched_off_leaves_lengths_to_be_read() -> None:
    data, twin = twins("elbow")
    for each in (data, twin):
        each.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
        excite(each)
        mujoco.mj_step(each.model, each, nstep=5)
        mujoco.mj_forward(each.model, each)
    np.testing.assert_allclose(data.actuator_length, twin.actuator_length, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(data.qpos, twin.qpos, rtol=0.0, atol=1e-13)
    assert not data.actuator_force.any()


# ------------------------------------------------------------------------------------------------ the model


def test_the_mode_can_be_changed() -> None:
    """By installing again: the actuators get their force limits back, or lose them."""
    spec = spec_of(ARM.format(tendon=EXTENSOR, actuator=MUSCLE, custom="", option=""))
    before = spec.compile()
    for mode in ("wrench", "transmission", "transmission", "wrench"):
        model = install(spec, mode=mode)
        silent = mode == "wrench"
        assert bool(model.actuator_forcelimited[0]) == silent
        np.testing.assert_array_equal(
            model.actuator_gainprm == before.actuator_gainprm, [[True] * 9 + [not silent]]
        )
        assert read(mujoco.MjData(model)).transmitted.tolist() == [not silent]


def test_models_of_both_modes_in_one() -> None:
    """Attached twice, by wrenches on the left and by transmission on the right: both move as alone."""
    xml = ARM.format(tendon=EXTENSOR, actuator=MUSCLE, custom="", option="")
    parent = mujoco.MjSpec()
    parent.option.timestep = 0.002
    for mode, place in (("wrench", [0.0, 0.0, 0.0]), ("transmission", [0.0, 3.0, 0.0])):
        child = spec_of(xml)
        install(child, mode=mode)
        parent.attach(child, frame=parent.worldbody.add_frame(pos=place), prefix=f"{mode}/")
    for both in (parent.compile(), install(parent, mode="transmission")):
        data, alone = mujoco.MjData(both), mujoco.MjData(install(spec_of(xml)))
        data.ctrl[:], alone.ctrl[:] = 0.8, 0.8
        for each in (data, alone):
            mujoco.mj_step(each.model, each, nstep=100)
        np.testing.assert_allclose(data.qpos, np.tile(alone.qpos, 2), rtol=0.0, atol=1e-12)
        assert read(data).transmitted.tolist() == [False, True]


def test_a_model_without_actuators_on_strings_is_refused() -> None:
    joint = '<mujoco><worldbody><body><joint name="j"/><geom size="1"/></body></worldbody>{}</mujoco>'
    with pytest.raises(mw.ModelError, match="no actuator on a spatial tendon"):
        install(spec_of(joint.format('<actuator><motor joint="j"/></actuator>')), mode="transmission")
