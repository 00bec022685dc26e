"""The runs behind Table I: the paper's methods and the production solver over cases 1 and 2, and rates of length."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import paper_scenes as paper
from paper_scenes import Array

import mjwrap as mw
from mjwrap.methods import ChainProblem, iterate, make_solver

TOL = 1e-10
UPRIGHT = np.eye(3)[None]
CYLINDER = mw.Cylinder(paper.RADIUS)
HINT = (0.0, paper.RADIUS, -1.5 * paper.CM)
RATE_STEPS = [0.004, 0.002, 0.001, 0.0005, 0.00025]


@dataclass(frozen=True)
class Row:
    """One method over the 251 poses of a case, beside the paper's numbers (None where it has none)."""

    case: int
    label: str
    n_i: int
    n_f: int
    seconds: float
    failures: int
    touched: int
    tangency_error: float
    length_error_cm: float
    paper: tuple[int, int, int, float] | None

    @property
    def i_a(self) -> float:
        """Iterations a pose."""
        return self.n_i / len(paper.TIMES)


def case_problem(case: int, t: float, residual: str = "tangency") -> ChainProblem:
    """Return the system of case 1 or 2 at time t [s]."""
    centre = paper.centre(case, t)[None]
    return ChainProblem(paper.ORIGIN, paper.INSERTION, [CYLINDER], centre, UPRIGHT, residual)


def _length(problem: ChainProblem, x: Array) -> tuple[float, bool]:
    """Return the length [m] and whether the path wraps; it is straight where l < 0, that is P_x Q_y − P_y Q_x < 0."""
    if x[4] > 0.0:
        return problem.length(x), True
    return float(np.linalg.norm(paper.INSERTION - paper.ORIGIN)), False


def paper_row(case: int, row: paper.PaperRow, restart: bool) -> Row:
    """Run one of the paper's methods as the paper does: every pose is solved, lifted ones with l < 0.

    A pose starts from the last solution; with restart it takes only (u, v) from there, and (u', v', l) from the first
    guess. After a failed pose the first guess is used again. The time includes the building of each pose's problem.
    """
    solver = make_solver(row.method, max_iterations=500, **row.options)
    n_i = n_f = failures = touched = 0
    worst = error = 0.0
    guess = case_problem(case, 0.0).first_guess()
    x = guess
    began = time.perf_counter()
    found: list[tuple[float, bool]] = []
    solved: list[bool] = []
    for t in paper.TIMES:
        problem = case_problem(case, t)
        outcome = iterate(solver, problem, np.concatenate([x[:2], guess[2:]]) if restart else x, TOL)
        reached = problem.normalised(outcome.x)
        found.append(_length(problem, reached))
        solved.append(outcome.converged)
        x = reached if outcome.converged else guess
        n_i += outcome.iterations
        n_f += outcome.evaluations
        worst = max(worst, outcome.error)
    seconds = time.perf_counter() - began
    for t, good, (length, wraps) in zip(paper.TIMES, solved, found, strict=True):
        exact, touches = paper.closed_form(case, t)
        touched += wraps
        failures += not good or wraps != touches
        error = max(error, abs(length - exact))
    return Row(
        case, row.label, n_i, n_f, seconds, failures, touched, worst, error / paper.CM, row.cases[case]
    )


def timed_sweep(obstacles: list[mw.Obstacle], pos: Array, repeats: int) -> tuple[mw.SweepSolution, float]:
    """Return `mjwrap.solve_sweep` of the poses (251, n, 3) [m] and its time [s]: median over repeats, once compiled."""
    quat = np.zeros((*pos.shape[:2], 4))
    quat[..., 0] = 1.0
    sweep = mw.solve_sweep(paper.ORIGIN, paper.INSERTION, obstacles, pos, quat, warm=True)
    taken = []
    for _ in range(repeats):
        began = time.perf_counter()
        sweep = mw.solve_sweep(paper.ORIGIN, paper.INSERTION, obstacles, pos, quat, warm=True)
        taken.append(time.perf_counter() - began)
    return sweep, float(np.median(taken))


def production_row(case: int, repeats: int) -> Row:
    """Run `mjwrap.solve_sweep`, one compiled call for the 251 poses; seconds: median over repeats, once compiled."""
    obstacles = [mw.Obstacle(CYLINDER, hint=HINT)]
    pos = np.array([[paper.centre(case, t)] for t in paper.TIMES])
    sweep, seconds = timed_sweep(obstacles, pos, repeats)
    exact = [paper.closed_form(case, t) for t in paper.TIMES]
    return Row(
        case,
        "mjwrap newton",
        int(sweep.iterations.sum()),
        int(sweep.evaluations.sum()),
        seconds,
        int((sweep.status != mw.Status.CONVERGED).sum()),
        sum(touches for _, touches in exact),
        float(sweep.tangency_error.max()),
        max(abs(a - b) for a, (b, _) in zip(sweep.length, exact, strict=True)) / paper.CM,
        None,
    )


class _Broyden:
    """The paper's best method as a length and a rate of length at any time, warm from a pose nearby."""

    label = "BR line search"

    def __init__(self, case: int) -> None:
        self.case = case
        self.solver = make_solver("broyden")

    def at(self, t: float, start: Any) -> tuple[float, float, bool, Any]:
        problem = case_problem(self.case, t)
        outcome = iterate(self.solver, problem, problem.first_guess() if start is None else start, TOL)
        if not outcome.converged:
            raise mw.PathError(f"{self.label} did not converge at t = {t} s")
        length, wraps = _length(problem, outcome.x)
        rate = (
            lengthening_rate(problem, outcome.x, paper.centre_velocity(self.case, t)[None]) if wraps else 0.0
        )
        return length, rate, wraps, outcome.x


class _Newton:
    """The production solver as a length and a rate of length at any time, warm from a pose nearby."""

    label = "mjwrap newton"

    def __init__(self, case: int) -> None:
        self.case = case

    def at(self, t: float, start: Any) -> tuple[float, float, bool, Any]:
        obstacle = mw.Obstacle(CYLINDER, pos=tuple(paper.centre(self.case, t)), hint=HINT)
        sol = mw.solve_path(paper.ORIGIN, paper.INSERTION, [obstacle], start=start)
        if not sol.converged:
            raise mw.PathError(f"{self.label} did not converge at t = {t} s")
        twist = np.concatenate([paper.centre_velocity(self.case, t), np.zeros(3)])
        return sol.length, sol.speed(np.zeros(3), np.zeros(3), twist[None]), sol.contacts[0].active, sol


def lengthening_rate(problem: ChainProblem, x: Array, velocities: Array) -> float:
    """Return l̇ (17) [m/s] for obstacles that translate with velocities (n, 3) between fixed end points."""
    d = problem.straights(problem.geometry(x))[0]
    e = d / np.linalg.norm(d, axis=1)[:, None]
    return float(((e[:-1] - e[1:]) * velocities).sum())


@dataclass(frozen=True)
class Rates:
    """l̇ against central differences of l: the largest error [m/s] for each step and the order seen between steps.

    extrapolated: the largest error of the two smallest steps' Richardson extrapolation, over the largest |l̇|. across:
    poses whose widest stencil spans a lift-off or touchdown, where l̇ has a corner, and their largest error by step.
    failures: poses left out because a solve at or near them did not converge.
    """

    case: int
    label: str
    steps: list[float]
    errors: list[float]
    orders: list[float]
    extrapolated: float
    largest_rate: float
    poses: int
    across: int
    across_errors: list[float]
    failures: int


def rates(case: int, method: str) -> Rates:
    """Compare l̇ with differences of l, for "broyden" or "newton"."""
    solve = _Broyden(case) if method == "broyden" else _Newton(case)
    smooth: list[list[float]] = []
    corner: list[list[float]] = []
    largest, failures = 0.0, 0
    start = None
    for t in paper.TIMES:
        try:
            _, rate, wraps, start = solve.at(t, start)
            around = [(solve.at(t - h, start), solve.at(t + h, start), h) for h in RATE_STEPS]
        except mw.PathError:
            failures += 1
            continue
        largest = max(largest, abs(rate))
        same = all(wraps == before[2] == after[2] for before, after, _ in around)
        errors = [(after[0] - before[0]) / (2.0 * h) - rate for before, after, h in around]
        (smooth if same else corner).append(errors)
    by_step = np.abs(smooth).max(axis=0)
    last = np.array(smooth)[:, -2:]
    extrapolated = np.abs((4.0 * last[:, 1] - last[:, 0]) / 3.0).max() / largest
    return Rates(
        case,
        solve.label,
        RATE_STEPS,
        by_step.tolist(),
        np.log2(by_step[:-1] / by_step[1:]).tolist(),
        float(extrapolated),
        largest,
        len(smooth) + len(corner),
        len(corner),
        np.abs(corner).max(axis=0).tolist() if corner else [],
        failures,
    )
