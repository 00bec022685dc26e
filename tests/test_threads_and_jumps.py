"""Several threads at once, large jumps, and other cases that a first user met."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import mjwrap as mw

ROOT = Path(__file__).resolve().parents[1]
ELBOW = str(ROOT / "models/elbow/elbow.xml")


def swing(integrator: mujoco.mjtIntegrator, steps: int) -> float:
    """Return the elbow's angle after a swing."""
    model = mujoco.MjModel.from_xml_path(ELBOW)
    model.opt.integrator = integrator
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    data.ctrl[:] = 0.3
    for _ in range(steps):
        muscles.step(data)
    return float(data.qpos[0])


@pytest.mark.parametrize("integrator", [mujoco.mjtIntegrator.mjINT_RK4, mujoco.mjtIntegrator.mjINT_EULER])
def test_threads_step_and_compile_beside_each_other(integrator: mujoco.mjtIntegrator) -> None:
    """The control callback belongs to the process: steps of several threads share it and do not disturb each other."""
    alone = swing(integrator, 200)
    together: list[float] = []
    threads = [threading.Thread(target=lambda: together.append(swing(integrator, 200))) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert together == [alone] * 3
    assert mujoco.get_mjcb_control() is None


def test_apply_beside_a_force_that_is_assigned_at_every_step() -> None:
    angles = []
    for how in ("apply", "step"):
        model = mujoco.MjModel.from_xml_path(ELBOW)
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
        muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
        data.ctrl[:] = 0.2
        for _ in range(100):
            data.xfrc_applied[2] = [5.0, 0.0, 0.0, 0.0, 0.0, 0.0]
            if how == "apply":
                muscles.apply(data)
                mujoco.mj_step(model, data)
            else:
                muscles.step(data)
        angles.append(float(data.qpos[0]))
    assert angles[0] == pytest.approx(angles[1], abs=1e-12)


def test_jumps_do_not_wind_the_string_up() -> None:
    """However far two cylinders jump, each is passed within one turn; small steps may wind on."""
    rng = np.random.default_rng(31)
    sol = None
    for _ in range(200):
        row = [mw.Obstacle(mw.Cylinder(0.02), (x, rng.uniform(-0.08, 0.08), 0)) for x in (-0.05, 0.05)]
        sol = mw.solve_path((-0.15, 0, 0), (0.15, 0, 0.01), row, start=sol)
        arcs = [contact.arc_length for contact in sol.contacts]
        assert max(arcs) < 2.0 * np.pi * 0.02 * 1.1


def test_a_slow_turn_winds_on() -> None:
    """An insertion that circles a cylinder three times winds the string on it, and off again."""
    sol = None
    lengths = []
    turns = np.concatenate([np.linspace(0, 3, 301), np.linspace(3, 0, 301)])
    for turn in turns:
        angle = np.pi - 0.2 + 2 * np.pi * turn
        end = (0.1 * np.cos(angle), 0.1 * np.sin(angle), 0.05)
        sol = mw.solve_path((0.1, 0, 0), end, [mw.Obstacle(mw.Cylinder(0.02))], start=sol)
        assert sol.converged
        lengths.append(sol.length)
    assert lengths[300] > lengths[0] + 0.9 * 3 * 2 * np.pi * 0.02
    assert lengths == pytest.approx(lengths[::-1], rel=1e-12)


def test_a_site_that_comes_out_of_a_cylinder_takes_the_short_way() -> None:
    sol = None
    for x in np.linspace(0.08, -0.08, 321):
        sol = mw.solve_path((0.0, 0.1, 0.0), (x, 0.004, 0.01), [mw.Obstacle(mw.Cylinder(0.02))], start=sol)
    assert sol is not None
    cold = mw.solve_path((0.0, 0.1, 0.0), (-0.08, 0.004, 0.01), [mw.Obstacle(mw.Cylinder(0.02))])
    assert sol.converged
    assert sol.length == pytest.approx(cold.length, rel=1e-12)


def test_results_stay_as_they_were() -> None:
    model = mujoco.MjModel.from_xml_path(ELBOW)
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    muscles.forward(data)
    before = muscles.length
    data.qpos[0] = 1.0
    muscles.forward(data)
    assert np.abs(muscles.length - before).min() > 1e-3


def test_a_paper_method_on_the_long_way_round_a_sphere_is_not_a_minimum() -> None:
    """The fold-free tangent path over the far side is a saddle of length; the certificate says so."""
    rng = np.random.default_rng(32)
    for _ in range(30):
        centre = (0.0, *rng.uniform(-0.02, 0.02, 2))
        row = [mw.Obstacle(mw.Sphere(0.04), centre)]
        exact = mw.solve_path((0.15, 0, 0), (-0.15, 0, 0.01), row)
        found = mw.solve_path((0.15, 0, 0), (-0.15, 0, 0.01), row, method="bfgs")
        if found.converged:
            assert found.length == pytest.approx(exact.length, rel=1e-9)


@pytest.mark.parametrize("wrong", ["elbow.xml", None])
def test_something_that_is_no_model_is_named(wrong: Any) -> None:
    with pytest.raises(mw.ModelError, match="expected an MjModel"):
        mw.MuscleSystem(wrong)
