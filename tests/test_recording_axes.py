"""The axes of a recording: whatever the curves are, two ticks are labelled."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

import mjwrap as mw

pytest.importorskip("rerun", reason="recordings need the rerun-sdk package")

from cli_runs import ELBOW
from test_recording_layout import layout

from mjwrap.recording.axes import EDGE, MOST, common_range, tick_range, widen


@pytest.mark.parametrize("seed", range(3))
def test_an_axis_has_two_labelled_ticks(seed: int) -> None:
    """Ticks stand at multiples of a power of ten; they are labelled if a step is a ninth of the plot or more."""
    rng = np.random.default_rng(seed)
    for _ in range(500):
        low = float(rng.normal() * 10.0 ** rng.uniform(-6, 6))
        high = low + abs(low) * 10.0 ** float(rng.uniform(-3, 2))
        found = tick_range(low, high)
        assert found is not None
        bottom, top = found
        assert bottom < low < high < top
        steps = 10.0 ** np.arange(-12, 12)
        labelled = steps[top - bottom <= (MOST + 2 * EDGE) * steps * (1 + 1e-9)]
        step = float(labelled[0])
        assert np.floor((top - 0.05 * step) / step) - np.ceil((bottom + 0.05 * step) / step) >= 1
        assert top - bottom <= 13 * (high - low)


@pytest.mark.parametrize(("low", "high"), [(-0.9, 0.7), (-0.02, 0.075), (-30.0, 53.0), (0.1, 0.42)])
def test_the_usual_curves_have_a_tick_beside_zero(low: float, high: float) -> None:
    found = tick_range(low, high)
    assert found is not None
    step = 10.0 ** np.ceil(np.log10((found[1] - found[0]) / (MOST + 2 * EDGE)))
    ticks = step * np.arange(np.ceil(found[0] / step), np.floor(found[1] / step) + 1)
    assert (np.abs(ticks) > 0.5 * step).any()


def test_nothing_known_or_one_value_has_no_range() -> None:
    bounds: dict[str, np.ndarray] = {}
    assert common_range(bounds, ["a"]) is None
    widen(bounds, "a", np.array([[2.0, np.nan], [2.0, np.inf]]))
    assert common_range(bounds, ["a"]) is None
    widen(bounds, "a", np.array([[3.0, 5.0]]))
    found = common_range(bounds, ["a"], [True, False])
    assert found is not None
    assert found[0] < 2.0 < 3.0 < found[1] < 5.0


def test_a_recording_carries_the_ranges_of_its_curves(tmp_path: Path) -> None:
    """Of the whole run, though the first state is logged alone."""
    model = mujoco.MjModel.from_xml_path(ELBOW)
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    tensions = []
    with mw.Recorder(model, muscles, tmp_path / "run.rrd", flush_every=7) as recorder:
        for k in range(60):
            muscles.excitation[:] = k / 60
            muscles.step(data)
            recorder.log(data)
            tensions.append(muscles.tension.copy())
    ends = layout(tmp_path / "run.rrd", "ScalarAxis:range")
    wanted = tick_range(float(np.min(tensions)), float(np.max(tensions)))
    assert wanted is not None
    assert any(np.allclose(pair, wanted) for pair in ends)
    assert [0.0, 1.0] in [list(pair) for pair in ends]  # of activations


def test_the_first_look_hides_no_muscle(tmp_path: Path) -> None:
    """Bodies are translucent and wrapping surfaces wireframes, in the layout; the recorded shapes are the model's."""
    model = mujoco.MjModel.from_xml_path(ELBOW)
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    muscles.forward(data)
    with mw.Recorder(model, muscles, tmp_path / "run.rrd") as recorder:
        recorder.log(data)
    colors = [
        value
        for shape in ("Capsules3D", "Ellipsoids3D", "Cylinders3D", "Boxes3D")
        for value in layout(tmp_path / "run.rrd", f"{shape}:colors")
    ]
    assert len(colors) == model.ngeom
    assert all(color & 0xFF < 200 for color in colors)
    wires = [
        value
        for shape in ("Ellipsoids3D", "Cylinders3D")
        for value in layout(tmp_path / "run.rrd", f"{shape}:fill_mode")
    ]
    assert len(wires) == 3  # the head of the humerus and both cylinders of the elbow
