"""MuscleSystem if a path cannot be found, and if a state is not finite."""

from __future__ import annotations

import math
from collections.abc import Callable

import mujoco
import numpy as np
import pytest
from mjcf_reading import Vector

import mjwrap as mw

RADIUS = 0.03
# The insertion swings between x = 0.1 and 0.02 m on a heavy, sprung slide with a period of 0.4 s, in and out of the
# cylinder. The shorter way round is below; the hint is above. A second muscle never fails.
SCENE = f"""<mujoco><option gravity="0 0 0" timestep="0.002"/>
  <worldbody>
    <geom name="cylinder" type="cylinder" size="{RADIUS} 0.1" contype="0" conaffinity="0"/>
    <site name="above" pos="0 0.05 0"/> <site name="origin" pos="-0.1 -0.005 0"/> <site name="far" pos="0 0.2 0"/>
    <body name="sledge" pos="0.1 0 0">
      <joint name="slide" type="slide" axis="1 0 0" stiffness="{1e3 * (2 * math.pi / 0.4) ** 2}" springref="-0.04"/>
      <inertial pos="0 0.01 0" mass="1000" diaginertia="1 1 1"/>
      <site name="insertion"/>
      <body name="flap"><joint name="hinge" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>
    </body>
    <body name="loose" pos="0 0 1"><freejoint name="free"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>
    <body name="led" pos="0 0 2" mocap="true"><site name="hand"/></body>
  </worldbody>
  <tendon><spatial name="straight"><site site="far"/><site site="insertion"/></spatial></tendon>
  <actuator><muscle name="second" tendon="straight" force="20" lengthrange="0.1 0.4"/></actuator>
  <custom>
    <numeric name="mjwrap_f_max_isometric_force" data="50"/>
    <numeric name="mjwrap_f_optimal_fiber_length" data="0.15"/>
    <numeric name="mjwrap_f_tendon_slack_length" data="0.05"/>
    <tuple name="mjwrap_first">
      <element objtype="site" objname="origin"/>
      <element objtype="geom" objname="cylinder"/> <element objtype="site" objname="above" prm="1"/>
      <element objtype="site" objname="insertion"/>
      <element objtype="numeric" objname="mjwrap_f_max_isometric_force"/>
      <element objtype="numeric" objname="mjwrap_f_optimal_fiber_length"/>
      <element objtype="numeric" objname="mjwrap_f_tendon_slack_length"/>
    </tuple>
    <numeric name="mjwrap_h_optimal_force" data="3"/>
    <tuple name="mjwrap_third">
      <element objtype="site" objname="far"/> <element objtype="site" objname="hand"/>
      <element objtype="numeric" objname="mjwrap_h_optimal_force"/>
    </tuple>
  </custom></mujoco>"""
# Here it swings along the cylinder, 60 mm long, and the string leaves it beyond its end.
BEYOND = (
    SCENE.replace('axis="1 0 0" stiffness', 'axis="0 0 1" stiffness')
    .replace('<element objtype="geom" objname="cylinder"/>', '<element objtype="geom" objname="cylinder"/> '
             '<element objtype="numeric" objname="mjwrap_short_cylinder_size"/>')
    .replace("<custom>", f'<custom><numeric name="mjwrap_short_cylinder_size" data="{RADIUS} 0.03"/>')
)  # fmt: skip
EULER, RK4 = mujoco.mjtIntegrator.mjINT_EULER, mujoco.mjtIntegrator.mjINT_RK4
both = pytest.mark.parametrize("integrator", [EULER, RK4])


def scene(
    integrator: int = EULER, strict: bool = False, xml: str = SCENE
) -> tuple[mujoco.MjData, mw.MuscleSystem, int]:
    model = mujoco.MjModel.from_xml_string(xml)
    model.opt.integrator = int(integrator)
    muscles = mw.MuscleSystem(model, strict=strict)
    muscles.excitation[muscles.index("first")] = 0.5
    return mujoco.MjData(model), muscles, muscles.index("first")


def inside(data: mujoco.MjData) -> bool:
    return bool(0.1 + data.qpos[0] < RADIUS)


def exact_length(x: float, z: float = 0.0) -> float:
    path = mw.solve_path((-0.1, -0.005, 0), (x, 0, z), [mw.Obstacle(mw.Cylinder(RADIUS), hint=(0, 0.05, 0))])
    assert path.contacts[0].P is not None
    assert path.contacts[0].P[1] > 0
    return path.length


def snapshot(muscles: mw.MuscleSystem, i: int) -> tuple[Vector, Vector]:
    """Length, velocity and tension of muscle i, and its forces (k, 3)."""
    numbers = np.array([muscles.length[i], muscles.velocity[i], muscles.tension[i]])
    return numbers, np.array([force for _, _, force in muscles.forces(i)])


def test_a_muscle_whose_end_is_inside_follows_the_surface_and_recovers_on_its_side() -> None:
    """The surface's nearest point stays where the end went in, and so does the length."""
    data, muscles, i = scene()
    lost, around = 0, exact_length(RADIUS)
    while data.time < 0.9:
        expected_inside = inside(data)
        x = 0.1 + float(data.qpos[0])
        muscles.step(data)
        assert (muscles.status[i] == mw.Status.ENDPOINT_INSIDE) == expected_inside
        assert not muscles.held[i]
        assert muscles.length[i] == pytest.approx(around if expected_inside else exact_length(x), rel=1e-12)
        assert not expected_inside or abs(muscles.velocity[i]) < 1e-12
        lost += expected_inside
        assert muscles.failures[i] == lost
    assert lost > 20


def test_a_muscle_without_a_path_holds_its_last_good_force_and_recovers_on_its_side() -> None:
    data, muscles, i = scene(xml=BEYOND)
    other = muscles.index("second")
    held = snapshot(muscles, i)
    lost, spells, before = 0, 0, False
    while data.time < 0.9:
        z = float(data.qpos[0])
        muscles.step(data)
        now, beyond = snapshot(muscles, i), muscles.status[i] != mw.Status.CONVERGED
        assert beyond or z > -0.07
        assert not beyond or z < -0.03
        assert muscles.status[other] == mw.Status.CONVERGED
        assert not data.xfrc_applied.any()
        assert muscles.held[i] == beyond
        if beyond:
            assert muscles.status[i] == mw.Status.OUT_OF_RANGE
            lost, spells = lost + 1, spells + (not before)
            assert np.array_equal(now[0], held[0])
            assert np.array_equal(now[1], held[1])
            assert now[0][2] > 1
        else:
            assert now[0][0] == pytest.approx(exact_length(0.1, z), rel=1e-12)
            held = now
        before = beyond
        assert muscles.failures[i] == lost
    assert spells == 2
    assert lost > 20
    assert muscles.failures[other] == 0
    report = muscles.report()
    assert "first" in report
    assert str(lost) in report
    assert mw.Status.OUT_OF_RANGE.message in report
    assert "second" not in report


def test_held_forces_are_applied_and_still_balance() -> None:
    data, muscles, i = scene(xml=BEYOND)
    muscles.forward(data)
    muscles.excitation[muscles.index("third")] = 0.0
    muscles.apply(data)
    good = snapshot(muscles, i)
    data.qpos[0] = -0.08
    muscles.apply(data)
    assert muscles.status[i] == mw.Status.OUT_OF_RANGE
    assert muscles.failures[i] == 1
    pull = sum(force for body, _, force in muscles.forces(i) if body == data.model.body("sledge").id)
    assert np.array_equal(snapshot(muscles, i)[1], good[1])
    mujoco.mj_kinematics(data.model, data)
    mujoco.mj_comPos(data.model, data)
    wrench = data.xfrc_applied
    second = sum(
        force
        for body, _, force in muscles.forces(muscles.index("second"))
        if body == data.model.body("sledge").id
    )
    assert wrench[data.model.body("sledge").id, :3] == pytest.approx(pull + second, abs=1e-12)
    assert np.abs(wrench[:, :3].sum(0)).max() < 1e-12
    assert np.abs((wrench[:, 3:] + np.cross(data.xipos, wrench[:, :3])).sum(0)).max() < 1e-12


@both
def test_every_step_with_a_stage_without_a_path_counts_once(integrator: int) -> None:
    data, muscles, i = scene(integrator)
    steps = 0
    while data.time < 0.4:
        was = inside(data)
        muscles.step(data)
        steps += was or (integrator == RK4 and inside(data))
    assert steps > 10
    assert muscles.failures[i] == steps
    muscles.reset(data)
    assert muscles.failures[i] == 0
    assert muscles.report() == ""


@both
def test_strict_stops_at_the_first_pose_without_a_path(integrator: int) -> None:
    data, muscles, _ = scene(integrator, strict=True)
    data.xfrc_applied[1] = (0, 0, 1, 0, 0, 0)
    before = mujoco.get_mjcb_control()
    with pytest.raises(mw.PathError, match=r"first.*inside"):
        muscles.step(data, nstep=200)
    assert 0.1 + data.qpos[0] < RADIUS + 0.002  # it stops where the trouble is
    assert mujoco.get_mjcb_control() is before
    assert data.xfrc_applied[1].tolist() == [0, 0, 1, 0, 0, 0]
    data.qpos[0], data.qvel[0] = 0.0, 0.0
    muscles.reset(data)
    muscles.step(data, nstep=10)
    assert not muscles.status.any()


def test_a_muscle_that_never_had_a_path_pulls_nothing_and_starts_on_the_side_of_its_hint() -> None:
    data, muscles, i = scene(xml=BEYOND)
    data.qpos[0] = -0.08
    muscles.apply(data)
    assert muscles.status[i] == mw.Status.OUT_OF_RANGE
    assert muscles.tension[i] == 0.0
    assert muscles.forces(i) == []
    assert muscles.points(i).shape == (0, 3)
    assert np.isfinite(data.xfrc_applied).all()
    data.qpos[0] = -0.01
    muscles.apply(data)
    assert muscles.length[i] == pytest.approx(exact_length(0.1, -0.01), rel=1e-12)


# ------------------------------------------------------------------------------------- states that are not finite


def _qpos(address: int) -> Callable[[mujoco.MjData, float], None]:
    return lambda data, bad: data.qpos.__setitem__(address, bad)


CASES = {
    "slide": (_qpos(0), "qpos.*joint 'slide'"),
    "hinge": (_qpos(1), "qpos.*joint 'hinge'"),
    "free, position": (_qpos(3), "qpos.*joint 'free'"),
    "free, quaternion": (_qpos(8), "qpos.*joint 'free'"),
    "velocity": (lambda data, bad: data.qvel.__setitem__(7, bad), "qvel.*joint 'free'"),
    "control": (lambda data, bad: data.ctrl.__setitem__(0, bad), "ctrl.*actuator 'second'"),
    "activation": (lambda data, bad: data.act.__setitem__(0, bad), "act.*actuator 'second'"),
    "mocap": (lambda data, bad: data.mocap_pos.__setitem__((0, 1), bad), "'third'|mocap.*'led'"),
}


@both
@pytest.mark.parametrize("bad", [math.nan, math.inf])
@pytest.mark.parametrize("case", CASES)
def test_a_state_that_is_not_finite_is_named_and_nothing_moves(
    case: str, bad: float, integrator: int
) -> None:
    spoil, names = CASES[case]
    data, muscles, _ = scene(integrator)
    muscles.step(data, nstep=3)
    data.xfrc_applied[1] = (0, 0, 1, 0, 0, 0)
    spoil(data, bad)
    time = data.time
    for call in (muscles.forward, muscles.apply, muscles.length_jacobian, muscles.step):
        with pytest.raises(mw.StateError, match=names):
            call(data)
    assert data.time == time
    assert data.xfrc_applied[1].tolist() == [0, 0, 1, 0, 0, 0]
    assert np.isfinite(muscles.tension).all()
    assert np.isfinite(muscles.length).all()


def test_an_excitation_that_is_not_finite_is_named() -> None:
    data, muscles, i = scene()
    muscles.excitation[i] = math.nan
    with pytest.raises(mw.StateError, match=r"excitation.*'first'"):
        muscles.step(data)


def test_data_of_another_model_is_refused() -> None:
    data, _, _ = scene()
    _, muscles, _ = scene()
    with pytest.raises(mw.StateError, match="a different model"):
        muscles.step(data)
