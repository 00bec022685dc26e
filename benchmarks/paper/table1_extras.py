"""Two cylinders in a row, and the fold of Fig. 8 when only normals and binormals are constrained."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import paper_scenes as paper
from paper_scenes import Array
from table1_runs import TOL, case_problem, lengthening_rate, timed_sweep

import mjwrap as mw
from mjwrap.methods import iterate, make_solver, solve_chain

TWO_ROWS: list[tuple[str, str, dict[str, Any]]] = [
    ("NR λ=0.001", "nr", {"lam": 0.001}),
    ("BFGS step 1", "bfgs", {"step": 1.0}),
    ("BFGS Armijo", "bfgs", {"step": "armijo"}),
    ("BR step 1", "broyden", {"step": 1.0}),
    ("BR line search", "broyden", {"step": "line_search"}),
]
SURFACES = [mw.Cylinder(paper.TWO_RADIUS), mw.Cylinder(paper.TWO_RADIUS)]


@dataclass(frozen=True)
class TwoRow:
    """One method over the 251 poses of the two-cylinder scene; lengths are compared with the production solver's."""

    label: str
    n_i: int
    n_f: int
    seconds: float
    failures: int
    touched: list[int]
    tangency_error: float
    length_difference: float


def two_cylinders(repeats: int) -> tuple[list[TwoRow], Array]:
    """Run every method and the production solver; return their rows and the production lengths (251,) [m]."""
    pos = np.array([paper.two_centres(t) for t in paper.TIMES])
    over, under = (0.0, paper.TWO_RADIUS, -0.015), (0.0, -paper.TWO_RADIUS, -0.0125)
    obstacles = [mw.Obstacle(SURFACES[0], hint=over), mw.Obstacle(SURFACES[1], hint=under)]
    sweep, seconds = timed_sweep(obstacles, pos, repeats)
    rows = [_two_row(label, method, options, pos, sweep.length) for label, method, options in TWO_ROWS]
    newton = TwoRow(
        "mjwrap newton",
        int(sweep.iterations.sum()),
        int(sweep.evaluations.sum()),
        seconds,
        int((sweep.status != mw.Status.CONVERGED).sum()),
        _newton_touched(obstacles, pos),
        float(sweep.tangency_error.max()),
        0.0,
    )
    return [*rows, newton], sweep.length


def _newton_touched(obstacles: list[mw.Obstacle], pos: Array) -> list[int]:
    touched = np.zeros(2, dtype=int)
    sol = None
    for centres in pos:
        here = [replace(o, pos=tuple(c)) for o, c in zip(obstacles, centres.tolist(), strict=True)]
        sol = mw.solve_path(paper.ORIGIN, paper.INSERTION, here, start=sol)
        touched += [contact.active for contact in sol.contacts]
    return touched.tolist()


def _two_row(label: str, method: str, options: dict[str, Any], pos: Array, lengths: Array) -> TwoRow:
    upright = np.stack([np.eye(3)] * 2)
    tops = np.array([[0.0, paper.TWO_RADIUS, 0.0], [0.0, -paper.TWO_RADIUS, 0.0]])
    along = np.array([[-1.0, 0.0, 1.0]] * 2) * math.sqrt(0.5)  # the paper's 45°, towards the insertion
    start = (pos[0] + tops, along, np.zeros(2), np.ones(2, dtype=bool))
    n_i = n_f = failures = 0
    touched = np.zeros(2, dtype=int)
    worst = difference = 0.0
    began = time.perf_counter()
    for centres, length in zip(pos, lengths, strict=True):
        r = solve_chain(
            method, paper.ORIGIN, paper.INSERTION, SURFACES, centres, upright, start, TOL, **options
        )
        start = (r.P, r.t, r.s, r.active)
        n_i += r.iterations
        n_f += r.evaluations
        failures += not r.converged
        touched += r.active
        worst = max(worst, r.tangency_error)
        difference = max(difference, abs(r.length / length - 1.0))
    seconds = time.perf_counter() - began
    return TwoRow(label, n_i, n_f, seconds, failures, touched.tolist(), worst, difference)


@dataclass(frozen=True)
class Fold:
    """Case 1 with one residual: ‖residual‖ and ‖f‖ over the poses, and l̇ (17) beside differences of l [cm/s].

    from_first_guess: ‖h‖ and ‖f‖ where NR stands after its last allowed iteration from the paper's first guess.
    """

    label: str
    failures: int
    residual_error: float
    tangency_errors: tuple[float, float]
    rate: Array
    difference: Array
    length: Array
    arc: Array
    from_first_guess: tuple[int, float, float] | None


def fold(residual: str) -> Fold:
    """Follow case 1 with NR λ=0.08 on f, or on h from a start that runs back from the first contact point."""
    solver = make_solver("nr", lam=0.08)
    folded = residual == "normals_binormals"
    problem = case_problem(1, 0.0, residual)
    x = problem.first_guess()
    ran_off = None
    if folded:
        outcome = iterate(solver, problem, x, TOL)
        ran_off = (outcome.iterations, outcome.error, problem.tangency_error(outcome.x))
        # 30° before the top seen along the axis, back (−u') around the half turn to the other side's tangent
        x = np.array([math.pi / 3.0, -3.6, -math.sqrt(0.7), math.sqrt(0.3), 3.7])
    failures = 0
    worst = 0.0
    out = []
    for t in paper.TIMES:
        problem = case_problem(1, t, residual)
        outcome = iterate(solver, problem, x, TOL)
        x = problem.normalised(outcome.x)
        failures += not outcome.converged
        worst = max(worst, outcome.error)
        rate = lengthening_rate(problem, x, paper.centre_velocity(1, t)[None])
        out.append((problem.tangency_error(x), problem.length(x), rate, x[4] * paper.RADIUS))
    error, length, rate, arc = np.array(out).T
    difference = np.gradient(length, paper.TIMES, edge_order=2)
    return Fold(
        "h (31): normals and binormals" if folded else "f (18): tangents",
        failures,
        worst,
        (float(error.min()), float(error.max())),
        rate / paper.CM,
        difference / paper.CM,
        length / paper.CM,
        arc / paper.CM,
        ran_off,
    )
