"""Convert a surface to the kernels' rows; no other module does this."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import GeometryError
from mjwrap.kernels import layout
from mjwrap.kernels.geometry.dispatch import is_surface_kind
from mjwrap.surfaces.surface import Surface

Array = NDArray[np.float64]


def traits(surface: Surface) -> int:
    """Return the sum of a surface's trait bits, which `mjwrap/kernels/layout.py` lists."""
    return (
        layout.CLOSED_FORM * surface.closed_form
        + layout.BRANCHED * surface.branched
        + layout.HOLLOW * (surface.touches > 1)
        + layout.ONE_SIDED * surface.one_sided
        + layout.RANDOM_STARTS * surface.random_starts
        + layout.ELLIPSE_SECTIONS * surface.ellipse_sections
    )


def write_surface(surface: Surface, rows: Array) -> None:
    """Write a surface to all rows (n, ROW): kind, sizes and traits, not pose, touch number and saved solution.

    Raises `GeometryError` for a kind that the kernels do not know.
    """
    name, kind, columns = type(surface).__name__, getattr(surface, "kind", None), surface.columns
    if kind is None or not is_surface_kind(kind):
        raise GeometryError(
            f"{name}: the kernels have no surface of kind {kind!r}; kinds are listed in mjwrap/kernels/layout.py"
        )
    if len(columns) > layout.SIZE - layout.DIM:
        raise GeometryError(
            f"{name}: {len(columns)} numbers do not fit into {layout.SIZE - layout.DIM} columns"
        )
    rows[:, layout.KIND] = kind
    rows[:, layout.DIM : layout.SIZE] = (*columns, *[0.0] * (layout.SIZE - layout.DIM - len(columns)))
    rows[:, layout.SIZE] = surface.size
    rows[:, layout.TRAITS] = traits(surface)
    rows[:, layout.Z_LIMIT] = surface.z_limit


def surface_rows(surface: Surface, inside: bool = False) -> Array:
    """Return the rows (touches, ROW) of a surface for a cold start, without pose and hint.

    inside: the string must meet the solid. Raises `GeometryError` as `write_surface` does.
    """
    rows = np.zeros((surface.touches, layout.ROW))
    write_surface(surface, rows)
    rows[:, layout.S_MODE] = layout.COLD
    rows[:, layout.TOUCH] = np.arange(surface.touches)
    rows[:, layout.INSIDE] = surface.held_about if inside else 0.0
    return rows
