"""Path points that move within their bodies: places, lengths, speeds, forces, and what they leave alone."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from moving_models import REFERENCE, Leg, random_leg, random_pose

import mjwrap as mw
from mjwrap.checking import check_model
from mjwrap.system.point_forces import forces_on_joints

SEEDS = range(4)


def system(leg: Leg, integrator: str = "implicitfast") -> tuple[mw.MuscleSystem, mujoco.MjData]:
    model = leg.model(integrator)
    muscles = mw.MuscleSystem(model)
    muscles.excitation[:] = [0.4, 0.7, 0.2][: muscles.n]
    return muscles, mujoco.MjData(model)


@pytest.mark.parametrize("seed", SEEDS)
def test_sites_are_where_their_splines_put_them(seed: int) -> None:
    leg, rng = random_leg(seed, wraps=False), np.random.default_rng(seed)
    muscles, data = system(leg)
    model = muscles.model
    stops = [["pelvis", "patella", "shin"], ["back", "pes", "patella"], ["pelvis", "patella", "pes"]]
    for _ in range(20):
        data.qpos[:] = random_pose(model, rng)
        mujoco.mj_kinematics(model, data)
        muscles.forward(data)
        poses = muscles.poses(data)
        for site in ("patella", "shin", "pelvis", "front", "pes"):
            at = leg.place(model, data, site)
            np.testing.assert_allclose(poses.site_xpos[model.site(site).id], at, rtol=0.0, atol=1e-15)
        for i, route in enumerate(stops):
            places = np.array([leg.place(model, data, site) for site in route])
            expected = np.linalg.norm(np.diff(places, axis=0), axis=1).sum()
            assert abs(muscles.length[i] - expected) < 1e-15
            np.testing.assert_allclose(muscles.points(i), places, rtol=0.0, atol=1e-15)


def test_the_reference_pose_has_the_sites_of_the_file() -> None:
    leg = random_leg(5)
    muscles, data = system(leg)
    mujoco.mj_kinematics(muscles.model, data)
    before = data.site_xpos.copy()
    muscles.forward(data)
    np.testing.assert_allclose(muscles.poses(data).site_xpos, before, rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(data.site_xpos, before)  # forward writes nothing
    assert data.qpos[1] == REFERENCE["knee"]


@pytest.mark.parametrize("seed", SEEDS)
def test_jacobian_and_speed_are_slopes_of_the_length(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    muscles, data = system(random_leg(seed))
    model, checked = muscles.model, 0
    for _ in range(12):
        qpos, qvel = random_pose(model, rng), rng.normal(size=model.nv) * [1.0, 1.0, 0.1]
        data.qpos[:], data.qvel[:] = qpos, qvel
        jacobian = muscles.length_jacobian(data)
        speed, good, branch = muscles.velocity, muscles.status == 0, muscles.branch(data)
        np.testing.assert_allclose(speed, jacobian @ qvel, rtol=0.0, atol=1e-14)

        touched = np.diff(muscles.contacts()[1])

        def length(direction: np.ndarray, h: float, at=qpos, start=branch, before=touched) -> np.ndarray:
            data.qpos[:] = at + h * direction
            muscles.set_branch(data, start)
            muscles.forward(data)
            return np.where(np.diff(muscles.contacts()[1]) == before, muscles.length, np.nan)

        errors = []
        for h in (2e-3, 1e-3):
            slope = np.array(
                [
                    (length(unit, h) - length(unit, -h)) / (2 * h)
                    for unit in np.eye(model.nv) * [1.0, 1.0, 0.1]
                ]
            ).T / [1.0, 1.0, 0.1]
            rate = (length(qvel, h) - length(qvel, -h)) / (2 * h)
            errors.append((np.abs(slope - jacobian).max(axis=1), np.abs(rate - speed)))
        for wide, narrow in zip(
            *errors, strict=True
        ):  # second order, but where a spline's third derivative jumps
            fine = good & (narrow < np.maximum(0.5 * wide, 1e-9))
            checked += int(fine.sum())
            assert not (narrow[good] > 2e-5).any()  # NaN where a path lifts off
    assert checked > 50


@pytest.mark.parametrize("seed", SEEDS)
def test_generalised_force_and_power(seed: int) -> None:
    rng = np.random.default_rng(200 + seed)
    muscles, data = system(random_leg(seed))
    model = muscles.model
    for _ in range(10):
        data.qpos[:], data.qvel[:] = random_pose(model, rng), rng.normal(size=model.nv)
        mujoco.mj_forward(model, data)
        muscles.apply(data)
        force, share = data.qfrc_applied.copy(), data.qfrc_applied.copy()
        for body in range(model.nbody):
            wrench = data.xfrc_applied[body]
            mujoco.mj_applyFT(model, data, wrench[:3], wrench[3:], data.xipos[body], body, force)
        tension, velocity = muscles.tension, muscles.velocity
        assert np.abs(share).max() > 1e-3
        np.testing.assert_allclose(
            sum(forces_on_joints(muscles, i) for i in range(muscles.n)), share, atol=1e-12
        )
        muscles.reset(data)
        np.testing.assert_array_equal(data.qfrc_applied, 0.0)
        expected = -muscles.length_jacobian(data).T @ tension
        np.testing.assert_allclose(force, expected, rtol=0.0, atol=1e-9)
        assert abs(force @ data.qvel + tension @ velocity) < 1e-9  # the share is part of the power
        assert abs((force - share) @ data.qvel + tension @ velocity) > 1e-6


@pytest.mark.parametrize("seed", SEEDS)
def test_rate_of_the_jacobian(seed: int) -> None:
    rng = np.random.default_rng(300 + seed)
    muscles, data = system(random_leg(seed))
    model, checked = muscles.model, 0
    for _ in range(8):
        qpos, qvel = random_pose(model, rng), rng.normal(size=model.nv) * [1.0, 1.0, 0.05]
        data.qpos[:], data.qvel[:] = qpos, qvel
        muscles.forward(data)
        if muscles.status.any():
            continue
        branch, rate = muscles.branch(data), muscles.length_jacobian_rate(data)
        ends = []
        for h in (1e-5, -1e-5):
            data.qpos[:] = qpos + h * qvel
            muscles.set_branch(data, branch)
            ends.append(muscles.length_jacobian(data))
        np.testing.assert_allclose(rate, (ends[0] - ends[1]) / 2e-5, rtol=0.0, atol=2e-6)
        checked += 1
    assert checked > 4


def test_energy_of_a_string_with_constant_tension() -> None:
    """Skeleton and string together keep their energy, F l, which they do not without the share on the joints."""
    leg = Leg()
    leg.bend("patella", 0, "knee", 0.02, 0.01, -0.01)
    leg.bend("shin", 2, "hip", 0.03, -0.02)
    leg.bend("pelvis", 1, "sink", 0.5)
    leg.declare("long", "pelvis", "patella", "shin")
    leg.declare("short", "back", "pes", "patella")
    drifts = []
    for timestep in (2e-3, 1e-3):
        muscles, data = system(leg, "RK4")
        model = muscles.model
        model.opt.timestep = timestep
        model.dof_damping[:] = 0.0
        scratch, energy = mujoco.MjData(model), list[float]()
        for _ in range(round(0.3 / timestep)):
            muscles.forward(data)
            scratch.qpos[:], scratch.qvel[:] = data.qpos, data.qvel
            mujoco.mj_fwdPosition(model, scratch)
            mujoco.mj_fwdVelocity(model, scratch)
            mujoco.mj_energyPos(model, scratch)
            mujoco.mj_energyVel(model, scratch)
            energy.append(scratch.energy.sum() + muscles.tension @ muscles.length)
            muscles.step(data)
        drifts.append(float(np.ptp(energy)))
    assert drifts[0] < 1e-6
    assert drifts[1] < drifts[0] / 10.0


def test_forces_of_others_stay() -> None:
    muscles, data = system(random_leg(1))
    model = muscles.model
    others = np.array([0.3, 0.0, -2.0])
    data.qfrc_applied[:] = others
    for _ in range(5):
        muscles.apply(data)
        assert (data.qfrc_applied != others).any()
        mujoco.mj_step(model, data)
        muscles.advance(data)
    muscles.step(data)  # takes back what apply has added, and adds to the passive forces
    np.testing.assert_array_equal(data.qfrc_applied, others)
    muscles.apply(data)
    data.qfrc_applied += [0.0, 0.5, 0.0]
    muscles.reset(data)
    np.testing.assert_allclose(data.qfrc_applied, others + np.array([0.0, 0.5, 0.0]), rtol=0.0, atol=1e-14)
    muscles.apply(data)
    mujoco.mj_resetData(model, data)
    muscles.reset(data)
    np.testing.assert_array_equal(data.qfrc_applied, 0.0)


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_apply_and_step_agree(integrator: str) -> None:
    first, second = (system(random_leg(3), integrator) for _ in range(2))
    for _ in range(50):
        first[0].step(first[1])
        second[0].apply(second[1])
        mujoco.mj_step(second[0].model, second[1])
        second[0].advance(second[1])
    np.testing.assert_allclose(first[1].qpos, second[1].qpos, rtol=0.0, atol=1e-12)


def test_a_point_on_a_follower() -> None:
    """The moment arm about a knee contains what moves with a slide that follows it."""
    leg = random_leg(0)
    leg.more = '<equality><joint joint1="sink" joint2="knee" polycoef="0 .01 .005 0 0"/></equality>'
    muscles, data = system(leg)

    def length(knee: float) -> np.ndarray:
        x = knee - REFERENCE["knee"]
        data.qpos[:] = [0.1, knee, 0.01 * x + 0.005 * x * x]
        muscles.forward(data)
        return muscles.length

    slope = (length(0.3 + 1e-5) - length(0.3 - 1e-5)) / 2e-5
    length(0.3)
    np.testing.assert_allclose(muscles.moment_arms(data, "knee")[:, 0], -slope, rtol=0.0, atol=1e-8)
    alone = -muscles.length_jacobian(data)[:, 1]
    assert (np.abs(alone + slope) > 1e-6).any()


def test_declarations_and_texts_name_moving_points() -> None:
    muscles, _ = system(random_leg(0))
    model, declared = muscles.model, muscles.declarations[0]
    assert [model.site(s).name for s in declared.moving_sites] == ["pelvis", "patella", "shin"]
    assert "moving sites" in repr(declared)
    assert "patella (moves with knee and hip)" in muscles._repr_html_()
    crossed = muscles.moment_arms(mujoco.MjData(model))
    assert crossed.shape == (3, 3)


def _broken(old: str, new: str) -> str:
    text = random_leg(0).xml()
    assert old in text
    with pytest.raises(mw.ModelError) as caught:
        mw.MuscleSystem(mujoco.MjModel.from_xml_string(text.replace(old, new)))
    return str(caught.value)


def test_errors_name_the_tuple() -> None:
    joint = '<element objtype="joint" objname="sink" prm="0"/>'
    assert "tuple 'mjwrap_moving_shin': joint 'sink' has prm=3" in _broken(joint, joint.replace('"0"', '"3"'))
    assert "a moving point is a site, then" in _broken(joint, "")
    site = '<tuple name="mjwrap_moving_shin"><element objtype="site" objname="shin"/>'
    assert "site 'patella' is moved by two tuples" in _broken(
        site, site.replace('objname="shin"', 'objname="patella"')
    )
    text = random_leg(0).xml()
    data = text.split('name="shin_0" data="')[1].split('"')[0]
    assert "numeric 'shin_0' is not a piecewise polynomial: its" in _broken(data, data + " 1")
    assert "numeric 'shin_0' is not a piecewise polynomial: its" in _broken(data, "0")
    first, second = data.split()[1:3]
    assert "its breaks must ascend" in _broken(f" {first} {second} ", f" {second} {first} ")
    axis = joint.replace('prm="0"', 'prm="1"') + '<element objtype="numeric" objname="shin_0"/>'
    assert "axis y is given twice" in _broken(joint, axis + joint.replace('prm="0"', 'prm="1"'))


@pytest.mark.parametrize("seed", [0, 3])
def test_check_passes(seed: int) -> None:
    model = random_leg(seed).model()
    model.jnt_range[:] = [[-0.6, 0.6], [-0.7, 0.7], [-0.02, 0.02]]
    model.jnt_limited[:] = 1
    report = check_model(model)
    assert not report.failed, report.table()
