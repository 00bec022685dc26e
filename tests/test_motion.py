"""Motions: rates by splines, quaternions, joints that follow others, filters, and tables of coordinates."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from coupling_models import knee
from inverse_models import every_joint, swaying
from osim_models import compiled

import mjwrap as mw
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.mjcf.names import qpos_names

HINGES = """<mujoco><worldbody><body><joint name="one" axis="1 0 0"/><joint name="two" type="slide"/>
<geom size=".1"/></body></worldbody></mujoco>"""


def hinges() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(HINGES)


@pytest.mark.parametrize("frames", [6, 7, 30])
def test_rates_of_a_polynomial_of_degree_five_are_exact(frames: int) -> None:
    rng = np.random.default_rng(frames)
    time = np.sort(rng.uniform(-1.0, 1.0, frames))
    curves = [np.polynomial.Polynomial(rng.normal(size=6)) for _ in range(2)]
    motion = mw.Motion(time, np.column_stack([c(time) for c in curves])).completed(hinges())
    # rounding of the interpolation, which close times amplify
    scale = 1e-14 / np.diff(time).min() ** 2
    np.testing.assert_allclose(motion.qvel, np.column_stack([c.deriv()(time) for c in curves]), atol=scale)
    np.testing.assert_allclose(
        motion.qacc, np.column_stack([c.deriv(2)(time) for c in curves]), atol=1e2 * scale
    )


def test_few_times_have_the_polynomial_through_them_and_one_is_at_rest() -> None:
    time = np.array([0.0, 0.3, 1.0])
    motion = mw.Motion(time, np.column_stack([time**2, 3.0 - time])).completed(hinges())
    np.testing.assert_allclose(motion.qacc, [[2.0, 0.0]] * 3, atol=1e-12)
    np.testing.assert_allclose(motion.qvel[:, 0], 2 * time, atol=1e-12)
    still = mw.Motion([0.2], [[0.3, 0.1]]).completed(hinges())
    assert not still.qvel.any()
    assert not still.qacc.any()


def test_natural_ends_leave_the_third_and_fourth_derivative_zero() -> None:
    """A natural spline of degree 5 through a parabola is the parabola; through a cubic it is not."""
    time = np.linspace(0.0, 1.0, 40)
    both = np.column_stack([time**2, time**3])
    motion = mw.Motion(time, both, ends="natural").completed(hinges())
    np.testing.assert_allclose(motion.qacc[:, 0], 2.0, atol=1e-10)
    assert abs(motion.qacc[0, 1]) > 1e-2
    assert abs(motion.qacc[20, 1] - 6 * time[20]) < 1e-5


def test_accelerations_from_given_velocities_are_their_slopes() -> None:
    time = np.linspace(0.0, 2.0, 40)
    speeds = np.column_stack([np.sin(time), time**3])
    motion = mw.Motion(time, np.zeros((40, 2)), speeds).completed(hinges())
    np.testing.assert_array_equal(motion.qvel, speeds)
    np.testing.assert_allclose(motion.qacc, np.column_stack([np.cos(time), 3 * time**2]), atol=1e-6)


@pytest.mark.parametrize("flip", [False, True])
def test_quaternions_give_angular_rates_in_the_frame_of_the_body(flip: bool) -> None:
    """R = Rz(a(t)) Rx(b(t)) turns with (ḃ, ȧ sin b, ȧ cos b) in its own frame; flip: −q is the same rotation."""
    xml = '<mujoco><worldbody><body><freejoint/><geom size=".1"/><body pos="0 0 1"><joint type="ball"/>'
    model = mujoco.MjModel.from_xml_string(f'{xml}<geom size=".1"/></body></body></worldbody></mujoco>')
    time = np.linspace(0.0, 1.0, 201)
    a, da, dda = 4 * np.sin(2 * time), 8 * np.cos(2 * time), -16 * np.sin(2 * time)
    b, db, ddb = 1.0 + time**3, 3 * time**2, 6 * time
    zero = np.zeros_like(time)
    quat = np.column_stack(
        [np.cos(a / 2) * np.cos(b / 2), np.cos(a / 2) * np.sin(b / 2), np.sin(a / 2) * np.sin(b / 2),
         np.sin(a / 2) * np.cos(b / 2)]
    )  # fmt: skip
    if flip:
        quat *= np.where(np.random.default_rng(1).random(len(time)) < 0.5, -3.0, 0.5)[:, None]
    omega = np.column_stack([db, da * np.sin(b), da * np.cos(b)])
    alpha = np.column_stack(
        [ddb, dda * np.sin(b) + da * np.cos(b) * db, dda * np.cos(b) - da * np.sin(b) * db]
    )
    place = np.column_stack([time, zero, time**2])
    motion = mw.Motion(time, np.hstack([place, quat, quat])).completed(model)
    for dof in (3, 6):
        np.testing.assert_allclose(motion.qvel[:, dof : dof + 3], omega, atol=1e-7)
        np.testing.assert_allclose(motion.qacc[:, dof : dof + 3], alpha, atol=1e-4)
    np.testing.assert_allclose(motion.qacc[:, 2], 2.0, atol=1e-9)


def test_joints_that_follow_others_move_as_their_leaders_make_them() -> None:
    for model in (every_joint(), knee(3).model):
        motion = swaying(model, 400, 5).completed(model)
        couplings = CoupledJoints(model)
        for joint in couplings.leader:
            at, dof = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
            step = motion.time[1]
            velocity = (motion.qpos[2:, at] - motion.qpos[:-2, at]) / (2 * step)
            acceleration = np.diff(motion.qpos[:, at], 2) / step**2
            # central differences of a motion with rates up to about 1e4 per s^4
            np.testing.assert_allclose(motion.qvel[1:-1, dof], velocity, atol=2e-3)
            np.testing.assert_allclose(motion.qacc[1:-1, dof], acceleration, atol=1e-1)
        for k in (0, 100):
            speeds = couplings.matrix(motion.qpos[k]) @ motion.qvel[k, couplings.independent]
            np.testing.assert_allclose(motion.qvel[k], speeds, atol=1e-13)


def test_a_filter_halves_the_cut_off_frequency_and_has_no_phase() -> None:
    """Butterworth's |H|² = 1 / (1 + (tan(π f h) / tan(π f_c h))^2n), once for each of the two directions."""
    rate, cutoff, order = 200.0, 6.0, 3
    time = np.arange(4001) / rate
    for frequency in (1.0, 6.0, 15.0):
        wave = np.sin(2 * np.pi * frequency * time)
        ratio = np.tan(np.pi * frequency / rate) / np.tan(np.pi * cutoff / rate)
        gain = 1.0 / (1.0 + ratio ** (2 * order))
        motion = mw.Motion(time, np.column_stack([wave, 0 * wave]))
        found = motion.low_pass(hinges(), cutoff, order).qpos[1000:-1000, 0]
        np.testing.assert_allclose(found, gain * wave[1000:-1000], atol=1e-9)


def test_filtered_motions_keep_unit_quaternions_and_couplings() -> None:
    model = every_joint()
    motion = swaying(model, 200, 3)
    found = motion.low_pass(model, 8.0)
    for row in found.qpos:
        same = row.copy()
        mujoco.mj_normalizeQuat(model, same)
        CoupledJoints(model).place(same)
        np.testing.assert_allclose(row, same, atol=1e-14)
    assert 0 < np.abs(found.qpos - motion.qpos).max() < 0.1


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"cutoff": 60.0}, "not below half the sampling rate, 50"),
        ({"cutoff": 0.0}, "cutoff must be finite and positive"),
        ({"cutoff": 6.0, "order": 40}, "needs more than 123 times"),
        ({"cutoff": 6.0, "uneven": True}, "evenly spaced"),
    ],
)
def test_filters_that_cannot_be_are_refused(change: dict, words: str) -> None:
    time = np.linspace(0.0, 1.0, 101) ** (2 if change.pop("uneven", False) else 1)
    with pytest.raises(mw.StateError, match=words):
        mw.Motion(time, np.zeros((101, 2))).low_pass(hinges(), **change)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (([0.0, 1.0], np.zeros((3, 2))), r"qpos must have a row for each of 2 times"),
        (([0.0, 0.0], np.zeros((2, 2))), "ascend"),
        (([0.0, 1.0], [[0.0, np.nan], [0.0, 0.0]]), r"qpos\[1\] is not finite at time 0 s"),
        (([0.0], "x"), "qpos must be an array of numbers"),
        (([[0.0]], [[0.0, 0.0]]), r"time must be \(T,\)"),
        (([0.0], [[0.0, 0.0]], np.zeros((1, 5))), "more columns than qpos"),
    ],
)
def test_arrays_that_are_no_motion_are_refused(given: tuple, words: str) -> None:
    with pytest.raises(mw.StateError, match=words):
        mw.Motion(*given)


def test_motions_of_another_model_are_refused() -> None:
    with pytest.raises(mw.StateError, match=r"qpos must be \(T, 2\)"):
        mw.Motion([0.0], [[0.0] * 3]).completed(hinges())
    with pytest.raises(mw.StateError, match="quaternion of joint 'root' is zero at time 2 s"):
        mw.Motion([2.0], np.zeros((1, every_joint().nq))).completed(every_joint())
    with pytest.raises(mw.StateError, match="ends must be one of"):
        mw.Motion([0.0], [[0.0]], ends="free")


# ------------------------------------------------------------------------------------------- tables


def test_a_table_of_degrees_in_another_order_is_the_same_motion() -> None:
    made = knee(2)
    model, time = made.model, np.linspace(0.0, 1.0, 15)
    values = {name: 0.3 * np.sin(time + k) - 0.4 for k, name in enumerate(("hip", "knee", "ankle"))}
    wanted = np.tile(model.qpos0, (15, 1))
    for name, column in values.items():
        wanted[:, model.joint(name).qposadr[0]] = column
    wanted = np.array([made.follow(model, row) for row in wanted])
    names = ["speed", "/jointset/x/ankle/value", "qpos:hip", "knee"]
    columns = np.degrees(np.column_stack([0 * time, values["ankle"], values["hip"], values["knee"]]))
    table = mw.Table(time, tuple(names), columns, {"inDegrees": "yes"})
    found = mw.Motion.from_table(model, table)
    np.testing.assert_allclose(found.qpos, wanted, atol=1e-13)
    assert found.qvel is None


def test_missing_columns_are_named_and_can_be_given() -> None:
    model = knee(2).model
    table = mw.Table(np.array([0.0, 1.0]), ("hip", "kne"), np.zeros((2, 2)), source="walk.mot")
    with pytest.raises(
        mw.TableError, match=r"'walk.mot' has no column for knee, ankle; its columns: hip, kne"
    ):
        mw.Motion.from_table(model, table)
    found = mw.Motion.from_table(model, table, missing={"knee": -0.4, "ankle": 0.1, "hip": 9.0})
    assert found.qpos[1, model.joint("ankle").qposadr[0]] == 0.1
    assert found.qpos[1, model.joint("hip").qposadr[0]] == 0.0
    with pytest.raises(
        mw.StateError, match=r"missing: no independent coordinate 'kne' \(did you mean 'knee'\?\)"
    ):
        mw.Motion.from_table(model, table, missing={"kne": 0.0})


def test_columns_of_followers_are_compared_and_a_difference_is_a_warning() -> None:
    made = knee(2)
    model, time = made.model, np.array([0.0, 1.0])
    pose = np.tile(model.qpos0, (2, 1))
    pose = np.array([made.follow(model, row) for row in pose])
    names = tuple(qpos_names(model))
    right = mw.Motion.from_table(model, mw.Table(time, names, pose))
    np.testing.assert_allclose(right.qpos, pose, atol=1e-14)
    wrong = pose.copy()
    wrong[1, names.index("twist")] += 0.2
    with pytest.warns(UserWarning, match="column 'twist'.* at time 1 s is not used, because 'twist' follows"):
        same = mw.Motion.from_table(model, mw.Table(time, names, wrong, source="t.mot"))
    np.testing.assert_allclose(same.qpos, pose, atol=1e-14)


def test_tables_of_free_and_ball_joints_are_read_by_entry() -> None:
    model = every_joint()
    motion = swaying(model, 20, 8)
    names = tuple(f"qpos:{name}" for name in qpos_names(model))
    found = mw.Motion.from_table(model, mw.Table(motion.time, names, motion.qpos))
    np.testing.assert_allclose(found.qpos, motion.qpos, atol=1e-14)
    with pytest.raises(mw.TableError, match=r"no column for root\[0\].*its columns: knee"):
        mw.Motion.from_table(model, mw.Table(motion.time, ("knee",), motion.qpos[:, :1]))


def test_a_filter_acts_on_the_coordinates_before_their_followers_are_placed() -> None:
    model = hinges()
    time = np.linspace(0.0, 1.0, 101)
    values = np.random.default_rng(2).normal(size=(101, 2))
    table = mw.Table(time, ("one", "two"), values)
    found = mw.Motion.from_table(model, table, cutoff=6.0)
    np.testing.assert_allclose(found.qpos, mw.Motion(time, values).low_pass(model, 6.0).qpos, atol=1e-14)


def test_an_imported_model_is_set_as_set_coordinates_does() -> None:
    model = compiled("Rajagopal2015_right_leg_9musc")
    names = [name for name in mw.osim.coordinates(model, mujoco.MjData(model)) if "walker" not in name]
    free = [
        n
        for n in names
        if CoupledJoints(model).leader.get(_joint(model, n), None) is None and _joint(model, n) >= 0
    ]
    time = np.linspace(0.0, 1.0, 9)
    values = np.column_stack([0.1 + 0.2 * np.sin(time + k) for k in range(len(free))])
    found = mw.Motion.from_table(model, mw.Table(time, tuple(free), values))
    data = mujoco.MjData(model)
    for k in range(len(time)):
        mw.osim.set_coordinates(model, data, dict(zip(free, values[k].tolist(), strict=True)))
        np.testing.assert_allclose(found.qpos[k], data.qpos, atol=1e-14)


def _joint(model: mujoco.MjModel, name: str) -> int:
    return int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name))
