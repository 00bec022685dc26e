"""Where a search found no path with an end deep inside a surface, none is made near by; nothing else changes."""

import mujoco
import numpy as np
import pytest

import mjwrap as mw
from mjwrap.kernels.spans.end_inside import NO_SUBSTITUTE
from mjwrap.kernels.spans.lost_spans import LOST_MOVE
from mjwrap.plugin import read

RADII, BALL = (0.074, 0.17, 0.07), 0.0235
SIZE = RADII[2] ** 2 / RADII[1]  # smallest radius of curvature of the ellipsoid


def scenes(count: int) -> list[tuple[np.ndarray, np.ndarray, list[mw.Obstacle], mw.PathSolution]]:
    """Return scenes with the insertion deep inside an ellipsoid before a ball, and cold solves without a path."""
    rng, found = np.random.default_rng(3), []
    while len(found) < count:
        end = np.array(RADII) * rng.normal(size=3) * 0.35
        if (end / RADII) @ (end / RADII) > 0.6:
            continue
        far = np.array([0.15, 0.0, 0.0]) + 0.1 * rng.normal(size=3)
        row = [mw.Obstacle(mw.Ellipsoid(RADII)), mw.Obstacle(mw.Sphere(BALL), tuple(0.5 * (far + end)))]
        cold = mw.solve_path(far, end, row)
        searched = cold.evaluations > 0 and cold.tangency_error == NO_SUBSTITUTE
        if cold.status == mw.Status.ENDPOINT_INSIDE and searched:
            found.append((far, end, row, cold))
    return found


def test_a_search_that_found_nothing_is_not_made_again_near_by() -> None:
    for far, end, row, cold in scenes(10):
        again = mw.solve_path(far, end, row, start=cold)
        assert (again.status, again.tangency_error) == (mw.Status.ENDPOINT_INSIDE, NO_SUBSTITUTE)
        assert again.evaluations == 0
        move = np.array([0.0, 0.9 * LOST_MOVE * min(SIZE, BALL), 0.0])
        assert mw.solve_path(far, end + move, row, start=again).evaluations == 0


def test_it_is_made_again_after_a_move_and_once_the_end_is_outside() -> None:
    paths = 0
    for far, end, row, cold in scenes(10):
        lost = mw.solve_path(far, end, row, start=cold)
        moved = far + np.array([0.0, 0.0, 1.1 * LOST_MOVE * BALL])
        fresh, warm = mw.solve_path(moved, end, row), mw.solve_path(moved, end, row, start=lost)
        assert (warm.status, warm.length, warm.evaluations) == (fresh.status, fresh.length, fresh.evaluations)
        outside = end / np.sqrt((end / RADII) @ (end / RADII)) * 1.05
        fresh, warm = mw.solve_path(far, outside, row), mw.solve_path(far, outside, row, start=lost)
        assert (warm.status, warm.length) == (fresh.status, fresh.length)
        paths += warm.converged
    assert paths > 5


MODEL = """<mujoco><option gravity="0 0 0" timestep="0.001"/><worldbody>
  <geom name="trunk" type="ellipsoid" size="0.074 0.17 0.07" contype="0" conaffinity="0"/>
  <geom name="ball" type="sphere" size="0.0235" pos="{ball}" contype="0" conaffinity="0"/>
  <site name="far" pos="{far}"/>
  <body pos="{end}"><joint name="x" type="slide" axis="1 0 0"/>
    <inertial pos="0 0 0" mass="1" diaginertia=".01 .01 .01"/><site name="end"/></body></worldbody>
  <custom><numeric name="mjwrap_optimal_force" data="3"/><tuple name="mjwrap_string">
    <element objtype="site" objname="far"/> <element objtype="geom" objname="trunk"/>
    <element objtype="geom" objname="ball"/> <element objtype="site" objname="end"/>
    <element objtype="numeric" objname="mjwrap_optimal_force"/></tuple></custom></mujoco>"""


def model_xml() -> str:
    """Return a model of the first scene, whose end moves along x."""
    far, end, row, _ = scenes(1)[0]
    text = {name: " ".join(map(repr, map(float, place))) for name, place in
            (("far", far), ("end", end), ("ball", row[1].pos))}  # fmt: skip
    return MODEL.format(**text)


@pytest.mark.parametrize("speed", [0.0, 0.05, 0.8])
def test_saved_states_continue_to_the_last_bit_and_reset_searches_again(speed: float) -> None:
    """In MuscleSystem and in the plugin; a fast end comes out and finds its path."""
    model = mujoco.MjModel.from_xml_string(model_xml())
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    installed = mw.install(mujoco.MjSpec.from_string(model_xml()))
    twin = mujoco.MjData(installed)
    data.qvel[:] = twin.qvel[:] = speed
    statuses, saved = [], None
    for k in range(200):
        if k == 100:
            copy, other = mujoco.MjData(model), mw.MuscleSystem(model)
            copy.qpos[:], copy.qvel[:] = data.qpos, data.qvel
            other.set_branch(copy, muscles.branch(data))
            saved = copy, other
        muscles.step(data)
        mujoco.mj_step(installed, twin)
        statuses.append(int(muscles.status[0]))
        assert int(read(twin).status[0]) == statuses[-1]
        if saved is not None:
            saved[1].step(saved[0])
            assert int(saved[1].status[0]) == statuses[-1]
    assert statuses[0] == mw.Status.ENDPOINT_INSIDE
    assert (mw.Status.CONVERGED in statuses) == (speed > 0.5)
    assert np.array_equal(data.qpos, twin.qpos)
    assert saved is not None
    assert speed > 0.5 or np.array_equal(saved[0].qpos, data.qpos)
    mujoco.mj_resetData(model, data)
    muscles.reset(data)
    muscles.forward(data)
    fresh = mw.MuscleSystem(model)
    fresh.forward(data)
    assert np.array_equal(muscles.branch(data), fresh.branch(data))
