"""Path points that belong to the path only in ranges of joints: the routes that hold, their lengths and restarts."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from moving_models import Leg, random_leg, random_pose

import mjwrap as mw
from mjwrap.checking import check_model
from mjwrap.cli.inspect.declared import table
from mjwrap.kernels import layout
from mjwrap.mjcf.conditional_points import MOST, JointRange, TooManyAlternatives, alternatives, holds
from mjwrap.poses.joint_curves import curves

LOW, HIGH = -0.2, 0.35


def system(leg: Leg, integrator: str = "implicitfast") -> tuple[mw.MuscleSystem, mujoco.MjData]:
    muscles = mw.MuscleSystem(leg.model(integrator))
    muscles.excitation[:] = 0.5
    return muscles, mujoco.MjData(muscles.model)


def one_range(*stops: str) -> Leg:
    leg = Leg()
    leg.declare("string", *stops)
    return leg


def straight(leg: Leg, muscles: mw.MuscleSystem, data: mujoco.MjData, *sites: str) -> float:
    mujoco.mj_kinematics(muscles.model, data)
    places = np.array([leg.place(muscles.model, data, site) for site in sites])
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def test_both_ends_of_a_range_are_included() -> None:
    leg = one_range("pelvis", f"patella?knee {LOW} {HIGH}", "shin")
    muscles, data = system(leg)
    for knee, present in [
        (LOW, True), (HIGH, True), (0.1, True), (np.nextafter(LOW, -1.0), False), (np.nextafter(HIGH, 1.0), False),
        (2.0, False),
    ]:  # fmt: skip
        data.joint("knee").qpos = knee
        muscles.forward(data)
        sites = ["pelvis", "patella", "shin"] if present else ["pelvis", "shin"]
        assert abs(muscles.length[0] - straight(leg, muscles, data, *sites)) < 1e-15
        assert len(muscles.points(0)) == len(sites)
        assert muscles.status[0] == mw.Status.CONVERGED


def test_exactly_one_alternative_holds_everywhere() -> None:
    """Three points over two joints, one of them with ranges of both; all others have no segments and no length."""
    leg = Leg()
    leg.declare(
        "string", "pelvis", f"patella?knee {LOW} {HIGH}?hip -0.3 9", "pes?knee 0.1 0.6", "front?hip -0.1 0.2", "shin"
    )  # fmt: skip
    leg.declare("other", "back", "pes", "shin")
    muscles, data = system(leg)
    model, rng = muscles.model, np.random.default_rng(0)
    declared = muscles.declarations[0]
    assert {model.site(s).name for s in declared.conditional_sites} == {"patella", "pes", "front"}
    assert len(declared.pieces) == 1
    seen = set()
    edges = [LOW, HIGH, 0.1, 0.6, -0.3, -0.1, 0.2]
    for k in range(400):
        data.qpos[:2] = rng.uniform(-1.0, 1.0, 2) if k % 2 else rng.choice(edges, 2)
        holding = [c for c, route in enumerate(declared.routes) if holds(model, route.when, data.qpos)]
        assert len(holding) == 1
        muscles.forward(data)
        hip, knee = (float(q) for q in data.qpos[:2])
        sites = ["pelvis"]
        sites += ["patella"] * (LOW <= knee <= HIGH and hip >= -0.3)
        sites += ["pes"] * (0.1 <= knee <= 0.6) + ["front"] * (-0.1 <= hip <= 0.2) + ["shin"]
        assert abs(muscles.length[0] - straight(leg, muscles, data, *sites)) < 1e-15
        state = muscles._evaluation()
        assert np.flatnonzero(state.count[: len(declared.routes)]).tolist() == holding
        others = np.delete(state.info[: len(declared.routes)], holding, axis=0)
        assert (others[:, [layout.I_LENGTH, layout.I_SPEED]] == 0.0).all()
        assert (others[:, layout.I_STATUS] == layout.CONVERGED).all()
        seen |= set(holding)
    assert len(seen) == len(declared.routes)


@pytest.mark.parametrize("seed", range(3))
def test_derivatives_beside_wraps_and_moving_points(seed: int) -> None:
    leg, rng = random_leg(seed), np.random.default_rng(seed)
    leg.declare(
        "fourth",
        "pelvis",
        "egg:front",
        f"patella?knee {LOW} {HIGH}",
        "condyle:front",
        "pes?hip -9 0.1",
        "shin",
    )
    muscles, data = system(leg)
    model = muscles.model
    for _ in range(10):
        data.qpos[:], data.qvel[:] = random_pose(model, rng), rng.normal(size=model.nv)
        jacobian = muscles.length_jacobian(data)
        np.testing.assert_allclose(muscles.velocity, jacobian @ data.qvel, rtol=0.0, atol=1e-13)
        muscles.apply(data)
        mujoco.mj_forward(model, data)
        force = data.qfrc_applied.copy()
        for body in range(model.nbody):
            wrench = data.xfrc_applied[body]
            mujoco.mj_applyFT(model, data, wrench[:3], wrench[3:], data.xipos[body], body, force)
        np.testing.assert_allclose(force, -jacobian.T @ muscles.tension, rtol=0.0, atol=1e-9)
        muscles.reset(data)


def test_a_route_that_comes_back_starts_cold() -> None:
    """Its first length is that of a new system at that pose, to the bit: no memory of when it last held."""
    leg = one_range("back", "egg:front", f"pes?knee {LOW} {HIGH}", "condyle:front", "shin")
    muscles, data = system(leg)
    returned = 0
    before = True
    for k in range(600):
        data.qpos[:2] = 0.5 * np.sin(0.037 * k), 0.1 + 0.6 * np.sin(0.021 * k)
        muscles.forward(data)
        present = LOW <= data.qpos[1] <= HIGH
        if present != before:
            fresh = mw.MuscleSystem(muscles.model)
            fresh.forward(data)
            assert fresh.status[0] == muscles.status[0]
            assert fresh.length[0] == muscles.length[0]
            returned += 1
        before = present
    assert returned > 6


def test_ends_pulleys_and_several_pieces() -> None:
    """The first and last point may be conditional, and each piece between pulleys has alternatives of its own."""
    leg = one_range(f"pelvis?knee -9 {LOW}", "back", "patella", f"shin?knee {LOW} 9")
    muscles, data = system(leg)
    for knee, sites in [(-0.5, ["pelvis", "back", "patella"]), (0.5, ["back", "patella", "shin"])]:
        data.joint("knee").qpos = knee
        muscles.forward(data)
        assert abs(muscles.length[0] - straight(leg, muscles, data, *sites)) < 1e-15
    with pytest.raises(
        mw.ModelError, match="two at least; it is: site 'pelvis', where its conditional points are"
    ):
        system(one_range("pelvis", f"shin?knee {LOW} {HIGH}"))


def test_a_run_over_edges_and_its_restored_branch() -> None:
    leg = random_leg(1)
    leg.declare("fourth", "pelvis", "egg:front", f"patella?knee {LOW} 0.15", "condyle:front", "shin")
    muscles, data = system(leg, "RK4")
    other = mujoco.MjData(muscles.model)
    data.qvel[:2] = [-1.0, 1.0]
    seen = set()
    for k in range(300):
        if k == 120:
            state = np.concatenate([data.qpos, data.qvel])
            other.qpos[:], other.qvel[:] = state[:3], state[3:]
            muscles.set_branch(other, muscles.branch(data))
        muscles.step(data)
        seen.add(LOW <= data.qpos[1] <= 0.15)
        if k >= 120:
            muscles.step(other)
    assert seen == {True, False}
    np.testing.assert_array_equal(other.qpos, data.qpos)
    muscles.reset(data)
    muscles.forward(data)
    assert np.isfinite(muscles.length).all()


def test_texts_of_conditional_points() -> None:
    muscles, _ = system(one_range("pelvis", f"patella?knee {LOW} {HIGH}", "shin"))
    text = muscles._repr_html_()
    assert f"pelvis &gt; patella &gt; shin, where knee is in [{LOW}, {HIGH}]" in text
    assert f"pelvis &gt; shin, where knee is not in [{LOW}, {HIGH}]" in text
    assert "when not (joint 1 in" in repr(muscles.declarations[0])
    listed = table(muscles.model, muscles.declarations)
    assert f"pelvis > patella > shin, patella only where knee is in [{LOW}, {HIGH}]" in listed
    apart, _ = system(one_range("pelvis", "patella?knee -1 0", "pes?knee 0.1 1", "shin"))
    listed = table(apart.model, apart.declarations)  # no pose has both points
    assert "pelvis > patella > shin, where knee is in [-1, 0] and knee is not in [0.1, 1] / pelvis" in listed


def _error(old: str, new: str) -> str:
    text = one_range("pelvis", f"patella?knee {LOW} {HIGH}", "shin").xml()
    assert old in text
    with pytest.raises(mw.ModelError) as caught:
        mw.MuscleSystem(mujoco.MjModel.from_xml_string(text.replace(old, new)))
    return str(caught.value)


def test_errors_name_the_element() -> None:
    joint = '<element objtype="joint" objname="knee"/>'
    numeric = '<element objtype="numeric" objname="string_patella_knee_active_range"/>'
    assert "joint 'knee' must be followed by a numeric whose name contains active_range" in _error(
        numeric, ""
    )
    site = '<element objtype="site" objname="patella"/>'
    assert "joint 'knee' must directly follow a site" in _error(
        site, site + '<element objtype="geom" objname="egg"/>'
    )
    assert "must be a lowest and a highest position of 'knee'" in _error(f'"{LOW} {HIGH}"', f'"{HIGH} {LOW}"')
    assert "must be a lowest and a highest position of 'knee'" in _error(f'"{LOW} {HIGH}"', '"1 2 3"')
    assert "no joint" not in _error(joint + numeric, numeric + joint)


def test_too_many_combinations_are_refused_with_their_number() -> None:
    ranges = [(JointRange(k, 0.0, 1.0),) for k in range(7)]
    assert len(alternatives(ranges[:6])) == MOST
    with pytest.raises(TooManyAlternatives) as caught:
        alternatives(ranges)
    assert caught.value.count == 128
    many = [(JointRange(0, float(k), k + 1.5),) for k in range(40)]  # along one joint: few of the 2^40 occur
    with pytest.raises(TooManyAlternatives) as caught:
        alternatives(many)
    assert caught.value.count == 80
    leg = Leg()
    stops = [
        f"patella?knee {k / 100} {k / 100 + 0.015}?hip -{k + 1} {k + 1}?sink -{k + 1} 0" for k in range(40)
    ]
    for k, stop in enumerate(stops):
        leg.declare(f"s{k}", "pelvis", stop, "shin")
    assert system(leg)[0].n == 40


def test_checks_and_curves_know_conditional_edges() -> None:
    leg = random_leg(0)
    leg.declare("fourth", "pelvis", f"pes?knee {LOW} {HIGH}", "shin")
    model = leg.model()
    model.jnt_range[:] = [[-0.6, 0.6], [-0.7, 0.7], [-0.02, 0.02]]
    model.jnt_limited[:] = 1
    found = check_model(model)
    assert not found.failed, found.table()
    assert any("conditional edge" in remark for check in found.checks for remark in check.remarks)
    places = curves(model, "knee").edges
    assert list(places) == ["fourth"]
    np.testing.assert_allclose(places["fourth"], [LOW, HIGH], rtol=0.0, atol=1e-12)
