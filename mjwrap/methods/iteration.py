"""The iteration that the three methods share: a solver is init, advance, terminate; an outcome carries its status."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from mjwrap.methods.problem import Array, ChainProblem


@dataclass(frozen=True)
class State:
    """An iterate: unknowns x (5n,), their residual, its norm, and whether the method can go on from here."""

    x: Array
    residual: Array
    error: float
    k: int
    stuck: bool


S = TypeVar("S", bound=State)


class Solver(Protocol, Generic[S]):
    """A method with its options: `init` makes the first state, `advance` the next one."""

    @property
    def max_iterations(self) -> int:
        """Steps after which to give up."""
        ...

    def init(self, problem: ChainProblem, x: Array) -> S:
        """Evaluate the first guess x (5n,)."""
        ...

    def advance(self, problem: ChainProblem, state: S) -> S:
        """Take one step; neither raises nor terminates."""
        ...


@dataclass(frozen=True)
class Outcome:
    """How an iteration ended.

    Attributes:
        x: (5n,) the last finite unknowns.
        error: ‖f‖ or ‖h‖ there.
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

    An iterate that is not finite ends the iteration at the one before.

    Args:
        solver: one of `METHODS`.
        problem: the problem.
        x: (5n,) start values of the unknowns.
        tol: largest norm of the residual.

    Returns:
        The last unknowns, with their residual and cost.
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
