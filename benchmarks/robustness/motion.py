"""Smooth random motions over every class of scenes: does length follow the motion, whatever way it is run through?

Each motion moves and turns all surfaces and both end points through one period in 1,501 poses, each solved from
the one before. It fails where length or moment arm jumps though the path goes on behind the jump (polished
there by other means, and judged), where the speed is not the rate of the length, where it depends on the way
(backwards, every 10th or 50th pose, one compiled loop) and where the judge of `tests/certificate.py` refutes a
pose. A string that slips because its path ceases to be a minimum is counted apart. Surfaces pulled through a
string in one or two steps are compared with the same in fine ones. The exit status is 1 for any failure.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # matrices here are small: more threads only fight each other

import argparse
import json
import multiprocessing
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from motion_checks import (
    Report,
    follow,
    judged,
    large_jumps,
    no_jumps,
    rates_agree,
    steps_do_not_matter,
    sweep_agrees,
    touched,
)
from motions import Motion, random_motion
from options import add_options, parsed
from tqdm import tqdm

import mjwrap as mw
from mjwrap.verification.cases import describe
from mjwrap.verification.random_scenes import Maker
from mjwrap.verification.scenes import height

POSES = 1501
PULL_STEPS = (1, 2)  # in which a surface is pulled through the string, against PULL_FINE
PULL_FINE = 150
BESIDE = 4e-3  # of the string, where a pull begins [m]
COLUMNS = {
    "motions": "motions",
    "poses": "poses",
    "not converged": "not converged",
    "touchdowns": "contacts come or go",
    "slips": "slips",
    "jumps": "jumps",
    "lost": "lost",
    "refuted": "refuted",
    "wrong speed": "wrong speed",
    "back differs": "back",
    "every 10th differs": "every 10th",
    "every 50th differs": "every 50th",
    "sweep differs": "one loop",
    "pulls": "pulls",
    "pulled: missed": "missed",
    "pulled: other side": "other side",
    "large jumps to another branch": "large jumps: other branch",
    "worst rate": "l̇ error",
}
FAILURES = (
    "jumps",
    "lost",
    "refuted",
    "wrong speed",
    "back differs",
    "every 10th differs",
    "every 50th differs",
    "sweep differs",
    "pulled: missed",
    "pulled: other side",
    "not finite",
    "raised",
)


def run_motion(motion: Motion, rng: np.random.Generator, poses: int = POSES) -> Report:
    """Return everything that one motion shows."""
    report = Report()
    run = follow(motion, np.linspace(0.0, 2.0 * np.pi, poses))
    report.count("motions")
    report.count("poses", poses)
    report.count("not converged", int((~run.good).sum()))
    states = [tuple(touched(sol)) for sol in run.sols]
    report.count("touchdowns", sum(a != b for a, b in pairwise(states)))
    judged(run, report)
    slips = no_jumps(run, report)
    report.count("slips", slips)
    rates_agree(run, rng, report)
    steps_do_not_matter(run, report, slips + int((~run.good).sum()))
    sweep_agrees(run, report)
    large_jumps(run, rng, report)
    return report


def pull_through(motion: Motion, rng: np.random.Generator, report: Report) -> None:
    """Pull one surface across the straight string, from a few millimetres beside it, in one, two and many steps.

    Compared only where in fine steps no string slips and no end comes inside: where the way does not matter.
    """
    k = int(rng.integers(len(motion.obstacles)))
    a, b, row = motion.scene(0.0)
    along = (b - a) / np.linalg.norm(b - a)
    way = np.cross(along, rng.normal(size=3))
    way /= np.linalg.norm(way)
    obstacle = replace(row[k], hint=None)
    middle = a + ((obstacle.pos - a) @ along) * along + 0.004 * rng.normal(size=3)

    def scene(offset: float) -> list[mw.Obstacle]:
        return [replace(obstacle, pos=tuple(middle + offset * way))]

    string = a + np.linspace(0.0, 1.0, 101)[:, None] * (b - a)
    aside = next(
        (x for x in np.arange(0.005, 0.12, 0.001) if height(scene(-x)[0], string).min() > BESIDE), None
    )
    before = None if aside is None else mw.solve_path(a, b, scene(-aside))
    if aside is None or before is None or not before.converged or before.contacts[0].active:
        return
    for target in (0.0, 0.7 * aside):  # its middle on the string, and beyond it
        fine = [before]
        for offset in np.linspace(-aside, target, PULL_FINE + 1)[1:]:
            fine.append(mw.solve_path(a, b, scene(offset), start=fine[-1]))
        lengths = np.array([sol.length for sol in fine])
        if (
            not all(sol.converged for sol in fine)
            or np.abs(np.diff(lengths)).max() > 2.0 * (target + aside) / PULL_FINE
        ):
            report.count("pulls that slip")
            continue
        report.count("pulls")
        for steps in PULL_STEPS:
            sol = before
            for offset in np.linspace(-aside, target, steps + 1)[1:]:
                sol = mw.solve_path(a, b, scene(offset), start=sol)
            if not sol.converged or abs(sol.length - lengths[-1]) > 1e-9 * sol.length:
                noticed = sol.converged and touched(sol) == touched(fine[-1])
                name = type(obstacle.surface).__name__
                detail = f"{name} by {target + aside:.3f} m in {steps} steps: {sol!r} not {fine[-1]!r}"
                ends = [describe(a, b, scene(x)) for x in (-aside, target)]
                report.fault("pulled: other side" if noticed else "pulled: missed", 0.0, detail)
                report.faults[-1]["scenes"] = ends


def run_job(job: tuple[str, int, int, int]) -> tuple[str, Report, dict[str, Any]]:
    """Return the report of one motion and the motion itself: class, seed, number, poses."""
    name, seed, number, poses = job
    maker = Maker(name, seed, 1000 + number)
    motion = random_motion(maker)
    try:
        report = run_motion(motion, maker.rng, poses)
        for _ in range(4):
            pull_through(motion, maker.rng, report)
    except Exception as error:
        report = Report()
        report.fault("raised", 0.0, repr(error))
    return (
        name,
        report,
        {"class": name, "place": [seed, number], "motion": motion.plain(), "faults": report.faults},
    )


def table(results: dict[str, dict[str, float]], markdown: bool) -> str:
    """Return the table of all classes."""
    used = {key: title for key, title in COLUMNS.items() if any(key in row for row in results.values())}
    lines = [["class", *used.values()]]
    for name, row in results.items():
        cells = [name]
        for key in used:
            value = row.get(key, 0)
            cells.append(f"{value:.0e}" if key == "worst rate" else f"{value:.0f}")
        lines.append(cells)
    if markdown:
        lines.insert(1, ["---", *["---:"] * len(used)])
        return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    return "\n".join("  ".join(f"{c:>{w}}" for c, w in zip(line, widths, strict=True)) for line in lines)


def show(file: Path, index: int | None) -> None:
    """Run saved motions again and print what is wrong with them."""
    saved = json.loads(file.read_text(encoding="utf-8"))
    for number in range(len(saved)) if index is None else [index]:
        case = saved[number]
        print(f"motion {number}: {case['class']}, {case['place']}")
        for fault in case["faults"]:
            print(f"  saved: {fault['what']} at {fault['tau']!r}: {fault['detail']}")
        motion = Motion.restored(case["motion"])
        report = run_motion(motion, np.random.default_rng(0))
        for fault in report.faults:
            print(f"  now: {fault['what']} at {fault['tau']!r}: {fault['detail']}")


def arguments() -> argparse.Namespace:
    """Return the options of the command line, checked."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--motions", type=int, default=10, help="motions of each class (default 10)")
    parser.add_argument("--poses", type=int, default=POSES, help=f"of each motion (default {POSES:,})")
    add_options(parser, "every motion with a failure", "run saved motions again")
    return parsed(parser, motions=1, poses=101)


def main() -> int:
    options = arguments()
    if options.replay:
        show(Path(options.replay[0]), int(options.replay[1]) if len(options.replay) == 2 else None)
        return 0
    jobs = [
        (name, options.seed, i, options.poses) for name in options.classes for i in range(options.motions)
    ]
    results: dict[str, dict[str, float]] = {}
    saved = []
    started = time.perf_counter()
    with ProcessPoolExecutor(options.jobs, multiprocessing.get_context("spawn")) as pool:
        done = pool.map(run_job, jobs) if options.jobs > 1 else map(run_job, jobs)
        for name, report, case in tqdm(done, total=len(jobs), unit="motion", smoothing=0.0):
            row = results.setdefault(name, {})
            for key, value in report.counts.items():
                row[key] = max(row.get(key, 0), value) if key == "worst rate" else row.get(key, 0) + value
            if report.faults:
                saved.append(case)
                if options.save:
                    options.save.write_text(json.dumps(saved), encoding="utf-8")
    print(table(results, options.markdown))
    failures = {key: sum(row.get(key, 0) for row in results.values()) for key in FAILURES}
    print("\nfailures: " + (", ".join(f"{n:.0f} {key}" for key, n in failures.items() if n) or "none"))
    print(f"{time.perf_counter() - started:.0f} s, seed {options.seed}")
    if options.save:
        print(f"{len(saved)} motions: {options.save}")
    if options.json:
        options.json.write_text(json.dumps(results, indent=1), encoding="utf-8")
    return 1 if any(failures.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
