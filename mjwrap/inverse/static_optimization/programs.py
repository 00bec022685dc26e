"""Solve the quadratic programs of many frames in parallel threads, with results that do not depend on how many."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from mjwrap.inverse.threads import in_threads
from mjwrap.kernels.optimization.dual_newton import solve_frames
from mjwrap.kernels.optimization.feasibility import prove_infeasible
from mjwrap.kernels.optimization.optimality import optimality_residuals
from mjwrap.kernels.optimization.pattern import mark_used, subtract_forces
from mjwrap.kernels.optimization.problem import (
    NOT_CONVERGED,
    SOLVED,
    Frames,
    Objective,
    Pattern,
    Results,
    Work,
)

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
CHUNK = 64  # frames that one thread solves in a row, each from the last; the first of them from zero
ACCEPTED = 1e-10  # scaled residual of the optimality conditions up to which a frame is solved


@dataclass(frozen=True, eq=False)
class Programs:
    """For each of T frames: minimise Σ w a² + Σ (r / ρ)² subject to Rᵀ (F₀ + a F₁) + r = τ and low ≤ a ≤ high.

    Attributes:
        moment_arms: (T, n, k) R [m], [-].
        force: (T, n) F₀ of each muscle, its force at activation 0 [N].
        strength: (T, n) F₁, what its force grows by to activation 1 [N].
        wanted: (T, k) τ [N m], [N].
        weights: (n,) w > 0.
        reserves: (k,) ρ > 0; infinite for a reserve without cost.
        low: (T, n) least activations.
        high: (T, n) largest activations.
    """

    moment_arms: Array
    force: Array
    strength: Array
    wanted: Array
    weights: Array
    reserves: Array
    low: Array
    high: Array


@dataclass(frozen=True, eq=False)
class Optima:
    """The optima of T frames.

    Attributes:
        activation: (T, n).
        reserve: (T, k).
        status: (T,) SOLVED, NOT_CONVERGED or NON_FINITE of `kernels/optimization/problem.py`.
        residual: (T,) largest scaled residual of the optimality conditions.
        iterations: (T,) steps of Newton's method.
        infeasible: (T,) whether no activations within the bounds give the wanted moments without reserves; proved by
            a direction in which they can do less work than is wanted.
    """

    activation: Array
    reserve: Array
    status: Ints
    residual: Array
    iterations: Ints
    infeasible: NDArray[np.bool_]


def solve(programs: Programs, jobs: int = 1) -> Optima:
    """Solve all frames by Newton's method on the dual, `jobs` chunks of frames at a time."""
    frames, muscles = programs.low.shape
    rows = programs.wanted.shape[1]
    pattern, order = make_pattern(used_entries(programs.moment_arms))
    with np.errstate(divide="ignore"):
        objective = Objective(programs.weights, 1.0 / programs.reserves[order])
    wanted = np.ascontiguousarray(programs.wanted[:, order])
    results = Results(
        np.zeros((frames, muscles)), np.zeros((frames, rows)), np.zeros((frames, rows)),
        np.zeros(frames, dtype=np.int64), np.zeros(frames, dtype=np.int64),
    )  # fmt: skip
    residual, infeasible = np.zeros(frames), np.zeros(frames, dtype=np.bool_)

    def run(begin: int) -> None:
        part = slice(begin, begin + CHUNK)
        missing, arms = wanted[part], programs.moment_arms[part]
        subtract_forces(pattern, arms, programs.force[part], missing)
        given = Frames(arms, programs.strength[part], missing, programs.low[part], programs.high[part])
        found = Results(
            results.activation[part], results.reserve[part], results.dual[part],
            results.status[part], results.iterations[part],
        )  # fmt: skip
        solve_frames(pattern, given, objective, found, _work(len(pattern.row), muscles, rows))
        optimality_residuals(pattern, given, objective, found, residual[part], np.zeros(rows), np.zeros(rows))
        prove_infeasible(pattern, given, objective, found, infeasible[part])

    in_threads(run, range(0, frames, CHUNK), jobs)
    status = results.status.copy()
    status[(status == SOLVED) & ~(residual <= ACCEPTED)] = NOT_CONVERGED
    reserve = np.empty_like(results.reserve)
    reserve[:, order] = results.reserve
    return Optima(results.activation, reserve, status, residual, results.iterations, infeasible)


def used_entries(moment_arms: Array) -> NDArray[np.bool_]:
    """Return which moment arms (n, k) differ from zero in any of the frames (T, n, k)."""
    used = np.zeros(moment_arms.shape[1:], dtype=np.bool_)
    mark_used(moment_arms, used)
    return used


def make_pattern(used: NDArray[np.bool_]) -> tuple[Pattern, Ints]:
    """Return the pattern of moment matrices with some moment arms (n, k), and the order of elimination (k,)."""
    rows = used.shape[1]
    order = elimination_order(used)
    muscle, row = np.nonzero(used[:, order])
    start = np.searchsorted(muscle, np.arange(len(used) + 1))
    first = np.arange(rows)
    np.minimum.at(first, row, row[start[muscle]])
    kinds = (np.ascontiguousarray(array, dtype=np.int64) for array in (start, row, order[row], first))
    return Pattern(*kinds), order


def elimination_order(used: NDArray[np.bool_]) -> Ints:
    """Return an order of k rows in which the factor of the Newton steps' matrix has a small envelope.

    used: (n, k) which moment arms are used. Tried are the given order, the opposite one, in which a tree's leaves come
    first, and that of Cuthill and McKee.
    """
    crossing = used.astype(np.int64)
    i, j = np.nonzero(crossing.T @ crossing)
    given = np.arange(used.shape[1], dtype=np.int64)
    if not len(i):
        return given
    coupled = csr_array((np.ones(len(i)), (i, j)), shape=(len(given), len(given)))
    tried = [given, given[::-1], reverse_cuthill_mckee(coupled, symmetric_mode=True).astype(np.int64)]

    def envelope(order: Ints) -> int:
        place = np.empty_like(given)
        place[order] = given
        first = given.copy()
        np.minimum.at(first, place[i], place[j])
        return int(((given - first) ** 2).sum())

    return min(tried, key=envelope)


def _work(entries: int, muscles: int, rows: int) -> Work:
    size = muscles + rows
    return Work(
        scaled=np.zeros(entries), load=np.zeros(rows), target=np.zeros(muscles), residual=np.zeros(rows),
        size=np.zeros(rows), step=np.zeros(rows), target_step=np.zeros(muscles), hessian=np.zeros((rows, rows)),
        matrix=np.zeros((size, size + 1)), free=np.zeros(muscles, dtype=np.int64),
    )  # fmt: skip
