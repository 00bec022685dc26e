"""Time of a muscle's force and of a step of its fibre in a compiled loop, per muscle and step.

Muscles of four kinds, from a short tendon to one seven times as long as its fibre, are moved by half an optimal fibre
length at up to 2.4 optimal lengths a second, under excitations that switch; each kind in several phases. Lengths,
speeds and activations are made beforehand: neither a step of activation nor a path is in the figures. A step has
failed where its iteration did not converge or took more than ten evaluations, where the tension is not finite, or
where it is not that of the tendon beside the new fibre to 1e-8 of the maximum force. Times are the CPU time of the
thread. Exit code 1 where a target is missed or a step failed, 2 for a bad argument.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from time import thread_time_ns as clock
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

import mjwrap as mw
from mjwrap.kernels.musculotendon import activation_dynamics, equilibrium, fiber
from mjwrap.kernels.musculotendon import tension as muscle
from mjwrap.muscles.laws import parameter_row

KINDS = {  # F_max [N], l_o [m], l_s [m], pennation [rad]
    "short tendon": (600.0, 0.12, 0.03, 0.14),
    "parallel": (1000.0, 0.10, 0.20, 0.0),
    "soleus-like": (3549.0, 0.05, 0.25, 0.436),
    "gastrocnemius-like": (1600.0, 0.055, 0.39, 0.17),
}
PHASES = 4
STEPS, BLOCK = 1000, 100  # of a motion, and between two looks at the clock
LIMIT, BALANCE = 10, 1e-8  # evaluations in a step; [F_max]
TARGETS = {"rigid": 0.1, "elastic": 0.5}  # [us]
Array = NDArray[np.float64]
Row = dict[str, Any]
jit: Any = numba.njit


@dataclass
class Motion:
    """The muscles of a law and what they are given: params (n, PARAMS), start (n,) [m], signals (STEPS + 1, 4, n).

    The signals are activation, its rate [1/s], length [m] and speed [m/s].
    """

    code: int
    params: Array
    start: Array
    signals: Array


def declare(law: str, tendon: str, sizes: tuple[float, float, float, float]) -> Any:
    """Return a muscle of a kind under a law."""
    if law == "mujoco":
        force, optimal, slack, _ = sizes
        prm = (0.75, 1.05, force, 200.0, 0.5, 1.6, 1.5, 1.3, 1.2)
        return mw.MuJoCoMuscle(prm, (slack + 0.7 * optimal, slack + 1.25 * optimal), 1.0)
    made = {"degroote_fregly_2016": mw.DeGrooteFregly2016, "millard_2012": mw.Millard2012}[law]
    return made(*sizes, tendon=tendon)


def prepare(law: str, tendon: str, step: float) -> Motion:
    """Return the motion of a law's muscles at steps of a duration [s]."""
    laws = [declare(law, tendon, sizes) for sizes in KINDS.values() for _ in range(PHASES)]
    params = np.array([parameter_row(law) for law in laws])
    time = np.arange(STEPS + 1) * step
    signals = np.zeros((STEPS + 1, 4, len(laws)))
    start = np.zeros(len(laws))
    for m, (_, optimal, slack, pennation) in enumerate(s for s in KINDS.values() for _ in range(PHASES)):
        phase = 2.0 * np.pi * (m % PHASES) / PHASES
        along = optimal * (0.95 * np.cos(pennation) + 0.25 * np.sin(3.0 * np.pi * time + phase))
        excitation = np.where(np.sin(5.0 * np.pi * time + 2.0 * phase) > 0.0, 0.9, 0.05)
        a = 0.3
        for k in range(STEPS + 1):
            signals[k, 0, m] = a
            signals[k, 1, m] = activation_dynamics.zajac_rate(excitation[k], a, 0.01, 0.04)
            a = activation_dynamics.advance_activation(a, excitation[k], 0.01, 0.04, step)
        signals[:, 2, m] = 1.02 * slack + along
        signals[:, 3, m] = 0.75 * np.pi * optimal * np.cos(3.0 * np.pi * time + phase)
        if tendon == "elastic":
            start[m] = fiber.equilibrium(laws[m].code, params, m, 0.3, signals[0, 2, m])[0]
    return Motion(laws[0].code, params, start, signals)


@jit(nogil=True)
def run_rigid(code, params, signals, first, last, lengths, step, tension, counts):
    """Write the tensions (steps, n) [N] of muscles without a fibre's state."""
    for k in range(first, last):
        for m in range(params.shape[0]):
            tension[k, m] = muscle.tension(
                code, params, m, signals[k + 1, 0, m], signals[k + 1, 2, m], signals[k + 1, 3, m]
            )


@jit(nogil=True)
def run_elastic(code, params, signals, first, last, lengths, step, tension, counts):
    """Advance the fibres `lengths` (n,) [m]; write tensions and, negative where it did not converge, evaluations."""
    for k in range(first, last):
        for m in range(params.shape[0]):
            lengths[m], tension[k, m], count, status = fiber.step_fiber(
                code, params, m, signals[k, 0, m], signals[k + 1, 0, m], signals[k + 1, 1, m],
                signals[k, 2, m], signals[k + 1, 2, m], signals[k + 1, 3, m], lengths[m], step,
            )  # fmt: skip
            counts[k, m] = -1 if status == equilibrium.NOT_CONVERGED else count


@jit(nogil=True)
def run_euler(code, params, signals, first, last, lengths, step, tension, counts):
    """Do what `run_elastic` does with backward Euler."""
    for k in range(first, last):
        for m in range(params.shape[0]):
            lengths[m], tension[k, m], count, status = fiber.advance_fiber(
                code, params, m, signals[k + 1, 0, m], signals[k + 1, 2, m], lengths[m], step
            )
            counts[k, m] = -1 if status == equilibrium.NOT_CONVERGED else count


def failures(motion: Motion, runner: Any, step: float) -> tuple[int, NDArray[np.int64]]:
    """Return how many steps of a motion failed, and all evaluations."""
    n = len(motion.params)
    tension, counts = np.zeros((STEPS, n)), np.zeros((STEPS, n), np.int64)
    lengths, off = motion.start.copy(), np.zeros((STEPS, n))
    elastic = runner is not run_rigid
    for k in range(STEPS):
        runner(motion.code, motion.params, motion.signals, k, k + 1, lengths, step, tension, counts)
        if elastic:
            for m in range(n):
                length = motion.signals[k + 1, 2, m]
                there = fiber.tendon_force(motion.code, motion.params, m, length, lengths[m])
                off[k, m] = abs(tension[k, m] - there) / motion.params[m, fiber.F_MAX]
    bad = ~np.isfinite(tension) | (counts < 0) | (counts > LIMIT) | ~(off <= BALANCE)
    return int(bad.sum()), counts.ravel()


def measure(law: str, tendon: str, runner: Any, step: float, repeats: int) -> Row:
    """Return the figures [us] of a law: over all blocks of all repeats of the motion, and its failures."""
    motion = prepare(law, tendon, step)
    failed, counts = failures(motion, runner, step)
    n = len(motion.params)
    tension, scratch = np.zeros((STEPS, n)), np.zeros((STEPS, n), np.int64)
    times = []
    for _ in range(repeats):
        lengths = motion.start.copy()
        for first in range(0, STEPS, BLOCK):
            began = clock()
            runner(
                motion.code,
                motion.params,
                motion.signals,
                first,
                first + BLOCK,
                lengths,
                step,
                tension,
                scratch,
            )
            times.append((clock() - began) / (1e3 * BLOCK * n))
    row: Row = {"median": float(np.median(times)), "p95": float(np.percentile(times, 95))}
    row |= {"least": float(np.min(times)), "failures": failed, "steps": STEPS * n}
    if runner is not run_rigid:
        row["evaluations"] = {str(k): int(c) for k, c in enumerate(np.bincount(np.maximum(counts, 0))) if c}
        row["mean_evaluations"] = float(counts.mean())
    return row


CASES = (
    ("mujoco, no tendon", "mujoco", "rigid", run_rigid),
    ("degroote_fregly_2016, rigid", "degroote_fregly_2016", "rigid", run_rigid),
    ("millard_2012, rigid", "millard_2012", "rigid", run_rigid),
    ("degroote_fregly_2016, elastic", "degroote_fregly_2016", "elastic", run_elastic),
    ("millard_2012, elastic", "millard_2012", "elastic", run_elastic),
    ("degroote_fregly_2016, backward Euler", "degroote_fregly_2016", "elastic", run_euler),
    ("millard_2012, backward Euler", "millard_2012", "elastic", run_euler),
)


def verdict(label: str, row: Row) -> str:
    """Return whether a row meets its target, where it has one; none is met with failures."""
    limit = TARGETS.get(label.rpartition(", ")[2])
    if limit is None:
        return ""
    if row["failures"]:
        return "FAILED"
    return f"target {limit:g}: " + ("met" if row["median"] <= limit else "MISSED")


def main() -> int:
    """Run the benchmark; return the exit code."""
    parser = argparse.ArgumentParser(
        description="Time of muscle forces and of fibre steps in a compiled loop."
    )
    parser.add_argument("--repeats", type=int, default=30, help="runs of each motion (default 30)")
    parser.add_argument("--step", type=float, default=2e-3, help="duration of a step [s] (default 0.002)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures to FILE")
    options = parser.parse_args()
    if options.repeats < 1:
        parser.error(f"--repeats must be at least 1, not {options.repeats}")
    if not 0.0 < options.step <= 0.1:
        parser.error(f"--step must be above 0 and at most 0.1, not {options.step}")
    if options.json and not options.json.resolve().parent.is_dir():
        parser.error(f"--json: there is no folder {options.json.resolve().parent}")
    print(
        f"mjwrap {mw.__version__}; {PHASES * len(KINDS)} muscles, steps of {1e3 * options.step:g} ms; "
        "microseconds of CPU time per muscle and step"
    )
    print(f"{'':38}{'median':>8}{'p95':>8}{'least':>8}   evaluations: mean, share of each number")
    rows: dict[str, Row] = {}
    for label, law, tendon, runner in CASES:
        row = rows[label] = measure(law, tendon, runner, options.step, options.repeats)
        shares = "  ".join(f"{k}: {c / row['steps']:.2%}" for k, c in row.get("evaluations", {}).items())
        print(
            f"{label:38}{row['median']:8.3f}{row['p95']:8.3f}{row['least']:8.3f}   "
            + (f"{row['mean_evaluations']:.2f}   {shares}   " if shares else "")
            + verdict(label, row)
            + (f"   FAILURES {row['failures']}" if row["failures"] else "")
        )
    if options.json:
        try:
            options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        except OSError as error:
            print(f"bench_muscle.py: cannot write {options.json}: {error.strerror}", file=sys.stderr)
            return 2
    missed = any("MISSED" in verdict(label, row) for label, row in rows.items())
    return 1 if missed or any(row["failures"] for row in rows.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
