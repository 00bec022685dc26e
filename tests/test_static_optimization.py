"""Static optimisation of whole motions: OpenSim's results, balance, bounds, couplings, elastic tendons, errors."""

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.optimize import minimize

import mjwrap as mw
from mjwrap.errors import ModelError, StateError

DATA = Path(__file__).parent / "data" / "inverse"
BALL_AND_COUPLED = """
<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <site name="o1" pos="0.03 0 0.1"/> <site name="o2" pos="-0.03 0.01 0.1"/> <site name="o3" pos="0 0.04 0.1"/>
    <body name="upper">
      <joint name="shoulder" type="ball" damping="0.1"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="1.5"/>
      <site name="u1" pos="0.03 0 -0.1"/> <site name="u2" pos="-0.03 0 -0.12"/> <site name="u3" pos="0 0.03 -0.15"/>
      <body name="fore" pos="0 0 -0.3">
        <joint name="elbow" axis="0 1 0" damping="0.1"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.25" size="0.02" mass="1"/>
        <site name="f1" pos="0.03 0 -0.05"/> <site name="f2" pos="-0.03 0 -0.05"/>
        <body name="hand" pos="0 0 -0.25">
          <joint name="wrist" axis="0 1 0"/>
          <joint name="locked" axis="1 0 0"/>
          <geom type="capsule" fromto="0 0 0 0 0 -0.1" size="0.02" mass="0.4"/>
          <site name="h1" pos="0.02 0 -0.05"/>
        </body>
      </body>
    </body>
  </worldbody>
  <equality>
    <joint joint1="wrist" joint2="elbow" polycoef="0.1 0.5 0.2 0 0"/>
    <joint joint1="locked" polycoef="0.2 0 0 0 0"/>
  </equality>
  <tendon>
    <spatial name="front"><site site="o1"/><site site="u1"/></spatial>
    <spatial name="back"><site site="o2"/><site site="u2"/></spatial>
    <spatial name="side"><site site="o3"/><site site="u3"/></spatial>
    <spatial name="bend"><site site="u1"/><site site="f1"/><site site="h1"/></spatial>
    <spatial name="stretch"><site site="u2"/><site site="f2"/></spatial>
    <spatial name="weak"><site site="o1"/><site site="f1"/></spatial>
  </tendon>
  <actuator>
    <muscle name="front" tendon="front" force="800" lengthrange="0.1 0.3"/>
    <muscle name="back" tendon="back" force="900" lengthrange="0.1 0.3"/>
    <muscle name="side" tendon="side" force="700" lengthrange="0.1 0.35"/>
    <muscle name="bend" tendon="bend" force="500" lengthrange="0.2 0.6"/>
    <muscle name="stretch" tendon="stretch" force="600" lengthrange="0.1 0.4"/>
    <muscle name="weak" tendon="weak" force="1e-9" lengthrange="0.2 0.6"/>
  </actuator>
</mujoco>
"""


@pytest.fixture(scope="module")
def arm():
    return mw.MuscleSystem(mw.import_osim(DATA / "parity_arm.osim").spec.compile())


@pytest.fixture(scope="module")
def flexion(arm):
    return mw.Motion.from_table(arm.model, mw.read_table(DATA / "parity_arm.mot"), ends="natural")


@pytest.fixture(scope="module")
def coupled():
    return mw.MuscleSystem(mujoco.MjModel.from_xml_string(BALL_AND_COUPLED))


def swing(model, frames=60, size=0.4):
    """Return a motion of the ball joint and the elbow, with followers in place."""
    time = np.linspace(0.0, 1.0, frames)
    qpos = np.tile(model.qpos0, (frames, 1))
    angle = size * np.sin(2.0 * np.pi * time)
    qpos[:, 0], qpos[:, 2], qpos[:, 1] = np.cos(angle / 2), 0.8 * np.sin(angle / 2), 0.6 * np.sin(angle / 2)
    qpos[:, 4] = 0.5 - size * np.cos(2.0 * np.pi * time)
    qpos[:, 5] = 0.1 + 0.5 * qpos[:, 4] + 0.2 * qpos[:, 4] ** 2
    qpos[:, 6] = 0.2
    return mw.Motion(time, qpos)


def still(qpos, qvel):
    """Return a motion of a single frame without acceleration."""
    qvel = np.array([qvel], dtype=float)
    return mw.Motion(np.zeros(1), np.array([qpos], dtype=float), qvel, np.zeros_like(qvel))


def short(motion, frames=5):
    """Return a few frames of a motion with its velocities and accelerations."""
    some = slice(None, None, max(len(motion) // frames, 1))
    return mw.Motion(motion.time[some], motion.qpos[some], motion.qvel[some], motion.qacc[some])


def check_balance(found):
    """Assert that muscles and reserves together do the work that the motion needs, to 1e-9 of its terms."""
    given = np.einsum("tnk,tn->tk", found.moment_arm, found.tension)
    size = np.einsum("tnk,tn->tk", np.abs(found.moment_arm), found.tension) + np.abs(found.moment) + 1e-12
    assert (np.abs(given + found.reserve - found.moment) / size).max() <= 1e-9
    assert (found.tension >= 0.0).all()


# --------------------------------------------------------------------------------------------- OpenSim


def test_opensim_table_with_its_habits(arm, flexion):
    """Activations within 1e-6, reserves within 1e-6 N m: OpenSim's own optimiser leaves 1e-7."""
    # OpenSim's accelerations are slopes of splines through velocities, and these of splines through positions
    qvel = flexion.completed(arm.model).qvel
    motion = mw.Motion(flexion.time, flexion.qpos, qvel, ends="natural")
    found = mw.static_optimization(arm, motion, bounds=(0.01, 1.0), **mw.OPENSIM_PARITY)
    assert found.solved.all()
    tables = found.tables()
    for part, tolerance in (("activation", 1e-6), ("force", 1e-3)):
        frozen, mine = mw.read_table(DATA / f"parity_arm_{part}.sto"), tables[f"StaticOptimization_{part}"]
        np.testing.assert_allclose(mine.time, frozen.time, rtol=0, atol=1e-12)
        assert mine.names == frozen.names
        np.testing.assert_allclose(mine.values, frozen.values, rtol=0, atol=tolerance)
    np.testing.assert_allclose(
        found.reserve, mw.read_table(DATA / "parity_arm_force.sto").values[:, -2:], rtol=0, atol=1e-6
    )


def test_opensim_pennation_of_all_laws():
    muscles = mw.MuscleSystem(mw.import_osim(DATA / "pennate_muscles.osim").spec.compile())
    frozen = json.loads((DATA / "pennate_muscles.json").read_text())["records"]
    for record in frozen:
        motion = still([record["position"]], [record["speed"]])
        # the largest activation is that of a force that no muscle reaches: its tension is F₁
        found = mw.static_optimization(muscles, motion, bounds=(1.0, 1.0), **mw.OPENSIM_PARITY)
        for name, tension in zip(found.names, found.tension[0], strict=True):
            assert tension == pytest.approx(record["force"][name], rel=1e-9)


def test_the_right_physics_differs_from_opensims(arm, flexion):
    right = mw.static_optimization(arm, flexion)
    habits = mw.static_optimization(arm, flexion, **mw.OPENSIM_PARITY)
    assert np.abs(right.activation - habits.activation).max() > 0.05


# ------------------------------------------------------------------------------------- what must hold


@pytest.mark.parametrize("reserve", [1e-3, 1.0, 10.0])
@pytest.mark.parametrize("load", [1.0, 100.0])
def test_balance_and_optimum_with_ball_coupled_and_locked_joints(coupled, load, reserve):
    motion = swing(coupled.model).completed(coupled.model)
    motion = mw.Motion(motion.time, motion.qpos, motion.qvel, load * motion.qacc)
    found = mw.static_optimization(coupled, motion, reserves=reserve)
    assert found.coordinates == ("shoulder[0]", "shoulder[1]", "shoulder[2]", "elbow")
    assert found.solved.all()
    assert found.residual.max() <= 1e-10
    check_balance(found)
    assert (load > 1.0) == bool(found.infeasible.all())


def test_virtual_work_along_the_coupled_motion(coupled):
    """Power of muscles and reserves equals that of the needed moments, with lengthening speeds of the paths."""
    motion = swing(coupled.model).completed(coupled.model)
    found = mw.static_optimization(coupled, motion)
    speed = mw.muscle_analysis(coupled, motion).velocity
    assert motion.qvel is not None
    rates = motion.qvel[:, :4]  # of the ball joint and the elbow
    power = -(found.tension * speed).sum(axis=1) + (found.reserve * rates).sum(axis=1)
    np.testing.assert_allclose(power, (found.moment * rates).sum(axis=1), rtol=1e-9, atol=1e-9)


def test_power_balance_of_a_free_body():
    """A free body on three springy muscles: six independent coordinates, of which the muscles carry what they can."""
    xml = """<mujoco><worldbody><site name="a" pos="0 0 1"/><site name="b" pos="0.3 0 1"/>
      <body name="box" pos="0 0 0.5"><freejoint name="root"/><geom size="0.1" mass="2"/>
      <site name="c" pos="0 0 0.1"/><site name="d" pos="0.1 0 0"/></body></worldbody>
      <tendon><spatial name="l"><site site="a"/><site site="c"/></spatial>
      <spatial name="r"><site site="b"/><site site="d"/></spatial></tendon>
      <actuator><muscle name="l" tendon="l" force="200" lengthrange="0.1 0.8"/>
      <muscle name="r" tendon="r" force="200" lengthrange="0.1 0.9"/></actuator></mujoco>"""
    muscles = mw.MuscleSystem(mujoco.MjModel.from_xml_string(xml))
    motion = still(muscles.model.qpos0, np.zeros(6))
    found = mw.static_optimization(muscles, motion, reserves={"*": 10.0, "root[[]2]": 0.1})
    assert found.coordinates[2] == "root[2]"
    assert found.moment[0, 2] == pytest.approx(2 * 9.81)
    check_balance(found)
    assert abs(found.reserve[0, 2]) < 0.01 * found.moment[0, 2]


def test_threads_do_not_change_a_bit(arm, flexion):
    one, three = (mw.static_optimization(arm, flexion, jobs=jobs) for jobs in (1, 3))
    for name in ("activation", "tension", "reserve", "residual"):
        assert getattr(one, name).tobytes() == getattr(three, name).tobytes()


def test_a_single_frame_at_rest(arm):
    found = mw.static_optimization(arm, still([0.3, 1.0], [0.0, 0.0]))
    assert found.solved.all()
    check_balance(found)


# ------------------------------------------------------------------------------------- elastic tendons


def test_elastic_tendons_by_a_general_optimiser(arm, flexion):
    """The optimum over the true tension, with derivatives by differences: the same activations to its accuracy."""
    from mjwrap.kernels.musculotendon.tangent import tangent

    motion = short(flexion.completed(arm.model))
    found = mw.static_optimization(arm, motion, reserves=0.5)
    assert found.solved.all()
    law, params, n = arm._plan.law, arm._plan.params, len(arm.names)
    analysis = mw.muscle_analysis(arm, motion)
    for t in range(len(motion)):

        def tensions(a, t=t):
            each = (analysis.length[t], analysis.velocity[t])
            values = [tangent(law[m], params, m, a[m], each[0][m], each[1][m])[0] for m in range(n)]
            return np.maximum(values, 0.0)

        def cost(a, t=t, tensions=tensions):
            reserve = found.moment[t] - found.moment_arm[t].T @ tensions(a)
            return (a**2).sum() + ((reserve / 0.5) ** 2).sum()

        np.testing.assert_allclose(tensions(found.activation[t]), found.tension[t], rtol=0, atol=1e-6)
        other = minimize(
            cost, found.activation[t] + 0.05, bounds=[(0.01, 1.0)] * n, method="L-BFGS-B",
            options={"ftol": 1e-15, "gtol": 1e-9, "maxiter": 2000, "maxfun": 100_000},
        )  # fmt: skip
        assert cost(found.activation[t]) <= other.fun + 1e-12
        np.testing.assert_allclose(found.activation[t], other.x, rtol=0, atol=2e-4)


# ---------------------------------------------------------------------------------------------- bounds


def test_bounds_of_each_frame_hold(arm, flexion):
    """Measured activations of one muscle as bounds, the rest optimised: what EMG does."""
    frames, n = len(flexion), len(arm.names)
    measured = 0.3 + 0.1 * np.sin(10.0 * flexion.time)
    low, high = np.zeros((frames, n)), np.ones((frames, n))
    low[:, 2] = high[:, 2] = measured
    found = mw.static_optimization(arm, flexion, bounds=(low, high))
    np.testing.assert_array_equal(found.activation[:, 2], measured)
    assert found.solved.all()
    check_balance(found)


def test_least_activation_of_a_law_is_a_bound(arm, flexion):
    assert mw.static_optimization(arm, flexion).activation.min() == 0.01


def test_no_tendon_pushes():
    """A damped fibre shortens fast: it pulls only above an activation, which is the least bound then."""
    muscles = mw.MuscleSystem(mw.import_osim(DATA / "pennate_muscles.osim").spec.compile())
    motion = still([0.27], [-0.5])
    unclamped = mw.muscle_analysis(muscles, motion)
    assert unclamped.passive_force.min() < -1.0
    found = mw.static_optimization(muscles, motion, tendon="rigid")
    check_balance(found)
    idle = found.tension == 0.0
    assert idle.any()
    np.testing.assert_array_equal(
        found.activation[idle], np.broadcast_to(muscles._plan.params[:, 10], idle.shape)[idle]
    )
    needed = -unclamped.passive_force / unclamped.active_force
    assert (found.activation > needed)[~idle].all()


def test_reserves_and_weights_by_name(arm, flexion):
    even = mw.static_optimization(arm, flexion)
    dear = mw.static_optimization(arm, flexion, weights={"bic*": 100.0}, reserves={"elbow": 5.0})
    i, elbow = arm.names.index("biceps"), even.coordinates.index("elbow")
    assert dear.activation[:, i].mean() < 0.5 * even.activation[:, i].mean()
    assert np.abs(dear.reserve[:, elbow]).max() > np.abs(even.reserve[:, elbow]).max()
    listed = mw.static_optimization(
        arm, flexion, weights=[1.0, 1.0, 100.0, 1.0, 1.0, 1.0], reserves=[1.0, 5.0]
    )
    assert listed.activation.tobytes() == dear.activation.tobytes()


def test_a_free_reserve_asks_nothing_of_the_muscles(arm, flexion):
    found = mw.static_optimization(arm, flexion, reserves=np.inf)
    np.testing.assert_array_equal(found.activation, 0.01)
    assert not found.tables()["StaticOptimization_activation"].values[:, -2:].any()


def test_external_loads_change_the_moments(arm, flexion):
    free = mw.static_optimization(arm, flexion)
    force = np.tile([0.0, -30.0, 0.0], (len(flexion), 1))
    body = mujoco.mj_id2name(arm.model, mujoco.mjtObj.mjOBJ_BODY, arm.model.nbody - 1)
    load = mw.ExternalForce(body, flexion.time, force=force)
    held = mw.static_optimization(arm, flexion, loads=mw.ExternalLoads([load]))
    assert np.abs(held.moment - free.moment).max() > 1.0
    check_balance(held)


# --------------------------------------------------------------------------------------- report, tables


def test_report_names_what_limits(arm, flexion):
    motion = flexion.completed(arm.model)
    heavy = mw.Motion(motion.time, motion.qpos, motion.qvel, 30.0 * motion.qacc)
    found = mw.static_optimization(arm, heavy)
    assert found.saturated.any()
    assert found.infeasible.any()
    assert found.reserve_share.max() > 0.01
    text = found.report()
    assert "201 frames: 201 solved" in text
    assert "muscles alone are too weak" in text
    assert "muscles at their largest activation" in text
    assert any(name in text for name in ("shoulder", "elbow"))
    assert found.reasons == ("",) * 201


def test_tables_can_be_written_and_read(arm, flexion, tmp_path):
    found = mw.static_optimization(arm, flexion)
    for name, table in found.tables().items():
        mw.write_table(tmp_path / f"arm_{name}.sto", table)
        again = mw.read_table(tmp_path / f"arm_{name}.sto")
        assert again.names == (*arm.names, "shoulder_reserve", "elbow_reserve")
        np.testing.assert_allclose(again.values, table.values, rtol=1e-6, atol=1e-9)


# ---------------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"power": 3}, "power must be 2"),
        ({"reserves": 0.0}, "reserves of coordinate 'shoulder' must be positive"),
        ({"reserves": np.nan}, "reserves of coordinate 'shoulder'"),
        ({"reserves": {"elbw": 1.0}}, "no coordinate 'elbw' .did you mean 'elbow'"),
        ({"reserves": [1.0, 2.0, 3.0]}, r"reserves must be one number, \(2,\)"),
        ({"weights": {"biceps": np.inf}}, "weights\\['biceps'\\] must be finite and positive"),
        ({"weights": {3: 1.0}}, "a key of weights must be the name of a muscle"),
        ({"weights": "low"}, "weights must be an array of numbers"),
        ({"bounds": (0.5, 0.2)}, "least activation 0.5 of muscle 'deltoid' at time 0 s is above the largest, 0.2"),
        ({"bounds": (0.0, np.nan)}, "largest activation of muscle 'deltoid' at time 0 s must be within"),
        ({"bounds": (0.0, 1.5)}, "must be within 0 and 1, not 1.5"),
        ({"bounds": (np.zeros(4), 1.0)}, "least activation must be one number"),
        ({"bounds": 1.0}, "bounds must be a pair"),
        ({"tendon": "stiff"}, "tendon must be one of model, rigid"),
        ({"pennation": "none"}, "pennation must be one of fiber, opensim"),
        ({"passive": False}, "passive=False: muscle 'deltoid' has an elastic tendon"),
        ({"passive": "yes"}, "passive must be True or False"),
        ({"jobs": 0}, "jobs must be a whole number"),
        ({"loads": 3}, "loads"),
    ],
)  # fmt: skip
def test_errors_name_what_is_wrong(arm, flexion, options, message):
    with pytest.raises((StateError, ModelError), match=message):
        mw.static_optimization(arm, flexion, **options)


def test_wrong_objects_are_named(arm, flexion):
    with pytest.raises(StateError, match="muscles: expected a MuscleSystem"):
        mw.static_optimization(arm.model, flexion)
    with pytest.raises(StateError, match="motion"):
        mw.static_optimization(arm, flexion.qpos)
