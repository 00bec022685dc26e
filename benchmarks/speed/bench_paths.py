"""Time per new pose of mjwrap's paths, MuJoCo's own tendon and OpenSim's Scholz2015GeometryPath, in one run.

Every repeat runs every solver over the whole sweep of every scene, one after another and in changing order; ratios are
taken within a repeat. Lengths are compared between the solvers at every pose. A pose that a solver gives up, does not
converge at, or gets wrong by more than 1e-9 is a failure: it is counted, and mjwrap with failures meets no target.
Times are the CPU time of the thread. Exit code 1 where a target is missed, or open because a solver is not installed,
2 for a bad argument.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from path_report import compare, machine, print_scene, read_old
from path_scenes import POSES, SCENES, Scene
from path_solvers import BLOCK, COPIES, LEAD, Mjwrap, solvers
from path_sweep import Solver, Sweep
from path_targets import MET, Row, judge

WRONG = 1e-9  # relative difference of lengths from mjwrap's certified ones that counts as a failure
LEGEND = f"""\
Microseconds of CPU time per new pose. median, p95: of blocks of {BLOCK} poses in the compiled loop (mjwrap), of single
poses (MuJoCo, {COPIES} equal tendons at once; OpenSim). whole: a whole sweep by its poses, the call's set-up included.
times mjwrap: the median over mjwrap's in the same repeat, warm, but OpenSim's cold one over mjwrap's cold one; median
over the repeats (range). length: largest relative difference from mjwrap warm. steps: Newton steps a pose.
cold: every pose from its hints alone; unaided: without hints too, there a shorter path is no failure."""


def time_scene(scene: Scene, repeats: int) -> tuple[dict[str, Row], dict[str, str]]:
    """Return one row of figures per solver, and why solvers are missing."""
    found, missing = solvers(scene)
    truth = found[0].sweep()
    for solver in found:
        solver.sweep()  # once unrecorded: compilation, caches, first solutions
    runs: dict[str, list[Sweep]] = {solver.name: [] for solver in found}
    for k in range(repeats):
        order = found[k % len(found) :] + found[: k % len(found)]
        for solver in order:
            runs[solver.name].append(solver.sweep())
    return {solver.name: _row(solver, runs, truth) for solver in found}, missing


def _row(solver: Solver, runs: dict[str, list[Sweep]], truth: Sweep) -> Row:
    mine = runs[solver.name]
    medians = np.array([np.nanmedian(run.samples) for run in mine])
    reference = np.array([np.median(run.samples) for run in runs[solver.against]])
    longer = np.array([run.length / truth.length[run.at] - 1.0 for run in mine])
    wrong = ~(longer <= WRONG) if solver.other_side else ~(np.abs(longer) <= WRONG)
    bad = np.logical_or([run.failed for run in mine], wrong)
    row: Row = {
        "median": float(np.median(medians)),
        "p95": float(np.nanpercentile(np.concatenate([run.samples for run in mine]), 95)),
        "whole": float(np.median([run.mean for run in mine])),
        "median_each": medians.tolist(),
        "against": solver.against,
        "ratio": float(np.median(medians / reference)),
        "ratio_low": float((medians / reference).min()),
        "ratio_high": float((medians / reference).max()),
        "poses": int(bad.size),
        "failures": int(bad.sum()),
        "shorter": int((longer < -WRONG).sum()) if solver.other_side else 0,
        "length_difference": float(np.nanmax(np.abs(longer))),
    }
    if isinstance(solver, Mjwrap):
        row["allocations"] = solver.allocations()
    for run in mine:
        row.update(run.notes)
    return row


def arguments() -> tuple[argparse.Namespace, dict[str, Any] | None]:
    """Read the command line and the old run to compare with; exit with code 2 for a bad argument."""
    parser = argparse.ArgumentParser(description="Time per new pose of mjwrap's paths and of other solvers'.")
    parser.add_argument(
        "--repeats", type=int, default=9, help="sweeps of every solver over every scene (default 9)"
    )
    parser.add_argument("--poses", type=int, default=POSES, help=f"poses of a sweep (default {POSES})")
    parser.add_argument(
        "--scenes",
        nargs="+",
        metavar="NAME",
        default=list(SCENES),
        help=f"of: {', '.join(SCENES)} (default all)",
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures to FILE")
    parser.add_argument(
        "--against", type=Path, metavar="OLD", help="compare with a file that --json wrote earlier"
    )
    parser.add_argument(
        "--profile", action="store_true", help="print instead where mjwrap's time goes in the scenes"
    )
    options = parser.parse_args()
    if options.repeats < 1 or options.poses < BLOCK + LEAD:
        parser.error(f"--repeats must be at least 1 and --poses at least {BLOCK + LEAD}")
    unknown = [name for name in options.scenes if name not in SCENES]
    if unknown:
        parser.error(f"--scenes: no scene is called {unknown[0]!r}; there are: {', '.join(SCENES)}")
    if options.json and not options.json.resolve().parent.is_dir():
        parser.error(f"--json: there is no folder {options.json.resolve().parent}")
    try:
        return options, read_old(options.against) if options.against else None
    except ValueError as reason:
        parser.error(f"--against: {reason}")


def main() -> int:
    """Run the benchmark; return the exit code."""
    options, old = arguments()
    print(", ".join(f"{key} {value}" for key, value in machine().items()))
    chosen = [SCENES[name](options.poses) for name in SCENES if name in options.scenes]
    if options.profile:
        from path_profile import profile

        for scene in chosen:
            profile(scene)
        return 0
    print(f"{options.poses} poses, {options.repeats} repeats\n{LEGEND}")
    scenes: dict[str, dict[str, Row]] = {}
    for scene in chosen:
        scenes[scene.name], missing = time_scene(scene, options.repeats)
        print_scene(scene.name, scenes[scene.name], missing)
    verdicts = judge(scenes)
    print()
    for verdict in verdicts:
        print(f"{verdict.state:6}  {verdict.text}")
    result = {"machine": machine(), "poses": options.poses, "repeats": options.repeats, "scenes": scenes}
    result["targets"] = [{"target": verdict.text, "state": verdict.state} for verdict in verdicts]
    if old:
        compare(old, result)
    if options.json:
        try:
            options.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
        except OSError as error:
            print(f"bench_paths.py: cannot write {options.json}: {error.strerror}", file=sys.stderr)
            return 2
    return 0 if all(verdict.state == MET for verdict in verdicts) else 1


if __name__ == "__main__":
    sys.exit(main())
