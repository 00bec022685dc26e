"""Coordinates by name: read, set with all followers, and refused with a reason."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from coupling_models import Knee, installed, knee

import mjwrap as mw
from mjwrap.mjcf.coordinate_functions import CoordinateFunction
from mjwrap.mjcf.couplings import CoupledJoints


@pytest.fixture
def made() -> Knee:
    return knee(2)


def test_values_are_those_of_all_hinges_and_slides(made: Knee) -> None:
    model = made.model
    data = mujoco.MjData(model)
    data.qpos[:] = np.random.default_rng(0).normal(size=model.nq)
    found = mw.osim.coordinates(model, data)
    assert list(found) == [model.joint(j).name for j in range(model.njnt)]
    np.testing.assert_array_equal(list(found.values()), data.qpos)


def test_what_follows_is_set_too_and_the_others_stay(made: Knee) -> None:
    rng = np.random.default_rng(1)
    for model in (made.model, installed(made)):
        data = mujoco.MjData(model)
        for _ in range(20):
            given = dict(zip(("hip", "knee", "ankle"), rng.uniform(-2.0, 0.5, 3).tolist(), strict=True))
            before = data.qpos.copy()
            names = rng.permutation(list(given))[: rng.integers(1, 4)]
            mw.osim.set_coordinates(model, data, {name: given[name] for name in names})
            for name in names:
                before[model.joint(name).qposadr[0]] = given[name]
            np.testing.assert_allclose(data.qpos, made.follow(model, before), rtol=0, atol=1e-13)
            twin = mujoco.MjData(made.model)
            twin.qpos[:] = data.qpos
            made.set_active(made.model, twin)
            np.testing.assert_array_equal(data.eq_active, twin.eq_active)
            mujoco.mj_forward(model, data)
            assert np.abs(data.efc_pos[: data.ne]).max() < 1e-13


def test_what_was_read_can_be_set(made: Knee) -> None:
    model = made.model
    one, other = mujoco.MjData(model), mujoco.MjData(model)
    one.qpos[:] = np.random.default_rng(3).uniform(-1.5, 0.3, model.nq)
    CoupledJoints(model).place(one.qpos)
    mw.osim.set_coordinates(model, other, mw.osim.coordinates(model, one))
    np.testing.assert_allclose(other.qpos, one.qpos, rtol=0, atol=1e-14)


SIMPLE = """<mujoco><worldbody>
  <body><freejoint name="base"/><geom size=".1"/>
  <body><joint name="elbow_flexion" range="-10 90" limited="true"/><geom size=".1"/>
  <body><joint name="locked_one" ref="20"/><geom size=".1"/>
  <body><joint name="grip" type="slide" ref=".2"/><geom size=".1"/>
  <body><joint name="shown" type="slide" range="0 2" limited="true"/><geom size=".1"/></body></body></body></body>
  </body>
</worldbody>
<equality><joint joint1="locked_one" polycoef="0 0 0 0 0"/>
  <joint joint1="grip" joint2="elbow_flexion" polycoef="0 .1 0 0 0"/></equality>
<custom><numeric name="f" data="1 0 5 2"/><numeric name="g" data="2 1 0 1 0 0 1 1 1 2"/>
  <numeric name="bad" data="2 1 0"/><numeric name="range" data=".1 2"/>
  <tuple name="mjwrap_coordinate_patella"><element objtype="joint" objname="elbow_flexion"/>
    <element objtype="numeric" objname="f"/></tuple>
  <tuple name="mjwrap_coordinate_inverse"><element objtype="joint" objname="shown" prm="1"/>
    <element objtype="numeric" objname="g"/><element objtype="numeric" objname="range"/></tuple>{}</custom></mujoco>"""


@pytest.fixture
def simple() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(SIMPLE.format(""))


def test_coordinates_that_are_functions_of_a_joint(simple: mujoco.MjModel) -> None:
    """And one of which the joint is a function f: c² below 1, and 1 + (c - 1) + 2 (c - 1)² above."""
    data = mujoco.MjData(simple)
    mw.osim.set_coordinates(simple, data, {"elbow_flexion": 0.5, "inverse": 0.7})
    found = mw.osim.coordinates(simple, data)
    assert found["patella"] == pytest.approx(6.0, abs=1e-15)
    assert found["grip"] == pytest.approx(0.25, abs=1e-15)
    assert found["shown"] == 0.7**2
    assert found["inverse"] == pytest.approx(0.7, abs=1e-15)
    mw.osim.set_coordinates(simple, data, {"inverse": 1.5})
    assert mw.osim.coordinates(simple, data)["shown"] == 1.0 + 0.5 + 2.0 * 0.25
    assert mw.osim.coordinates(simple, data)["inverse"] == pytest.approx(1.5, abs=1e-15)
    mw.osim.set_coordinates(simple, data, mw.osim.coordinates(simple, data))
    assert mw.MuscleSystem(simple).n == 0  # these tuples are no muscles
    for value, position in (
        (-1.0, 0.1**2 - 2.0 * 0.1 * 1.1),
        (3.0, 4.0 + 5.0),
    ):  # straight lines beyond the range
        mw.osim.set_coordinates(simple, data, {"inverse": value})
        assert mw.osim.coordinates(simple, data)["shown"] == pytest.approx(position, abs=1e-14)
        assert mw.osim.coordinates(simple, data)["inverse"] == pytest.approx(value, abs=1e-14)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rates_and_inverses_of_declared_coordinates(sign: float) -> None:
    """A function that rises or falls: its inverse to rounding, and its rate by differences of second order."""
    rng = np.random.default_rng(4)
    rows = np.array([[0.0, 1.0, 0.3, -0.1], [1.2, 1.3, 0.5, 0.2]]) * sign
    function = CoordinateFunction(0, (-0.5, 2.0), np.array([1.0]), np.array([0.0, 1.0]), rows)
    for value in rng.uniform(-1.0, 3.0, 50):
        position = function.position(float(value))
        assert function.value(position) == pytest.approx(value, abs=1e-14)
        if min(abs(value - edge) for edge in (-0.5, 1.0, 2.0)) < 2e-3:
            continue
        slopes = [
            (function.value(position + step) - function.value(position - step)) / (2.0 * step)
            for step in (1e-3, 5e-4)
        ]
        assert (4.0 * slopes[1] - slopes[0]) / 3.0 == pytest.approx(function.rate(position), abs=1e-9)


def test_a_value_outside_the_range_is_set_as_it_is(simple: mujoco.MjModel) -> None:
    data = mujoco.MjData(simple)
    mw.osim.set_coordinates(simple, data, {"elbow_flexion": 2.5})
    assert mw.osim.coordinates(simple, data)["elbow_flexion"] == 2.5


@pytest.mark.parametrize(
    ("values", "wanted"),
    [
        ({"elbow_flexon": 0.0}, "no coordinate 'elbow_flexon'; did you mean elbow_flexion?"),
        (
            {"zz": 0.0},
            "no coordinate 'zz'; coordinates: elbow_flexion, locked_one, grip, shown, patella, inverse",
        ),
        ({"base": 0.0}, "joint 'base' is a free joint"),
        (
            {"grip": 0.4},
            "coordinate 'grip' follows 'elbow_flexion', which puts it at 0.2, so it cannot be 0.4",
        ),
        (
            {"patella": 1.0},
            "coordinate 'patella' follows 'elbow_flexion', which puts it at 5, so it cannot be 1",
        ),
        ({"locked_one": 0.0}, "coordinate 'locked_one' is locked at 0.34906585 by an equality"),
        ({"elbow_flexion": float("nan")}, "coordinate 'elbow_flexion' must be a finite number, not nan"),
        ({"elbow_flexion": "0"}, "coordinate 'elbow_flexion' must be a finite number"),
        ({3: 0.0}, "a coordinate is given by its name, not by 3"),
        ([1.0], "values must be a dict of values by coordinate"),
        ({"elbow_flexion": 0.3, "grip": 0.4}, "coordinate 'grip' follows"),
    ],
)
def test_errors_name_the_coordinate_and_write_nothing(
    simple: mujoco.MjModel, values: object, wanted: str
) -> None:
    data = mujoco.MjData(simple)
    before = data.qpos.copy()
    with pytest.raises(mw.StateError) as caught:
        mw.osim.set_coordinates(simple, data, values)  # pyright: ignore[reportArgumentType]
    assert wanted in str(caught.value)
    np.testing.assert_array_equal(data.qpos, before)


def test_data_of_another_model_and_a_wrong_declaration(simple: mujoco.MjModel, made: Knee) -> None:
    with pytest.raises(mw.StateError, match="belongs to a different model"):
        mw.osim.coordinates(simple, mujoco.MjData(made.model))
    for elements, wanted in (
        ('<element objtype="numeric" objname="f"/>', "tuple 'mjwrap_coordinate_x' must list a joint"),
        (
            '<element objtype="joint" objname="grip"/><element objtype="numeric" objname="bad"/>',
            "numeric 'bad' is not a piecewise polynomial",
        ),
        (
            '<element objtype="joint" objname="shown" prm="1"/><element objtype="numeric" objname="g"/>',
            "tuple 'mjwrap_coordinate_x' must list a joint and then a numeric and, as the joint has prm=1, a second",
        ),
        (
            '<element objtype="joint" objname="shown" prm="1"/><element objtype="numeric" objname="g"/>'
            '<element objtype="numeric" objname="f"/>',
            "numeric 'f' must be the lowest and the highest value of a coordinate",
        ),
    ):
        text = SIMPLE.format(f'<tuple name="mjwrap_coordinate_x">{elements}</tuple>')
        wrong = mujoco.MjModel.from_xml_string(text)
        with pytest.raises(mw.ModelError, match=wanted):
            mw.osim.coordinates(wrong, mujoco.MjData(wrong))
