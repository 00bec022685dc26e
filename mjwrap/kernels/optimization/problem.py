"""The groups of arrays of the optimisation of muscle activations, and its statuses.

In every frame: minimise Σ w a² + Σ (r / ρ)² subject to A a + r = b and low ≤ a ≤ high, with n activations a, and k
moments b and reserves r. The moment matrix A is sparse: a muscle crosses few joints.
"""

from __future__ import annotations

from typing import NamedTuple

from mjwrap.kernels.array_types import FloatRows, Floats, FloatStacks, Ints
from mjwrap.kernels.compilation.jit import inlined

SOLVED, NOT_CONVERGED, NON_FINITE = 0, 1, 2


class Pattern(NamedTuple):
    """Where the moment matrix may differ from zero, muscle after muscle, and the order of elimination."""

    start: Ints  # (n + 1,) where each muscle's entries begin
    row: Ints  # (z,) row of each entry, ascending for each muscle, in the order of elimination
    column: Ints  # (z,) the same, in the order of `Frames.moment_arms`
    first: Ints  # (k,) the first row that is coupled with each row by a muscle


class Frames(NamedTuple):
    """The numbers of all frames."""

    moment_arms: FloatStacks  # (T, n, k) [m], [-]
    strength: FloatRows  # (T, n) active force at activation 1 [N]; times the moment arms, the transpose of A
    wanted: FloatRows  # (T, k) b, in the order of elimination
    low: FloatRows  # (T, n)
    high: FloatRows  # (T, n)


class Objective(NamedTuple):
    """What is minimised."""

    weights: Floats  # (n,) w > 0
    stiffness: Floats  # (k,) 1 / ρ ≥ 0 [1/(N m)]; 0 for a reserve without cost


class Results(NamedTuple):
    """The optimum of every frame."""

    activation: FloatRows  # (T, n)
    reserve: FloatRows  # (T, k)
    dual: FloatRows  # (T, k) multipliers y = r / ρ of the scaled constraints
    status: Ints  # (T,)
    iterations: Ints  # (T,)


class Work(NamedTuple):
    """Work space of one frame."""

    scaled: Floats  # (z,) entries of the moment matrix over ρ
    load: Floats  # (k,) b / ρ
    target: Floats  # (n,) z, the activations without bounds
    residual: Floats  # (k,)
    size: Floats  # (k,) of the terms of the residual
    step: Floats  # (k,) of the dual
    target_step: Floats  # (n,)
    hessian: FloatRows  # (k, k)
    matrix: FloatRows  # (n + k, n + k + 1)
    free: Ints  # (n,)


@inlined
def entry(pattern, frames, t, m, e):
    """Return entry e of the moment matrix, which belongs to muscle m, in frame t [N m], [N]."""
    return frames.moment_arms[t, m, pattern.column[e]] * frames.strength[t, m]
