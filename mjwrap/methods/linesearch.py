"""The paper's two line searches: Armijo backtracking for BFGS, a derivative-free one for Broyden's method."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mjwrap.methods.iteration import norm
from mjwrap.methods.problem import Array

SMALLEST_STEP = 2.0**-40  # a search with a shorter step has stalled


def armijo(
    residual: Callable[[Array], Array], x: Array, d: Array, phi: float, slope: float, a: float, b: float
) -> tuple[Array, Array] | None:
    """Return the first x + αd, α = 1, b, b², …, with ‖f‖² ≤ phi + a α slope, and its residual; None if there is none.

    phi = ‖f(x)‖², slope = its derivative along d.
    """
    alpha = 1.0
    while alpha >= SMALLEST_STEP:
        new = x + alpha * d
        f = residual(new)
        if f @ f <= phi + a * alpha * slope:
            return new, f
        alpha *= b
    return None


def derivative_free(
    residual: Callable[[Array], Array],
    x: Array,
    d: Array,
    error: float,
    k: int,
    sigma1: float,
    sigma2: float,
    rho: float,
    shrink: float,
) -> tuple[Array, Array] | None:
    """Return a point x + αd and its residual by the search (29) of Li and Fukushima; None if none is accepted.

    α = 1 is taken at once if ‖f(x + d)‖ ≤ ρ‖f‖ − σ₂‖d‖²; else the first α = 1, shrink, shrink², … with
    ‖f(x + αd)‖ ≤ (1 + η_k)‖f‖ − σ₁‖αd‖², η_k = 1/(k + 1)². error = ‖f(x)‖; k counts iterations from zero.
    """
    size2 = float(d @ d)
    eta = 1.0 / (k + 1) ** 2
    alpha = 1.0
    while alpha >= SMALLEST_STEP:
        new = x + alpha * d
        f = residual(new)
        e = norm(f)
        at_once = alpha == 1.0 and e <= rho * error - sigma2 * size2
        if np.isfinite(e) and (at_once or e <= (1.0 + eta) * error - sigma1 * alpha * alpha * size2):
            return new, f
        alpha *= shrink
    return None
