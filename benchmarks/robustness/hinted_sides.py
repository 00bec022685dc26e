"""Cold starts with hints at rings and in rows with rings: counts paths that do not run where the hints say.

Rings alone: ends on both sides, so that the straight line passes outside; the hint is anywhere on the inner side of the
tube. Rows: scenes that are made along a known path (`mjwrap/verification/random_scenes.py`), with the middle of each
geodesic as hint, and again with the hint of each ring anywhere on the side of the tube on which the known path passes.
Which side a path takes is judged from its polyline, by the number of times that it crosses the disk in the hole,
without the solver's winding angles. The exit status is 1 if a path is refuted.
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

import mjwrap as mw
from mjwrap.verification.certificate import Case, findings
from mjwrap.verification.random_scenes import CLASSES, Maker
from mjwrap.verification.scenes import local

Array = NDArray[np.float64]
ROWS = ("te", "tet", "tect", "etct", "ttt", "tk", "ctpt")  # letters of `random_scenes.py`; t is a torus
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
        first = _nearest(points, contact.touches[0].P, at)
        at = _nearest(points, contact.touches[-1].Q, first)
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
        if points[0, 2] * points[-1, 2] < 0.0:
            through = math.hypot(obstacle.hint[0], obstacle.hint[1]) < major
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


def count(origin: Array, insertion: Array, row: list[mw.Obstacle], tally: Counter[str]) -> None:
    """Solve a scene and count how that ends."""
    sol = mw.solve_path(origin, insertion, row)
    tally["scenes"] += 1
    if not sol.converged:
        tally["not converged"] += 1
        return
    tally["refuted"] += bool(findings([Case.of(origin, insertion, row, sol)])[0])
    tally["another side"] += not passes_as_hinted(sol, row)
    tally["says so"] += not all(sol.hints_met)


def main() -> int:
    """Run the scenes, print the table, and return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", type=int, default=100, help="scenes of each class (default 100)")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    tallies: dict[str, Counter[str]] = {}
    rng = np.random.default_rng(options.seed)
    tally = tallies.setdefault("ring alone, anywhere on the inner side", Counter())
    for _ in tqdm(range(options.scenes), desc="ring", leave=False):
        count(*lone_ring(rng), tally)
    for letters in ROWS:
        CLASSES.setdefault(letters, letters)
        maker = Maker(letters, options.seed, 0)
        for _ in tqdm(range(options.scenes), desc=letters, leave=False):
            scene = maker.scene(True)
            row = scene.hinted("good")
            assert row is not None
            count(
                scene.origin,
                scene.insertion,
                row,
                tallies.setdefault(f"{letters}, next to the path", Counter()),
            )
            count(
                scene.origin, scene.insertion, spread(row, rng),
                tallies.setdefault(f"{letters}, anywhere on the side", Counter()),
            )  # fmt: skip
    columns = ("scenes", "not converged", "refuted", "another side")
    print("| hinted rings | " + " | ".join(columns) + " |\n| --- |" + " ---: |" * len(columns))
    for name, tally in tallies.items():
        print(f"| {name} | " + " | ".join(str(tally[column]) for column in columns) + " |")
    return int(any(tally["refuted"] for tally in tallies.values()))


if __name__ == "__main__":
    raise SystemExit(main())
