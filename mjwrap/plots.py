"""Axes of matplotlib with paths in space: the one module outside the command line that loads matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import MissingPackageError

Array = NDArray[np.float64]


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
    """
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise MissingPackageError(
            f"a plot needs matplotlib, which cannot be loaded ({error}): pip install 'mjwrap[demo]'"
        ) from None
    if axes is None:
        axes = plt.figure(figsize=(6.5, 5.5), layout="constrained").add_subplot(projection="3d")
    for grid in surfaces:
        axes.plot_wireframe(*np.moveaxis(grid, -1, 0), color="0.55", linewidth=0.5, alpha=0.7)
    labelled = False
    for number, (label, points) in enumerate(paths):
        labelled |= bool(label)
        shown = (
            f" {label}" if label.startswith("_") else label
        )  # a legend leaves out labels that begin with "_"
        axes.plot(
            *points.T, color=f"C{number % 10}" if len(paths) > 1 else "C3", linewidth=2.0, label=shown or None
        )
    if len(marks):
        axes.plot(*marks.T, linestyle="none", marker="o", markersize=4.0, color="0.15")
    for name in "xyz":
        getattr(axes, f"set_{name}label")(f"{name} [m]")
    if labelled:
        axes.legend(
            fontsize=8, loc="upper left", bbox_to_anchor=(1.02, 1.0), ncols=1 + (len(paths) - 1) // 25
        )
    axes.set_aspect("equal")
    return axes
