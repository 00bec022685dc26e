"""Plots of `run` and `compare`: one unit per axis, names that can be read, and a word on what is left out."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="plots need matplotlib")

import matplotlib.pyplot as pyplot

from mjwrap.cli.compare import plot as compare_plot
from mjwrap.cli.run import plot as run_plot
from mjwrap.comparison import MotionDifference, MuscleSummary, PoseComparison
from mjwrap.comparison.verdict import Curves
from mjwrap.files.atomic import PartFile
from mjwrap.system import CableSystem

AT = np.linspace(0.0, 2.0, 11)


@pytest.fixture(autouse=True)
def figures() -> Any:
    pyplot.switch_backend("Agg")
    yield
    pyplot.close("all")


def summary(name: str, *, turning: bool = True, curves: bool = True, native_only: str = "") -> MuscleSummary:
    found = MuscleSummary(name, native_only=native_only, poses=1)
    if curves:
        length, slope = 0.3 + 0.02 * AT, np.full(11, -0.02)
        found.curves = Curves(
            "joint", AT, length, slope, length, slope, np.zeros(11, dtype=bool), turning=turning
        )
    return found


@pytest.mark.parametrize(("turning", "unit", "end"), [(True, "°", np.degrees(2.0)), (False, "mm", 2000.0)])
def test_a_sweep_has_one_unit_per_axis(turning: bool, unit: str, end: float) -> None:
    _, pair = pyplot.subplots(1, 2)
    compare_plot.draw_sweep(pair, summary("m", turning=turning), PoseComparison())
    for axis in pair:
        assert axis.get_xlabel() == f"joint [{unit}]"
        assert axis.lines[0].get_xdata()[-1] == pytest.approx(end)
    assert pair[0].lines[0].get_ydata()[0] == pytest.approx(300.0)  # mm
    assert pair[1].lines[0].get_ydata()[0] == pytest.approx(20.0 if turning else 0.02)
    assert pair[1].get_ylabel().endswith("moment arm [mm]" if turning else "[mm/mm]")


def test_a_motion_does_not_mix_angles_and_lengths() -> None:
    """The angle differs most; slides are counted, not drawn on its axis."""
    time = np.linspace(0, 1, 5)
    gap = np.outer(time, [1e-3, 2e-7, 5e-3, *[1e-5] * 7])
    turns = (False, True, True, *[True] * 7)
    motion = MotionDifference(
        time, np.zeros((5, 10)), gap, gap, [f"j{i}" for i in range(10)], list(range(10)), turns=turns,
        alone=(True,) * 10,
    )  # fmt: skip
    _, pair = pyplot.subplots(1, 2)
    compare_plot.draw_motion(pair, motion)
    assert pair[0].get_ylabel() == "motion\nj2 [°]"
    assert pair[1].get_ylabel() == "mjwrap − MuJoCo [°]"
    assert len(pair[1].lines) == compare_plot.MOTIONS
    assert pair[1].get_title(loc="right") == "not shown: 3 that differ less, 1 slide"
    assert pair[1].lines[0].get_ydata()[-1] == pytest.approx(np.degrees(5e-3))


def test_a_small_difference_has_its_power_of_ten_in_the_unit() -> None:
    motion = MotionDifference(
        np.arange(2.0), np.zeros((2, 1)), np.zeros((2, 1)), np.array([[0.0], [3e-8]]), ["slide"], [0],
        turns=(False,), alone=(True,),
    )  # fmt: skip
    _, pair = pyplot.subplots(1, 2)
    compare_plot.draw_motion(pair, motion)
    assert pair[1].get_ylabel() == "mjwrap − MuJoCo [10⁻⁶ mm]"
    assert pair[1].lines[0].get_ydata()[-1] == pytest.approx(30.0)


def test_a_comparison_says_what_it_leaves_out() -> None:
    found = PoseComparison(left_out={"cable": "no spatial tendon"})
    for i in range(7):
        found.muscles[f"m{i}"] = summary(f"m{i}")
    found.muscles["still"] = summary("still", curves=False)
    found.muscles["kept"] = summary("kept", native_only="a reason")
    shown = list(found.muscles.values())[: compare_plot.SWEEPS]
    told = compare_plot.left_out_of_plot(found, shown)
    assert told.startswith("Curves of 5 of 8 muscles: those with the largest differences")
    for part in (
        "no joint changes their length: still.",
        "MuJoCo's own tendon: kept.",
        "Not compared (the text says why): cable.",
    ):
        assert part in told
    few = PoseComparison(muscles={"m": summary("m")})
    assert compare_plot.left_out_of_plot(few, list(few.muscles.values())) == ""


@pytest.mark.parametrize("count", [7, 60, 414])
def test_every_muscle_of_a_run_has_a_name_that_can_be_read(
    count: int, tmp_path: Path, monkeypatch: Any
) -> None:
    """Names do not overlap, joints are in degrees, and no figure is too large to be opened."""
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body><joint name="hinge"/><geom size=".1"/></body></worldbody></mujoco>'
    )
    names = [f"muscle{i}" for i in range(count)]
    muscles = SimpleNamespace(n=count, names=names, failures=np.zeros(count, dtype=int))
    time, rng = np.linspace(0, 1, 20), np.random.default_rng(0)
    columns = {1: np.linspace(0, 1, 20)[:, None], **{k: rng.uniform(size=(20, count)) for k in (2, 3, 4)}}
    history = SimpleNamespace(time=time, column=columns.__getitem__)
    kept: list[Any] = []
    monkeypatch.setattr(run_plot, "save_figure", lambda figure, output: kept.append(figure))
    run_plot.plot_run(PartFile(tmp_path / "p.png", ".png"), "run", model, muscles, history)  # type: ignore[arg-type]
    (figure,) = kept
    figure.canvas.draw()
    axes = [axis for axis in figure.axes if axis.get_label() != "<colorbar>"]
    (joints,) = (axis for axis in axes if axis.get_ylabel() == "joints [°]")
    assert joints.lines[0].get_ydata()[-1] == pytest.approx(np.degrees(1.0))
    if count <= run_plot.LINES:
        shown = [
            text for axis in axes for text in (axis.get_legend().get_texts() if axis is not joints else [])
        ]
        assert [text.get_text() for text in shown] == 3 * names
        return
    labels = [label for axis in axes for label in axis.get_yticklabels() if label.get_text() in names]
    shown = [label for label in labels if label.get_visible()]
    assert sorted({label.get_text() for label in shown}) == sorted(names)
    boxes = sorted((label.get_window_extent() for label in shown), key=lambda box: box.y0)
    lower = boxes[0]
    for upper in boxes[1:]:
        if upper.y0 > lower.y0 + 1:
            assert upper.y0 > lower.y1 - 0.25 * lower.height
            lower = upper
    assert max(figure.get_size_inches()) * 110 < 12_000  # pixels


@pytest.mark.parametrize("count", [3, 30])
def test_controls_of_cables_fill_their_panel(count: int, tmp_path: Path, monkeypatch: Any) -> None:
    """A control is a length, a force or anything else; a panel from 0 to 1 would show a flat line."""
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body><joint name="hinge"/><geom size=".1"/></body></worldbody></mujoco>'
    )
    muscles = CableSystem.__new__(CableSystem)
    for name, value in {"cables": range(count), "failures": np.zeros(count, dtype=int)}.items():
        monkeypatch.setattr(CableSystem, name, value, raising=False)
    monkeypatch.setattr(CableSystem, "n", count, raising=False)
    monkeypatch.setattr(CableSystem, "names", [f"cable{i}" for i in range(count)], raising=False)
    time = np.linspace(0, 1, 20)
    controls = np.tile(0.1 + 0.02 * np.sin(6 * time), (count, 1)).T
    history = SimpleNamespace(
        time=time, column={1: time[:, None], 2: controls, 3: controls, 4: controls}.__getitem__
    )
    kept: list[Any] = []
    monkeypatch.setattr(run_plot, "save_figure", lambda figure, output: kept.append(figure))
    run_plot.plot_run(PartFile(tmp_path / "p.png", ".png"), "run", model, muscles, history)  # type: ignore[arg-type]
    (figure,) = kept
    if count <= run_plot.LINES:
        (panel,) = (axis for axis in figure.axes if axis.get_ylabel() == "control")
        low, high = panel.get_ylim()
    else:
        drawn = next(axis for axis in figure.axes if axis.collections)
        low, high = drawn.collections[0].get_clim()
    assert high - low < 0.06
    assert low > 0.05
