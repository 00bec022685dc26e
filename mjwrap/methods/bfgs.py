"""BFGS: quasi-Newton minimisation of ‖f‖² (23)–(25)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from mjwrap.methods.iteration import State, norm
from mjwrap.methods.linesearch import armijo
from mjwrap.methods.problem import Array, ChainProblem


@dataclass(frozen=True)
class BfgsState(State):
    """An iterate with the gradient of ‖f‖² and the approximate inverse Hessian H."""

    gradient: Array
    H: Array


@dataclass(frozen=True)
class Bfgs:
    """x ← x − αHg on ‖f‖², with H from I by the BFGS update of the inverse Hessian.

    The gradient g is 2Jᵀf with J by central differences. An update without positive curvature is left out. If a
    direction is not a descent direction, H is reset to I.

    Args:
        step: a fixed α (the paper's 1.0), or "armijo", backtracking with a and b.
        a: share of the decrease predicted by the slope that a step must achieve.
        b: factor by which a step is shortened.
        max_iterations: largest number of steps.
    """

    step: float | Literal["armijo"] = "armijo"
    a: float = 0.382
    b: float = 0.618
    max_iterations: int = 2000

    def init(self, problem: ChainProblem, x: Array) -> BfgsState:
        """Evaluate the first guess and its gradient: 10n + 1 evaluations."""
        f = problem(x)
        gradient = 2.0 * problem.jacobian(x).T @ f
        return BfgsState(x, f, norm(f), 0, False, gradient, np.eye(len(x)))

    def advance(self, problem: ChainProblem, state: BfgsState) -> BfgsState:
        """Take one step: 10n + 1 evaluations, and one more for each backtracking."""
        x, g, H = state.x, state.gradient, state.H
        d = -H @ g
        slope = float(g @ d)
        if self.step == "armijo":
            if not slope < 0.0:
                H = np.eye(len(x))
                d, slope = -g, -float(g @ g)
            found = armijo(problem, x, d, state.error**2, slope, self.a, self.b)
            if found is None:
                return BfgsState(x, state.residual, state.error, state.k, True, g, H)
            new, f = found
        else:
            new = x + self.step * d
            f = problem(new)
        gradient = 2.0 * problem.jacobian(new).T @ f
        H = _updated(H, new - x, gradient - g)
        return BfgsState(new, f, norm(f), state.k + 1, False, gradient, H)


def _updated(H: Array, s: Array, y: Array) -> Array:
    curvature = s @ y
    if not curvature > 0.0:
        return H
    V = np.eye(len(s)) - np.outer(s, y) / curvature
    return V @ H @ V.T + np.outer(s, s) / curvature
