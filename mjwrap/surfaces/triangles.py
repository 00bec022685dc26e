"""Wrapping surfaces as triangles, for pictures and for sampling them: points in the surface's own frame [m]."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import GeometryError
from mjwrap.surfaces.primitives import (
    Capsule,
    Cone,
    Cylinder,
    Ellipsoid,
    EllipticCylinder,
    Sphere,
    Surface,
    Torus,
)

Array = NDArray[np.float64]
Faces = NDArray[np.int64]
UNBOUNDED = 4.0  # half length of a cylinder without one, in radii


def surface_grid(
    surface: Surface, around: int = 48, along: int = 24, half_length: float | None = None
) -> Array:
    """Return points (along, around, 3) of a surface [m]: circles about local z, the first point of each also its last.

    half_length [m]: of cylinders that have none (four times their radius otherwise). `GeometryError` for surfaces that
    have no such grid.
    """
    turn = np.linspace(0.0, 2.0 * math.pi, around)
    turn[-1] = 0.0  # to the last bit the same point
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros(around)], axis=-1)  # (around, 3)
    radii, height = _profile(surface, along, half_length)
    grid = radii[:, None, None] * ring
    if isinstance(surface, Ellipsoid):
        grid = grid * (surface.radii[0], surface.radii[1], 1.0)
    elif isinstance(surface, EllipticCylinder):
        grid = grid * (*surface.radii, 1.0)
    grid[:, :, 2] = height[:, None]
    return grid


def _profile(surface: Surface, count: int, half_length: float | None) -> tuple[Array, Array]:
    """Return radii and heights (count,) of the circles; of elliptic sections in units of their semi-axes."""
    if isinstance(surface, Sphere | Ellipsoid | Capsule):
        rise = np.linspace(-0.5 * math.pi, 0.5 * math.pi, count)
        radii, height = np.cos(rise), np.sin(rise)
        radii[[0, -1]] = 0.0
        if isinstance(surface, Ellipsoid):
            return radii, surface.radii[2] * height
        middle = surface.half_length if isinstance(surface, Capsule) else 0.0
        return surface.radius * radii, surface.radius * height + middle * np.sign(height)
    if isinstance(surface, Torus):
        turn = np.linspace(0.0, 2.0 * math.pi, count)
        turn[-1] = 0.0
        return surface.major_radius + surface.minor_radius * np.cos(turn), surface.minor_radius * np.sin(turn)
    if isinstance(surface, Cone):
        height = np.linspace(-surface.half_length, surface.half_length, count)
        return np.linspace(surface.bottom_radius, surface.top_radius, count), height
    if isinstance(surface, Cylinder | EllipticCylinder):
        half = surface.half_length
        if not math.isfinite(half):
            wide = surface.radius if isinstance(surface, Cylinder) else max(surface.radii)
            half = UNBOUNDED * wide if half_length is None else half_length
        radius = surface.radius if isinstance(surface, Cylinder) else 1.0
        return np.full(count, radius), np.linspace(-half, half, count)
    raise GeometryError(f"{type(surface).__name__} has no grid of points")


def triangles(grid: Array) -> tuple[Array, Faces]:
    """Return vertices (n, 3), each once, and faces (m, 3) of a grid; the faces' right-hand normals point outwards."""
    along, around = grid.shape[:2]
    index = np.arange(along * around).reshape(along, around)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]).reshape(-1, 3)
    vertices, place = np.unique(grid.reshape(-1, 3) + 0.0, axis=0, return_inverse=True)  # + 0.0: no -0.0
    faces = place.reshape(-1)[faces]
    a, b, c = faces.T
    return vertices, faces[(a != b) & (b != c) & (c != a)]  # at poles and tips only one of two is left
