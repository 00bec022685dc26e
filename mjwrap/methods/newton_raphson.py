"""NR: Newton–Raphson with a constant damping term (22)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjwrap.methods.iteration import State, norm
from mjwrap.methods.problem import Array, ChainProblem


@dataclass(frozen=True)
class NewtonRaphson:
    """x ← x − (JᵀJ + λI)⁻¹Jᵀf (22), J by central differences at every step.

    lam: λ, the paper's 0.08, 0.1 or 0.5. The term makes the convergence linear, with the factor λ/(σ² + λ) per step,
    where σ is the smallest nonzero singular value of J.
    """

    lam: float = 0.08
    max_iterations: int = 2000

    def init(self, problem: ChainProblem, x: Array) -> State:
        """Evaluate the first guess: one evaluation."""
        f = problem(x)
        return State(x, f, norm(f), 0, False)

    def advance(self, problem: ChainProblem, state: State) -> State:
        """Take one step: 10n + 1 evaluations."""
        J = problem.jacobian(state.x)
        A = J.T @ J + self.lam * np.eye(len(state.x))
        try:
            d = -np.linalg.solve(A, J.T @ state.residual)
        except np.linalg.LinAlgError:  # λ = 0 leaves JᵀJ singular
            return State(state.x, state.residual, state.error, state.k, True)
        x = state.x + d
        f = problem(x)
        return State(x, f, norm(f), state.k + 1, False)
