"""What uses coupled poses, with couplings of several pieces: moment arms, curves, runs, tables of states, checks."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from coupling_models import Knee, gait_knee, knee

import mjwrap as mw
from mjwrap.calibration.joints import JointSpace
from mjwrap.checking import check_model
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.poses.joint_sweeps import PoseMaker
from mjwrap.runs.models import set_state
from mjwrap.runs.simulation import RunSettings, Simulation
from mjwrap.runs.state_tables import read_states


@pytest.fixture
def made() -> Knee:
    return knee(3, muscle=True)


def test_moment_arms_are_slopes_along_the_coupled_motion(made: Knee) -> None:
    """Also at poses beside knots, by extrapolated differences of lengths at poses that the splines alone place."""
    model, rng = made.model, np.random.default_rng(0)
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    assert muscles.coordinates == ["hip", "knee", "ankle"]
    at = [int(model.joint(name).qposadr[0]) for name in muscles.coordinates]
    for _ in range(20):
        pose = np.zeros(model.nq)
        pose[at] = rng.uniform(-1.7, 0.4, 3)
        near = rng.choice(made.splines["slide_x"].knots)
        pose[at[1]] = near + 1e-3 * rng.choice([-1.0, 1.0])
        data.qpos[:] = made.follow(model, pose)
        arms = muscles.moment_arms(data)[0].copy()
        for column, place in enumerate(at):
            slopes = []
            for step in (2e-4, 1e-4):
                ends = []
                for sign in (-1.0, 1.0):
                    moved = pose.copy()
                    moved[place] += sign * step
                    data.qpos[:] = made.follow(model, moved)
                    muscles.forward(data)
                    ends.append(float(muscles.length[0]))
                slopes.append((ends[1] - ends[0]) / (2.0 * step))
            wanted = -(4.0 * slopes[1] - slopes[0]) / 3.0
            assert arms[column] == pytest.approx(wanted, abs=1e-8)


def test_moment_arms_about_followers_are_those_of_their_leaders_by_the_slope(made: Knee) -> None:
    """The wheel follows two joints: of all motions that turn it at rate 1, the least has rates like their factors."""
    model = made.model
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    data.qpos[:] = made.follow(model, np.random.default_rng(2).uniform(-0.9, -0.6, model.nq))
    couplings = CoupledJoints(model)
    matrix = couplings.matrix(data.qpos)
    about = {
        name: muscles.moment_arms(data, name)[:, 0] for name in ("hip", "knee", "ankle", "glide", "wheel")
    }
    leaders = [model.joint(name).dofadr[0] == couplings.independent for name in ("hip", "knee", "ankle")]
    hip, knee, ankle = (int(np.flatnonzero(each)[0]) for each in leaders)
    slope = matrix[model.joint("glide").dofadr[0], knee]
    np.testing.assert_allclose(about["glide"] * slope, about["knee"], rtol=0, atol=1e-12)
    factors = matrix[model.joint("wheel").dofadr[0], [hip, ankle]]
    both = factors @ np.array([about["hip"], about["ankle"]]) / (factors @ factors)
    np.testing.assert_allclose(about["wheel"], both, rtol=0, atol=1e-12)


def test_sweeps_and_calibration_place_followers(made: Knee) -> None:
    model = made.model
    maker = PoseMaker(model, model.qpos0)
    sweep = maker.sweep(model.joint("knee").id, 40)
    for pose in [*sweep.qpos, *maker.random(20).qpos]:
        np.testing.assert_allclose(pose, made.follow(model, pose), rtol=0, atol=1e-13)
    space = JointSpace(model, model.qpos0, dict.fromkeys(("hip", "knee", "ankle"), (-1.5, 0.4)))
    rng = np.random.default_rng(0)
    for _ in range(20):
        pose = space.pose(rng.uniform(0.0, 1.0, space.k))
        np.testing.assert_allclose(pose, made.follow(model, pose), rtol=0, atol=1e-13)
    moved, _ = space.moves(mw.MuscleSystem(model).declarations)
    assert moved.tolist() == [[False, True, False]]  # by the knee alone, directly and through three followers


def saved(made: Knee, tmp_path) -> str:
    path = tmp_path / "knee.xml"
    path.write_text(made.xml)
    return str(path)


@pytest.mark.parametrize("mode", ["python", "wrench"])
def test_a_prescribed_leader_takes_its_followers_along(tmp_path, mode: str) -> None:
    made = gait_knee(1e-3, "RK4")
    made = Knee(knee(1, muscle=True, given=made.splines).xml, made.splines, made.leaders)
    settings = RunSettings(0.8, mode=mode, prescribed=["knee=sine:0.6,1.25"])
    run = Simulation(saved(made, tmp_path), settings)
    run.begin()
    poses: list[np.ndarray] = []
    run.advance([lambda data: poses.append(data.qpos.copy())])
    couplings = CoupledJoints(made.model)
    slides = [made.model.joint(name).id for name in ("slide_x", "slide_z", "glide")]
    errors = [[abs(couplings.residuals(pose)[joint]) for joint in slides] for pose in poses]
    assert np.ptp([pose[made.model.joint("knee").qposadr[0]] for pose in poses]) > 1.0
    assert max(errors[0]) < 1e-14
    assert np.max(errors) < 1e-5


def test_start_positions_set_what_follows_them(made: Knee) -> None:
    model = made.model
    data = mujoco.MjData(model)
    set_state(model, data, -1, {"knee": -0.4})
    wanted = model.qpos0.copy()
    wanted[model.joint("knee").qposadr[0]] = -0.4
    np.testing.assert_allclose(data.qpos, made.follow(model, wanted), rtol=0, atol=1e-13)
    set_state(model, data, -1, {"knee": -0.4, "twist": 0.5})
    assert data.qpos[model.joint("twist").qposadr[0]] == 0.5


def table(time: np.ndarray, columns: dict[str, np.ndarray]) -> mw.Table:
    return mw.Table(time, tuple(columns), np.stack(list(columns.values()), axis=1))


def test_a_table_of_coordinates_alone_places_all_followers(made: Knee) -> None:
    model = made.model
    muscles, start = mw.MuscleSystem(model), mujoco.MjData(model)
    time = np.linspace(0.0, 1.0, 9)
    given = {"knee": np.linspace(-1.6, 0.2, 9), "knee_u": np.linspace(1.0, 2.0, 9), "hip": np.sin(time)}
    states = read_states(model, muscles, start, table(time, given))
    for k, pose in enumerate(states.qpos):
        wanted = model.qpos0.copy()
        wanted[model.joint("knee").qposadr[0]] = given["knee"][k]
        wanted[model.joint("hip").qposadr[0]] = given["hip"][k]
        np.testing.assert_allclose(pose, made.follow(model, wanted), rtol=0, atol=1e-13)
        slope = made.splines["slide_x"](given["knee"][k], 1)
        speed = states.qvel[k, model.joint("slide_x").dofadr[0]]
        assert speed == pytest.approx(slope * given["knee_u"][k], abs=1e-13)
    assert "5 positions missing, of joints that follow others" in " ".join(states.remarks)
    own = dict(given, slide_x=np.full(9, 0.3))
    states = read_states(model, muscles, start, table(time, own))
    np.testing.assert_array_equal(states.qpos[:, model.joint("slide_x").qposadr[0]], 0.3)


def test_the_check_of_a_model_tells_the_coupling_error() -> None:
    made = knee(1, muscle=True)
    found = {check.name: check for check in check_model(made.model, poses=4, samples=11).checks}
    check = found["couplings"]
    assert check.verdict == "pass"
    assert check.count == 4 * 5
    assert check.worst < 1e-12
    assert "in 0.1 s of motion, with 1 ms a step, joints are up to" in check.remarks[0]
    size = float(check.remarks[0].split("up to ")[1].split(" m ")[0])
    assert 1e-8 < size < 2e-5


def test_a_comparison_of_motions_switches_on_both_sides() -> None:
    from mjwrap.comparison.motion import compare_motion

    made = knee(1, integrator="RK4", muscle=True)
    found = compare_motion(made.model, ["quad=constant:0.3"], 0.15, qpos=made.model.qpos0)
    assert not found.stopped
    couplings = CoupledJoints(made.model)
    for poses in (found.native, found.mjwrap):
        assert np.ptp(poses[:, made.model.joint("knee").qposadr[0]]) > 0.3
        assert max(abs(e) for pose in poses for e in couplings.residuals(pose).values()) < 1e-4
