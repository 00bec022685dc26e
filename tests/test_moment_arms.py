"""Moment arms about independent coordinates: the negative slopes of lengths along the coupled motion."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import mjwrap as mw
from mjwrap.mjcf.couplings import CoupledJoints

LINKS = 6
# Followers in the wrong order, a chain of three, one fixed by an equality without a leader, one switched off.
PAIRS = (("q4", "q3"), ("q3", "q1"), ("q6", "q4"), ("q5", None))


def linkage(rng: np.random.Generator, active: bool = True) -> mujoco.MjModel:
    """Return a chain of hinges and slides, some of them coupled, with two muscles over surfaces and via sites."""
    lines, ends = [], ""
    for k in range(1, LINKS + 1):
        kind = "slide" if k in (2, 4) else "hinge"
        axis = " ".join(f"{x:.6f}" for x in rng.normal((0.0, 2.0, 0.0)))
        lines.append(
            f'<body pos=".1 0 0"><joint name="q{k}" type="{kind}" axis="{axis}" ref="{rng.normal(0, 0.2):.6f}"/>'
            f'<geom name="w{k}" type="{"sphere" if k % 2 else "cylinder"}" size=".03 .05" zaxis="0 1 0"'
            f' pos="0 0 {rng.uniform(-0.035, -0.025):.6f}"/><site name="s{k}" pos=".05 0 {rng.normal(0, 0.003):.6f}"/>'
        )
        ends += "</body>"
    sizes = np.array([0.03, 0.3, 0.3, 0.3, 0.3])
    couplings = "".join(
        f'<joint joint1="{follower}" joint2="{leader}" polycoef="{" ".join(map(str, rng.normal(0, sizes)))}"'
        f' active="{str(active).lower()}"/>'
        if leader
        else f'<joint joint1="{follower}" polycoef="{rng.normal(0, 0.03)!r} 0 0 0 0" active="{str(active).lower()}"/>'
        for follower, leader in PAIRS
    )
    stops = "".join(
        f'<element objtype="geom" objname="w{k}"/><element objtype="site" objname="s{k}"/>'
        for k in range(1, LINKS)
    )

    def muscle(name: str, first: str, last: str) -> str:
        return (
            f'<tuple name="mjwrap_{name}"><element objtype="site" objname="{first}"/>{stops}'
            f'<element objtype="geom" objname="w{LINKS}"/><element objtype="site" objname="{last}"/>'
            f'<element objtype="numeric" objname="optimal_force"/></tuple>'
        )

    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><compiler angle="radian"/><default><joint armature=".1"/><geom density="1000"/></default>
        <worldbody><site name="s0" pos="0 0 .005"/><body><joint name="ball" type="ball"/><geom size=".01"/>
        <site name="o" pos=".03 .01 .01"/>{"".join(lines)}{ends}</body>
        <body><freejoint name="float"/><geom size=".01"/></body></worldbody>
        <equality>{couplings}<joint joint1="q2" joint2="q1" polycoef="0 5 0 0 0" active="false"/></equality>
        <custom><numeric name="optimal_force" data="100"/>{muscle("one", "s0", f"s{LINKS}")}
        {muscle("two", "o", f"s{LINKS}")}</custom></mujoco>"""
    )


def in_place(model: mujoco.MjModel, rng: np.random.Generator) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0 + rng.normal(0.0, 0.1, model.nq)
    mujoco.mj_normalizeQuat(model, data.qpos)
    CoupledJoints(model).place(data.qpos)
    return data


def differences(muscles: mw.MuscleSystem, data: mujoco.MjData, dof: int, step: float) -> np.ndarray | None:
    """Return central differences of the lengths as one degree of freedom moves and its followers follow."""
    model, twin = muscles.model, mujoco.MjData(muscles.model)
    muscles.forward(data)
    touched = [len(muscles.contact_points(i)) for i in range(muscles.n)]
    lengths = []
    for sign in (1.0, -1.0):
        twin.qpos[:] = data.qpos
        motion = np.zeros(model.nv)
        motion[dof] = sign * step
        mujoco.mj_integratePos(model, twin.qpos, motion, 1.0)
        CoupledJoints(model).place(twin.qpos)
        muscles.forward(twin)
        if muscles.status.any() or touched != [len(muscles.contact_points(i)) for i in range(muscles.n)]:
            return None  # a surface is touched, left or entered on the way: the slope has a kink
        lengths.append(muscles.length)
    return (lengths[0] - lengths[1]) / (2.0 * step)


@pytest.mark.parametrize("active", [True, False])
def test_moment_arms_are_slopes_of_the_lengths_along_the_coupled_motion(active: bool) -> None:
    rng, compared, worst = np.random.default_rng(7), 0, []
    for _ in range(8):
        model = linkage(rng, active)
        muscles = mw.MuscleSystem(model)
        followers = {f for f, _ in PAIRS} if active else set()
        assert muscles.coordinates == [f"q{k}" for k in range(1, LINKS + 1) if f"q{k}" not in followers]
        names = [*muscles.coordinates, "ball", "float"]
        dofs = [model.joint(n).dofadr[0] + i for n in names for i in range({"ball": 3, "float": 6}.get(n, 1))]
        for _ in range(3):
            data = in_place(model, rng)
            muscles.forward(data)
            if muscles.status.any():
                continue
            found = muscles.moment_arms(data, names)
            assert found.shape == (2, len(dofs))
            np.testing.assert_array_equal(found[:, -6:], 0.0)  # the muscles do not cross the free joint
            for column, dof in enumerate(dofs[:-6]):
                coarse, fine = (differences(muscles, data, int(dof), step) for step in (4e-4, 2e-4))
                if coarse is None or fine is None or np.abs(coarse - fine).max() > 3e-5:
                    continue  # a kink, or close to a tie round a sphere, where the slope itself turns within a step
                errors = [np.abs(found[:, column] + d).max() for d in (coarse, fine)]
                size = max(1e-3, float(np.abs(found[:, column]).max()))
                assert errors[1] < 1e-3 * size
                if errors[0] > 1e-9:
                    assert 3.5 < errors[0] / errors[1] < 4.5  # second order
                worst.append(np.abs(found[:, column] + (4.0 * fine - coarse) / 3.0).max() / size)
                compared += 1
    assert compared > 30
    assert max(worst) < 1e-8


def test_default_columns_are_the_independent_coordinates_and_data_is_not_written() -> None:
    model = linkage(np.random.default_rng(3))
    muscles, data = mw.MuscleSystem(model), in_place(model, np.random.default_rng(4))
    before = {
        name: np.copy(getattr(data, name)) for name in ("qpos", "qvel", "xpos", "qfrc_applied", "act", "ctrl")
    }
    found = muscles.moment_arms(data)
    for name, value in before.items():
        np.testing.assert_array_equal(getattr(data, name), value)
    assert muscles.coordinates == ["q1", "q2"]
    np.testing.assert_array_equal(found, muscles.moment_arms(data, muscles.coordinates))
    np.testing.assert_array_equal(found[:, 1:], muscles.moment_arms(data, "q2"))
    np.testing.assert_array_equal(found[:, ::-1], muscles.moment_arms(data, ["q2", "q1"]))
    assert muscles.moment_arms(data, []).shape == (2, 0)
    plain = -muscles.length_jacobian(data)
    assert np.abs(found[:, 0] - plain[:, model.joint("q1").dofadr[0]]).max() > 1e-3  # the followers count


def test_a_pull_drives_a_coordinate_up_where_its_moment_arm_is_positive() -> None:
    model = mujoco.MjModel.from_xml_path("models/elbow/elbow.xml")
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    found = muscles.moment_arms(data)
    muscles.apply(data)
    driven = np.empty(model.nv)
    for i in range(muscles.n):
        alone = np.zeros(model.nv)
        for body, point, force in muscles.forces(i):
            mujoco.mj_forward(model, data)
            mujoco.mj_applyFT(model, data, force, np.zeros(3), point, body, alone)
        driven = CoupledJoints(model).matrix(data.qpos).T @ alone
        np.testing.assert_allclose(driven, found[i] * muscles.tension[i], atol=1e-9)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("flaot", ["no joint 'flaot'", "did you mean 'float'", "joints: "]),
        ("elbow", ["no joint 'elbow'", "joints: ball, q1"]),
    ],
)
def test_a_wrong_coordinate_is_named(name: str, words: list[str]) -> None:
    model = linkage(np.random.default_rng(3))
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    with pytest.raises(mw.GeometryError) as raised:
        muscles.moment_arms(data, ["q1", name])
    assert all(word in str(raised.value) for word in words), raised.value
