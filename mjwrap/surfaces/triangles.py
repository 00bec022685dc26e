"""Wrapping surfaces as triangles, for pictures and for samples; points are in the surface's own frame [m]."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mjwrap.surfaces.surface import Surface

Array = NDArray[np.float64]
Faces = NDArray[np.int64]


def surface_grid(
    surface: Surface, around: int = 48, along: int = 24, half_length: float | None = None
) -> Array:
    """Return points (along, around, 3) of a surface [m]: circles about local z, the first point of each also its last.

    half_length [m]: of infinite cylinders (default: four times the radius). Raises `GeometryError` for surfaces that
    have no such grid.
    """
    turn = np.linspace(0.0, 2.0 * math.pi, around)
    turn[-1] = 0.0  # exactly the same point
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros(around)], axis=-1)  # (around, 3)
    radii, height = surface.profile(along, half_length)
    grid = radii[:, None, None] * ring * (*surface.stretch, 1.0)
    grid[:, :, 2] = height[:, None]
    return grid


def triangles(grid: Array) -> tuple[Array, Faces]:
    """Return vertices (n, 3), without repetition, and faces (m, 3) of a grid; right-hand normals point outwards."""
    along, around = grid.shape[:2]
    index = np.arange(along * around).reshape(along, around)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]).reshape(-1, 3)
    vertices, place = np.unique(grid.reshape(-1, 3) + 0.0, axis=0, return_inverse=True)  # + 0.0: no -0.0
    faces = place.reshape(-1)[faces]
    a, b, c = faces.T
    return vertices, faces[
        (a != b) & (b != c) & (c != a)
    ]  # at poles and tips only one of two triangles remains
