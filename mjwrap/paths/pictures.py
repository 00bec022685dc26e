"""A solved path in a notebook: its numbers as a table, a small drawing, and axes of matplotlib."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np

from mjwrap import html, plots
from mjwrap.errors import GeometryError
from mjwrap.paths.contact import Contact
from mjwrap.paths.scene import Array, Obstacle, ViaPoint
from mjwrap.surfaces.triangles import surface_grid

AROUND, ALONG = 25, 9  # points of a surface's outline


def surface_grids(obstacles: Sequence[Obstacle | ViaPoint], reach: float) -> list[Array]:
    """Return grids (a, b, 3) of the obstacles' surfaces, world [m]; none for surfaces that have no grid.

    reach [m]: half length with which infinite cylinders are drawn.
    """
    found: list[Array] = []
    for obstacle in obstacles:
        if isinstance(obstacle, ViaPoint):
            continue
        try:
            grid = surface_grid(obstacle.surface, AROUND, ALONG, reach)
        except GeometryError:  # written by a user: its functions are known, its outline is not
            continue
        found.append(grid @ rotation(obstacle.quat).T + np.array(obstacle.pos))
    return found


def rotation(quat: Sequence[float]) -> Array:
    """Return the matrix (3, 3) of a quaternion w, x, y, z of any length."""
    w, x, y, z = np.array(quat) / np.linalg.norm(quat)
    return np.array([
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ])  # fmt: skip


def contact_marks(contacts: Sequence[Contact]) -> Array:
    """Return first and last contact points (k, 3), world [m]."""
    found = [
        p for contact in contacts for touch in contact.touches for p in (touch.P, touch.Q) if p is not None
    ]
    return np.array(found).reshape(-1, 3)


def plot(
    points: Array,
    contacts: Sequence[Contact],
    obstacles: Sequence[Obstacle | ViaPoint],
    axes: Any,
    title: str = "",
) -> Any:
    """Draw a path, its contacts and the surfaces into axes, with a title if it is not empty, and return these."""
    ends = points[[0, -1]]
    marks = np.vstack([ends, contact_marks(contacts)])
    drawn = plots.draw_paths([("", points)], marks, surface_grids(obstacles, _reach(points)), axes)
    if title:
        drawn.set_title(textwrap.fill(title, 60), y=0.92, fontsize=9)
    return drawn


def svg(points: Array, contacts: Sequence[Contact], obstacles: Sequence[Obstacle | ViaPoint]) -> str:
    """Return a drawing of a path, seen along the direction in which it is flattest."""
    if not np.isfinite(points).all():
        return ""
    view = flattest_view(points)
    outlines = [ring @ view for grid in surface_grids(obstacles, _reach(points)) for ring in _rings(grid)]
    marks = np.vstack([points[[0, -1]], contact_marks(contacts)]) @ view
    return html.drawing([(points @ view).tolist()], marks.tolist(), [ring.tolist() for ring in outlines])


def flattest_view(points: Array) -> Array:
    """Return two directions (3, 2) in which the points spread most; world z points upwards where it can."""
    _, _, rows = np.linalg.svd(points - points.mean(axis=0), full_matrices=True)
    across, up = rows[0], rows[1]
    if abs(across[2]) > abs(up[2]):
        across, up = up, across
    across, up = (v if v[k] >= 0.0 else -v for v, k in ((across, int(np.argmax(np.abs(across)))), (up, 2)))
    return np.stack([across, up], axis=1)


def _rings(grid: Array) -> list[Array]:
    return [*grid[:: max(1, len(grid) // 4)], *np.moveaxis(grid, 1, 0)[::6]]


def _reach(points: Array) -> float:
    return 0.25 * max(float(np.ptp(points, axis=0).max()), 1e-9)


def describe(point: Array | None) -> str:
    """Return a point as text [m]."""
    return "-" if point is None else "(" + ", ".join(f"{x:.5g}" for x in point) + ")"
