"""Sides that hold at every pose in models: `prm="2"` in a tuple, MuscleSystem, the engine plugin, and the texts."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from declared_models import ARM, EXTENSOR, MUSCLE, compiled, declared, element

import mjwrap as mw
from mjwrap.cli import main
from mjwrap.mjcf import read_declarations
from mjwrap.plugin import read

SIDED = [
    element("actuator", "extensor"),
    element("site", "origin"),
    element("geom", "elbow"),
    element("site", "elbow_side", 2),
    element("site", "via"),
    element("geom", "egg_here"),
    element("numeric", "mjwrap_m_ellipsoid_size"),
    element("site", "ball_side", 2),
    element("site", "insertion"),
]
SIZES = '<numeric name="mjwrap_m_ellipsoid_size" data="0.012 0.02 0.03"/>'


def arm(rest: list[str] | None = None) -> mujoco.MjModel:
    """Return the arm with a muscle over the elbow and an ellipsoid at the ball, both on their sides at every pose."""
    elements = [part.replace("egg_here", "ball") for part in (rest or SIDED)]
    return compiled(actuator=MUSCLE, custom=SIZES + declared(elements))


def poses(count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform((-2.8, -1.5), (2.8, 1.5), (count, 2))


def test_lengths_follow_from_the_pose() -> None:
    """Whatever came before: the lengths are those of a new system, at poses far from each other and near."""
    model = arm()
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    muscles.forward(data)
    walk = poses(60, 0)
    walk[30:] = walk[30] + np.cumsum(0.03 * np.random.default_rng(1).normal(size=(30, 2)), axis=0)
    valid = 0
    for qpos in walk:
        data.qpos[:] = qpos
        muscles.forward(data)
        fresh, there = mw.MuscleSystem(model), mujoco.MjData(model)
        there.qpos[:] = qpos
        fresh.forward(there)
        assert muscles.status[0] == fresh.status[0]
        if muscles.status[0] == mw.Status.CONVERGED:
            valid += 1
            assert muscles.length[0] == pytest.approx(fresh.length[0], abs=1e-9)
            assert (muscles.unmet_hints(0) == []) == bool(muscles.hints_met[0])
    assert valid > 30


def test_the_moment_arm_is_the_slope_of_the_length() -> None:
    model = arm()
    data, muscles, seen = mujoco.MjData(model), mw.MuscleSystem(model), 0

    def length(qpos: np.ndarray) -> float:
        data.qpos[:] = qpos
        muscles.forward(data)
        return float(muscles.length[0]) if muscles.status[0] == mw.Status.CONVERGED else np.nan

    for qpos in poses(20, 2):
        slopes = []
        for i in range(2):
            step = 1e-6 * np.eye(2)[i]
            slopes.append((length(qpos + step) - length(qpos - step)) / 2e-6)
        if np.isfinite(length(qpos)) and np.isfinite(slopes).all():
            data.qpos[:] = qpos
            muscles.forward(data)
            seen += 1
            np.testing.assert_allclose(-muscles.moment_arms(data)[0], slopes, atol=1e-7)
    assert seen > 10


def test_the_plugin_holds_the_same_sides() -> None:
    """In the engine too, after steps, resets and a jump to another pose: the lengths are those of MuscleSystem."""
    model = arm()
    muscles, plain = mw.MuscleSystem(model), mujoco.MjData(model)
    spec = mujoco.MjSpec.from_string(_xml())
    engine = mw.install(spec)
    data = mujoco.MjData(engine)
    seen = 0
    for qpos in poses(15, 3):
        data.qpos[:], data.qvel[:] = qpos, 0.0
        mujoco.mj_step(engine, data)
        mujoco.mj_forward(engine, data)
        plain.qpos[:] = data.qpos
        muscles.forward(plain)
        found = read(data)
        assert found.status[0] == muscles.status[0]
        if muscles.status[0] == mw.Status.CONVERGED:
            seen += 1
            assert found.length[0] == pytest.approx(muscles.length[0], abs=1e-9)
    assert seen > 7


def _xml() -> str:
    elements = [part.replace("egg_here", "ball") for part in SIDED]
    return ARM.format(tendon=EXTENSOR, actuator=MUSCLE, custom=SIZES + declared(elements), option="")


def test_a_saved_state_goes_on_the_same() -> None:
    """A state that is stored and restored in another MjData gives the same steps, to the last bit."""
    engine = mw.install(mujoco.MjSpec.from_string(_xml()))
    one, other = mujoco.MjData(engine), mujoco.MjData(engine)
    one.qpos[:] = (0.4, 0.3)
    for _ in range(50):
        one.ctrl[:] = 0.6
        mujoco.mj_step(engine, one)
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(engine, kind))
    mujoco.mj_getState(engine, one, state, kind)
    mujoco.mj_setState(engine, other, state, kind)
    for _ in range(50):
        for data in (one, other):
            data.ctrl[:] = 0.2
            mujoco.mj_step(engine, data)
    np.testing.assert_array_equal(one.qpos, other.qpos)
    np.testing.assert_array_equal(read(one).length, read(other).length)


def test_what_is_declared() -> None:
    nodes = read_declarations(arm()).muscles[0].routes[0].nodes
    assert [node.side for node in nodes] == [True, False, True]
    assert "side site" in repr(nodes[0])


@pytest.mark.parametrize(
    ("elements", "words"),
    [
        (
            [SIDED[1], element("site", "via", 2), SIDED[-1]],
            ["site 'via'", "side (prm=2)", "not site 'origin'"],
        ),
        (
            [SIDED[1], SIDED[2], element("site", "axis", 2), SIDED[-1]],
            ["site 'axis'", "geom 'elbow'", "on the axis"],
        ),
        (
            [SIDED[1], SIDED[2], SIDED[3], element("site", "via", 1), SIDED[-1]],
            ["'via'", "'elbow' with a side"],
        ),
        ([SIDED[1], element("site", "via", 3), SIDED[-1]], ["site 'via'", "prm=3", "2 the side"]),
    ],
)
def test_wrong_declarations_name_the_element(elements: list[str], words: list[str]) -> None:
    text = ARM.format(tendon=EXTENSOR, actuator=MUSCLE, custom=declared([SIDED[0], *elements]), option="")
    text = text.replace('<site name="origin"', '<site name="axis" pos="0 0.02 0"/><site name="origin"')
    with pytest.raises(mw.ModelError) as caught:
        read_declarations(mujoco.MjModel.from_xml_string(text))
    for part in words:
        assert part in str(caught.value)


def test_routes_take_sides(tmp_path: object, capsys: pytest.CaptureFixture[str]) -> None:
    """`GEOM:side=SITE` in a route writes prm="2", and inspect says that the side holds at every pose."""
    text = ARM.format(tendon="", actuator="", custom="", option="")
    model = mujoco.MjModel.from_xml_string(text)
    made = mw.muscle_xml(
        model, "m", "origin,elbow:side=elbow_side,insertion", parameters={"optimal_force": 100.0}
    )
    assert '<element objtype="site" objname="elbow_side" prm="2"/>' in made
    with pytest.raises(mw.ModelError, match="the side 'nowhere' is not a site"):
        mw.muscle_xml(model, "m", "origin,elbow:side=nowhere,insertion", parameters={"optimal_force": 100.0})
    file = f"{tmp_path}/arm.xml"
    with open(file, "w", encoding="utf-8") as out:
        out.write(mw.insert_xml(text, made))
    assert main(["inspect", file]) == 0
    assert "side elbow_side at every pose" in capsys.readouterr().out
