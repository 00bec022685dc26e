"""Capsules crossed lengthwise: Newton's method gets over the seams, where the curvature jumps, cold and warm."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mjwrap as mw
from mjwrap.verification.scenes import check_path

Array = NDArray[np.float64]
CASES = 100


def scene(rng: np.random.Generator, spread: float) -> tuple[Array, Array, mw.Capsule]:
    """Return ends beyond the caps, within `spread` radii of the axis, and a capsule about z."""
    radius, half = rng.uniform(0.01, 0.03), rng.uniform(0.01, 0.06)
    ends: list[Any] = []
    for way in (1.0, -1.0):
        angle, far = rng.uniform(0.0, 2.0 * np.pi), radius * spread * np.sqrt(rng.random())
        ends.append(
            np.array(
                [far * np.cos(angle), far * np.sin(angle), way * (radius + half + rng.uniform(0.01, 0.1))]
            )
        )
    return ends[0], ends[1], mw.Capsule(radius, half)


@pytest.mark.parametrize("spread", [0.3, 1.0, 1.5, 2.0, 3.0])
def test_a_capsule_crossed_lengthwise_has_a_path_without_hints(spread: float) -> None:
    rng = np.random.default_rng(31)
    for _ in range(CASES):
        origin, insertion, capsule = scene(rng, spread)
        row = [mw.Obstacle(capsule)]
        path = mw.solve_path(origin, insertion, row)
        assert path.converged
        check_path(origin, insertion, row, path)


def moved(
    start: mw.PathSolution, row: list[mw.Obstacle], origin: Array, insertion: Array, shifts: Array, steps: int
) -> list[mw.PathSolution]:
    """Return the paths of a straight motion of both ends in equal steps, the start's included."""
    found = [start]
    for share in np.linspace(0.0, 1.0, steps + 1)[1:]:
        found.append(
            mw.solve_path(origin + share * shifts[0], insertion + share * shifts[1], row, start=found[-1])
        )
    return found


def test_a_warm_move_over_the_seams_does_not_depend_on_its_steps() -> None:
    """Where a path follows the motion without a jump, 1 to 100 steps of straight motions end on it."""
    rng, followed = np.random.default_rng(32), 0
    while followed < CASES // 2:
        origin, insertion, capsule = scene(rng, 1.5)
        row = [mw.Obstacle(capsule)]
        start = mw.solve_path(origin, insertion, row)
        if not start.contacts[0].active:
            continue
        shifts = rng.normal(size=(2, 3)) * capsule.radius * 0.8

        fine = moved(start, row, origin, insertion, shifts, 400)
        jumps = np.abs(np.diff([path.length for path in fine], 2)).max()
        if jumps > 1e-6 or not all(path.converged for path in fine):
            continue
        followed += 1
        for steps in (1, 2, 5, 20, 100):
            last = moved(start, row, origin, insertion, shifts, steps)[-1]
            assert last.converged
            assert last.length == pytest.approx(fine[-1].length, abs=1e-11)
