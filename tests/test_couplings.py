"""Coupled joints stand where their equalities want them, and N = ∂q/∂q_independent is the slope of that."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from mjwrap.mjcf.couplings import CoupledJoints, read_couplings
from mjwrap.poses.joint_sweeps import PoseMaker

# A free body, a ball and hinges; a chain of three followers whose equalities stand in the wrong order; one without a
# leader; one that is switched off; a second equality for `second`; a ring of two.
CHAIN = """
<mujoco>
  <default><joint armature=".1"/></default>
  <worldbody>
    <body name="free"><freejoint name="base"/><geom size=".1"/>
      <body><joint name="ball" type="ball"/><geom size=".1"/>
        <body pos=".1 0 0"><joint name="leader" ref="20"/><joint name="third"/><geom size=".1"/>
          <body pos=".1 0 0"><joint name="second" type="slide"/><joint name="first" ref="-10"/><geom size=".1"/>
            <body pos=".1 0 0"><joint name="still"/><joint name="loose"/><geom size=".1"/>
              <body pos=".1 0 0"><joint name="ring"/><joint name="other"/><geom size=".1"/></body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <equality>
    <joint joint1="third" joint2="second" polycoef=".2 -.7 .4 .3 -.2"/>
    <joint joint1="second" joint2="first" polycoef="-.1 .6 .3 0 .5"/>
    <joint joint1="first" joint2="leader" polycoef=".1 1.5 -.3 .2 0"/>
    <joint joint1="second" joint2="ball" polycoef="0 0 0 0 0" active="false"/>
    <joint joint1="still" polycoef=".3 0 0 0 0"/>
    <joint joint1="loose" joint2="leader" polycoef="0 1 0 0 0" active="false"/>
    <joint joint1="second" joint2="leader" polycoef="0 9 0 0 0"/>
    <joint joint1="ring" joint2="other" polycoef="0 2 0 0 0"/>
    <joint joint1="other" joint2="ring" polycoef="0 .5 0 0 0"/>
  </equality>
</mujoco>
"""


@pytest.fixture
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(CHAIN.replace('joint1="second" joint2="ball"', 'joint1="second"'))


def random_pose(model: mujoco.MjModel, rng: np.random.Generator) -> np.ndarray:
    qpos = rng.normal(0.0, 0.4, model.nq)
    mujoco.mj_normalizeQuat(model, qpos)
    return qpos


def value(model: mujoco.MjModel, qpos: np.ndarray, joint: str) -> float:
    return float(qpos[model.joint(joint).qposadr[0]])


def test_followers_stand_where_mujoco_itself_wants_them(model: mujoco.MjModel) -> None:
    """All residuals of MuJoCo's own constraint are zero, but for the one that contradicts an earlier one."""
    couplings, rng = CoupledJoints(model), np.random.default_rng(0)
    data = mujoco.MjData(model)
    contradiction = 6  # the second equality of `second`
    wanted = [int(i) for i in np.flatnonzero(model.eq_active0) if i != contradiction]
    for _ in range(50):
        qpos = random_pose(model, rng)
        couplings.place(qpos)
        data.qpos[:] = qpos
        mujoco.mj_forward(model, data)
        rows = {int(data.efc_id[k]): float(data.efc_pos[k]) for k in range(data.ne)}
        assert set(rows) == {*wanted, contradiction}
        np.testing.assert_allclose([rows[i] for i in wanted], 0.0, atol=1e-14)
        assert abs(rows[contradiction]) > 1e-6


def test_what_follows_what(model: mujoco.MjModel) -> None:
    couplings = CoupledJoints(model)
    ids = {model.joint(j).name: j for j in range(model.njnt)}
    heads = {name: couplings.head(j) for name, j in ids.items()}
    assert [heads[name] for name in ("first", "second", "third")] == [ids["leader"]] * 3
    assert heads["still"] == -1
    assert (
        heads["ring"] == heads["other"] == ids["other"]
    )  # the equality that would close the ring is left out
    assert heads["loose"] == ids["loose"]
    assert len(read_couplings(model)) == 7
    followers = ("first", "second", "third", "still", "ring")
    assert set(couplings.leader) == {ids[name] for name in followers}
    dofs = {int(model.jnt_dofadr[ids[name]]) for name in followers}
    assert couplings.independent.tolist() == [dof for dof in range(model.nv) if dof not in dofs]


def test_the_matrix_is_the_slope_of_the_poses(model: mujoco.MjModel) -> None:
    """Central differences of placed poses come to N at second order in their step."""
    couplings, rng = CoupledJoints(model), np.random.default_rng(1)
    k = len(couplings.independent)
    for _ in range(50):
        qpos = random_pose(model, rng)
        couplings.place(qpos)
        matrix = couplings.matrix(qpos)
        assert matrix.shape == (model.nv, k)
        errors = []
        for step in (1e-3, 1e-4):
            found, slope = np.empty((model.nv, k)), np.empty(model.nv)
            for column, dof in enumerate(couplings.independent):
                ends = []
                for sign in (-1.0, 1.0):
                    moved, direction = qpos.copy(), np.zeros(model.nv)
                    direction[dof] = sign * step
                    mujoco.mj_integratePos(model, moved, direction, 1.0)
                    couplings.place(moved)
                    ends.append(moved)
                mujoco.mj_differentiatePos(model, slope, 2.0 * step, *ends)
                found[:, column] = slope
            errors.append(np.abs(found - matrix).max())
        assert errors[1] < 1e-4 * max(1.0, np.abs(matrix).max())
        assert errors[1] < 0.02 * errors[0]


def test_columns_of_the_matrix_are_spread_tangents(model: mujoco.MjModel) -> None:
    couplings, rng = CoupledJoints(model), np.random.default_rng(2)
    qpos = random_pose(model, rng)
    couplings.place(qpos)
    independent = rng.normal(size=len(couplings.independent))
    tangent = np.zeros(model.nv)
    tangent[couplings.independent] = independent
    couplings.spread(qpos, tangent)
    np.testing.assert_allclose(couplings.matrix(qpos) @ independent, tangent, rtol=1e-14)


def test_a_joint_that_is_freed_stays_and_its_followers_follow(model: mujoco.MjModel) -> None:
    freed = model.joint("second").id
    couplings, rng = CoupledJoints(model, freed), np.random.default_rng(3)
    qpos = random_pose(model, rng)
    before = qpos.copy()
    couplings.place(qpos)
    assert value(model, qpos, "second") == value(model, before, "second")
    assert couplings.head(model.joint("third").id) == freed
    x = value(model, qpos, "second")
    assert value(model, qpos, "third") == pytest.approx(np.polyval([-0.2, 0.3, 0.4, -0.7, 0.2], x), rel=1e-14)


def test_a_sweep_takes_followers_along_and_moves_a_follower_alone(model: mujoco.MjModel) -> None:
    maker = PoseMaker(model, model.qpos0)
    for name, alone in (("leader", False), ("second", True), ("other", False), ("ring", True)):
        joint = model.joint(name).id
        found = maker.sweep(joint, 5)
        assert found.alone == alone
        np.testing.assert_array_equal(found.qpos[:, model.jnt_qposadr[joint]], found.at)
        step = 1e-5
        for at, tangent in zip(found.at, found.tangent, strict=True):
            ends = [maker.place(joint, 0, float(at) + sign * step)[0] for sign in (-1.0, 1.0)]
            slope = np.empty(model.nv)
            mujoco.mj_differentiatePos(model, slope, 2.0 * step, *ends)
            np.testing.assert_allclose(tangent, slope, rtol=1e-6, atol=1e-6)
