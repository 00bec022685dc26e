"""Plot a comparison: outcomes by muscle, the sweeps with the largest differences, and the motion of both models."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from mjwrap.cli.common.figures import legend_label, save_figure
from mjwrap.cli.compare.data_panels import DataPanel
from mjwrap.cli.compare.text import TITLES
from mjwrap.comparison import AGREE, MotionDifference, MuscleSummary, Outcome, PoseComparison
from mjwrap.files.atomic import PartFile

COLOURS = {
    Outcome.AGREE: "#4c9f70",
    Outcome.OTHER_BRANCH: "#8ab6d6",
    Outcome.MUJOCO_NOT_GEODESIC: "#e8963d",
    Outcome.NO_PATH: "#bbbbbb",
    Outcome.MJWRAP_FAILED: "#d1495b",
    Outcome.MJWRAP_WRONG: "#8f2d56",
    Outcome.UNEXPLAINED: "#000000",
    Outcome.WRONG_SIDE: "#f4b6c2",
    Outcome.KINK: "#c9d99e",
}
NATIVE, OWN = (
    {"color": "tab:orange", "linewidth": 2.6, "alpha": 0.75},
    {"color": "tab:blue", "linewidth": 1.2},
)
SWEEPS = 5  # muscles whose sweeps are shown


def plot_comparison(
    output: PartFile, title: str, found: PoseComparison, motion: MotionDifference | None,
    panels: Sequence[DataPanel] = (),
) -> None:  # fmt: skip
    """Plot a comparison, with the muscles of given tables first, and write the file."""
    shown = _telling(found)
    rows = len(panels) + len(shown) + (1 if motion is not None and motion.difference.size else 0)
    both = [s for s in found.muscles.values() if not s.native_only]
    height = max(2.6 * rows, 0.19 * len(both) + 1.4, 3.0)
    figure = plt.figure(figsize=(14.0, height), layout="constrained")
    figure.suptitle(title, fontsize=11)
    sides: Any = figure.subfigures(1, 2, width_ratios=(1.0, 2.6))
    left, right = sides
    draw_outcomes(left.subplots(), both)
    if rows:
        axes = right.subplots(rows, 2, squeeze=False)
        for pair, panel in zip(axes, panels, strict=False):
            panel.draw(pair, NATIVE, OWN)
        for pair, summary in zip(axes[len(panels) :], shown, strict=False):
            draw_sweep(pair, summary, found)
        if motion is not None and motion.difference.size:
            draw_motion(axes[-1], motion)
    save_figure(figure, output)


def _telling(found: PoseComparison) -> list[MuscleSummary]:
    """Return the muscles whose sweeps are plotted: jumps and differences first, then the largest changes of length."""
    jumps = {
        name: sum(abs(j.length) + abs(j.slope) for j in found.jumps if j.muscle == name)
        for name in found.muscles
    }

    def weight(s: MuscleSummary) -> tuple[float, float, float]:
        assert s.curves is not None
        gap = 0.0
        if s.curves.length is not None:
            gap = float(np.abs(s.curves.length - s.curves.native_length)[~s.curves.failed].max(initial=0.0))
        change = float(np.ptp(s.curves.native_length))
        return gap if gap > AGREE * s.size else 0.0, jumps[s.name], change

    drawn = [s for s in found.muscles.values() if s.curves is not None]
    return sorted(drawn, key=weight, reverse=True)[:SWEEPS]


def draw_outcomes(axis: Any, both: list[MuscleSummary]) -> None:
    """Draw a bar for each muscle: the share of poses of each outcome."""
    start = np.zeros(len(both))
    for outcome in Outcome:
        share = np.array([100.0 * s.counts[outcome.name] / max(s.poses, 1) for s in both])
        if share.any():
            axis.barh(np.arange(len(both)), share, left=start, color=COLOURS[outcome], label=TITLES[outcome])
            start += share
    axis.set_yticks(np.arange(len(both)), [s.name for s in both], fontsize=7.5)
    axis.set_ylim(max(len(both), 8) - 0.4, -0.6)
    axis.set_xlim(0.0, 100.0)
    axis.set_xlabel("poses [%]")
    if both:
        axis.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), fontsize=7.5, frameon=False, ncols=2)


def draw_sweep(pair: Any, summary: MuscleSummary, found: PoseComparison) -> None:
    """Draw the lengths and moment arms of both programs along one sweep."""
    curves = summary.curves
    assert curves is not None
    axes = (
        (pair[0], curves.native_length, curves.length, 1e3),
        (pair[1], curves.native_slope, curves.slope, -1e3),
    )
    for axis, native, own, scale in axes:
        axis.plot(curves.at, scale * native, label="MuJoCo", **NATIVE)
        if own is not None:
            axis.plot(curves.at, np.where(curves.failed, np.nan, scale * own), label="mjwrap", **OWN)
        for jump in found.jumps:
            if jump.muscle == summary.name and jump.sweep == curves.motion and jump.base == curves.base:
                axis.axvline(jump.at, color="tab:red", linewidth=0.8, linestyle=":")
        if own is not None and not curves.failed.all():
            gap = float(np.abs(own - native)[~curves.failed].max())
            axis.set_title(f"largest difference {1e3 * gap:.1e} mm", fontsize=7.5, loc="right", color="0.35")
        axis.grid(alpha=0.25)
        axis.set_xlabel(f"{curves.motion} [rad or m]", fontsize=8)
        axis.tick_params(labelsize=8)
    pair[0].set_ylabel(f"{summary.name}\nlength [mm]", fontsize=8.5)
    pair[1].set_ylabel("moment arm [mm]", fontsize=8.5)
    pair[0].legend(fontsize=7.5, frameon=False)


def draw_motion(pair: Any, motion: MotionDifference) -> None:
    """Draw the joint that differs most in both simulations, and the differences of the six that differ most."""
    order = np.argsort(-np.abs(motion.difference).max(axis=0))[:6]
    for d in order:
        pair[1].plot(motion.time, motion.difference[:, d], linewidth=1.2, label=legend_label(motion.dofs[d]))
    pair[1].set_ylabel("mjwrap − MuJoCo [rad, m]", fontsize=8.5)
    pair[1].legend(fontsize=7, ncols=2, framealpha=0.7)
    place = motion.places[int(order[0])]
    pair[0].plot(motion.time, motion.native[:, place], label="MuJoCo", **NATIVE)
    pair[0].plot(motion.time, motion.mjwrap[:, place], label="mjwrap", **OWN)
    pair[0].set_ylabel(f"motion\n{motion.dofs[int(order[0])]} [rad, m]", fontsize=8.5)
    pair[0].legend(fontsize=7.5, frameon=False)
    for axis in pair:
        axis.set_xlabel("time [s]", fontsize=8)
        axis.grid(alpha=0.25)
        axis.tick_params(labelsize=8)
