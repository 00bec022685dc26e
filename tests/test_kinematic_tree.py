"""The dofs that a muscle crosses are those with which its length changes, in models with pulleys and all joints."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from mjwrap.mjcf import read_declarations
from mjwrap.model.kinematic_tree import crossed_dofs, last_dofs, moving_dofs

SITES = 6


def random_tree(seed: int) -> mujoco.MjModel:
    """A tree of bodies with all kinds of joints, and straight muscles between random sites, some over pulleys."""
    rng = np.random.default_rng(seed)
    spec = mujoco.MjSpec()
    bodies = [spec.worldbody]
    kinds = mujoco.mjtJoint
    for i in range(SITES):
        parent = bodies[int(rng.integers(len(bodies)))]
        body = parent.add_body(name=f"b{i}", pos=rng.normal(size=3))
        if parent is spec.worldbody and rng.uniform() < 0.3:
            body.add_freejoint()
        else:
            h, s, b = kinds.mjJNT_HINGE, kinds.mjJNT_SLIDE, kinds.mjJNT_BALL
            for kind in ((), (h,), (s,), (b,), (h, s), (s, h, h), (s, b))[int(rng.integers(7))]:
                body.add_joint(type=kind, axis=rng.normal(size=3), pos=rng.normal(size=3))
        body.add_geom(size=[0.1, 0, 0])
        body.add_site(name=f"s{i}", pos=rng.normal(size=3))
        bodies.append(body)
    spec.worldbody.add_site(name="ground", pos=rng.normal(size=3))
    names = [*(f"s{i}" for i in range(SITES)), "ground"]
    for i in range(5):
        tendon = spec.add_tendon(name=f"m{i}")
        for piece in range(int(rng.integers(1, 4))):
            if piece:
                tendon.wrap_pulley(2.0)
            for name in rng.choice(names, size=int(rng.integers(2, 4)), replace=False):
                tendon.wrap_site(str(name))
        spec.add_actuator(name=f"m{i}", target=f"m{i}", trntype=mujoco.mjtTrn.mjTRN_TENDON)
    return spec.compile()


@pytest.mark.parametrize("seed", range(30))
def test_crossed_dofs_change_the_length_and_no_others_do(seed: int) -> None:
    model = random_tree(seed)
    muscles = read_declarations(model, transmission=True).muscles
    crossed = crossed_dofs(model, muscles)
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    slopes = np.zeros((len(muscles), model.nv))
    for _ in range(3):
        direction = rng.normal(size=model.nv)
        mujoco.mj_integratePos(model, data.qpos, direction, 1.0)
        mujoco.mj_forward(model, data)
        jacobian = np.zeros((model.ntendon, model.nv))
        mujoco.mju_sparse2dense(
            jacobian, data.ten_J, model.ten_J_rownnz, model.ten_J_rowadr, model.ten_J_colind
        )
        slopes = np.maximum(slopes, np.abs(jacobian))
    assert len(muscles) == 5
    assert np.array_equal(crossed, slopes > 1e-10)


@pytest.mark.parametrize("seed", range(5))
def test_the_dofs_above_a_body_are_those_that_follow_from_its_last_one(seed: int) -> None:
    model = random_tree(seed)
    moves = moving_dofs(model)
    for body, dof in enumerate(last_dofs(model).tolist()):
        chain = []
        while dof >= 0:
            chain.append(dof)
            dof = int(model.dof_parentid[dof])
        assert sorted(chain) == np.flatnonzero(moves[body]).tolist()
