"""Cold starts with hints at rings and in rows with rings: counts paths that do not run where the hints say.

Rings alone: ends on both sides, so that the straight line passes outside; the hint is anywhere on the inner side of the
tube. Rows: scenes that are made along a known path (`mjwrap/verification/random_scenes.py`), with the middle of each
geodesic as hint, and again with the hint of each ring anywhere on the side of the tube that the known path passes.
Which side a path takes is judged from its polyline (`mjwrap/verification/ring_sides.py`). The exit status is 1 if a
path is refuted.
"""

from __future__ import annotations

import argparse
from collections import Counter

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

import mjwrap as mw
from mjwrap.verification.certificate import Case, findings
from mjwrap.verification.random_scenes import Maker
from mjwrap.verification.ring_sides import lone_ring, passes_as_hinted, spread

Array = NDArray[np.float64]
ROWS = ("te", "tet", "tect", "etct", "ttt", "tk", "ctpt")  # letters of `random_scenes.py`; t is a torus


def count(origin: Array, insertion: Array, row: list[mw.Obstacle], tally: Counter[str]) -> None:
    """Solve a scene and count how that ends."""
    sol = mw.solve_path(origin, insertion, row)
    tally["scenes"] += 1
    if not sol.converged:
        tally["not converged"] += 1
        return
    tally["refuted"] += bool(findings([Case.of(origin, insertion, row, sol)])[0])
    if not passes_as_hinted(sol, row):
        tally["another side"] += 1
        tally["of these said"] += not all(sol.hints_met)


def main() -> int:
    """Run the scenes, print the table, and return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", type=int, default=100, help="scenes of each class (default 100)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rows", nargs="*", default=ROWS, help="letters of rows (default: several)")
    options = parser.parse_args()
    tallies: dict[str, Counter[str]] = {}
    rng = np.random.default_rng(options.seed)
    tally = tallies.setdefault("ring alone, anywhere on the inner side", Counter())
    for _ in tqdm(range(options.scenes), desc="ring", leave=False):
        count(*lone_ring(rng), tally)
    for letters in options.rows:
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
    columns = ("scenes", "not converged", "refuted", "another side", "of these said")
    print("| hinted rings | " + " | ".join(columns) + " |\n| --- |" + " ---: |" * len(columns))
    for name, tally in tallies.items():
        print(f"| {name} | " + " | ".join(str(tally[column]) for column in columns) + " |")
    return int(any(tally["refuted"] for tally in tallies.values()))


if __name__ == "__main__":
    raise SystemExit(main())
