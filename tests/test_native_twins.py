"""Everything that MuJoCo's tendons and muscles can say, taken over as it stands: mjwrap beside the native twin.

MuJoCo finds the corner of a string that runs inside a geom to 1e-6 rad only, where Newton's method happens to stop: its
length is exact all the same, velocity and moment arm are off in proportion to that angle.
"""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from declared_models import ARM, EXTENSOR, MUSCLE, tendon_jacobian
from mjcf_reading import Vector
from myo_models import load_myo
from native_twins import EXPLICIT
from newer_mujoco import VERSION

import mjwrap as mw
from mjwrap.mjcf import read_declarations
from mjwrap.plugin import install, read

CORNER = 1e-6  # [rad] MuJoCo's
CURVES = 'gainprm="0.75 1.05 400 200 0.5 1.6 1.5 1.3 1.2" lengthrange="0.3 0.6"'
FLV = f'<general name="extensor" tendon="extensor" gaintype="muscle" biastype="muscle" {CURVES}'
SAME = 'biasprm="0.75 1.05 400 200 0.5 1.6 1.5 1.3 1.2"'
ROUTES = {
    "inside a cylinder": EXTENSOR.replace("elbow_side", "elbow_inside"),
    "inside a moving sphere": EXTENSOR.replace("ball_side", "ball_inside"),
    "inside both": EXTENSOR.replace("elbow_side", "elbow_inside").replace("ball_side", "ball_inside"),
    "an end fixed inside": EXTENSOR.replace('site="origin"', 'site="elbow_inside"'),
    "an end and its side fixed inside": EXTENSOR.replace('site="middle"', 'site="ball_inside"'),
    "a side site beyond the end of a cylinder": EXTENSOR.replace("elbow_side", "elbow_beyond"),
    "pulleys": """<spatial name="extensor">
      <site site="origin"/> <geom geom="elbow" sidesite="elbow_inside"/> <site site="via"/>
      <pulley divisor="2"/> <site site="via"/> <site site="middle"/> <geom geom="ball" sidesite="ball_inside"/>
      <site site="insertion"/>
      <pulley divisor="3"/> <site site="origin"/> <geom geom="elbow" sidesite="elbow_side"/> <site site="via"/>
      <site site="middle"/> <geom geom="ball" sidesite="ball_side"/> <site site="insertion"/></spatial>""",
}
ACTUATORS = {
    "gear": MUSCLE.replace("400", "160")
    .replace("/>", ' gear="2.5"/>')
    .replace('lengthrange="0.3 0.6"', 'lengthrange="0.75 1.5"'),
    "force limits": MUSCLE.replace("/>", ' forcerange="-60 -1"/>'),
    "passive force of its own": f'{FLV} dyntype="muscle" dynprm="0.01 0.04"'
    ' biasprm="0.6 1.2 300 200 0 1.4 1.5 1.1 1.2"/>',
    "no passive force": f'{FLV.replace("""biastype="muscle" """, "")} dyntype="muscle" dynprm="0.01 0.04"/>',
    "early integrator": f'{FLV} {SAME} dyntype="integrator" actrange="0 1" actearly="true"/>',
    "early filter": f'{FLV} {SAME} dyntype="filter" dynprm="0.03" actearly="true"/>',
    "early exact filter": f'{FLV} {SAME} dyntype="filterexact" dynprm="0.001" actrange="0.1 0.7" actearly="true"/>',
    "early muscle": f'{FLV} {SAME} dyntype="muscle" dynprm="0.01 0.04" actearly="true"/>',
    "early smooth muscle": f'{FLV} {SAME} dyntype="muscle" dynprm="0.01 0.04 0.2" actearly="true"/>',
    "early without a state": f'{FLV} {SAME} ctrlrange="0 1" actearly="true"/>',
}
WRONG_CORNER = "before MuJoCo 3.16 its tendon takes a wrong corner inside a geom at 3 poses in 1,000"
LOSES_THE_CORNER = [("inside both", "plain"), ("pulleys", "plain")]  # at a stage of RK4
CASES = [(route, "plain") for route in ROUTES] + [("outside", actuator) for actuator in ACTUATORS]


def xml(route: str, actuator: str) -> str:
    arm = ARM.replace(
        '<site name="origin"',
        '<site name="elbow_beyond" pos="-0.02 0.03 0"/><site name="origin"',
    ).replace(
        '<site name="ball_side"', '<site name="ball_inside" pos="0.172 0 -0.01"/><site name="ball_side"'
    )
    tendon = ROUTES.get(route, EXTENSOR)
    return arm.format(tendon=tendon, actuator=ACTUATORS.get(actuator, MUSCLE), custom="", option="")


def holds(route: str) -> bool:
    """Return whether the route may have a corner."""
    return "inside" in ROUTES.get(route, "")


@pytest.mark.parametrize(("route", "actuator"), CASES)
def test_path_and_force_are_mujocos(route: str, actuator: str) -> None:
    model, native = (mujoco.MjModel.from_xml_string(xml(route, actuator)) for _ in range(2))
    assert read_declarations(native).native == {}
    data, twin, muscles = mujoco.MjData(model), mujoco.MjData(native), mw.MuscleSystem(model)
    rng = np.random.default_rng(71)
    arm = 0.3 * CORNER if holds(route) else 1e-12  # lever of a corner's force [m]
    touched: set[int] = set()
    forces = []
    for _ in range(60):
        twin.qpos[:] = data.qpos[:] = rng.uniform((-0.6, -0.4), (2.2, 1.2))
        twin.qvel[:] = data.qvel[:] = rng.normal(size=2)
        twin.act[:] = data.act[:] = rng.uniform(0.1, 0.7, native.na)
        twin.ctrl[:] = data.ctrl[:] = rng.uniform(-0.2, 1.2)
        mujoco.mj_forward(native, twin)
        muscles.reset(data)
        jacobian = muscles.length_jacobian(data)
        assert muscles.status == [0]
        gear = native.actuator_gear[0, 0]
        assert muscles.length == pytest.approx(twin.ten_length, abs=1e-13)
        assert muscles.velocity == pytest.approx(twin.ten_velocity, abs=3 * arm)
        assert jacobian == pytest.approx(tendon_jacobian(native, twin), abs=arm)
        rel = 1e-4 if holds(route) else 1e-10  # the force-velocity curve is steep: 1e-6 m/s in 0.1 m/s
        assert muscles.tension == pytest.approx(-gear * twin.actuator_force, rel=rel, abs=1e-9)
        contacts, drawn = muscles.contact_points(0), muscles.points(0)
        drawn = drawn[~np.isnan(drawn[:, 0])]  # between routes
        touched.add(len(contacts))
        for point in contacts.reshape(-1, 3):
            assert np.linalg.norm(drawn - point, axis=1).min() < 1e-14
        forces.append(float(muscles.tension[0]))
        body, point, force = (np.array(x) for x in zip(*muscles.forces(0), strict=True))
        assert np.abs(force.sum(axis=0)).max() < 1e-13 * (1 + forces[-1])
        assert np.abs(np.cross(point, force).sum(axis=0)).max() < 1e-13 * (1 + forces[-1])
        assert len(body) == len(force)
        assert -muscles.tension[0] * (jacobian @ data.qvel) == pytest.approx(
            -muscles.tension[0] * muscles.velocity, rel=1e-11, abs=1e-10
        )
    assert len(touched) > 1 or "end" in route
    assert np.ptp(forces) > 10.0


def test_the_jacobian_of_a_held_string_changes_as_its_rate_says() -> None:
    """Against central quotients, whose error falls at second order, at poses where both corners are there."""
    model = mujoco.MjModel.from_xml_string(xml("inside both", "plain"))
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    rng = np.random.default_rng(72)
    ratios = []
    while len(ratios) < 50:
        qpos, direction = rng.uniform((-0.6, -0.4), (2.2, 1.2)), rng.normal(size=2)

        def jacobian(step: float, qpos: Vector = qpos, direction: Vector = direction) -> Vector:
            data.qpos[:] = qpos + step * direction
            return muscles.length_jacobian(data)

        if any(jacobian(step) is None or len(muscles.contact_points(0)) < 2 for step in (-0.01, 0.0, 0.01)):
            continue
        data.qpos[:], data.qvel[:] = qpos, direction
        exact = muscles.length_jacobian_rate(data)
        errors = [np.abs((jacobian(h) - jacobian(-h)) / (2 * h) - exact).max() for h in (1e-3, 5e-4)]
        assert errors[1] < 1e-5
        assert errors[1] <= errors[0] / 3 + 1e-11
        ratios.append(errors[0] / errors[1])
    assert np.median(ratios) == pytest.approx(4.0, abs=0.05)


@pytest.mark.parametrize("mode", ["wrench", "transmission"])
@pytest.mark.parametrize("integrator", EXPLICIT)
@pytest.mark.parametrize(("route", "actuator"), [*CASES, ("inside both", "early muscle")])
def test_the_plugin_moves_the_model_as_mujoco_does(
    route: str, actuator: str, integrator: int, mode: str
) -> None:
    if VERSION < (3, 16) and integrator == EXPLICIT[1] and (route, actuator) in LOSES_THE_CORNER:
        pytest.skip(WRONG_CORNER)
    native = mujoco.MjModel.from_xml_string(xml(route, actuator))
    ours = install(mujoco.MjSpec.from_string(xml(route, actuator)), mode)
    data, twin = mujoco.MjData(ours), mujoco.MjData(native)
    for model, start in ((ours, data), (native, twin)):
        model.opt.integrator = int(integrator)
        start.qpos[:], start.qvel[:] = (1.0, 0.2), (0.5, -0.3)
    gap = 0.0
    for _ in range(250):
        data.ctrl[:] = twin.ctrl[:] = 0.5 + 0.5 * np.sin(20 * data.time)
        mujoco.mj_step(ours, data)
        mujoco.mj_step(native, twin)
        gap = max(gap, float(np.abs(data.qpos - twin.qpos).max()))
    assert gap < (1e-7 if holds(route) else 1e-11)
    assert np.abs(data.qpos - (1.0, 0.2)).max() > 0.05
    assert read(data).status == [0]
    np.testing.assert_allclose(data.act, twin.act, rtol=0.0, atol=1e-13)


@pytest.mark.myo
@pytest.mark.slow
@pytest.mark.filterwarnings(
    "ignore:Attaching a spec with an empty prefix:UserWarning"
)  # myo_sim builds it so
def test_the_arm_of_myo_sim_is_taken_over() -> None:
    """All muscles but one, whose end is inside its cylinder at most poses; held ones agree with MuJoCo's."""
    model, native = (load_myo("myoarm_r") for _ in range(2))
    data, twin, muscles = mujoco.MjData(model), mujoco.MjData(native), mw.MuscleSystem(model)
    assert list(muscles.native) == ["RI2"]
    held = [
        i
        for i, muscle in enumerate(muscles.declarations)
        if any(node.inside for route in muscle.routes for node in route.nodes)
    ]
    assert len(held) == 20
    if VERSION < (3, 16):
        pytest.skip(WRONG_CORNER)
    tendons = [muscles.declarations[i].tendon for i in held]
    low, high = model.jnt_range.T
    rng = np.random.default_rng(73)
    corners = np.zeros(len(held), dtype=bool)
    for _ in range(40):
        data.qpos[:] = twin.qpos[:] = rng.uniform(low, high)
        mujoco.mj_fwdPosition(native, twin)
        jacobian = muscles.length_jacobian(data)
        assert not muscles.status[held].any()
        assert muscles.length[held] == pytest.approx(twin.ten_length[tendons], abs=1e-13)
        expected = tendon_jacobian(native, twin)[tendons]
        assert jacobian[held] == pytest.approx(expected, abs=0.3 * CORNER)
        corners |= [len(muscles.contact_points(i)) > 0 for i in held]
    assert corners.sum() >= 17
