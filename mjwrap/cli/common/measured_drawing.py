"""Draw tables of data over curves: bands, and points or, where there are many, dotted lines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mjwrap.cli.common.measured import MeasuredCurve

MARKERS = ("o", "s", "^", "D", "v", "P", "X")
MANY = 60  # more points than this are drawn as a line


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
            found.append(Patch(color=colour, alpha=0.3, linewidth=0.0, label=source))
        else:
            found.append(Line2D([], [], color=colour, label=source, **style(pointed, number)))
    return found
