"""Draw tables of data over curves: bands, and points or, where there are many, dotted lines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mjwrap.cli.common.figures import legend_label
from mjwrap.cli.common.measured import MeasuredCurve

MARKERS = ("o", "s", "^", "D", "v", "P", "X")
MANY = 60  # more points than this are drawn as a line
DARKER = 0.45  # such a line against its muscle's colour, so that it is seen on a curve that it agrees with
WIDE = 28  # letters of a line in the legend


def draw_measured(
    axis: Any, curve: MeasuredCurve, number: int, colour: Any, position: float, value: float
) -> None:
    """Draw one column of a table; number: of the table; position, value: factors from SI units to the axes'."""
    at = position * curve.at
    if curve.low is not None and curve.high is not None:
        axis.fill_between(
            at, value * curve.low, value * curve.high, color=colour, alpha=0.18, linewidth=0.0, zorder=1
        )
    if np.isfinite(curve.value).any():
        if len(curve.at) > MANY:
            from matplotlib.colors import to_rgb

            colour = tuple(DARKER * part for part in to_rgb(colour))
        axis.plot(at, value * curve.value, color=colour, zorder=3, **style(curve, number))


def style(curve: MeasuredCurve, number: int) -> dict[str, Any]:
    """Return the line or marker style of a column of table `number`."""
    if len(curve.at) > MANY:
        return {"linestyle": (0, (1.0, 1.2)), "linewidth": 1.8}
    return {
        "linestyle": "none",
        "marker": MARKERS[number % len(MARKERS)],
        "markersize": 4.5,
        "markerfacecolor": "none",
        "markeredgewidth": 1.1,
    }


def handles(given: Sequence[MeasuredCurve], colour: Any) -> list[Any]:
    """Return a handle for a legend for each table."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    found: list[Any] = []
    for number, source in enumerate(dict.fromkeys(curve.source for curve in given)):
        own = [curve for curve in given if curve.source == source]
        pointed = next((curve for curve in own if np.isfinite(curve.value).any()), None)
        if pointed is None:
            found.append(Patch(color=colour, alpha=0.3, linewidth=0.0, label=_label(source)))
        else:
            found.append(Line2D([], [], color=colour, label=_label(source), **style(pointed, number)))
    return found


def _label(source: str) -> str:
    """Return the name of a table for a legend, broken at "_" where it is long, so that the panels keep their width."""
    lines = [""]
    for part in source.split("_"):
        if len(lines[-1]) + len(part) > WIDE and lines[-1]:
            lines.append("")
        lines[-1] += f"{part}_"
    return legend_label("\n".join(lines)[:-1])
