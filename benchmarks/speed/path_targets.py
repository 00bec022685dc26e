"""The speed that mjwrap's paths should have, and the judgement of a run of bench_paths.py by it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from path_solvers import COLD, WARM

Row = dict[str, Any]
Rows = dict[str, Row]

LIMITS = {"1 ellipsoid": 1.5, "1 torus": 3.0}  # warm, median [us]
PACE = {  # times faster than OpenSim's path, for which of its rows, on the scenes below
    "OpenSim warm": (WARM, 10.0),
    "OpenSim cold": (COLD, 20.0),
}
PACE_SCENES = ("1 cylinder", "1 sphere", "1 ellipsoid", "1 torus", "3 mixed", "5 mixed", "16 cylinders")
GROWTH = 1.2  # largest cost per cylinder of any row, in times of one cylinder's
MET, MISSED, OPEN = "met", "MISSED", "OPEN"  # open: a solver is missing, so nobody knows


@dataclass(frozen=True)
class Verdict:
    """One target as a sentence with its figure; state: MET, MISSED or OPEN."""

    text: str
    state: str


def _state(good: bool, *rows: Row) -> str:
    """MET where the figure is good and mjwrap failed nowhere in the rows that it comes from."""
    return MET if good and all(row["failures"] == 0 for row in rows) else MISSED


def paired(upper: Row, lower: Row) -> float:
    """Return the median over the repeats of one row's median time over another's."""
    return float(np.median(np.array(upper["median_each"]) / np.array(lower["median_each"])))


def _pace(name: str, rows: Rows) -> list[Verdict]:
    verdicts = []
    for peer, (mine, wanted) in PACE.items():
        head, tail = f"{name}, {mine}: ", f"target at least {wanted:g} times as fast as {peer}"
        if peer not in rows:
            verdicts.append(Verdict(f"{head}not measured, {tail}", OPEN))
            continue
        found = paired(rows[peer], rows[mine])
        verdicts.append(Verdict(f"{head}{found:.3g} times, {tail}", _state(found >= wanted, rows[mine])))
    return verdicts


def _growth(scenes: dict[str, Rows]) -> Verdict | None:
    """Judge the cost per cylinder over all rows of the run; None without one cylinder or without a row."""
    rows = {int(name.split()[0]): scenes[name][WARM] for name in scenes if name.endswith("cylinders")}
    if not rows or "1 cylinder" not in scenes:
        return None
    one = scenes["1 cylinder"][WARM]
    share = {n: paired(row, one) / n for n, row in rows.items()}
    worst = max(share, key=lambda n: share[n])
    longest = max(share)
    text = (
        f"cost per cylinder in a row: at most {share[worst]:.2f} times one alone ({worst} in a row), "
        f"{share[longest]:.2f} for {longest}, target at most {GROWTH:g} times"
    )
    return Verdict(text, _state(share[worst] <= GROWTH, one, *rows.values()))


def judge(scenes: dict[str, Rows]) -> list[Verdict]:
    """Return every target that the scenes of a run can judge."""
    verdicts: list[Verdict] = []
    for name, rows in scenes.items():
        if name in PACE_SCENES:
            verdicts += _pace(name, rows)
        if name in LIMITS:
            row, limit = rows[WARM], LIMITS[name]
            text = f"{name}, {WARM}: {row['median']:.3f} us, target at most {limit:g} us"
            verdicts.append(Verdict(text, _state(row["median"] <= limit, row)))
    growth = _growth(scenes)
    if growth:
        verdicts.append(growth)
    mine = [row for rows in scenes.values() for solver, row in rows.items() if solver.startswith("mjwrap")]
    asked = sum(row["allocations"] for row in mine)
    verdicts.append(Verdict(f"allocations inside mjwrap's loops: {asked}, target none", _state(asked == 0)))
    failures = sum(row["failures"] for row in mine)
    verdicts.append(Verdict(f"poses that mjwrap failed at: {failures}, target none", _state(failures == 0)))
    return verdicts
