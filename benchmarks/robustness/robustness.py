"""Cold starts over seeded random scenes: counts failures, wrong claims, and paths that are not the shortest.

Scenes at muscle scale of every surface alone and of rows of 3, 5, 16 and 64 (`random_scenes.py`), each solved
with good hints, with random ones and with none. Every converged answer is judged again, from its contact points
alone, by `mjwrap/verification/certificate.py`. Answers without hints are compared with every other path known for
the scene: the one that it was made for, the certified answers with hints, and, for the first --multistart scenes of a
class, the shortest that an independent search finds (`multistart.py`). Cases that do not converge, are refuted
or are longer can be saved and replayed. The exit status is 1 if a claim is refuted.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # matrices here are small: more threads only fight each other

import argparse
import json
import math
import multiprocessing
import sys
import time
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from options import add_options, parsed
from robustness_table import NOTES, PEERS, REFUSALS, Tally, table
from tqdm import tqdm

import mjwrap as mw
from mjwrap.verification.cases import describe, plain, replay
from mjwrap.verification.certificate import Case, findings
from mjwrap.verification.multistart import SHORTER, shortest
from mjwrap.verification.perturbation import lowest, stiffness_by_differences
from mjwrap.verification.random_scenes import CLASSES, Maker, Scene

HINTS = ("good", "random", "none")
SHAKEN = 0.02  # share of the paths that are shaken
SLIPPING = 1e-3  # negative stiffness of a shaken path, of its largest: differences are good to a tenth of it
CHUNK = {1: 100, 3: 100, 5: 100, 16: 40, 64: 20}  # scenes made from one pool


@dataclass
class Answer:
    """What the solver said about one scene with one kind of hints."""

    obstacles: list[mw.Obstacle]
    sol: mw.PathSolution | None = None
    case: Case | None = None
    reason: str = ""  # empty where the path converged and nothing speaks against it


def _solve(scene: Scene, obstacles: list[mw.Obstacle], tally: Tally) -> Answer:
    """Solve one scene and count how that ends."""
    tally.scenes += 1
    answer = Answer(obstacles)
    started = time.perf_counter()
    try:
        sol = mw.solve_path(scene.origin, scene.insertion, obstacles)
    except Exception as error:
        tally.exceptions += 1
        answer.reason = f"exception: {error!r}"
        return answer
    tally.microseconds.append(1e6 * (time.perf_counter() - started))
    tally.evaluations.append(sol.evaluations)
    tally.status[sol.status.name] += 1
    answer.sol = sol
    values = [sol.length, sol.tangency_error, *sol.points().ravel(), *sol.wrenches(1.0).ravel()]
    if not np.isfinite(values).all():
        tally.not_finite += 1
        answer.reason = "not finite"
    elif not sol.converged:
        answer.reason = sol.status.name
    else:
        answer.case = Case.of(scene.origin, scene.insertion, obstacles, sol)
    return answer


def _shake(answer: Answer, tally: Tally) -> None:
    """Measure the second derivative of a path's length by shifting its contact points."""
    assert answer.case is not None
    if not any(answer.case.contacts):
        return
    try:
        stiffness = lowest(stiffness_by_differences(answer.case))
    except ValueError:  # an arc too short for differences
        return
    tally.shaken += 1
    if stiffness < -SLIPPING:
        tally.refuted += 1
        answer.reason = f"REFUTED shaken: stiffness {stiffness:.1e}"


def _judge(answers: Iterable[Answer], tally: Tally, shake: np.random.Generator) -> None:
    """Judge all converged answers of one kind at once, and shake a share of those that stand."""
    claimed = [answer for answer in answers if answer.case is not None]
    for answer, reason in zip(claimed, findings([a.case for a in claimed if a.case]), strict=True):
        if reason:
            answer.reason = f"REFUTED {reason}"
            tally.refuted += 1
            tally.folded += reason.startswith("folded")
            tally.penetrating += reason.startswith("penetrating")
        elif answer.case is not None and shake.random() < SHAKEN:
            _shake(answer, tally)


def run_chunk(
    job: tuple[str, int, int, int, int, tuple[str, ...]],
) -> tuple[str, dict[str, Tally], list[dict]]:
    """Return tallies and saved cases of one chunk: class, seed, number, scenes, scenes to search, kinds of hints."""
    name, seed, number, count, search, kinds = job
    maker = Maker(name, seed, number)
    chained = [maker.scene(True) for _ in range(count if "good" in kinds else (count + 1) // 2)]
    half = (count + 1) // 2
    mixed = chained[:half] + [maker.scene(False) for _ in range(count - half)]
    tallies = {kind: Tally() for kind in kinds}
    answers: dict[str, list[Answer]] = {}
    for kind in kinds:
        scenes = chained if kind == "good" else mixed
        answers[kind] = [_solve(s, s.hinted(kind) or s.obstacles, tallies[kind]) for s in scenes]
        _judge(answers[kind], tallies[kind], np.random.default_rng([seed, number]))
    saved: list[dict] = []
    searched = set(np.random.default_rng([seed, number]).permutation(count)[:search].tolist())
    for kind in kinds:
        scenes = chained if kind == "good" else mixed
        for i, (scene, answer) in enumerate(zip(scenes, answers[kind], strict=True)):
            others = [(scene.known, "the path that the scene was made for")] if scene.known else []
            if kind == "none":
                others += _others(scene, answers, i, len(scenes) == count, half)
                if i in searched:
                    start = answer.case if not answer.reason else None
                    rng = np.random.default_rng([seed, number, i])
                    tallies[kind].searched += 1
                    others.append(
                        (shortest(scene.origin, scene.insertion, scene.obstacles, rng, start), "search")
                    )
            best, how = min(
                ((case, how) for case, how in others if case), key=lambda x: x[0].length, default=(None, "")
            )
            reason = _compared(answer, best, kind, tallies[kind])
            if reason:
                saved.append(
                    plain(
                        {
                            "class": name,
                            "hints": kind,
                            "place": [seed, number, i],
                            "reason": reason,
                            "scene": describe(scene.origin, scene.insertion, answer.obstacles),
                            "best": best and {"length": best.length, "how": how, "contacts": best.contacts},
                        }
                    )
                )
    return name, tallies, saved


def _others(
    scene: Scene, answers: dict[str, list[Answer]], i: int, same: bool, half: int
) -> list[tuple[Case | None, str]]:
    """Return the certified answers for the same scene with hints."""
    found = []
    for kind in ("good", "random"):
        if kind in answers and (kind == "random" or i < half):
            other = answers[kind][i]
            if not other.reason:
                found.append((other.case, f"{kind} hints"))
    return found if same else []


def _compared(answer: Answer, best: Case | None, kind: str, tally: Tally) -> str:
    """Return why an answer is worth saving, and count it."""
    status = answer.sol.status.name if answer.sol is not None else ""
    if status in REFUSALS:
        tally.refused_wrongly += best is not None and kind != "random"
    if kind == "none" and best is not None and answer.case is not None and not answer.reason:
        tally.compared += 1
        if answer.case.length > best.length * (1.0 + SHORTER):
            tally.longer += 1
            return f"LONGER by {answer.case.length - best.length:.2e} m"
    return answer.reason


def arguments() -> argparse.Namespace:
    """Return the options of the command line, checked."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--scenes", type=int, default=200, help="scenes of each class and kind of hints (default 200)"
    )
    parser.add_argument("--hints", nargs="+", choices=HINTS, default=list(HINTS))
    parser.add_argument(
        "--multistart",
        type=int,
        default=20,
        metavar="N",
        help="scenes of each class searched anew (default 20)",
    )
    add_options(parser, "every case that did not hold", "solve saved cases again")
    return parsed(parser, scenes=1, multistart=0)


def jobs_of(options: argparse.Namespace) -> list[tuple]:
    """Return the chunks of all classes, each with its share of the scenes to be searched."""
    jobs = []
    kinds = tuple(kind for kind in HINTS if kind in options.hints)
    for name in options.classes:
        size = CHUNK[len(CLASSES[name])]
        left, search = options.scenes, min(options.multistart, options.scenes)
        for number in range(math.ceil(options.scenes / size)):
            count = min(size, left)
            now = math.ceil(search * count / left)
            jobs.append((name, options.seed, number, count, now, kinds))
            left, search = left - count, search - now
    return jobs


def main() -> int:
    options = arguments()
    if options.replay:
        replay(Path(options.replay[0]), int(options.replay[1]) if len(options.replay) == 2 else None)
        return 0
    jobs = jobs_of(options)
    tallies: dict[str, dict[str, Tally]] = {}
    saved: list[dict] = []
    started = time.perf_counter()
    with ProcessPoolExecutor(options.jobs, multiprocessing.get_context("spawn")) as pool:
        results = pool.map(run_chunk, jobs) if options.jobs > 1 else map(run_chunk, jobs)
        for name, found, cases in tqdm(results, total=len(jobs), unit="chunk", smoothing=0.0):
            for kind, tally in found.items():
                tallies.setdefault(name, {}).setdefault(kind, Tally()).add(tally)
            saved += cases
            if options.save:
                options.save.write_text(json.dumps(saved), encoding="utf-8")
    numbers = {
        name: {kind: tally.numbers() for kind, tally in kinds.items()} for name, kinds in tallies.items()
    }
    print(table(numbers, options.markdown))
    print(f"\n{NOTES}\n\n{PEERS}\n\n{time.perf_counter() - started:.0f} s, seed {options.seed}")
    if options.save:
        print(f"{len(saved)} cases: {options.save}")
    if options.json:
        options.json.write_text(json.dumps(numbers, indent=1), encoding="utf-8")
    return 1 if any(tally.wrong for kinds in tallies.values() for tally in kinds.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
