"""Draw curves of muscles over a joint: few muscles in one panel for each quantity, many in a panel each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D

from mjwrap.cli.common.figures import legend_label, save_figure
from mjwrap.cli.common.measured import MeasuredCurve
from mjwrap.cli.common.measured_drawing import draw_measured, handles
from mjwrap.cli.plot.model_curves import ModelCurves, shown_unit
from mjwrap.files.atomic import PartFile

TOGETHER = 10  # more muscles than this cannot be told apart in one panel
ACROSS = 6  # panels side by side
HIGHEST = 3  # more panels than this stand in two columns
STYLES = ("-", "--", "-.", ":")
WORDS = {
    "length": "length",
    "moment_arm": "moment arm",
    "fiber_length": "fibre length",
    "normalized_fiber_length": "fibre length / optimal",
    "tendon_length": "tendon length",
    "pennation": "pennation angle",
    "tension": "tension",
    "active_fiber_force": "active fibre force",
    "passive_fiber_force": "passive fibre force",
    "moment": "moment",
}
WIDEST, NARROWEST = (
    3.0,
    1.3,
)  # widths of the first and the last curve of a panel, so that equal ones are all seen
NATIVE = {"linewidth": 6.0, "alpha": 0.25, "zorder": 1}


def plot_curves(
    output: PartFile, found: Sequence[ModelCurves], quantities: Sequence[str], given: Sequence[MeasuredCurve]
) -> None:
    """Plot the curves of all models, with the given tables over them, and write the file."""
    muscles = list(dict.fromkeys(name for each in found for name in each.curves.names))
    if 1 < len(muscles) <= TOGETHER:
        figure = _together(found, quantities, given, muscles)
    else:
        figure = _apart(found, quantities, given, muscles)
    save_figure(figure, output)


def _together(
    found: Sequence[ModelCurves],
    quantities: Sequence[str],
    given: Sequence[MeasuredCurve],
    muscles: list[str],
) -> Any:
    """Draw a panel for each quantity: the colour tells the muscle, the style of the line the model."""
    across = 1 if len(quantities) <= HIGHEST else 2
    down = math.ceil(len(quantities) / across)
    figure, axes = plt.subplots(
        down,
        across,
        sharex=True,
        squeeze=False,
        figsize=(7.0 * across + 2.0, 3.2 * down + 0.9),
        layout="constrained",
    )
    for axis in axes.ravel()[len(quantities) :]:
        axis.remove()
    colours = plt.get_cmap("tab10").colors  # pyright: ignore[reportAttributeAccessIssue]
    for axis, quantity in zip(axes.ravel(), quantities, strict=False):
        for place, (name, colour) in enumerate(zip(muscles, colours, strict=False)):
            width = WIDEST - (WIDEST - NARROWEST) * place / (len(muscles) - 1)
            for number, each in enumerate(found):
                _draw(axis, each, name, quantity, colour, STYLES[number % len(STYLES)], width)
            _draw_tables(axis, given, name, quantity, colour, found)
        axis.set_ylabel(_label(quantity, found))
        axis.grid(alpha=0.25)
    entries: list[Any] = [
        Line2D([], [], color=colour, label=legend_label(name))
        for name, colour in zip(muscles, colours, strict=False)
    ]
    if len(found) > 1:
        entries += [
            Line2D([], [], color="0.3", linestyle=STYLES[k % len(STYLES)], label=legend_label(each.label))
            for k, each in enumerate(found)
        ]
    entries += [*_native_handle(found), *handles(given, "0.3")]
    axes[0, -1].legend(
        handles=entries, loc="upper left", bbox_to_anchor=(1.0, 1.02), fontsize=8.5, frameon=False
    )
    for axis in axes.ravel()[max(len(quantities) - across, 0) : len(quantities)]:
        axis.set_xlabel(_position(found))
        axis.tick_params(labelbottom=True)
    _limit(axes[0, 0], found, given)
    figure.suptitle(_title(found), fontsize=11)
    return figure


def _apart(
    found: Sequence[ModelCurves],
    quantities: Sequence[str],
    given: Sequence[MeasuredCurve],
    muscles: list[str],
) -> Any:
    """Draw a panel for each quantity and muscle: the colour tells the model."""
    single = len(muscles) == 1
    across = 1 if single else ACROSS
    down = math.ceil(len(muscles) / across)
    size = (
        (7.5, 3.4 * len(quantities) + 0.9)
        if single
        else (2.35 * across, (1.65 * down + 0.6) * len(quantities) + 0.6)
    )
    figure = plt.figure(figsize=size, layout="constrained")
    parts: Any = figure.subfigures(len(quantities), 1, squeeze=False)
    colours = plt.get_cmap("tab10").colors  # pyright: ignore[reportAttributeAccessIssue]
    position = _position(found)
    first = None
    for part, quantity in zip(parts[:, 0], quantities, strict=True):
        axes = part.subplots(down, across, sharex=True, squeeze=False).ravel()
        first = axes[0] if first is None else first
        for place, (axis, name) in enumerate(zip(axes, muscles, strict=False)):
            for number, each in enumerate(found):
                share = number / (len(found) - 1) if len(found) > 1 else 0.8
                width = WIDEST - (WIDEST - NARROWEST) * share
                _draw(axis, each, name, quantity, colours[number % 10], "-", width)
            _draw_tables(axis, given, name, quantity, "0.15", found)
            axis.grid(alpha=0.25)
            _limit(axis, found, given)
            if not single:
                axis.set_title(name, fontsize=8.5, pad=3)
                axis.tick_params(labelsize=7.5)
                if place + across >= len(muscles):  # the lowest of its column
                    axis.tick_params(labelbottom=True)
        for axis in axes[len(muscles) :]:
            axis.remove()
        part.supylabel(_label(quantity, found), fontsize=10)
    parts[-1, 0].supxlabel(position, fontsize=10)
    entries: list[Any] = []
    if len(found) > 1:
        entries += [
            Line2D([], [], color=colours[k % 10], label=legend_label(each.label))
            for k, each in enumerate(found)
        ]
    entries += [*_native_handle(found), *handles(given, "0.15")]
    if entries and single and first is not None:
        first.legend(handles=entries, fontsize=8.5, framealpha=0.7)
    elif entries:
        figure.legend(handles=entries, loc="outside upper right", ncols=4, fontsize=9, frameon=False)
    figure.suptitle(f"{muscles[0]}, {_title(found)}" if single else _title(found), fontsize=11)
    return figure


def _draw(
    axis: Any, each: ModelCurves, name: str, quantity: str, colour: Any, line: str, width: float = 1.6
) -> None:
    curves = each.curves
    if name not in curves.names:
        return
    i, (scale, _) = curves.names.index(name), shown_unit(quantity, curves.turns)
    at = curves.at * _factor(each)
    if quantity in curves.native:
        axis.plot(at, scale * curves.native[quantity][:, i], color=colour, **NATIVE)
    axis.plot(at, scale * curves[quantity][:, i], color=colour, linestyle=line, linewidth=width, zorder=2)


def _draw_tables(
    axis: Any,
    given: Sequence[MeasuredCurve],
    name: str,
    quantity: str,
    colour: Any,
    found: Sequence[ModelCurves],
) -> None:
    sources = list(dict.fromkeys(curve.source for curve in given))
    scale, _ = shown_unit(quantity, found[0].curves.turns)
    for curve in given:
        if curve.muscle == name and curve.quantity == quantity:
            draw_measured(axis, curve, sources.index(curve.source), colour, _factor(found[0]), scale)


def _native_handle(found: Sequence[ModelCurves]) -> list[Any]:
    drawn = any(each.curves.native for each in found)
    return [Line2D([], [], color="0.3", label="MuJoCo's tendon", **NATIVE)] if drawn else []


def _factor(each: ModelCurves) -> float:
    return 180.0 / math.pi if each.curves.turns else 1.0


def _position(found: Sequence[ModelCurves]) -> str:
    names = list(dict.fromkeys(each.curves.joint for each in found))
    return f"{', '.join(names)} [{'°' if found[0].curves.turns else 'm'}]"


def _limit(axis: Any, found: Sequence[ModelCurves], given: Sequence[MeasuredCurve]) -> None:
    places = [*(each.curves.at for each in found), *(curve.at for curve in given if len(curve.at))]
    ends = [_factor(found[0]) * end for at in places for end in at[[0, -1]].tolist()]
    margin = 0.015 * (max(ends) - min(ends))  # for points at the ends
    axis.set_xlim(min(ends) - margin, max(ends) + margin)


def _label(quantity: str, found: Sequence[ModelCurves]) -> str:
    _, unit = shown_unit(quantity, found[0].curves.turns)
    return f"{WORDS[quantity]} [{unit}]" if unit else f"{WORDS[quantity]} [-]"


def _title(found: Sequence[ModelCurves]) -> str:
    return ", ".join(each.label for each in found)
