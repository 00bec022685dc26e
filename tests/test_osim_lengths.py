"""Lengths of imported OpenSim paths: those that OpenSim computes, and derivatives of these for moment arms."""

import json
import time

import mujoco
import numpy as np
import pytest
from osim_models import FROZEN, compiled, imported, model_file, set_coordinates

import mjwrap as mw

NAMES = sorted(file.stem.removeprefix("lengths_") for file in FROZEN.glob("lengths_*.json"))
# The largest difference from OpenSim's classic paths [m] over surfaces, where these are no truth: their arcs are
# iterated to 0.5 mm. Two models have poses with ends inside a surface or paths over two surfaces that it cannot do.
CLASSIC = {"arm26": 2e-3, "WrapPathCustomJointMomentArmTest": 1e-5, "test_wrapAllVis": 1e-15}
CASES = [name for name in NAMES if name != "knee_patella_ligament"]  # it has no paths


def differences(name: str, wrapped: bool) -> list[tuple[float, str]]:
    """Return the differences of mjwrap's lengths from OpenSim's [m], with the names of the paths."""
    frozen = json.loads((FROZEN / f"lengths_{name}.json").read_text())
    model = compiled(name)
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    found = []
    for values, lengths in zip(frozen["values"], frozen["lengths"], strict=True):
        mujoco.mj_resetData(model, data)
        set_coordinates(model, data, dict(zip(frozen["coordinates"], values, strict=True)))
        muscles.reset(data)
        muscles.forward(data)
        for path, wraps, length in zip(frozen["paths"], frozen["wrapped"], lengths, strict=True):
            index = list(muscles.names).index(path)
            if bool(wraps) == wrapped and muscles.status[index] == mw.Status.CONVERGED:
                found.append((abs(float(muscles.length[index]) - length), path))
    return found


@pytest.mark.parametrize("name", CASES)
def test_paths_without_wraps_have_opensims_length(name):
    found = differences(name, wrapped=False)
    assert max(found, default=(0.0, ""))[0] < 1e-12, max(found)


@pytest.mark.parametrize("name", sorted(CLASSIC))
def test_wrapped_paths_have_nearly_opensims_length(name):
    found = differences(name, wrapped=True)
    assert found
    assert max(found)[0] < CLASSIC[name], max(found)


@pytest.mark.parametrize(
    "name", ["gait10dof18musc", "leg6dof9musc", "arm26", "CoupledCoordinatesMPPsMomentArmTest"]
)
def test_moment_arms_are_derivatives_of_the_length(name):
    """Moving points, conditional points and couplings included: the derivative is taken along the couplings.

    The frozen poses do not satisfy other constraints, which are switched off.
    """
    model, data = compiled(name), None
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    frozen = json.loads((FROZEN / f"lengths_{name}.json").read_text())
    random = np.random.default_rng(5)
    for values in frozen["values"][:3]:
        pose = dict(zip(frozen["coordinates"], values, strict=True))
        mujoco.mj_resetData(model, data)
        data.eq_active[model.eq_type != mujoco.mjtEq.mjEQ_JOINT] = 0
        set_coordinates(model, data, pose)
        muscles.reset(data)
        muscles.forward(data)
        sites = routes_at(model, data)
        arms = muscles.moment_arms(data)
        independent = independent_coordinates(model, frozen["coordinates"])
        coordinate = independent[int(random.integers(len(independent)))]
        slopes = []
        for step in (1e-4, 5e-5):
            ends = []
            for sign in (1.0, -1.0):
                set_coordinates(model, data, pose | {coordinate: pose[coordinate] + sign * step})
                if routes_at(model, data) != sites:
                    break  # a conditional point switches within the step
                muscles.forward(data)
                ends.append(muscles.length.copy())
            else:
                slopes.append((ends[0] - ends[1]) / (2.0 * step))
        if len(slopes) == 2:
            slope = (4.0 * slopes[1] - slopes[0]) / 3.0
            column = independent.index(coordinate)
            good = muscles.status == mw.Status.CONVERGED
            np.testing.assert_allclose(arms[good, column], -slope[good], atol=1e-9)


def independent_coordinates(model: mujoco.MjModel, names: list[str]) -> list[str]:
    """Return the joints that no equality ties to another one, in the order of the model."""
    followers = {model.eq_obj1id[e] for e in range(model.neq) if model.eq_type[e] == mujoco.mjtEq.mjEQ_JOINT}
    return [model.joint(j).name for j in range(model.njnt) if j not in followers]


def routes_at(model: mujoco.MjModel, data: mujoco.MjData) -> list[bool]:
    """Return for every range of a conditional point whether its joint is inside."""
    held = []
    for j in range(len(model.tuple_objtype) - 1):
        if (
            model.tuple_objtype[j] == mujoco.mjtObj.mjOBJ_JOINT
            and model.tuple_objtype[j + 1] == mujoco.mjtObj.mjOBJ_NUMERIC
        ):
            numeric = model.tuple_objid[j + 1]
            if "active_range" in model.numeric(numeric).name:
                low, high = model.numeric_data[model.numeric_adr[numeric] :][:2]
                held.append(bool(low <= data.qpos[model.jnt_qposadr[model.tuple_objid[j]]] <= high))
    return held


def test_the_largest_model_imports_fast():
    file = model_file("gait2392_millard")
    mw.import_osim(file)
    start = time.perf_counter()
    mw.import_osim(file)
    assert time.perf_counter() - start < 10.0


def test_every_muscle_keeps_its_name_and_drives_an_actuator():
    model = compiled("gait2392_millard")
    muscles = mw.MuscleSystem(model)
    frozen = json.loads((FROZEN / "lengths_gait2392_millard.json").read_text())
    assert sorted(muscles.names) == sorted(frozen["paths"])
    assert {
        entry.outcome for entry in imported("gait2392_millard").report.entries if "Muscle" in entry.kind
    } == {"exact"}
