"""Convert a surface to the kernels' rows; no other module does this."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap.errors import GeometryError
from mjwrap.kernels import layout
from mjwrap.kernels.geometry.dispatch import is_surface_kind
from mjwrap.kernels.wraps.sides import ON_AXIS
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


def side_fault(surface: Surface, point: ArrayLike) -> str | None:
    """Return why a point (3,) in the surface's frame [m] says no side that holds at every pose; None where it does."""
    x, y, z = np.asarray(point, dtype=np.float64).tolist()
    if surface.branched and surface.closed_form:
        return "on the axis" if math.hypot(x, y) < ON_AXIS * surface.size else None
    return "in the middle" if math.sqrt(x * x + y * y + z * z) < ON_AXIS * surface.size else None


def surface_rows(surface: Surface, inside: bool = False, sided: bool = False) -> Array:
    """Return the rows (touches, ROW) of a surface for a cold start, without pose and hint.

    inside: the string must meet the solid. sided: the hint is a side that holds at every pose. Raises `GeometryError`
    as `write_surface` does.
    """
    rows = np.zeros((surface.touches, layout.ROW))
    write_surface(surface, rows)
    rows[:, layout.S_MODE] = layout.COLD
    rows[:, layout.TOUCH] = np.arange(surface.touches)
    rows[:, layout.INSIDE] = surface.held_about if inside else 0.0
    rows[0, layout.TRAITS] += layout.SIDED * sided
    return rows
