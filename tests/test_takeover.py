"""A native actuator and mjwrap never both pull a muscle: taking over, twice, in copies, and giving back."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest
from declared_models import EXTENSOR, HILL, MUSCLE, PULLEYS, compiled, declared, element
from mjcf_reading import MODELS, load

import mjwrap as mw
from mjwrap.mjcf import read_model

LIMITED = MUSCLE.replace("/>", ' forcerange="-60 -1"/>')
FIELDS = ("forcelimited", "forcerange", "gainprm", "biasprm", "dynprm")


def fields(model: mujoco.MjModel) -> list[np.ndarray]:
    return [getattr(model, f"actuator_{field}").copy() for field in FIELDS]


def same(first: list[np.ndarray], second: list[np.ndarray]) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


def tensions(muscles: mw.MuscleSystem) -> np.ndarray:
    """Tensions (n,) at full activation, in a pose in which the muscle is stretched."""
    data = mujoco.MjData(muscles.model)
    data.act[:] = 1.0
    muscles.excitation[:] = 1.0
    data.qpos[:] = -0.3
    muscles.forward(data)
    return muscles.tension.copy()


def native_force(model: mujoco.MjModel) -> float:
    data = mujoco.MjData(model)
    data.act[:] = 1.0
    data.qpos[:] = -0.3
    mujoco.mj_forward(model, data)
    return float(data.actuator_force[0])


@pytest.mark.parametrize("actuator", [MUSCLE, LIMITED], ids=["unlimited", "limited"])
def test_taken_over_silent_and_given_back(actuator: str) -> None:
    model = compiled(actuator=actuator)
    before, force = fields(model), native_force(model)
    assert force < 0.0
    assert (force == -60.0) == (actuator == LIMITED)
    muscles = mw.MuscleSystem(model)
    assert native_force(model) == 0.0
    assert tensions(muscles) == pytest.approx(-force, rel=1e-10)
    muscles.release()
    assert same(fields(model), before)
    assert native_force(model) == force


def test_a_silent_actuator_keeps_its_activation_dynamics() -> None:
    model, twin = compiled(), compiled()
    muscles = mw.MuscleSystem(model)
    data, native = mujoco.MjData(model), mujoco.MjData(twin)
    for k in range(50):
        data.ctrl[:] = native.ctrl[:] = 0.5 + 0.5 * np.sin(0.3 * k)
        muscles.step(data)
        mujoco.mj_step(twin, native)
        assert data.act == native.act


def test_limits_hold_for_the_smallest_force_too() -> None:
    """An inactive muscle whose force range ends at -1 N pulls with 1 N."""
    muscles = mw.MuscleSystem(compiled(actuator=LIMITED))
    muscles.forward(mujoco.MjData(muscles.model))
    assert muscles.tension == [1.0]


@pytest.mark.parametrize("actuator", [MUSCLE, LIMITED], ids=["unlimited", "limited"])
def test_a_second_system_on_one_model_reads_the_same(actuator: str) -> None:
    model = compiled(actuator=actuator)
    before = fields(model)
    first = mw.MuscleSystem(model)
    taken = fields(model)
    second = mw.MuscleSystem(model)
    assert same(fields(model), taken)
    assert second.declarations == first.declarations
    assert tensions(second) == tensions(first)
    second.release()
    assert same(fields(model), before)
    third = mw.MuscleSystem(model)
    first.release()
    assert same(fields(model), before)
    third.release()
    third.release()
    assert same(fields(model), before)


def saved(model: mujoco.MjModel, folder: Path) -> mujoco.MjModel:
    path = folder / "taken.mjb"
    mujoco.mj_saveModel(model, str(path), None)
    return read_model(path)


COPIES: dict[str, Callable[[mujoco.MjModel, Path], mujoco.MjModel]] = {
    "copy": lambda model, folder: copy.copy(model),
    "deepcopy": lambda model, folder: copy.deepcopy(model),
    "pickle": lambda model, folder: pickle.loads(pickle.dumps(model)),
    "binary file": saved,
}


@pytest.mark.parametrize("actuator", [MUSCLE, LIMITED], ids=["unlimited", "limited"])
@pytest.mark.parametrize("how", COPIES)
def test_a_copy_of_a_model_that_is_taken_over(actuator: str, how: str, tmp_path: Path) -> None:
    model = compiled(actuator=actuator)
    before = fields(model)
    first = mw.MuscleSystem(model)
    twin = COPIES[how](model, tmp_path)
    assert native_force(twin) == 0.0
    second = mw.MuscleSystem(twin)
    assert second.declarations == first.declarations
    assert tensions(second) == tensions(first)
    second.release()
    assert same(fields(twin), before)
    assert native_force(model) == 0.0


def test_a_refused_second_system_changes_nothing() -> None:
    model = compiled()
    mw.MuscleSystem(model)
    taken = fields(model)
    model.geom("ball").size[0] = np.nan
    with pytest.raises(mw.ModelError, match="ball"):
        mw.MuscleSystem(model)
    assert same(fields(model), taken)


def test_muscles_that_stay_native_keep_pulling() -> None:
    joint = '<muscle name="joint" joint="elbow" force="5" lengthrange="-1 1"/>'
    model = compiled(actuator=joint + MUSCLE)
    muscles = mw.MuscleSystem(model)
    assert muscles.names == ["extensor"]
    assert native_force(model) < 0.0


def test_released_muscles_move_as_if_they_had_never_been_taken_over() -> None:
    model, _ = load(MODELS / "elbow" / "elbow.xml")
    twin = copy.copy(model)
    mw.MuscleSystem(model).release()
    data, native = mujoco.MjData(model), mujoco.MjData(twin)
    data.ctrl[:] = native.ctrl[:] = 0.3
    mujoco.mj_step(model, data, 20)
    mujoco.mj_step(twin, native, 20)
    assert np.array_equal(data.qpos, native.qpos)


# -------------------------------------------------------------------------------- no muscles at all


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicitfast"])
def test_a_model_without_muscles(integrator: str) -> None:
    option = f'integrator="{integrator}"'
    model = compiled(tendon="", actuator='<motor name="m" joint="elbow"/>', option=option)
    twin = copy.copy(model)
    muscles = mw.MuscleSystem(model, strict=True)
    assert (muscles.n, muscles.names, muscles.declarations, muscles.native) == (0, [], [], {})
    data, native = mujoco.MjData(model), mujoco.MjData(twin)
    data.ctrl[:] = native.ctrl[:] = 0.1
    data.xfrc_applied[-1] = native.xfrc_applied[-1] = 0.2
    muscles.forward(data)
    muscles.apply(data)
    muscles.step(data, nstep=5)
    mujoco.mj_step(twin, native, 5)
    assert np.array_equal(data.qpos, native.qpos)
    assert np.array_equal(data.xfrc_applied, native.xfrc_applied)
    for array in (muscles.length, muscles.velocity, muscles.tension, muscles.activation, muscles.excitation):
        assert array.shape == (0,)
        assert array.dtype == np.float64
    assert muscles.status.shape == muscles.failures.shape == (0,)
    assert muscles.length_jacobian(data).shape == (0, model.nv)
    assert muscles.report() == ""
    with pytest.raises(mw.GeometryError, match="there are 0: none"):
        muscles.points(0)
    muscles.reset(data)
    muscles.reset()
    muscles.release()


def test_a_model_without_joints() -> None:
    """A muscle between fixed points of an immobile world: nothing can move, and nothing breaks."""
    xml = """<mujoco><worldbody><site name="a"/><site name="b" pos="0.1 0 0"/></worldbody>
      <tendon><spatial name="t"><site site="a"/><site site="b"/></spatial></tendon><custom>{}</custom></mujoco>"""
    model = mujoco.MjModel.from_xml_string(
        xml.format(declared([element("tendon", "t")], {"optimal_force": 9.0}))
    )
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    muscles.excitation[:] = 0.5
    muscles.step(data, nstep=3)
    assert muscles.length == pytest.approx(0.1, rel=1e-15)
    assert muscles.tension == [4.5]
    assert muscles.velocity == [0.0]
    assert muscles.length_jacobian(data).shape == (1, 0)


def test_two_muscles_between_the_same_sites_are_two() -> None:
    """One native on a tendon, one of mjwrap's own along it: each pulls its own share."""
    custom = declared([element("tendon", "extensor")], HILL)
    muscles = mw.MuscleSystem(compiled(actuator=MUSCLE.replace('name="extensor"', 'name="a"'), custom=custom))
    assert muscles.names == ["a", "extensor"]
    alone = mw.MuscleSystem(compiled(tendon=EXTENSOR))
    assert tensions(muscles)[0] == tensions(alone)[0]


def test_no_line_is_drawn_from_one_route_of_a_muscle_to_the_next() -> None:
    """Routes joined by pulleys are strips of their own, each from its first site to its last."""
    model = compiled(tendon=PULLEYS)
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    muscles.forward(data)
    points, site = muscles.points(0), muscles.poses(data).site
    gaps = np.flatnonzero(np.isnan(points).all(axis=1))
    assert np.isnan(points).sum() == 3 * len(gaps) == 6
    ends = ("origin", "via"), ("via", "insertion"), ("via", "insertion")
    for strip, names in zip(np.split(points, gaps), ends, strict=True):
        drawn = strip[~np.isnan(strip[:, 0])]
        assert drawn[[0, -1]] == pytest.approx(np.array([site(name).xpos for name in names]), abs=1e-15)
    everything, starts = muscles.polylines()
    assert np.array_equal(everything, points, equal_nan=True)
    assert starts.tolist() == [0, len(points)]
