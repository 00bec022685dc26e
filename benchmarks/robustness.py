"""Cold starts over random rows of cylinders and spheres: how many converge, and is every claim true?

Scenes at muscle scale (spacing 6 to 12 cm, radii 1 to 4.5 cm, axes tilted by about 0.4 rad, nothing overlapping),
with and without random hints. Each solution that is called converged is judged again by the independent certificate
of `tests/scenes.py`, from its contact points alone. Cases that do not converge can be saved and replayed.
"""

from __future__ import annotations

import argparse
import collections
import json
import sys
import time
from pathlib import Path

import numpy as np

import mjwrap as mw

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from scenes import check_path, random_scene

ROWS = {
    "cylinder": "c",
    "sphere": "s",
    "3 mixed": "csc",
    "5 cylinders": "ccccc",
    "5 mixed": "csccs",
    "16 mixed": "cscc" * 4,
}


def describe(origin: np.ndarray, insertion: np.ndarray, row: list[mw.Obstacle]) -> dict:
    """Return a scene as plain numbers, to be saved and replayed."""
    return {
        "origin": list(origin),
        "insertion": list(insertion),
        "obstacles": [
            [type(o.surface).__name__, float(o.surface.dims[0]), list(o.pos), list(o.quat), o.hint]
            for o in row
        ],
    }


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", type=int, default=1000, help="scenes of each class (default 1000)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--save", type=Path, help="write the scenes that did not converge to this JSON file")
    options = parser.parse_args()
    if options.scenes < 1:
        parser.error("--scenes must be at least 1")
    rng = np.random.default_rng(options.seed)
    lost, wrong = [], 0
    print(
        f"{'class':<12} {'hints':<7} {'scenes':>6} {'converged':>9} {'refuted':>7}  {'median':>6} {'most':>5}  others"
    )
    for name, kinds in ROWS.items():
        for hints in (False, True):
            counts: collections.Counter[str] = collections.Counter()
            evaluations = []
            refuted = 0
            started = time.perf_counter()
            for _ in range(options.scenes):
                origin, insertion, row = random_scene(rng, kinds, hints)
                sol = mw.solve_path(origin, insertion, row)
                counts[sol.status.name] += 1
                evaluations.append(sol.evaluations)
                if not sol.converged:
                    lost.append({"status": sol.status.name, **describe(origin, insertion, row)})
                    continue
                try:
                    check_path(origin, insertion, row, sol)
                except AssertionError:
                    refuted += 1
                    lost.append({"status": "REFUTED", **describe(origin, insertion, row)})
            wrong += refuted
            others = ", ".join(
                f"{count} {status}" for status, count in counts.items() if status != "CONVERGED"
            )
            hint = "random" if hints else "none"
            seconds = time.perf_counter() - started
            print(
                f"{name:<12} {hint:<7} {options.scenes:>6} {counts['CONVERGED']:>9} {refuted:>7}"
                f"  {np.median(evaluations):>6.0f} {max(evaluations):>5}  {others or '-'}   ({seconds:.0f} s)",
                flush=True,
            )
    print("median, most: evaluations of all residuals, closed-form wraps of every obstacle counted like one")
    if options.save:
        options.save.write_text(json.dumps(lost))
        print(f"{len(lost)} cases: {options.save}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
