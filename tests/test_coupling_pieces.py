"""Couplings of several pieces: where they put their followers, their slopes, and wrong tuples."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from coupling_models import Knee, knee

import mjwrap as mw
from mjwrap.mjcf.couplings import CoupledJoints, read_couplings

FOLLOWERS = ("slide_x", "slide_z", "twist", "glide", "wheel")


def random_pose(made: Knee, model: mujoco.MjModel, rng: np.random.Generator) -> np.ndarray:
    """Return a random pose; one leader in two is at a knot, or the next number below it."""
    qpos = rng.uniform(-1.8, 0.5, model.nq)
    if rng.integers(2):
        at = rng.choice(made.splines["slide_z"].knots)
        qpos[model.joint("knee").qposadr[0]] = rng.choice([at, np.nextafter(at, -9.0)])
    return qpos


@pytest.mark.parametrize("seed", range(6))
def test_followers_stand_where_the_spline_has_them(seed: int) -> None:
    made = knee(seed)
    model, rng = made.model, np.random.default_rng(seed)
    couplings = CoupledJoints(model)
    assert {model.joint(j).name for j in couplings.leader} == set(FOLLOWERS)
    assert [len(c.equalities) for c in read_couplings(model)] == [9, 12, 7, 8, 10]
    for _ in range(100):
        qpos = random_pose(made, model, rng)
        wanted = made.follow(model, qpos)
        assert max(map(abs, couplings.residuals(wanted).values())) < 1e-13
        off = couplings.residuals(qpos)
        couplings.place(qpos)
        np.testing.assert_allclose(qpos, wanted, rtol=0, atol=1e-13)
        assert max(map(abs, off.values())) > 1e-4


@pytest.mark.parametrize("seed", range(3))
def test_mujoco_has_no_constraint_error_at_placed_poses(seed: int) -> None:
    """With the piece of the pose active, MuJoCo's own rows are zero."""
    made = knee(seed)
    model, rng = made.model, np.random.default_rng(seed)
    data, couplings = mujoco.MjData(model), CoupledJoints(model)
    for _ in range(50):
        data.qpos[:] = random_pose(made, model, rng)
        couplings.place(data.qpos)
        made.set_active(model, data)
        mujoco.mj_forward(model, data)
        assert data.ne == len(FOLLOWERS)
        np.testing.assert_allclose(data.efc_pos[: data.ne], 0.0, atol=1e-13)


@pytest.mark.parametrize("seed", range(3))
def test_the_matrix_is_the_slope_on_both_sides_of_a_knot(seed: int) -> None:
    made = knee(seed)
    model, rng = made.model, np.random.default_rng(seed)
    couplings = CoupledJoints(model)
    step = 1e-6
    for _ in range(40):
        qpos = random_pose(made, model, rng)
        couplings.place(qpos)
        matrix = couplings.matrix(qpos)
        for column, dof in enumerate(couplings.independent):
            ends = [qpos.copy(), qpos.copy()]
            for end, sign in zip(ends, (-1.0, 1.0), strict=True):
                end[dof] += sign * step
            slope = (made.follow(model, ends[1]) - made.follow(model, ends[0])) / (2.0 * step)
            np.testing.assert_allclose(matrix[:, column], slope, atol=1e-9)


def test_who_follows_whom_through_sums_and_chains() -> None:
    model = knee().model
    couplings = CoupledJoints(model)
    at = {model.joint(j).name: j for j in range(model.njnt)}
    assert couplings.head(at["glide"]) == at["knee"]
    assert couplings.heads(at["wheel"]) == [at["hip"], at["ankle"]]
    assert couplings.heads(at["hip"]) == [at["hip"]]
    assert sorted(couplings.independent) == sorted(model.jnt_dofadr[at[n]] for n in ("hip", "knee", "ankle"))


def test_a_tendon_with_a_factor_and_a_loop_through_a_sum() -> None:
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><worldbody>
          <body><joint name="a" ref="10"/><geom size=".1"/><body><joint name="b"/><geom size=".1"/>
          <body><joint name="c" ref="5"/><geom size=".1"/><body><joint name="d"/><geom size=".1"/></body></body></body>
          </body></worldbody>
        <tendon><fixed name="c3"><joint joint="c" coef="-3"/></fixed>
          <fixed name="ab"><joint joint="a" coef="2"/><joint joint="b" coef=".5"/><joint joint="c" coef="0"/></fixed>
          <fixed name="a1"><joint joint="a" coef="1"/></fixed><fixed name="cd"><joint joint="c" coef="1"/>
          <joint joint="d" coef="1"/></fixed><fixed name="d1"><joint joint="d" coef="2"/></fixed></tendon>
        <equality><tendon tendon1="c3" tendon2="ab" polycoef=".2 1.5 -.3 .1 .05"/>
          <tendon tendon1="a1" tendon2="cd" polycoef="0 1 0 0 0"/><tendon tendon1="ab" tendon2="cd"/>
          <tendon tendon1="d1" polycoef=".4 0 0 0 0"/></equality></mujoco>"""
    )
    couplings, data = CoupledJoints(model), mujoco.MjData(model)
    assert {model.joint(j).name for j in couplings.leader} == {
        "c",
        "d",
    }  # a would close a loop; ab has two joints
    data.qpos[:2] = 0.3, -0.2
    couplings.place(data.qpos)
    mujoco.mj_forward(model, data)
    rows = {int(i): float(p) for i, p in zip(data.efc_id[: data.ne], data.efc_pos, strict=False)}
    assert abs(rows[0]) < 1e-14
    assert abs(rows[3]) < 1e-14


BASE = """<mujoco><worldbody><body name="B"><joint name="a"/><geom size=".1"/><body><joint name="b"/><geom size=".1"/>
<body><joint name="c"/><geom size=".1"/></body></body></body></worldbody>
<equality><joint name="e0" joint1="b" joint2="a" polycoef="0 1 0 0 0"/>
<joint name="e1" joint1="b" joint2="a" active="false"/>
<joint name="e2" joint1="b" joint2="a" active="false"/>
<joint name="c1" joint1="c" joint2="a" active="false"/>
<joint name="bc" joint1="b" joint2="c" active="false"/><weld name="w" body1="B" active="false"/>
<joint name="on" joint1="b" joint2="a"/><joint name="alone" joint1="b" active="false"/></equality>
<custom><numeric name="two" data="0 1"/><numeric name="down" data="1 0"/><numeric name="same" data="1 1"/>
<numeric name="one" data="0"/>{}</custom></mujoco>"""


@pytest.mark.parametrize(
    ("elements", "wanted"),
    [
        ("e0 e1 e2 one", "numeric 'one' has 1 value; 3 pieces need 2"),
        ("e0 e1 two", "numeric 'two' has 2 values; 2 pieces need 1"),
        ("e0 two", "numeric 'two' has 2 values; 1 piece need"),
        ("e0 e1 e2 down", "numeric 'down' must have finite, increasing values, not 1 0"),
        ("e0 e1 e2 same", "numeric 'same' must have finite, increasing values"),
        ("e0 e1 e2", "it lists 0 numerics for 3 pieces"),
        ("e0 e1 e2 two two", "it lists 2 numerics for 3 pieces"),
        ("two", "it lists no equality"),
        ("e0 c1 one", "equality 'c1' moves joint 'c', equality 'e0' joint 'b'"),
        ("e0 bc one", "equality 'bc' has the leaders 'c' (times 1), equality 'e0' 'a' (times 1)"),
        ("e0 e1 w two", "equality 'w' (type 'weld') does not couple joints"),
        ("e0 on one", "equality 'e0', equality 'on' are all active at the start"),
        ("e0 e1 e1 two", "lists an equality twice"),
        ("alone alone one", "equality 'alone' has no leader"),
        ("e0 a one", "joint 'a' cannot be used"),
    ],
)
def test_a_wrong_tuple_is_named_with_its_element(elements: str, wanted: str) -> None:
    kinds = {"a": "joint", "two": "numeric", "down": "numeric", "same": "numeric", "one": "numeric"}
    inner = "".join(
        f'<element objtype="{kinds.get(name, "equality")}" objname="{name}"/>' for name in elements.split()
    )
    model = mujoco.MjModel.from_xml_string(BASE.format(f'<tuple name="mjwrap_coupling_b">{inner}</tuple>'))
    with pytest.raises(mw.ModelError) as caught:
        read_couplings(model)
    assert "tuple 'mjwrap_coupling_b'" in str(caught.value)
    assert wanted in str(caught.value)


def test_an_equality_is_a_piece_of_one_coupling_only() -> None:
    one, other = (
        f'<tuple name="mjwrap_coupling_{n}"><element objtype="equality" objname="e0"/></tuple>' for n in "bx"
    )
    model = mujoco.MjModel.from_xml_string(BASE.format(one + other))
    with pytest.raises(mw.ModelError, match="'e0' is in tuple 'mjwrap_coupling_b' already"):
        read_couplings(model)


def test_couplings_are_no_muscles_also_after_attach() -> None:
    made = knee(3, timestep=0.002, integrator="Euler", muscle=True)
    child, parent = mujoco.MjSpec.from_string(made.xml), mujoco.MjSpec()
    parent.attach(child, prefix="left_", frame=parent.worldbody.add_frame())
    model = parent.compile()
    assert mw.MuscleSystem(model).names == ["left_quad"]
    found = read_couplings(model)
    assert [model.joint(c.joint).name for c in found] == [f"left_{name}" for name in FOLLOWERS]
    assert [len(c.equalities) for c in found] == [9, 12, 7, 8, 10]
    text = mujoco.MjSpec.from_string(made.xml)
    text.compile()
    again = mujoco.MjModel.from_xml_string(text.to_xml())
    assert [len(c.equalities) for c in read_couplings(again)] == [9, 12, 7, 8, 10]
