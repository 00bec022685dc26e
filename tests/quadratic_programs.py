"""Random problems of muscle activations, and slow, independent solutions of them."""

from __future__ import annotations

import daqp
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from mjwrap.inverse.static_optimization.programs import Programs

Array = NDArray[np.float64]


def random_programs(
    seed: list[int],
    frames: int,
    muscles: int,
    rows: int,
    *,
    load: float = 1.0,
    reserve: float = 1.0,
    weight_orders: float = 0.0,
) -> Programs:
    """Return frames of one sparse moment matrix: each muscle crosses one to four neighbouring coordinates.

    load: times moments that activations up to 0.5 give, with a fifth of noise; weight_orders: the weights' range.
    """
    rng = np.random.default_rng(seed)
    arms = np.zeros((muscles, rows))
    for m in range(muscles):
        count = min(rows, int(rng.integers(1, 5)))
        first = int(rng.integers(0, rows - count + 1))
        arms[m, first : first + count] = rng.normal(0.0, 0.04, count)
    strength = 10.0 ** rng.uniform(2.0, 3.5, muscles)
    meant = rng.uniform(0.0, 0.5, muscles) @ (arms * strength[:, None])
    noise = 0.2 * np.abs(meant).mean() * rng.normal(size=(frames, rows))
    return Programs(
        moment_arms=np.tile(arms, (frames, 1, 1)),
        force=np.zeros((frames, muscles)),
        strength=np.tile(strength, (frames, 1)),
        wanted=load * (meant + noise),
        weights=10.0 ** rng.uniform(-weight_orders / 2, weight_orders / 2, muscles),
        reserves=np.full(rows, reserve),
        low=np.zeros((frames, muscles)),
        high=np.ones((frames, muscles)),
    )


def moment_matrix(programs: Programs, t: int) -> Array:
    """Return A (k, n) of a frame."""
    return (programs.moment_arms[t] * programs.strength[t][:, None]).T


def by_daqp(programs: Programs, t: int) -> Array | None:
    """Return the activations of a frame by DAQP, a dual active-set method; None where it does not end as optimal.

    Activations and reserves over ρ are its unknowns, their balance a constraint: better conditioned than without them.
    """
    n, k = len(programs.weights), len(programs.reserves)
    matrix = moment_matrix(programs, t) / programs.reserves[:, None]
    load = programs.wanted[t] / programs.reserves
    free = np.full(k, 1e30)
    sense = np.r_[np.zeros(n + k), np.full(k, 5.0)].astype(np.int32)
    found, _, flag, _ = daqp.solve(
        np.diag(np.r_[2.0 * programs.weights, np.full(k, 2.0)]), np.zeros(n + k), np.hstack([matrix, np.eye(k)]),
        np.r_[programs.high[t], free, load], np.r_[programs.low[t], -free, load], sense,
        primal_tol=1e-12, eps_prox=0.0,
    )  # fmt: skip
    return found[:n] if flag == 1 else None


def by_least_squares(programs: Programs, t: int) -> Array:
    """Return the activations of a frame by SciPy's bounded-variable least squares (Stark and Parker)."""
    matrix = moment_matrix(programs, t) / programs.reserves[:, None]
    whole = np.vstack([matrix, np.diag(np.sqrt(programs.weights))])
    right = np.r_[programs.wanted[t] / programs.reserves, np.zeros(len(programs.weights))]
    return lsq_linear(whole, right, (programs.low[t], programs.high[t]), method="bvls", tol=1e-15).x
