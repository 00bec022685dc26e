"""Large moves: surfaces driven through a string catch it on the side they come from, and no path is lost."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest
from test_surface_paths import EXACT, every_surface

import mjwrap as mw
from mjwrap.verification.scenes import LETTERS, Array, check_path, height, random_scene

FINE = 120  # steps of a pull against which one, two and three are held
PULLS = 8  # of each shape


@dataclass(frozen=True)
class Pull:
    """End points and a surface in its way across the straight string between them: beside it at 0, behind it at 1."""

    origin: Array
    insertion: Array
    obstacle: mw.Obstacle
    path: Array

    def solve(self, share: float, start: mw.PathSolution | None = None) -> mw.PathSolution:
        """Return the path at a share of the way."""
        pos = self.obstacle.pos + share * self.path
        return mw.solve_path(
            self.origin, self.insertion, [replace(self.obstacle, pos=tuple(pos))], start=start
        )


def random_pull(rng: np.random.Generator, letter: str) -> Pull:
    """Return a pull across the string at right angles, by 1 to 1.7 times the way to the middle of the surface."""
    while True:
        origin, insertion, (obstacle,) = random_scene(rng, letter, hints=False)
        string = origin + np.linspace(0.0, 1.0, 101)[:, None] * (insertion - origin)
        way = np.cross(insertion - origin, rng.normal(size=3))
        way /= np.linalg.norm(way)
        middle = string[50] + 0.004 * rng.normal(size=3)
        for aside in np.arange(0.01, 0.1, 1e-3):
            beside = replace(obstacle, pos=tuple(middle - aside * way))
            if height(beside, string).min() > 4e-3:
                return Pull(origin, insertion, beside, rng.uniform(1.0, 1.7) * aside * way)


@every_surface
def test_a_surface_pulled_through_a_string_at_once_catches_it_as_in_small_steps(letter: str) -> None:
    """Where the string does not slip on the way, and goes back to a straight line when the surface does."""
    rng = np.random.default_rng(47)
    compared = 0
    while compared < PULLS:
        pull = random_pull(rng, letter)
        fine = [pull.solve(0.0)]
        for k in range(FINE):
            fine.append(pull.solve((k + 1) / FINE, fine[-1]))
        most = 2.0 * float(np.linalg.norm(pull.path)) / FINE
        smooth = all(abs(b.length - a.length) <= most for a, b in pairwise(fine))
        if not (smooth and all(sol.converged for sol in fine) and fine[-1].contacts[0].active):
            continue
        compared += 1
        for steps in (1, 2, 3):
            sol = fine[0]
            for k in range(steps):
                sol = pull.solve((k + 1) / steps, sol)
            assert sol.converged
            assert sol.length == pytest.approx(fine[-1].length, rel=EXACT)
        back = pull.solve(0.0, fine[-1])
        assert back.converged
        assert back.length == pytest.approx(np.linalg.norm(pull.insertion - pull.origin), rel=EXACT)


@pytest.mark.parametrize("count", [1, 3])
def test_no_path_is_lost_in_a_jump(count: int) -> None:
    """From another scene's path to where a cold start finds one, and to the same bits whenever it is asked for.

    No cones: a string that was wound round one may have to slip off (`NO_GEODESIC`).
    """
    rng = np.random.default_rng(53)
    letters = LETTERS.replace("k", "")
    jumps = 0
    for _ in range(40 // count):
        kinds = "".join(rng.choice(list(letters), count))
        scenes = [random_scene(rng, kinds, hints=False) for _ in range(4)]
        sol = mw.solve_path(*scenes[0])
        for origin, insertion, row in scenes[1:]:
            start = sol.branch
            sol = mw.solve_path(origin, insertion, row, start=start)
            if mw.solve_path(origin, insertion, row).converged:
                assert sol.converged
                check_path(origin, insertion, row, sol)
                again = mw.solve_path(origin, insertion, row, start=start)
                assert again.length == sol.length
                assert np.array_equal(again.branch, sol.branch)
                jumps += 1
    assert jumps > 20
