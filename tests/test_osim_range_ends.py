"""Moving and conditional points at the ends of their coordinates' ranges, as OpenSim 4.6 has them."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from osim_models import compiled, model_file, set_coordinates

import mjwrap as mw
from mjwrap.osim.description.forces import Muscle
from mjwrap.osim.description.functions import Piecewise, clamped
from mjwrap.osim.kinematics.paths import holds
from mjwrap.osim.reading.model import read_osim

# OpenSim 4.6, leg6dof9musc.osim: MovingPathPoint.getLocation at values of knee_angle_r, whose range is
# -2.0943951 to 0.17453293 and which was neither locked nor clamped.
BELOW, ABOVE = (-2.3943950999999997, -2.0953951, -2.0943951), (0.17453293, 0.17553293, 0.47453293)
PLACES = {
    "rect_fem_r-P3": (
        [0.017508344332237455, 0.026308320049186287, 0.00157322],
        [0.08237319388454528, 0.01792960354280987, 0.00157322],
    ),
    "vas_int_r-P4": (
        [0.00929708431315432, 0.028766419998071953, 0.00202271],
        [0.07690439299079488, 0.024529602761905994, 0.00202271],
    ),
}


@pytest.mark.parametrize("name", list(PLACES))
def test_a_moving_point_stays_where_its_range_ends(name: str) -> None:
    model = read_osim(model_file("leg6dof9musc"))
    points = [p for f in model.forces if isinstance(f, Muscle) for p in f.path.points if p.name == name]
    moving = points[0].moving
    assert moving is not None
    for values, wanted in zip((BELOW, ABOVE), PLACES[name], strict=True):
        for value in values:
            np.testing.assert_allclose([f(value) for f in moving.functions], wanted, rtol=0, atol=2e-16)


def test_the_moment_arm_beyond_the_range_is_the_slope_of_the_length() -> None:
    model = compiled("leg6dof9musc")
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    place, step = muscles.names.index("rect_fem_r"), 1e-5
    for knee in (0.3, 0.45):
        lengths = []
        for value in (knee - step, knee + step):
            set_coordinates(model, data, {"knee_angle_r": value})
            muscles.reset(data)
            muscles.forward(data)
            lengths.append(muscles.length[place])
        set_coordinates(model, data, {"knee_angle_r": knee})
        arm = muscles.moment_arms(data, "knee_angle_r")[place, 0]
        assert arm == pytest.approx(-(lengths[1] - lengths[0]) / (2.0 * step), abs=1e-8)


@pytest.mark.parametrize(
    ("beyond", "wanted"), [(-1e-4, True), (0.0, True), (9.99e-6, True), (1.001e-5, False), (1e-4, False)]
)
def test_the_range_of_a_conditional_point_has_a_tolerance(beyond: float, wanted: bool) -> None:
    """wanted: ConditionalPathPoint.isActive of OpenSim 4.6, the same at both ends of five points of leg6dof9musc."""
    model = read_osim(model_file("leg6dof9musc"))
    found = [p.condition for f in model.forces if isinstance(f, Muscle) for p in f.path.points if p.condition]
    assert found
    for condition in found:
        for end, sign in zip(condition.range, (-1.0, 1.0), strict=True):
            assert holds(condition, {condition.coordinate: end + sign * beyond}) is wanted


def test_the_written_range_has_the_tolerance_too() -> None:
    model = compiled("leg6dof9musc")
    ranges = [
        model.numeric_data[model.numeric_adr[i] :][:2].tolist()
        for i in range(model.nnumeric)
        if "psoas" in model.numeric(i).name and "active_range" in model.numeric(i).name
    ]
    np.testing.assert_allclose(ranges, [[-1.5708 - 1e-5, 0.785398 + 1e-5]], rtol=0, atol=1e-15)


def test_a_clamped_function_is_the_function_of_the_clamped_value() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        breaks = np.sort(rng.uniform(-1.0, 1.0, rng.integers(0, 4)))
        origins = rng.uniform(-1.0, 1.0, len(breaks) + 1)
        function = Piecewise(breaks, origins, rng.normal(size=(len(origins), 4)))
        low, high = np.sort(rng.uniform(-1.5, 1.5, 2))
        x = np.concatenate([rng.uniform(-3.0, 3.0, 200), breaks])
        wanted = function(np.clip(x, low, high))
        np.testing.assert_allclose(clamped(function, low, high)(x), wanted, rtol=0, atol=1e-14)
