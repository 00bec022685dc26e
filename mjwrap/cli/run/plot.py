"""Plot a run: joints, activations, lengths and tensions over time; few muscles as lines, many as maps."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import mujoco
import numpy as np
from matplotlib.colors import Normalize, PowerNorm
from numpy.typing import NDArray

from mjwrap import MuscleSystem
from mjwrap.cli.common.figures import legend_label, save_figure
from mjwrap.files.atomic import PartFile
from mjwrap.mjcf import name_of
from mjwrap.runs.plot_history import PlotHistory
from mjwrap.system import CableSystem
from mjwrap.text import counted

Array = NDArray[np.float64]
LINES = 12  # more curves than this in one panel cannot be distinguished
NAME = 0.155  # height of a muscle's name [inches]
QUANTITIES = ("activation", "length", "tension")
_STYLES = ("-", "--", ":")


def plot_run(
    output: PartFile, title: str, model: mujoco.MjModel, muscles: MuscleSystem, history: PlotHistory
) -> None:
    """Plot a run and write the file."""
    many = muscles.n > LINES
    turns, slides, left_out = _joints(model, history.column(1))
    joints = [p for p in ("turns" if turns else "", "slides" if slides else "") if p]
    figure, places = _panels(joints, list(QUANTITIES) if muscles.n else [], muscles.n)
    time = history.time
    for panel, axis in places.items():
        if panel == "turns":
            _lines(axis, time, {name: np.degrees(x) for name, x in turns.items()}, "joints [°]", many)
        elif panel == "slides":
            _lines(axis, time, {name: 1e3 * x for name, x in slides.items()}, "joints [mm]", many)
        elif panel in QUANTITIES:
            _muscle_panel(figure, axis, time, panel, muscles, history, many)
        axis.set_xlim(time[0], max(time[-1], time[0] + 1e-9))
    notes = [f"left out: {counted(left_out, 'joint')} with less motion"] if left_out else []
    if muscles.failures.any():
        failed = [name for name, count in zip(muscles.names, muscles.failures, strict=True) if count]
        notes.append(f"paths not found at some steps: {'in red' if many else ', '.join(failed)}")
    figure.supxlabel("; ".join(notes), fontsize=8, color="0.4")
    figure.suptitle(title, fontsize=11)
    save_figure(figure, output)


def _panels(joints: list[str], quantities: list[str], count: int) -> tuple[Any, dict[str, Any]]:
    """Return a figure and its axes by panel: one below the other, or with many muscles their maps side by side.

    Side by side the maps share the muscles' names, and a figure is only as tall as these.
    """
    if count <= LINES:
        panels = [*joints, *quantities] or [""]
        figure, axes = plt.subplots(
            len(panels), 1, sharex=True, squeeze=False, figsize=(11.0, 2.3 * len(panels) + 0.9), layout="constrained"
        )  # fmt: skip
        axes[-1, 0].set_xlabel("time [s]")
        return figure, dict(zip(panels, axes[:, 0], strict=True))
    tall = max(3.0, NAME * count)
    figure = plt.figure(figsize=(15.0, 2.6 * len(joints) + tall + 1.0), layout="constrained")
    grid = figure.add_gridspec(
        len(joints) + 1, len(quantities), height_ratios=[2.6] * len(joints) + [tall]
    )  # fmt: skip
    places = {panel: figure.add_subplot(grid[k, :]) for k, panel in enumerate(joints)}
    for k, panel in enumerate(quantities):
        places[panel] = figure.add_subplot(grid[len(joints), k])
        if k:
            places[panel].sharey(places[quantities[0]])
            places[panel].tick_params(labelleft=False)
    for axis in places.values():
        axis.set_xlabel("time [s]")
    return figure, places


def _joints(model: mujoco.MjModel, qpos: Array) -> tuple[dict[str, Array], dict[str, Array], int]:
    """Return the positions of the hinges and slides that move most, and the number of joints left out."""
    turns: dict[str, Array] = {}
    slides: dict[str, Array] = {}
    for j in range(model.njnt):
        name, curve = name_of(model, mujoco.mjtObj.mjOBJ_JOINT, j), qpos[:, model.jnt_qposadr[j]]
        if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE:
            turns[name] = curve
        elif model.jnt_type[j] == mujoco.mjtJoint.mjJNT_SLIDE:
            slides[name] = curve
    count = len(turns) + len(slides)
    for group in (turns, slides):
        for name in sorted(group, key=lambda n: -float(np.ptp(group[n])))[LINES:]:
            del group[name]
    return turns, slides, count - len(turns) - len(slides)


def _lines(axis: Any, time: Array, curves: dict[str, Array], label: str, wide: bool = False) -> None:
    """Draw named curves, with the legend at the right or, for `wide` panels, above."""
    colours = plt.get_cmap("tab10").colors  # pyright: ignore[reportAttributeAccessIssue]
    for k, (name, curve) in enumerate(curves.items()):
        axis.plot(
            time,
            curve,
            color=colours[k % 10],
            linestyle=_STYLES[k // 10 % 3],
            linewidth=1.4,
            label=legend_label(name),
        )
    axis.set_ylabel(label)
    axis.grid(alpha=0.25)
    if wide:  # colour bars take the place at the right
        axis.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=6, fontsize=7.5, frameon=False)
    else:
        axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False)


def _muscle_panel(
    figure: Any, axis: Any, time: Array, panel: str, muscles: MuscleSystem, history: PlotHistory, many: bool
) -> None:
    values = history.column({"activation": 2, "length": 3, "tension": 4}[panel])
    cables = len(muscles.cables) if isinstance(muscles, CableSystem) else 0
    drive = "control" if cables == muscles.n else "activation, control of cables" if cables else "activation"
    label = {"activation": drive, "length": "length [mm]", "tension": "tension [N]"}[panel]
    if panel == "length":
        values = 1e3 * values
    if not many:
        _lines(axis, time, {name: values[:, i] for i, name in enumerate(muscles.names)}, label)
        if panel == "activation" and cables < muscles.n:  # controls of cables have any unit and any size
            axis.set_ylim(-0.03, max(1.03, float(values.max()) * 1.03))
        return
    if panel == "length":  # each muscle relative to its own first length, because lengths differ tenfold
        values, label = values - values[0], "length, change since the start [mm]"
    top = float(np.abs(values).max()) or 1.0
    norm = {
        "activation": Normalize() if cables == muscles.n else Normalize(0.0, 1.0),
        "length": Normalize(-top, top),
        "tension": PowerNorm(0.5, 0.0, top),  # so that small muscles are visible beside large ones
    }[panel]
    colours = "RdBu_r" if panel == "length" else "viridis"
    edges = np.append(time, time[-1] + (time[-1] - time[-2] if len(time) > 1 else 1e-3))
    picture = axis.pcolormesh(
        edges, np.arange(muscles.n + 1), values.T, cmap=colours, norm=norm, rasterized=True
    )
    if panel == QUANTITIES[0]:
        axis.set_yticks(np.arange(muscles.n) + 0.5, muscles.names, fontsize=6.5)
        for tick, failures in zip(axis.get_yticklabels(), muscles.failures, strict=True):
            tick.set_color("red" if failures else "black")
        axis.invert_yaxis()
    figure.colorbar(picture, ax=axis, label=label, location="top", pad=0.005, aspect=30)
