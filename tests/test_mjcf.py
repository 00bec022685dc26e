"""Every form in which a model declares muscles, read into what it means; native tendons agree with MuJoCo."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from declared_models import (
    ARM,
    EXTENSOR,
    HILL,
    MUSCLE,
    PULLEYS,
    ROW,
    compiled,
    declared,
    element,
    tendon_jacobian,
)

import mjwrap as mw
from mjwrap.mjcf import MuscleDeclaration, Node, Route, read_declarations

SITE, GEOM = mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_GEOM
LENGTH = 1e-13  # [m] sums of a dozen terms below one metre
RATE = 1e-12  # [m/rad], the same
TWO_SITES = '<spatial name="extensor"><site site="origin"/><site site="via"/></spatial>'


def ids(model: mujoco.MjModel, kind: mujoco.mjtObj, *wanted: str) -> list[int]:
    return [mujoco.mj_name2id(model, kind, name) for name in wanted]


def only(model: mujoco.MjModel) -> MuscleDeclaration:
    """The one muscle of a model."""
    found = read_declarations(model)
    assert not found.native
    (muscle,) = found.muscles
    return muscle


# ------------------------------------------------------------------------------------ native tendons


def test_a_native_muscle_is_a_declaration_as_it_stands() -> None:
    model = compiled()
    muscle = only(model)
    origin, side, via, middle, ball_side, insertion = ids(
        model, SITE, "origin", "elbow_side", "via", "middle", "ball_side", "insertion"
    )
    elbow, ball = ids(model, GEOM, "elbow", "ball")
    nodes = (
        Node(geom=elbow, hint_site=side, surface=mw.Cylinder(0.025)),
        Node(site=via),
        Node(site=middle),
        Node(geom=ball, hint_site=ball_side, surface=mw.Sphere(0.015)),
    )
    assert muscle.routes == (Route(origin, nodes, insertion),)
    assert (muscle.name, muscle.law, muscle.actuator, muscle.tendon) == ("extensor", "mujoco", 0, 0)
    assert (muscle.origin_site, muscle.insertion_site) == (origin, insertion)
    assert muscle.via_sites == [via, middle]
    assert muscle.geoms == [elbow, ball]
    assert muscle.surfaces == [mw.Cylinder(0.025), mw.Sphere(0.015)]
    assert isinstance(muscle.parameters, mw.MuJoCoMuscle)
    assert muscle.parameters.prm == tuple(model.actuator_gainprm[0, :9])
    assert muscle.parameters.length_range == (0.3, 0.6)


def test_a_geom_without_a_side_site_has_no_hint() -> None:
    tendon = EXTENSOR.replace(' sidesite="ball_side"', "")
    model = compiled(tendon=tendon)
    assert [node.hint_site for node in only(model).routes[0].nodes if node.geom >= 0] == [
        *ids(model, SITE, "elbow_side"),
        -1,
    ]


def test_pulleys_divide_a_muscle_into_weighted_routes() -> None:
    model = compiled(tendon=PULLEYS)
    routes = only(model).routes
    assert [route.weight for route in routes] == [1.0, 1 / 2, 1 / 3]
    via, insertion = ids(model, SITE, "via", "insertion")
    assert [(route.origin, route.insertion) for route in routes[1:]] == [(via, insertion)] * 2


@pytest.mark.parametrize("tendon", [EXTENSOR, PULLEYS], ids=["tendon", "pulleys"])
def test_length_speed_jacobian_and_force_are_mujocos(tendon: str) -> None:
    """Over poses at which no string passes a surface on the side away from its side site: there MuJoCo's jumps."""
    model = compiled(tendon=tendon)
    native = compiled(tendon=tendon)
    data, twin = mujoco.MjData(model), mujoco.MjData(native)
    muscles = mw.MuscleSystem(model)
    rng = np.random.default_rng(20)
    touched = set()
    for _ in range(60):
        twin.qpos[:] = data.qpos[:] = rng.uniform((-0.6, -0.4), (2.2, 1.2))
        twin.qvel[:] = data.qvel[:] = rng.normal(size=2)
        twin.act[:] = data.act[:] = rng.uniform(0, 1)
        mujoco.mj_forward(native, twin)
        muscles.reset(data)
        muscles.apply(data)
        jacobian = muscles.length_jacobian(data)
        assert muscles.length == pytest.approx(twin.ten_length, abs=LENGTH)
        assert muscles.velocity == pytest.approx(twin.ten_velocity, abs=LENGTH * 10)
        assert jacobian == pytest.approx(tendon_jacobian(native, twin), abs=RATE)
        assert muscles.tension == pytest.approx(-twin.actuator_force, rel=1e-10)
        mujoco.mj_forward(model, data)
        assert data.qacc == pytest.approx(twin.qacc, rel=1e-9, abs=1e-9)
        touched.add(len(muscles.contact_points(0)))
    assert touched == {0, 1, 2}


# -------------------------------------------------------------------- native muscles that stay native


def test_a_side_site_that_may_leave_its_geom_leaves_the_muscle_native() -> None:
    """MuJoCo judges at every pose anew whether the string runs inside, and jumps."""
    forearm = ARM.replace('<site name="via"', '<site name="shifting" pos="0.005 0 0"/><site name="via"')
    tendon = EXTENSOR.replace('"elbow_side"', '"shifting"')
    model = mujoco.MjModel.from_xml_string(
        forearm.format(tendon=tendon, actuator=MUSCLE, custom="", option="")
    )
    found = read_declarations(model)
    assert found.muscles == []
    assert "runs inside geom 'elbow' changes with the pose: side site 'shifting'" in found.native["extensor"]


@pytest.mark.parametrize("side", ['sidesite="elbow_side"', ""])
def test_a_tendon_whose_end_point_may_leave_its_geom_stays_native(side: str) -> None:
    """MuJoCo goes straight through while it is inside; a path round the geom does not exist then."""
    tendon = EXTENSOR.replace('site="via"', 'site="within"').replace('sidesite="elbow_side"', side)
    forearm = ARM.replace('<site name="via"', '<site name="within" pos="0.005 0 0"/><site name="via"')
    model = mujoco.MjModel.from_xml_string(
        forearm.format(tendon=tendon, actuator=MUSCLE, custom="", option="")
    )
    found = read_declarations(model)
    assert found.muscles == []
    assert "no path can go round geom 'elbow': site 'within' is inside it" in found.native["extensor"]


@pytest.mark.parametrize(("share", "stays"), [(0.8, True), (0.2, False)])
def test_a_muscle_without_a_path_at_most_poses_stays_native(share: float, stays: bool) -> None:
    """Its end is outside at the reference pose, and inside over the last part of the joint's range of 1 rad."""
    reach, middle = 0.02, 1 - share / 2
    centre = f"{reach * np.cos(middle)} {reach * np.sin(middle)} 0"
    xml = f"""<mujoco><compiler angle="radian"/><worldbody><site name="a" pos="-0.1 0 0.05"/>
      <geom name="ball" size="{2 * reach * np.sin(share / 4)}" pos="{centre}" contype="0" conaffinity="0"/>
      <body><joint axis="0 0 1" range="0 1" limited="true"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
        <site name="b" pos="{reach} 0 0"/></body></worldbody>
      <tendon><spatial name="t"><site site="a"/><geom geom="ball"/><site site="b"/></spatial></tendon>
      <actuator><muscle name="m" tendon="t" lengthrange="0.1 0.2"/></actuator></mujoco>"""
    found = read_declarations(mujoco.MjModel.from_xml_string(xml))
    assert (found.muscles == []) == stays
    assert ("site 'b' is inside it there" in found.native.get("m", "")) == stays


FIXED = EXTENSOR + '<fixed name="sum"><joint joint="elbow" coef="1"/></fixed>'
LIMITED = EXTENSOR.replace('"extensor"', '"extensor" actuatorfrclimited="true" actuatorfrcrange="-50 50"')
CURVES = 'gainprm="0.75 1.05 100 200 0.5 1.6 1.5 1.3 1.2" lengthrange="0.3 0.6"'
STAYS_NATIVE = {
    "joint": (EXTENSOR, '<muscle name="m" joint="elbow" lengthrange="-1 1"/>', "does not pull a tendon"),
    "fixed": (FIXED, '<muscle name="m" tendon="sum" lengthrange="-1 1"/>', "tendon is fixed"),
    "gear": (
        EXTENSOR,
        '<muscle name="m" tendon="extensor" gear="-1" lengthrange="-1 -.1"/>',
        "gear is not positive",
    ),
    "tendon limit": (
        LIMITED,
        '<muscle name="m" tendon="extensor" lengthrange="0.3 0.6"/>',
        "actuatorfrcrange",
    ),
    "bias": (
        EXTENSOR,
        f'<general name="m" tendon="extensor" gaintype="muscle" biastype="affine" {CURVES}/>',
        "bias is not that of a muscle",
    ),
    "early": (
        EXTENSOR,
        f'<general name="m" tendon="extensor" gaintype="muscle" dyntype="user" actdim="1" actearly="true" {CURVES}/>',
        "its dynamics are not integrator",
    ),
    "early with a delay": (
        EXTENSOR,
        '<general name="m" tendon="extensor" gaintype="muscle" dyntype="filter" actearly="true" delay="0.01"'
        f' nsample="8" {CURVES}/>',
        "it has actearly, and its control has a delay",
    ),
    "delay": (
        EXTENSOR,
        f'<general name="m" tendon="extensor" gaintype="muscle" delay="0.01" nsample="8" {CURVES}/>',
        "its control has a delay",
    ),
}


@pytest.mark.parametrize("case", STAYS_NATIVE)
def test_what_mjwrap_cannot_drive_stays_native_and_pulls_on(case: str) -> None:
    tendon, actuator, reason = STAYS_NATIVE[case]
    model = compiled(tendon=tendon, actuator=MUSCLE + actuator if case != "tendon limit" else actuator)
    muscles = mw.MuscleSystem(model)
    assert list(muscles.native) == ["m"]
    assert reason in muscles.native["m"]
    assert "m" not in muscles.names
    data = mujoco.MjData(model)
    data.ctrl[:] = data.act[:] = 0.5
    mujoco.mj_step(model, data, 8)  # past the delay
    assert data.actuator("m").force[0] != 0.0


def test_passive_curves_without_a_bias_do_not_pull() -> None:
    model = compiled(actuator=f'<general name="m" tendon="extensor" gaintype="muscle" {CURVES}/>')
    parameters = only(model).parameters
    assert isinstance(parameters, mw.MuJoCoMuscle)
    assert parameters.prm[7] == 0.0


def test_actuators_with_several_controls_shift_nothing() -> None:
    """Controls, gears and length ranges have addresses of their own where an actuator has three of each."""
    xml = ARM.format(tendon=EXTENSOR, actuator='<orientation joint="ball"/>' + MUSCLE, custom="", option="")
    extra = '<body pos="1 0 0"><joint name="ball" type="ball"/><geom size="0.1"/></body></worldbody>'
    model = mujoco.MjModel.from_xml_string(xml.replace("</worldbody>", extra))
    assert (model.nu, model.nactuator) == (4, 2)
    muscle = only(model)
    assert muscle.name == "extensor"
    assert muscle.parameters == only(compiled()).parameters
    straight = f'<general name="extensor" tendon="extensor" ctrlrange="0 0.4" gaintype="muscle" {CURVES}/>'
    model = mujoco.MjModel.from_xml_string(xml.replace("</worldbody>", extra).replace(MUSCLE, straight))
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.1, 0.2, 0.3, 0.9
    muscles = mw.MuscleSystem(model)
    muscles.forward(data)
    assert muscles.activation == [0.4]


# -------------------------------------------------------------------------------------------- tuples


def test_a_tuple_has_a_route_of_its_own_with_surfaces_in_a_row() -> None:
    model = compiled(custom=declared([element("actuator", "extensor"), *ROW], HILL))
    muscle = only(model)
    origin, side, wrist_side, insertion = ids(model, SITE, "origin", "elbow_side", "wrist_side", "insertion")
    elbow, ball, wrist = ids(model, GEOM, "elbow", "ball", "wrist")
    nodes = (
        Node(geom=elbow, hint_site=side, surface=mw.Cylinder(0.025)),
        Node(geom=ball, surface=mw.Sphere(0.015)),
        Node(geom=wrist, hint_site=wrist_side, surface=mw.Cylinder(0.012)),
    )
    assert muscle.routes == (Route(origin, nodes, insertion),)
    assert (muscle.name, muscle.actuator, muscle.tendon) == ("extensor", 0, 0)
    assert muscle.parameters == mw.DeGrooteFregly2016(600.0, 0.12, 0.3)


def test_every_hill_parameter_is_found_by_what_its_name_contains() -> None:
    values = HILL | {"pennation_angle": 0.2, "max_contraction_velocity": 8.0, "fiber_damping": 0.05}
    model = compiled(custom=declared([element("actuator", "extensor")], values))
    assert only(model).parameters == mw.DeGrooteFregly2016(600.0, 0.12, 0.3, 0.2, 8.0, 0.05)


def test_a_tuple_without_a_route_takes_its_tendons() -> None:
    """The actuator's tendon, or one that the tuple names instead."""
    native = only(compiled()).routes
    by_actuator = only(compiled(custom=declared([element("actuator", "extensor")], HILL)))
    assert by_actuator.routes == native
    other = EXTENSOR + TWO_SITES.replace("extensor", "other")
    model = compiled(
        tendon=other, custom=declared([element("actuator", "extensor"), element("tendon", "other")], HILL)
    )
    muscle = only(model)
    origin, via = ids(model, SITE, "origin", "via")
    assert muscle.routes == (Route(origin, (), via),)
    assert muscle.tendon == 1


def test_a_tuple_without_an_actuator_is_called_like_its_tendon_or_itself() -> None:
    custom = declared([element("tendon", "extensor")], HILL) + declared(
        ROW, {"optimal_force": 50.0}, muscle="rope"
    )
    found = read_declarations(compiled(actuator="", custom=custom))
    assert [(m.name, m.actuator, m.law) for m in found.muscles] == [
        ("extensor", -1, "degroote_fregly_2016"),
        ("rope", -1, "path_actuator"),
    ]


def test_activation_time_constants_of_a_muscle_without_an_actuator() -> None:
    values = HILL | {"activation_time_constants": (0.02, 0.06)}
    model = compiled(actuator="", custom=declared([element("tendon", "extensor")], values))
    assert only(model).activation.row()[:2] == (0.02, 0.06)
    model = compiled(actuator="", custom=declared([element("tendon", "extensor")], HILL))
    assert only(model).activation.row()[:2] == (0.01, 0.04)


@pytest.mark.parametrize(
    ("values", "law"),
    [
        (HILL, "degroote_fregly_2016"),
        ({"optimal_force": 10.0}, "path_actuator"),
        ({}, "mujoco"),
    ],
)
@pytest.mark.parametrize("named", [True, False])
def test_a_law_is_named_or_follows_from_the_parameters(
    values: dict[str, float], law: str, named: bool
) -> None:
    model = compiled(custom=declared([element("actuator", "extensor")], values, law if named else None))
    assert only(model).law == law


def test_tuples_that_are_not_mjwraps_are_left_alone() -> None:
    custom = '<tuple name="others"><element objtype="body" objname="hand"/></tuple>'
    assert only(compiled(custom=custom)) == only(compiled())


def test_muscles_come_in_the_order_of_actuators_then_of_tuples() -> None:
    second = TWO_SITES.replace("extensor", "second")
    custom = declared(ROW, HILL, muscle="free") + declared([element("actuator", "b")], HILL, muscle="b")
    pulled = '<muscle name="{}" tendon="{}" lengthrange="0.3 0.6"/>'
    actuator = (
        pulled.format("a", "extensor") + '<motor name="c" joint="elbow"/>' + pulled.format("b", "second")
    )
    muscles = mw.MuscleSystem(compiled(tendon=EXTENSOR + second, actuator=actuator, custom=custom))
    assert muscles.names == ["a", "b", "free"]
    assert [declaration.actuator for declaration in muscles.declarations] == [0, 2, -1]
