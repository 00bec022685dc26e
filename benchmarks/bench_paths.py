"""Time per new pose of mjwrap's paths, MuJoCo's own tendon and OpenSim's Scholz2015GeometryPath, in one run.

Every repeat runs every solver over the whole sweep of every scene, one after another and in changing order; ratios are
taken within a repeat. Lengths are compared between the solvers at every pose. A pose that a solver gives up, does not
converge at, or gets wrong by more than 1e-9 is a failure: it is counted, and a solver with failures meets no target.
Times are the CPU time of the thread. Exit code 1 where a target is missed, 2 for a bad argument.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from path_scenes import POSES, Scene, all_scenes
from path_solvers import BLOCK, COPIES, LEAD, Solver, Sweep, solvers

import mjwrap as mw

WRONG = 1e-9  # relative difference of lengths from mjwrap's certified ones that counts as a failure
ONE_CYLINDER = 1.0  # target: one warm cylinder [us]
SIXTEEN = 16.0  # target: 16 cylinders, in times of one
REFERENCE = "mjwrap warm"
LEGEND = f"""\
Microseconds of CPU time per new pose. median, p95: of blocks of {BLOCK} poses in the compiled loop (mjwrap), of single
poses (MuJoCo, {COPIES} equal tendons at once; OpenSim). whole: a whole sweep by its poses, the call's set-up included.
length: largest relative difference from mjwrap warm. steps: Newton steps a pose."""
Row = dict[str, Any]


def machine() -> dict[str, str]:
    """What the figures depend on."""
    found = {"machine": platform.machine(), "cores": str(os.cpu_count()), "python": platform.python_version()}
    found["mjwrap"] = mw.__version__
    for package in ("numba", "numpy", "mujoco", "opensim"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


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
    reference = np.array([np.median(run.samples) for run in runs[REFERENCE]])
    difference = np.array([np.abs(run.length / truth.length - 1.0) for run in mine])
    bad = np.logical_or([run.failed for run in mine], ~(difference <= WRONG))
    row: Row = {
        "median": float(np.median(medians)),
        "p95": float(np.nanpercentile(np.concatenate([run.samples for run in mine]), 95)),
        "whole": float(np.median([run.mean for run in mine])),
        "median_each": medians.tolist(),
        "ratio": float(np.median(medians / reference)),
        "ratio_low": float((medians / reference).min()),
        "ratio_high": float((medians / reference).max()),
        "poses": int(bad.size),
        "failures": int(bad.sum()),
        "length_difference": float(np.nanmax(difference)),
    }
    for run in mine:
        row.update(run.notes)
    return row


def judge(scenes: dict[str, dict[str, Row]]) -> list[tuple[str, bool]]:
    """Return each target as a sentence with its figure, and whether it is met."""
    verdicts = []
    one, many = scenes["1 cylinder"][REFERENCE], scenes["16 cylinders"][REFERENCE]
    took = one["median"]
    verdicts.append(
        (f"one warm cylinder: {took:.3f} us, target at most {ONE_CYLINDER:g} us", took <= ONE_CYLINDER)
    )
    grew = float(np.median(np.array(many["median_each"]) / np.array(one["median_each"])))
    verdicts.append(
        (f"16 cylinders: {grew:.2f} times one, target at most {SIXTEEN:g} times", grew <= SIXTEEN)
    )
    failures = sum(
        rows[name]["failures"] for rows in scenes.values() for name in rows if name.startswith("mjwrap")
    )
    verdicts.append((f"poses that mjwrap failed at: {failures}, target none", failures == 0))
    return [(text, met and failures == 0) for text, met in verdicts]


def print_scene(name: str, rows: dict[str, Row], missing: dict[str, str]) -> None:
    """Print one scene's table."""
    print(f"\n{name}")
    print(
        f"  {'':20}{'median':>9}{'p95':>9}{'whole':>9}{'times mjwrap warm (range)':>27}{'failures':>16}{'length':>10}"
        f"{'steps':>7}"
    )
    for solver, row in rows.items():
        ratio = f"{row['ratio']:.3g} ({row['ratio_low']:.3g} to {row['ratio_high']:.3g})"
        failures = f"{row['failures']} of {row['poses']}"
        steps = f"{row['iterations']:.2f}" if "iterations" in row else ""
        print(
            f"  {solver:20}{row['median']:9.3f}{row['p95']:9.3f}{row['whole']:9.3f}{ratio:>27}{failures:>16}"
            f"{row['length_difference']:10.0e}{steps:>7}"
        )
    for solver, reason in missing.items():
        print(f"  {solver:20}  no: {reason}")


def compare(old: dict[str, Any], new: dict[str, Any]) -> None:
    """Print the medians of two saved runs side by side."""
    changed = {k: (old["machine"].get(k), v) for k, v in new["machine"].items() if old["machine"].get(k) != v}
    print("\nagainst the old run" + (f" (other: {changed})" if changed else ""))
    print(f"  {'':16}{'':20}{'old':>9}{'new':>9}{'new/old':>9}")
    for scene, rows in new["scenes"].items():
        for solver, row in rows.items():
            before = old["scenes"].get(scene, {}).get(solver)
            if before is not None:
                print(
                    f"  {scene:16}{solver:20}{before['median']:9.3f}{row['median']:9.3f}"
                    f"{row['median'] / before['median']:9.2f}"
                )


def read_old(path: Path) -> dict[str, Any]:
    """Read an earlier run's file; ValueError with the reason where that fails."""
    try:
        old = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(old["scenes"], dict) or not isinstance(old["machine"], dict):
            raise KeyError("scenes")
    except OSError as error:
        raise ValueError(f"cannot read {path}: {error.strerror}") from None
    except (ValueError, KeyError, TypeError):
        raise ValueError(f"{path} is not a file that --json of this benchmark wrote") from None
    return old


def main() -> int:
    """Run the benchmark; return the exit code."""
    parser = argparse.ArgumentParser(description="Time per new pose of mjwrap's paths and of other solvers'.")
    parser.add_argument(
        "--repeats", type=int, default=9, help="sweeps of every solver over every scene (default 9)"
    )
    parser.add_argument("--poses", type=int, default=POSES, help=f"poses of a sweep (default {POSES})")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures to FILE")
    parser.add_argument(
        "--against", type=Path, metavar="OLD", help="compare with a file that --json wrote earlier"
    )
    options = parser.parse_args()
    if options.repeats < 1 or options.poses < BLOCK + LEAD:
        parser.error(f"--repeats must be at least 1 and --poses at least {BLOCK + LEAD}")
    if options.json and not options.json.resolve().parent.is_dir():
        parser.error(f"--json: there is no folder {options.json.resolve().parent}")
    try:
        old = read_old(options.against) if options.against else None
    except ValueError as reason:
        parser.error(f"--against: {reason}")
    print(", ".join(f"{key} {value}" for key, value in machine().items()))
    print(f"{options.poses} poses, {options.repeats} repeats\n{LEGEND}")
    scenes: dict[str, dict[str, Row]] = {}
    for scene in all_scenes(options.poses):
        scenes[scene.name], missing = time_scene(scene, options.repeats)
        print_scene(scene.name, scenes[scene.name], missing)
    verdicts = judge(scenes)
    print()
    for text, met in verdicts:
        print(f"{'met   ' if met else 'MISSED'}  {text}")
    result = {"machine": machine(), "poses": options.poses, "repeats": options.repeats, "scenes": scenes}
    result["targets"] = [{"target": text, "met": met} for text, met in verdicts]
    if old:
        compare(old, result)
    if options.json:
        try:
            options.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
        except OSError as error:
            print(f"bench_paths.py: cannot write {options.json}: {error.strerror}", file=sys.stderr)
            return 2
    return 0 if all(met for _, met in verdicts) else 1


if __name__ == "__main__":
    sys.exit(main())
