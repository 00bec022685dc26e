"""On which side a path passes rings, judged from its polyline alone; seeded scenes with hints at rings.

How often a path crosses the disk in a ring's hole tells whether it runs through the hole, without the solver's winding
angles.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import mjwrap as mw
from mjwrap.verification.scenes import local

Array = NDArray[np.float64]
LEVEL = 0.1  # cosine of the angle about the tube within which a hint is right above or below it, and asks for no side
FINE = 4e-4  # spacing of the points in which a path is judged [m]


def crossings(points: Array, major: float) -> int:
    """Return how often points in a ring's frame cross the disk in its hole, downwards less upwards."""
    z = points[:, 2] + 3e-13
    count = 0
    for k in np.flatnonzero((z[:-1] >= 0.0) != (z[1:] >= 0.0)):
        at = points[k] + z[k] / (z[k] - z[k + 1]) * (points[k + 1] - points[k])
        if math.hypot(at[0], at[1]) < major:
            count += 1 if z[k] >= 0.0 else -1
    return count


def _nearest(points: Array, point: Array, first: int) -> int:
    return first + int(np.abs(((points[first:] - point) ** 2).sum(1)).argmin())


def pieces(sol: mw.PathSolution) -> list[Array]:
    """Return for each obstacle the part of the path between the contacts before and behind it."""
    points, at = sol.points(FINE), 0
    places: list[tuple[int, int] | None] = []
    for contact in sol.contacts:
        if not contact.active:
            places.append(None)
            continue
        before, behind = contact.touches[0].P, contact.touches[-1].Q
        assert before is not None
        assert behind is not None
        first = _nearest(points, before, at)
        at = _nearest(points, behind, first)
        places.append((first, at))
    found = []
    for k in range(len(places)):
        start = max((place[1] for place in places[:k] if place), default=0)
        stop = min((place[0] for place in places[k + 1 :] if place), default=len(points) - 1)
        found.append(points[start : stop + 1])
    return found


def passes_as_hinted(sol: mw.PathSolution, row: list[mw.Obstacle]) -> bool:
    """Return whether the path passes every ring on the side of its hint, where it runs from one side to the other."""
    for obstacle, piece in zip(row, pieces(sol), strict=True):
        if not isinstance(obstacle.surface, mw.Torus) or obstacle.hint is None:
            continue
        points, major = local(obstacle, piece), obstacle.surface.major_radius
        aside = math.hypot(obstacle.hint[0], obstacle.hint[1]) - major
        level = abs(aside) < LEVEL * math.hypot(aside, obstacle.hint[2])
        if points[0, 2] * points[-1, 2] < 0.0 and not level:
            through = aside < 0.0
            if crossings(points, major) != (math.copysign(1, points[0, 2]) if through else 0):
                return False
    return True


def lone_ring(rng: np.random.Generator) -> tuple[Array, Array, list[mw.Obstacle]]:
    """Return a ring with a hint on the inner side of its tube, and ends whose straight line passes outside."""
    while True:
        major = rng.uniform(0.02, 0.06)
        minor = major * rng.uniform(0.1, 0.5)
        a, b = (v / np.linalg.norm(v) * major * rng.uniform(1.5, 5.0) for v in rng.normal(size=(2, 3)))
        if a[2] * b[2] >= 0.0:
            continue
        line = a + np.linspace(0.0, 1.0, 2001)[:, None] * (b - a)
        away = np.hypot(np.hypot(line[:, 0], line[:, 1]) - major, line[:, 2]).min()
        at = a + a[2] / (a[2] - b[2]) * (b - a)
        if away > 1.02 * minor and math.hypot(at[0], at[1]) > major:
            break
    obstacle = mw.Obstacle(mw.Torus(major, minor))
    return a, b, [_hinted_anywhere(obstacle, True, rng.uniform(0.0, 2.0 * math.pi), rng)]


def _hinted_anywhere(
    obstacle: mw.Obstacle, inner: bool, azimuth: float, rng: np.random.Generator
) -> mw.Obstacle:
    """Return the ring with a hint anywhere on the inner or the outer side of its tube, within 80 degrees."""
    assert isinstance(obstacle.surface, mw.Torus)
    major, minor = obstacle.surface.major_radius, obstacle.surface.minor_radius
    angle = (math.pi if inner else 0.0) + rng.uniform(-1.4, 1.4)
    rho = major + minor * math.cos(angle)
    return replace(obstacle, hint=(rho * math.cos(azimuth), rho * math.sin(azimuth), minor * math.sin(angle)))


def spread(row: list[mw.Obstacle], rng: np.random.Generator) -> list[mw.Obstacle]:
    """Return the row with the hint of each ring moved anywhere on its side of the tube."""
    found = []
    for obstacle in row:
        if isinstance(obstacle.surface, mw.Torus) and obstacle.hint is not None:
            inner = math.hypot(obstacle.hint[0], obstacle.hint[1]) < obstacle.surface.major_radius
            azimuth = rng.uniform(0.0, 2.0 * math.pi)
            if not inner:
                azimuth = math.atan2(obstacle.hint[1], obstacle.hint[0]) + rng.uniform(-1.0, 1.0)
            obstacle = _hinted_anywhere(obstacle, inner, azimuth, rng)
        found.append(obstacle)
    return found
