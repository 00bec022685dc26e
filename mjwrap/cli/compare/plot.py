"""Plot a comparison: outcomes by muscle, the sweeps with the largest differences, and the motion of both models."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from mjwrap.cli.common.figures import legend_label, save_figure
from mjwrap.cli.compare.data_panels import DataPanel
from mjwrap.cli.compare.text import TITLES
from mjwrap.comparison import AGREE, MotionDifference, MuscleSummary, Outcome, PoseComparison
from mjwrap.files.atomic import PartFile
from mjwrap.text import counted, few

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
MOTIONS = 6  # joints whose differences are shown
WIDE = 110  # letters of a line below the plot
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


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
    note = textwrap.fill(left_out_of_plot(found, shown), WIDE)
    if note:
        right.supxlabel(note, fontsize=8, color="0.35", x=0.01, ha="left")
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


def left_out_of_plot(found: PoseComparison, shown: list[MuscleSummary]) -> str:
    """Return in words which muscles a plot does not show, and why; empty if it shows all."""
    notes = []
    drawn = [s for s in found.muscles.values() if s.curves is not None]
    if len(drawn) > len(shown):
        every = found.counted([s.name for s in drawn])
        notes.append(
            f"Curves of {len(shown)} of {every}: those with the largest differences, then with jumps, then with the "
            "largest changes of length. The others have bars only."
        )
    still = [name for name, s in found.muscles.items() if s.curves is None]
    if still:
        notes.append(f"No curves, because no joint changes their length: {few(still)}.")
    native = [name for name, s in found.muscles.items() if s.native_only]
    if native:
        notes.append(f"No bar, because they stay with MuJoCo's own tendon: {few(native)}.")
    if found.left_out:
        notes.append(f"Not compared (the text says why): {few(list(found.left_out))}.")
    return " ".join(notes)


def joint_unit(turning: bool) -> tuple[float, str]:
    """Return the factor from SI units, and the unit, of an axis for a joint's position."""
    return (180.0 / np.pi, "°") if turning else (1e3, "mm")


def _scaled(values: Any, unit: str) -> tuple[float, str]:
    """Return a factor by which numbers near 1 are plotted, and the unit with that power of ten."""
    largest = float(np.abs(values).max(initial=0.0))
    if largest == 0.0 or largest >= 1e-2:
        return 1.0, unit
    exponent = 3 * int(np.floor(np.log10(largest) / 3))
    return 10.0**-exponent, f"10{str(exponent).translate(_RAISED)} {unit}"


def draw_sweep(pair: Any, summary: MuscleSummary, found: PoseComparison) -> None:
    """Draw the lengths and moment arms of both programs along one sweep."""
    curves = summary.curves
    assert curves is not None
    # over a slide the derivative is a number, over a hinge a length
    arm = ("moment arm", 1e3, "mm") if curves.turning else ("−∂length/∂position", 1.0, "mm/mm")
    panels = (
        ("length", curves.native_length, curves.length, 1e3, "mm"),
        (arm[0], curves.native_slope, curves.slope, -arm[1], arm[2]),
    )
    turn, angle = joint_unit(curves.turning)
    at = turn * curves.at
    for axis, (what, native, own, scale, unit) in zip(pair, panels, strict=True):
        axis.plot(at, scale * native, label="MuJoCo", **NATIVE)
        if own is not None:
            axis.plot(at, np.where(curves.failed, np.nan, scale * own), label="mjwrap", **OWN)
        for jump in found.jumps:
            if jump.muscle == summary.name and jump.sweep == curves.motion and jump.base == curves.base:
                axis.axvline(turn * jump.at, color="tab:red", linewidth=0.8, linestyle=":")
        if own is not None and not curves.failed.all():
            gap = abs(scale) * float(np.abs(own - native)[~curves.failed].max())
            axis.set_title(f"largest difference {gap:.1e} {unit}", fontsize=7.5, loc="right", color="0.35")
        axis.ticklabel_format(useOffset=False)
        axis.grid(alpha=0.25)
        axis.set_xlabel(f"{curves.motion} [{angle}]", fontsize=8)
        axis.set_ylabel(f"{what} [{unit}]", fontsize=8.5)
        axis.tick_params(labelsize=8)
    pair[0].set_ylabel(f"{summary.name}\nlength [mm]", fontsize=8.5)
    pair[0].legend(fontsize=7.5, frameon=False)


def draw_motion(pair: Any, motion: MotionDifference) -> None:
    """Draw the joint that differs most in both simulations, and the joints of its kind that differ most."""
    largest = np.abs(motion.difference).max(axis=0)
    order = [int(d) for d in np.argsort(-largest)]
    turning = motion.turns[order[0]]
    alike = [d for d in order if motion.turns[d] == turning]
    factor, unit = joint_unit(turning)
    shown = alike[:MOTIONS]
    power, scaled = _scaled(factor * motion.difference[:, shown], unit)
    for d in shown:
        curve = power * factor * motion.difference[:, d]
        pair[1].plot(motion.time, curve, linewidth=1.2, label=legend_label(motion.dofs[d]))
    pair[1].set_ylabel(f"mjwrap − MuJoCo [{scaled}]", fontsize=8.5)
    pair[1].legend(fontsize=7, ncols=2, framealpha=0.7)
    rest = [f"{len(alike) - len(shown)} that differ less"] if len(alike) > len(shown) else []
    if len(order) > len(alike):
        rest.append(counted(len(order) - len(alike), "slide" if turning else "angle"))
    if rest:
        pair[1].set_title(f"not shown: {', '.join(rest)}", fontsize=7.5, loc="right", color="0.35")
    single = [d for d in alike if motion.alone[d]]
    if single:
        place = motion.places[single[0]]
        pair[0].plot(motion.time, factor * motion.native[:, place], label="MuJoCo", **NATIVE)
        pair[0].plot(motion.time, factor * motion.mjwrap[:, place], label="mjwrap", **OWN)
        pair[0].set_ylabel(f"motion\n{motion.dofs[single[0]]} [{unit}]", fontsize=8.5)
        pair[0].legend(fontsize=7.5, frameon=False)
    else:
        pair[0].set_title("no hinge or slide to show", fontsize=8)
    for axis in pair:
        axis.ticklabel_format(useOffset=False)
        axis.set_xlabel("time [s]", fontsize=8)
        axis.grid(alpha=0.25)
        axis.tick_params(labelsize=8)
