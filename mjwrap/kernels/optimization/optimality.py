"""How far activations and reserves are from optimal: the Karush–Kuhn–Tucker conditions of `problem.py`, scaled.

With y the multipliers of the constraints over ρ, c a column of A / ρ: y = r / ρ; w a − cᵀy = 0 where a is between its
bounds, ≥ 0 at the lower and ≤ 0 at the upper one. Every condition is divided by the sum of the sizes of its terms.
"""

from __future__ import annotations

from mjwrap.kernels.compilation.jit import from_python
from mjwrap.kernels.optimization.problem import entry


@from_python
def optimality_residuals(pattern, frames, objective, results, residual, sums, sizes):
    """Write the largest scaled residual (T,) of the conditions of every frame; sums, sizes: work space (k,) each."""
    for t in range(residual.shape[0]):
        residual[t] = max(
            _balance_residual(pattern, frames, objective, results, t, sums, sizes),
            _stationarity_residual(pattern, frames, objective, results, t),
        )


@from_python
def _balance_residual(pattern, frames, objective, results, t, sums, sizes):
    """Return the largest residual of A a + r = b and of y = r / ρ in frame t, each over the sum of its terms."""
    rows, worst = sums.shape[0], 0.0
    for i in range(rows):
        reserve, wanted = results.reserve[t, i], frames.wanted[t, i]
        sums[i], sizes[i] = reserve - wanted, abs(reserve) + abs(wanted)
    for m in range(objective.weights.shape[0]):
        for e in range(pattern.start[m], pattern.start[m + 1]):
            moment = entry(pattern, frames, t, m, e) * results.activation[t, m]
            sums[pattern.row[e]] += moment
            sizes[pattern.row[e]] += abs(moment)
    for i in range(rows):
        if sizes[i] > 0.0:
            worst = max(worst, abs(sums[i]) / sizes[i])
            off = abs(results.dual[t, i] - objective.stiffness[i] * results.reserve[t, i])
            worst = max(worst, off / (objective.stiffness[i] * sizes[i] + abs(results.dual[t, i]) + 1e-300))
    return worst


@from_python
def _stationarity_residual(pattern, frames, objective, results, t):
    """Return the largest residual of the condition on an activation in frame t, over the sum of its terms."""
    worst = 0.0
    for m in range(objective.weights.shape[0]):
        a, low, high = results.activation[t, m], frames.low[t, m], frames.high[t, m]
        pull = objective.weights[m] * a
        size = abs(pull)
        for e in range(pattern.start[m], pattern.start[m + 1]):
            i = pattern.row[e]
            part = objective.stiffness[i] * entry(pattern, frames, t, m, e) * results.dual[t, i]
            pull -= part
            size += abs(part)
        outside = max(low - a, a - high, 0.0)
        worst = max(worst, outside / (abs(low) + abs(high) + 1e-300))
        wrong = pull
        if a <= low:
            wrong = min(pull, 0.0)
        if a >= high:
            wrong = 0.0 if a <= low else max(pull, 0.0)
        if size > 0.0:
            worst = max(worst, abs(wrong) / size)
    return worst
