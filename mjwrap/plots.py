"""Axes of matplotlib with paths in space: the one module outside the command line that loads matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import GeometryError, MissingPackageError

Array = NDArray[np.float64]
ROWS = 26  # of a legend
NARROWEST = 0.45  # shortest range of an axis, as a share of the longest one


def draw_paths(
    paths: Sequence[tuple[str, Array]],
    marks: Array,
    surfaces: Sequence[Array],
    axes: Any = None,
) -> Any:
    """Draw paths in space and return the axes.

    Args:
        paths: a label, "" for none, and points (m, 3) [m] of each path; rows of NaN separate its parts.
        marks: (k, 3) points to mark [m].
        surfaces: grids (a, b, 3) of surfaces [m].
        axes: matplotlib's 3D axes to draw into; None for a new figure.

    Returns:
        The axes; they are labelled in m, and have the same scale along x, y and z.

    Raises:
        MissingPackageError: matplotlib is not installed.
        GeometryError: `axes` are not such axes.
    """
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise MissingPackageError(
            f"a plot needs matplotlib, which cannot be loaded ({error}): pip install 'mjwrap[demo]'"
        ) from None
    if axes is not None and getattr(axes, "name", "") != "3d":
        given = "axes in the plane" if hasattr(axes, "set_xlabel") else type(axes).__name__
        raise GeometryError(
            f"axes must be matplotlib's 3D axes, such as plt.figure().add_subplot(projection='3d'), or None, "
            f"not {given}"
        )
    if axes is None:
        beside = 1.5 + 1.1 * (len(paths) // ROWS)  # for the labels and a legend [in]
        figure = plt.figure(figsize=(6.0 + beside, 5.5))
        axes = figure.add_subplot(projection="3d")
        figure.subplots_adjust(left=0.02, right=6.0 / (6.0 + beside), bottom=0.04, top=0.98)
    for grid in surfaces:
        axes.plot_wireframe(*np.moveaxis(grid, -1, 0), color="0.55", linewidth=0.5, alpha=0.7)
    many = plt.get_cmap("turbo")(np.linspace(0.03, 0.97, len(paths))) if len(paths) > 10 else None
    for k, (label, points) in enumerate(paths):
        # a legend leaves out labels that begin with "_"
        shown = f" {label}" if label.startswith("_") else label
        colour = {} if label else {"color": "C3"}  # else one after the other
        if many is not None:
            colour = {"color": many[k]}
        axes.plot(*points.T, linewidth=2.0, label=shown or None, **colour)
    if len(marks):
        axes.plot(*marks.T, linestyle="none", marker="o", markersize=4.0, color="0.15")
    for name in "xyz":
        getattr(axes, f"set_{name}label")(f"{name} [m]", labelpad=9.0)
    axes.locator_params(nbins=5)
    axes.tick_params(labelsize=8)
    named = axes.get_legend_handles_labels()[1]
    if named:
        columns = 1 + (len(named) - 1) // ROWS
        axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.02, 1.0), ncols=columns, frameon=False)
    _equalise(axes)
    return axes


def _equalise(axes: Any) -> None:
    """Give x, y and z the same scale, and each at least a share of the longest range, so that ticks do not overlap."""
    limits = [getattr(axes, f"get_{name}lim3d")() for name in "xyz"]
    least = NARROWEST * max(high - low for low, high in limits)
    ranges = []
    for name, (low, high) in zip("xyz", limits, strict=True):
        missing = max(least - (high - low), 0.0) / 2.0
        getattr(axes, f"set_{name}lim3d")(low - missing, high + missing)
        ranges.append(high - low + 2.0 * missing)
    axes.set_box_aspect(ranges, zoom=0.82)
