"""Saved branches are finite, whatever was tried on the way to a path, and a solve goes on from each of them."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
import pytest

import mjwrap as mw
from mjwrap.plugin import install

CASES = 8000
DRUM = """<mujoco><worldbody><site name="o" pos="-.3 .03 0"/>
<geom name="w" type="cylinder" size=".1 .2" contype="0" conaffinity="0"/>
<body name="b" pos=".3 0 0"><joint type="slide" axis="1 0 0" damping="1000"/>
<geom size=".01" mass="1" contype="0" conaffinity="0"/><site name="i"/></body></worldbody>
<tendon><spatial name="m"><site site="o"/><geom geom="w"/><site site="i"/></spatial></tendon>
<actuator><muscle name="m" tendon="m" lengthrange=".5 1"/></actuator></mujoco>"""
# Rows in which a trial left NaN in a row that the path does not touch (a small input of each kind of ending).
FOUND = {
    "of no length": (
        [-0.047, 0.03, -0.068],
        [-0.047, 0.03, -0.068],
        [
            ((0.00043, 0.0893, 0.013), (0.233, 0.045, -0.006), (0.105, 0.412, 0.844, 0.873), (0.004, 0.003, -0.012)),
            ((0.0728, 0.0673, 0.153), (1.399, 0.041, 0.041), (0.498, 0.769, -0.15, -0.537), (0.05, -0.049, 0.035)),
        ],
    ),
    "past a cone": (
        [-0.998, -1.479, 1.4],
        [20.959, -1.0, -1.065],
        [
            ((0.0, 1.994244068351581, 0.9191284201826095), (4.99, 0.784, -0.548), (1.019, -0.306, 1.129, 0.243),
             (1.362, -1.123, 0.708)),
            ((2.4532814236194467, 1.3401085038980571, 2.9776680120386936), (9.981, -0.509, -0.126),
             (0.654, -0.354, -1.067, -1.653), (-0.382, 2.101, -1.279)),
        ],
    ),
}  # fmt: skip


def drawn(rng: np.random.Generator) -> tuple[Any, Any, list[mw.Obstacle]]:
    """Return a row of cones, cylinders and spheres of all sizes, most of them hinted, some of them free."""
    n = int(rng.integers(1, 4))
    obstacles = []
    for i in range(n):
        kind = rng.integers(4)
        if kind < 2:
            surface: Any = mw.Cone(
                rng.choice([0.0, rng.uniform(0.0, 0.3)]), rng.uniform(0.35, 0.6), rng.uniform(0.1, 0.6)
            )
        else:
            surface = (mw.Cylinder, mw.Sphere)[kind - 2](rng.uniform(0.05, 0.5))
        hint = tuple(rng.normal(size=3) * 0.5) if rng.random() < 0.8 else None
        pos = tuple(np.array([i + 1.0, 0.0, 0.0]) + rng.normal(size=3) * 0.3)
        quat = tuple(rng.normal(size=4))
        obstacles.append(mw.Obstacle(surface, pos=pos, quat=quat, hint=hint))
    origin, insertion = rng.normal(size=3) * 0.3, np.array([n + 1.0, 0.0, 0.0]) + rng.normal(size=3) * 0.3
    return origin, origin if rng.random() < 0.05 else insertion, obstacles


def test_branches_of_random_rows_are_finite_and_lead_to_the_same_path() -> None:
    """At this count 28 converged and some 22 other results had NaN in their branch before."""
    rng = np.random.default_rng(9)
    for k in range(CASES):
        origin, insertion, obstacles = drawn(rng)
        path = mw.solve_path(origin, insertion, obstacles)
        assert np.isfinite(path.branch).all(), k
        if path.converged and k % 20 == 0:
            again = mw.solve_path(origin, insertion, obstacles, start=path.branch)
            assert again.converged, k
            assert again.length == pytest.approx(path.length, rel=1e-12)


@pytest.mark.parametrize("name", FOUND)
def test_a_solve_goes_on_from_the_branch_of_a_row_with_free_cones(name: str) -> None:
    origin, insertion, row = FOUND[name]
    obstacles = [
        mw.Obstacle(mw.Cone(*sizes), pos=pos, quat=quat, hint=hint) for sizes, pos, quat, hint in row
    ]
    path = mw.solve_path(origin, insertion, obstacles)
    assert path.converged
    assert np.isfinite(path.branch).all()
    again = mw.solve_path(origin, insertion, obstacles, start=path.branch)
    assert (again.length, again.converged) == (path.length, True)
    np.testing.assert_array_equal(again.branch, path.branch)


def test_states_of_the_plugin_and_of_a_system_are_finite() -> None:
    """The same row in a model: its branch is part of plugin_state and of `MuscleSystem.branch`."""
    origin, insertion, row = FOUND["past a cone"]
    spec = mujoco.MjSpec()
    world = spec.worldbody
    body = world.add_body(name="load", pos=insertion)
    body.add_joint(name="slide", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1, 0, 0])
    body.add_geom(size=[0.01, 0, 0], contype=0, conaffinity=0)
    world.add_site(name="origin", pos=origin)
    body.add_site(name="insertion")
    elements = [("site", "origin")]
    for k, (sizes, pos, quat, hint) in enumerate(row):
        geom = world.add_geom(name=f"cone{k}", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.1, 0, 0], pos=pos, quat=quat,
                              contype=0, conaffinity=0)  # fmt: skip
        rotated = np.zeros(3)
        mujoco.mju_rotVecQuat(rotated, np.array(hint), np.array(quat) / np.linalg.norm(quat))
        world.add_site(name=f"side{k}", pos=rotated + pos)
        spec.add_numeric(name=f"mjwrap_c{k}_cone_size", data=list(sizes))
        elements += [("geom", geom.name), ("numeric", f"mjwrap_c{k}_cone_size"), ("site", f"side{k}")]
    elements.append(("site", "insertion"))
    spec.add_numeric(name="mjwrap_m_optimal_force", data=[1.0])
    elements.append(("numeric", "mjwrap_m_optimal_force"))
    text = "".join(
        f'<element objtype="{kind}" objname="{name}" prm="{int(name.startswith("side"))}"/>'
        for kind, name in elements
    )
    xml = spec.to_xml().replace("</custom>", f'<tuple name="mjwrap_m">{text}</tuple></custom>')
    model = mujoco.MjModel.from_xml_string(xml)
    system, data = mw.MuscleSystem(model), mujoco.MjData(model)
    system.step(data)
    assert system.status[0] == mw.Status.CONVERGED
    branch = system.branch(data)
    assert np.isfinite(branch).all()
    system.set_branch(data, branch)
    installed = install(mujoco.MjSpec.from_string(xml))
    data = mujoco.MjData(installed)
    mujoco.mj_step(installed, data, nstep=3)
    assert np.isfinite(data.plugin_state).all()


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_branch_that_is_not_finite_is_refused_and_one_in_plugin_state_starts_cold(value: float) -> None:
    spec = mujoco.MjSpec.from_string(DRUM)
    model = spec.compile()
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    muscles.forward(data)
    length = muscles.length[0]
    with pytest.raises(mw.StateError, match="finite"):
        muscles.set_branch(data, np.full(len(muscles.branch(data)), value))
    path = mw.solve_path((-0.3, 0.0, 0.0), (0.3, 0.0, 0.0), [mw.Obstacle(mw.Cylinder(0.1))])
    with pytest.raises(mw.GeometryError, match="NaN or infinite"):
        mw.solve_path(
            (-0.3, 0.0, 0.0),
            (0.3, 0.0, 0.0),
            [mw.Obstacle(mw.Cylinder(0.1))],
            start=np.full_like(path.branch, value),
        )
    installed = mw.install(spec)
    there = mujoco.MjData(installed)
    mujoco.mj_step(installed, there)
    saved = there.plugin_state.copy()
    for k in range(len(saved) - 40, len(saved)):
        there.plugin_state[:] = saved
        there.plugin_state[k] = value
        mujoco.mj_step(installed, there)
        assert mw.plugin.Muscles(there).length[0] == pytest.approx(length, abs=1e-5)
        mujoco.mj_step(installed, there)
        assert np.isfinite(there.plugin_state).all()


def test_a_rotation_of_any_length_is_a_rotation() -> None:
    ends = (-0.3, 0.01, 0.0), (0.3, 0.01, 0.0)
    expected = mw.solve_path(*ends, [mw.Obstacle(mw.Cylinder(0.1), quat=(1.0, 0.5, 0.0, 0.0))]).length
    for size in (1e-300, 1e-200, 1e-3, 1e200):
        path = mw.solve_path(*ends, [mw.Obstacle(mw.Cylinder(0.1), quat=(size, 0.5 * size, 0.0, 0.0))])
        assert path.converged
        assert path.length == pytest.approx(expected, rel=1e-14)
