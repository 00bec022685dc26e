"""Scenes for the path tests, and geometry written without any of the package's kernels."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mjwrap as mw

Array = NDArray[np.float64]
REFERENCE = Path(__file__).resolve().parents[2] / "shared" / "reference" / "paths.json"
SURFACES = {"cylinder": mw.Cylinder, "sphere": mw.Sphere}


def reference_scene(name: str) -> dict[str, Any]:
    """Return one scene of exact paths, made by direct constrained minimisation (spectral curves, IPOPT)."""
    if not REFERENCE.exists():
        pytest.skip(
            "the table of exact reference paths is not part of a clone; it lies beside the project's own"
        )
    return json.loads(REFERENCE.read_text())[name]


def rotation(quat: Any) -> Array:
    """Return the matrix of a quaternion w, x, y, z of any length."""
    w, x, y, z = np.asarray(quat) / np.linalg.norm(quat)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def radius_of(obstacle: mw.Obstacle) -> float:
    """Return the radius of a cylinder or sphere [m]."""
    assert isinstance(obstacle.surface, mw.Cylinder | mw.Sphere)
    return obstacle.surface.dims[0]


def height(obstacle: mw.Obstacle, points: Array) -> Array:
    """Return the distance of points (m, 3) from an obstacle's surface, positive outside [m]."""
    local = (np.atleast_2d(points) - obstacle.pos) @ rotation(obstacle.quat)
    if isinstance(obstacle.surface, mw.Cylinder):
        local = local[:, :2]
    return np.linalg.norm(local, axis=1) - radius_of(obstacle)


def outward(obstacle: mw.Obstacle, points: Array) -> Array:
    """Return the outward normals (m, 3) of an obstacle at, or nearest to, points (m, 3)."""
    turn = rotation(obstacle.quat)
    local = (np.atleast_2d(points) - obstacle.pos) @ turn
    if isinstance(obstacle.surface, mw.Cylinder):
        local[:, 2] = 0.0
    return local / np.linalg.norm(local, axis=1, keepdims=True) @ turn.T


def _gap(a: mw.Obstacle, b: mw.Obstacle) -> float:
    """Return the distance between two centres or axes [m]."""
    offset = np.subtract(b.pos, a.pos)
    axes = [rotation(o.quat)[:, 2] for o in (a, b) if isinstance(o.surface, mw.Cylinder)]
    if len(axes) == 2:
        normal = np.cross(axes[0], axes[1])
        size = float(np.linalg.norm(normal))
        if size > 1e-9:
            return abs(float(offset @ normal)) / size
    for axis in axes[:1]:
        offset = offset - (offset @ axis) * axis
    return float(np.linalg.norm(offset))


def random_scene(rng: np.random.Generator, kinds: str, hints: bool) -> tuple[Array, Array, list[mw.Obstacle]]:
    """Return origin, insertion and obstacles in a row at muscle scale, none overlapping.

    kinds: one letter per obstacle, c for a cylinder, s for a sphere; axes are tilted by about 0.4 rad.
    """
    while True:
        spacing = rng.uniform(0.06, 0.12)
        row: list[mw.Obstacle] = []
        for k, letter in enumerate(kinds):
            for _ in range(100):
                radius = rng.uniform(0.01, 0.045)
                surface = mw.Cylinder(radius) if letter == "c" else mw.Sphere(radius)
                pos = [(k + rng.uniform(0.9, 1.1)) * spacing, *rng.uniform(-0.03, 0.03, 2)]
                hint = None
                if hints:
                    direction = rng.normal(size=3)
                    hint = tuple(direction / np.linalg.norm(direction) * radius)
                quat = (1.0, *(0.2 * rng.normal(size=3)))
                obstacle = mw.Obstacle(surface, tuple(pos), quat, hint)
                reach = [radius + radius_of(other) for other in row]
                if all(_gap(obstacle, o) > 1.05 * r for o, r in zip(row, reach, strict=True)):
                    row.append(obstacle)
                    break
        ends = np.array(
            [[0.0, *rng.uniform(-0.03, 0.03, 2)], [(len(kinds) + 1) * spacing, *rng.uniform(-0.03, 0.03, 2)]]
        )
        if len(row) == len(kinds) and all((height(o, ends) > 1e-3).all() for o in row):
            return ends[0], ends[1], row


def check_path(origin: Array, insertion: Array, obstacles: list[mw.Obstacle], sol: mw.PathSolution) -> None:
    """Assert from the answer alone that it is a tangent, clear, geodesic path whose length is the sum of its parts."""
    points: list[Array] = [origin]
    total = 0.0
    for obstacle, contact in zip(obstacles, sol.contacts, strict=True):
        if not contact.active:
            continue
        assert contact.P is not None
        assert contact.Q is not None
        assert contact.arc_length >= 0.0
        assert np.abs(height(obstacle, np.array([contact.P, contact.Q]))).max() < 1e-14
        arc, start, end = _shortest_arc(obstacle, contact, points[-1])
        assert contact.arc_length == pytest.approx(arc, rel=1e-9, abs=1e-12)
        for e, t in ((contact.P - points[-1], start), (None, end)):
            if e is not None:
                assert np.linalg.norm(e / np.linalg.norm(e) - t) < 1e-8
        points += [contact.P, contact.Q]
        total += contact.arc_length
    points.append(insertion)
    chords = np.array(points).reshape(-1, 2, 3)
    total += np.linalg.norm(chords[:, 1] - chords[:, 0], axis=1).sum()
    assert sol.length == pytest.approx(total, rel=1e-13)
    share = np.linspace(0.0, 1.0, 201)[:, None]
    for a, b in chords:
        for obstacle in obstacles:
            if _between(obstacle, obstacles, sol, a, b):
                assert height(obstacle, a + share * (b - a)).min() > -1e-12


def _between(obstacle: mw.Obstacle, row: list[mw.Obstacle], sol: mw.PathSolution, a: Array, b: Array) -> bool:
    """Return whether the straight segment from a to b passes an obstacle's turn in the row."""
    k = row.index(obstacle)
    before = [c.Q for c in sol.contacts[:k] if c.Q is not None]
    after = [c.P for c in sol.contacts[k + 1 :] if c.P is not None]
    here = sol.contacts[k]
    if here.P is not None and here.Q is not None:
        return np.array_equal(b, here.P) or np.array_equal(a, here.Q)
    starts_before = not before or np.array_equal(a, before[-1])
    return starts_before and (not after or np.array_equal(b, after[0]))


def _shortest_arc(obstacle: mw.Obstacle, contact: mw.Contact, before: Array) -> tuple[float, Array, Array]:
    """Return length and end tangents of the geodesic from P to Q that starts in the direction of P - before."""
    assert contact.P is not None
    assert contact.Q is not None
    turn = rotation(obstacle.quat)
    p, q = ((x - obstacle.pos) @ turn for x in (contact.P, contact.Q))
    heading = (contact.P - before) @ turn
    radius = radius_of(obstacle)
    if isinstance(obstacle.surface, mw.Sphere):
        axis = np.cross(p, heading)
        axis /= np.linalg.norm(axis)
        angle = np.arctan2(np.cross(p, q) @ axis, p @ q) % (2 * np.pi)
        return float(radius * angle), turn @ np.cross(axis, p) / radius, turn @ np.cross(axis, q) / radius
    side = 1.0 if p[0] * heading[1] - p[1] * heading[0] > 0 else -1.0
    angle = (side * np.arctan2(p[0] * q[1] - p[1] * q[0], p[0] * q[0] + p[1] * q[1])) % (2 * np.pi)
    flat, rise = radius * angle, q[2] - p[2]
    arc = float(np.hypot(flat, rise))
    if arc == 0.0:
        return (
            0.0,
            (contact.P - before) / np.linalg.norm(heading),
            (contact.P - before) / np.linalg.norm(heading),
        )

    def tangent(x: Array) -> Array:
        return turn @ np.array(
            [-side * x[1] / radius * flat / arc, side * x[0] / radius * flat / arc, rise / arc]
        )

    return arc, tangent(p), tangent(q)
