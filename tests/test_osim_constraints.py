"""Couplers, constraints, loops and locks as MuJoCo has them."""

import dataclasses

import mujoco
import numpy as np
import pytest
from osim_mechanics import written
from osim_scenes import ORIGIN, body, chain, frame, model, turning

from mjwrap.errors import OsimError
from mjwrap.osim.description.bodies import (
    Coupler,
    DistanceConstraint,
    PointConstraint,
    PointOnLineConstraint,
    WeldConstraint,
)
from mjwrap.osim.description.functions import Piecewise, linear


def test_a_dependent_coordinate_without_an_axis_is_composed_through_its_coupler():
    cubic = Piecewise(
        np.array([0.2]), np.array([0.0, 0.2]), np.array([[0.1, 0.5, 0.3, -0.2], [0.2, 0.4, -0.1, 0.3]])
    )
    coupler = Coupler(
        "c", "j1", ("j0",), Piecewise(np.zeros(0), np.zeros(1), np.array([[0.05, 0.8, 0.1, 0.2]])), 1.5
    )
    osim = chain(coupler, count=2)
    osim = dataclasses.replace(
        osim, joints=(osim.joints[0], turning("j1", frame("b0", 0.3, 0, 0), frame("b1"), cubic))
    )
    found = written(osim)
    compiled = found.compile()
    assert [compiled.joint(k).name for k in range(compiled.njnt)] == ["j0", "j1_rotation1"]
    driver = found.skeleton.drivers.driver("j1")
    assert driver is not None
    joint, function = driver
    assert joint == "j0"
    assert function is not None
    for x in np.linspace(-2.0, 2.0, 41):
        assert function(x) == pytest.approx(1.5 * float(coupler.function(x)), abs=1e-14)
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    assert data.qpos[1] == pytest.approx(float(cubic(1.5 * coupler.function(0.3))), abs=1e-9)
    assert np.abs(data.efc_pos[: data.ne]).max() == 0.0


def test_locked_and_prescribed_coordinates_are_held():
    osim = chain()
    joints = (
        turning("j0", ORIGIN, frame("b0"), default=0.4, locked=True),
        turning("j1", frame("b0", 0.3, 0.0, 0.0), frame("b1"), default=0.2, prescribed=linear(1.0, 0.7)),
        osim.joints[2],
    )
    found = written(dataclasses.replace(osim, joints=joints))
    compiled = found.compile()
    data = mujoco.MjData(compiled)
    assert compiled.qpos0.tolist() == [0.4, 0.7, pytest.approx(0.9)]
    for _ in range(200):
        mujoco.mj_step(compiled, data)
    np.testing.assert_allclose(data.qpos[:2], [0.4, 0.7], rtol=0.0, atol=1e-7)
    assert abs(data.qpos[2] - 0.9) > 0.01


CONSTRAINTS = [
    PointConstraint("c", frame("b2", 0.3, 0.0, 0.0), frame("ground", 0.4, 0.35, 0.0)),
    DistanceConstraint("c", frame("b2", 0.3, 0.1, 0.0), frame("ground", 0.9, 0.1, 0.0), 0.5),
    PointOnLineConstraint(
        "c", frame("ground", 0.1, 0.4, 0.0), np.array([1.0, 0.2, 0.0]), frame("b2", 0.3, 0.0, 0.0)
    ),
    WeldConstraint("c", frame("b2", 0.3, 0.0, 0.0), frame("ground", 0.35, 0.4, 0.0)),
]


@pytest.mark.parametrize("constraint", CONSTRAINTS, ids=lambda each: type(each).__name__)
def test_constraints_hold_from_the_default_pose_on(constraint):
    found = written(chain(constraint))
    compiled = found.compile()
    compiled.opt.timestep = 2e-4
    compiled.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    compiled.eq_solref[:, 0] = 4e-4
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    assert np.abs(data.efc_pos[: data.ne]).max() < 1e-12
    energy = data.energy.sum()
    for _ in range(1000):
        mujoco.mj_step(compiled, data)
    mujoco.mj_forward(compiled, data)
    tip, turn = data.body("b2").xpos, data.body("b2").xmat.reshape(3, 3)
    first = constraint.point if isinstance(constraint, PointOnLineConstraint) else constraint.first
    point = tip + turn @ first.position
    if isinstance(constraint, PointOnLineConstraint):
        away = np.cross(
            point - constraint.line.position, constraint.direction / np.linalg.norm(constraint.direction)
        )
        assert np.linalg.norm(away) < 5e-6
    elif isinstance(constraint, DistanceConstraint):
        assert abs(np.linalg.norm(point - constraint.second.position) - constraint.distance) < 5e-6
    else:
        np.testing.assert_allclose(point, constraint.second.position, rtol=0.0, atol=5e-6)
    assert data.energy.sum() == pytest.approx(energy, abs=2e-4)


def test_the_default_pose_is_the_nearest_one_that_satisfies_the_constraints():
    constraint = CONSTRAINTS[0]
    found = written(chain(constraint))
    values = np.array([found.skeleton.drivers.values[f"j{k}"] for k in range(3)])
    start, target = np.array([0.3, 0.6, 0.9]), np.array([0.4, 0.35])

    def tip(q):
        angles = np.cumsum(q)
        return 0.3 * np.array([np.cos(angles).sum(), np.sin(angles).sum()])

    np.testing.assert_allclose(tip(values), target, rtol=0.0, atol=1e-13)
    # At the nearest pose the way back is across the directions that the constraint leaves free.
    angles = np.cumsum(values)
    slopes = 0.3 * np.array(
        [[-np.sin(angles[k:]).sum() for k in range(3)], [np.cos(angles[k:]).sum() for k in range(3)]]
    )
    free = np.linalg.svd(slopes)[2][2]
    assert abs(free @ (values - start)) < 1e-8


def test_a_loop_is_closed_by_copies_that_share_the_mass():
    osim = chain()
    closing = turning("j3", frame("ground", 0.4, 0.2, 0.0), frame("b2", 0.3, 0.0, 0.0))
    found = written(dataclasses.replace(osim, joints=(*osim.joints, closing)))
    compiled = found.compile()
    assert compiled.body("b2").mass[0] == compiled.body("b2_j3").mass[0] == 0.5
    compiled.opt.timestep = 2e-4
    compiled.eq_solref[:, 0] = 4e-4
    data = mujoco.MjData(compiled)
    for _ in range(1500):
        mujoco.mj_step(compiled, data)
    np.testing.assert_allclose(data.body("b2").xpos, data.body("b2_j3").xpos, rtol=0.0, atol=2e-5)


def test_a_joint_towards_ground_is_turned_round():
    forward = chain(count=2)
    backward = turning("j1", frame("b1"), frame("b0", 0.3, 0.0, 0.0), default=-0.6)
    there = written(forward)
    back = written(dataclasses.replace(forward, joints=(forward.joints[0], backward)))
    for angle in (-1.0, 0.4):
        poses = []
        for found, sign in ((there, 1.0), (back, -1.0)):
            compiled = found.compile()
            data = mujoco.MjData(compiled)
            data.qpos[:] = 0.5, sign * angle
            mujoco.mj_kinematics(compiled, data)
            poses.append(np.concatenate([data.body("b1").xpos, data.body("b1").xmat]))
        np.testing.assert_allclose(poses[0], poses[1], rtol=0.0, atol=1e-15)


def test_a_body_without_a_joint_moves_freely():
    found = written(model([body("b0"), body("b1")], [turning("j0", ORIGIN, frame("b0"))]))
    compiled = found.compile()
    assert compiled.nv == 7
    data = mujoco.MjData(compiled)
    for _ in range(100):
        mujoco.mj_step(compiled, data)
    assert data.body("b1").xpos[1] == pytest.approx(-0.5 * 9.81 * 0.1**2, rel=1e-3)


def test_descriptions_that_cannot_be_written_name_the_element():
    circle = (Coupler("c1", "j0", ("j1",), linear(1.0)), Coupler("c2", "j1", ("j0",), linear(1.0)))
    two = Coupler("c3", "j0", ("j1", "j2"), linear(1.0))
    lost = Coupler("c4", "j0", ("nowhere",), linear(1.0))
    for constraints, words in ((circle, "circle"), ((two,), "'c3' has 2"), ((lost,), "'nowhere' not found")):
        with pytest.raises(OsimError, match=words):
            written(chain(*constraints))
    with pytest.raises(OsimError, match="joins body 'b0' to itself"):
        written(model([body("b0")], [turning("j0", frame("b0"), frame("b0"))]))
    with pytest.raises(OsimError, match="body 'b7' not found; bodies: b0"):
        written(model([body("b0")], [turning("j0", ORIGIN, frame("b7"))]))
