"""BR: Broyden's method (27)–(28) on the tangency residual."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from mjwrap.methods.iteration import State, norm
from mjwrap.methods.linesearch import derivative_free
from mjwrap.methods.problem import Array, ChainProblem

RANK_TOLERANCE = 1e-8  # larger than the error of central differences in a null direction, 1e-10


@dataclass(frozen=True)
class BroydenState(State):
    """An iterate with L, the approximate Jacobian."""

    L: Array


@dataclass(frozen=True)
class Broyden:
    """x ← x + αd, with d = −L⁺f, the shortest least-squares step, and L ← L + θ (y − Ls)sᵀ/(sᵀs).

    L is initially J by central differences. d and every update lie in the row space of L, so that no step goes along
    the null direction (the length of (u', v')).

    Args:
        step: a fixed α (the paper's 1.0), or "line_search", the derivative-free search (29).
        theta: θ of the update.
        sigma1: σ₁ of the line search (29).
        sigma2: σ₂ of the line search.
        rho: ρ of the line search.
        shrink: factor by which the line search shortens a step.
        max_iterations: largest number of steps.
    """

    step: float | Literal["line_search"] = "line_search"
    theta: float = 1.0
    sigma1: float = 0.001
    sigma2: float = 0.001
    rho: float = 0.9
    shrink: float = 0.5
    max_iterations: int = 2000

    def init(self, problem: ChainProblem, x: Array) -> BroydenState:
        """Evaluate the first guess and its Jacobian: 10n + 1 evaluations."""
        f = problem(x)
        return BroydenState(x, f, norm(f), 0, not np.isfinite(f).all(), problem.jacobian(x))

    def advance(self, problem: ChainProblem, state: BroydenState) -> BroydenState:
        """Take one step: one evaluation, and one more for each backtracking."""
        x, f, L = state.x, state.residual, state.L
        try:
            d = -np.linalg.lstsq(L, f, rcond=RANK_TOLERANCE)[0]
        except np.linalg.LinAlgError:
            return BroydenState(x, f, state.error, state.k, True, L)
        if self.step == "line_search":
            found = derivative_free(
                problem, x, d, state.error, state.k, self.sigma1, self.sigma2, self.rho, self.shrink
            )
            if found is None:
                return BroydenState(x, f, state.error, state.k, True, L)
            new, f_new = found
        else:
            new = x + self.step * d
            f_new = problem(new)
        s, y = new - x, f_new - f
        size2 = float(s @ s)
        if not size2 > 0.0:
            return BroydenState(x, f, state.error, state.k, True, L)
        L = L + self.theta * np.outer(y - L @ s, s) / size2
        return BroydenState(new, f_new, norm(f_new), state.k + 1, False, L)
