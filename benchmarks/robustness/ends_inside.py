"""Ends that move smoothly in and out of a surface: counts the steps at which the length jumps.

An end runs through a closed curve next to the surface, the other end one far from it; every pose is solved from the one
before. A step is a jump if the length changes by more than 2.5 times the way of both ends. Where the string slips, it
is at most a minimum on one side of the step: such a jump is there however small the steps are, outside as well.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

import mjwrap as mw
from mjwrap.kernels.spans.end_inside import has_valid_length
from mjwrap.surfaces import Surface
from mjwrap.verification.scenes import height

Array = NDArray[np.float64]
Curve = Callable[[float], Array]
POSES = 400  # of each motion
NEAR = 0.012  # largest distance of the curve's middle from the surface [m]
JUMP = 2.5

SURFACES: dict[str, Callable[[np.random.Generator], Surface]] = {
    "cylinder": lambda rng: mw.Cylinder(rng.uniform(0.02, 0.05)),
    "sphere": lambda rng: mw.Sphere(rng.uniform(0.02, 0.05)),
    "ellipsoid": lambda rng: mw.Ellipsoid(tuple(rng.uniform(0.02, 0.06, 3))),
    "long ellipsoid": lambda rng: mw.Ellipsoid((*rng.uniform(0.02, 0.03, 2), rng.uniform(0.08, 0.15))),
    "capsule": lambda rng: mw.Capsule(rng.uniform(0.015, 0.04), rng.uniform(0.02, 0.08)),
    "torus": lambda rng: mw.Torus(rng.uniform(0.04, 0.06), rng.uniform(0.01, 0.025)),
}


def _direction(rng: np.random.Generator) -> Array:
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def curves(rng: np.random.Generator, surface: Surface) -> tuple[Curve, Curve]:
    """Return the motions of both ends, functions of the time from 0 to 1."""
    obstacle = mw.Obstacle(surface)
    while True:
        middle = _direction(rng) * rng.uniform(0.02, 0.1)
        if abs(height(obstacle, middle[None])[0]) < NEAR:
            break
    while True:
        far = _direction(rng) * rng.uniform(0.12, 0.25)
        if height(obstacle, far[None])[0] > 0.03:
            break
    reach, phase = rng.uniform(0.005, 0.02, 3), rng.uniform(0.0, 2.0 * np.pi, 3)
    rounds, sway = rng.integers(1, 3, 3), _direction(rng) * rng.uniform(0.0, 0.05)
    return (
        lambda t: middle + reach * np.sin(rounds * 2.0 * np.pi * t + phase),
        lambda t: far + sway * np.sin(2.0 * np.pi * t),
    )


def follow(surface: Surface, near: Curve, far: Curve, tally: Counter[str]) -> None:
    """Solve all poses of a motion, and count."""
    row, before, ends, was_inside = [mw.Obstacle(surface)], None, None, False
    branch = None
    for t in np.linspace(0.0, 1.0, POSES).tolist():
        a, b = near(t), far(t)
        sol = mw.solve_path(a, b, row, start=branch)
        branch = sol.branch
        inside = sol.status == mw.Status.ENDPOINT_INSIDE
        known = bool(has_valid_length(sol.status, sol.tangency_error))
        tally["poses"] += 1
        tally["inside"] += inside
        tally["inside, no length"] += inside and not known
        tally["not converged"] += not inside and not sol.converged
        if known and before is not None and ends is not None:
            way = np.linalg.norm(a - ends[0]) + np.linalg.norm(b - ends[1])
            if abs(sol.length - before) > JUMP * way + 1e-9:
                tally["jumps inside" if inside or was_inside else "jumps outside"] += 1
        before, ends, was_inside = sol.length if known else None, (a, b), inside


def main() -> None:
    """Run the motions and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--motions", type=int, default=40, help="motions of each surface (default 40)")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    columns = ("poses", "not converged", "inside", "inside, no length", "jumps inside", "jumps outside")
    print("| surface | " + " | ".join(columns) + " |\n| --- |" + " ---: |" * len(columns))
    for name, make in SURFACES.items():
        rng, tally = np.random.default_rng(options.seed), Counter[str]()
        for _ in tqdm(range(options.motions), desc=name, leave=False):
            surface = make(rng)
            follow(surface, *curves(rng, surface), tally)
        print(f"| {name} | " + " | ".join(str(tally[column]) for column in columns) + " |", flush=True)


if __name__ == "__main__":
    main()
