"""The iteration of the three methods: a solver has `init` and `advance`; `iterate` runs it and returns an `Outcome`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from mjwrap.methods.problem import Array, ChainProblem


@dataclass(frozen=True)
class State:
    """An iterate: unknowns x (5n,), their residual, its norm, and whether the method can continue."""

    x: Array
    residual: Array
    error: float
    k: int
    stuck: bool


S = TypeVar("S", bound=State)


class Solver(Protocol, Generic[S]):
    """A method with its options: `init` returns the first state, `advance` the next one."""

    @property
    def max_iterations(self) -> int:
        """Largest number of steps."""
        ...

    def init(self, problem: ChainProblem, x: Array) -> S:
        """Evaluate the first guess x (5n,)."""
        ...

    def advance(self, problem: ChainProblem, state: S) -> S:
        """Take one step; it does not raise and does not test for convergence."""
        ...


@dataclass(frozen=True)
class Outcome:
    """The result of an iteration.

    Attributes:
        x: (5n,) the last finite unknowns.
        error: ‖f‖ or ‖h‖ at x.
        iterations: number of steps.
        evaluations: number of evaluations.
        converged: whether error is at most tol.
    """

    x: Array
    error: float
    iterations: int
    evaluations: int
    converged: bool


def iterate(solver: Solver[Any], problem: ChainProblem, x: Array, tol: float = 1e-10) -> Outcome:
    """Run a solver until the norm of its residual is at most tol, or until it is stuck or out of iterations.

    If an iterate is not finite, the iteration ends with the previous one.

    Args:
        solver: one of `METHODS`.
        problem: the problem.
        x: (5n,) start values of the unknowns.
        tol: largest norm of the residual.

    Returns:
        The last unknowns, with error and cost.
    """
    before = problem.evaluations
    with np.errstate(all="ignore"):
        state = solver.init(problem, np.array(x, dtype=np.float64))
        while state.error > tol and not state.stuck and state.k < solver.max_iterations:
            new = solver.advance(problem, state)
            if not (np.isfinite(new.error) and np.isfinite(new.x).all()):
                break
            state = new
    error = state.error if np.isfinite(state.error) else float("inf")
    return Outcome(state.x, error, state.k, problem.evaluations - before, error <= tol)


def norm(residual: Array) -> float:
    """Return the Euclidean norm."""
    return float(np.sqrt(residual @ residual))
