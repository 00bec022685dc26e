"""Newton's method on the dual of the problem in `problem.py`.

With y the multipliers of the constraints over ρ and c_m the muscles' columns of A / ρ, the optimum is
a = clip(z, low, high) with z_m = c_mᵀ y / w_m, and y solves y + Σ c_m a_m = b / ρ: as many equations as moments,
piecewise linear, the gradient of a convex function. A step of Newton's method keeps the muscles at a bound that are
there; where the dual function would rise along a step, `line_search.py` shortens it. So but for rounding every frame
ends after finitely many steps. y and z are both kept and changed by increments: z computed anew from a large y would
lose digits by cancellation.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import from_python, jit
from mjwrap.kernels.optimization import cholesky, lu
from mjwrap.kernels.optimization.line_search import step_length
from mjwrap.kernels.optimization.problem import NON_FINITE, NOT_CONVERGED, SOLVED, entry

TOLERANCE = 1e-13  # of a residual over the sum of its terms, where a frame ends
ENOUGH = 1e-11  # of the same, if no step makes it smaller
MAX_ITERATIONS = 200
SMALL_PIVOT = 1e-10  # share of a diagonal element below which `lu.py` replaces `cholesky.py`


@from_python
def solve_frames(pattern, frames, objective, results, work):
    """Solve all frames, each from the last one's dual; the first from zero."""
    for t in range(results.status.shape[0]):
        dual = results.dual[t]
        for i in range(dual.shape[0]):
            warm = t > 0 and results.status[t - 1] == SOLVED
            dual[i] = results.dual[t - 1, i] if warm else 0.0
        status, count = SOLVED, 0
        if _scale(pattern, frames, objective, t, work):
            status, count = _solve_frame(pattern, frames.low[t], frames.high[t], objective, dual, work)
        else:
            status = NON_FINITE
        results.status[t], results.iterations[t] = status, count
        _write(pattern, frames, t, results, work)


@jit
def _scale(pattern, frames, objective, t, work):
    """Write A / ρ and b / ρ of frame t; return whether they are finite."""
    total = 0.0
    for m in range(objective.weights.shape[0]):
        for e in range(pattern.start[m], pattern.start[m + 1]):
            work.scaled[e] = entry(pattern, frames, t, m, e) * objective.stiffness[pattern.row[e]]
            total += abs(work.scaled[e])
    for i in range(objective.stiffness.shape[0]):
        work.load[i] = frames.wanted[t, i] * objective.stiffness[i]
        total += abs(work.load[i])
    return math.isfinite(total)


@jit
def _write(pattern, frames, t, results, work):
    """Write activations of frame t, and the reserves that balance them."""
    activation, reserve = results.activation[t], results.reserve[t]
    for i in range(reserve.shape[0]):
        reserve[i] = frames.wanted[t, i]
    for m in range(activation.shape[0]):
        a = min(max(work.target[m], frames.low[t, m]), frames.high[t, m])
        activation[m] = a
        for e in range(pattern.start[m], pattern.start[m + 1]):
            reserve[pattern.row[e]] -= entry(pattern, frames, t, m, e) * a


@jit
def _solve_frame(pattern, low, high, objective, dual, work):
    """Solve one frame from a dual; return status and iterations."""
    weights, target = objective.weights, work.target
    _set_targets(pattern, work.scaled, weights, dual, target)
    error = math.inf
    fresh = True
    for iteration in range(MAX_ITERATIONS):
        before = error
        error = _residual(pattern, low, high, dual, work)
        settled = error <= TOLERANCE or (error <= ENOUGH and error >= 0.5 * before)
        if settled and (fresh or not _drifted(pattern, weights, dual, work)):
            return SOLVED, iteration
        if settled:
            _set_targets(pattern, work.scaled, weights, dual, target)
            fresh, error = True, math.inf
            _residual(pattern, low, high, dual, work)
        if not _newton_step(pattern, low, high, weights, work, iteration > MAX_ITERATIONS // 4):
            break
        falling = square = 0.0
        for i in range(dual.shape[0]):
            falling -= work.step[i] * work.residual[i]
            square += work.step[i] * work.step[i]
        if not falling < 0.0:
            break
        share = step_length(weights, low, high, target, work.target_step, falling, square)
        for i in range(dual.shape[0]):
            dual[i] += share * work.step[i]
        for m in range(target.shape[0]):
            target[m] += share * work.target_step[m]
        fresh = False
    error = _residual(pattern, low, high, dual, work)
    return SOLVED if error <= ENOUGH else NOT_CONVERGED, MAX_ITERATIONS


@jit
def _set_targets(pattern, scaled, weights, dual, target):
    """Write cᵀy / w of all muscles."""
    for m in range(weights.shape[0]):
        total = 0.0
        for e in range(pattern.start[m], pattern.start[m + 1]):
            total += scaled[e] * dual[pattern.row[e]]
        target[m] = total / weights[m]


@jit
def _drifted(pattern, weights, dual, work):
    """Return whether the targets differ from cᵀy / w by more than its rounding."""
    for m in range(weights.shape[0]):
        off = weights[m] * work.target[m]
        size = abs(off)
        for e in range(pattern.start[m], pattern.start[m + 1]):
            part = work.scaled[e] * dual[pattern.row[e]]
            off -= part
            size += abs(part)
        if abs(off) > TOLERANCE * size:
            return True
    return False


@jit
def _residual(pattern, low, high, dual, work):
    """Write b / ρ − y − Σ c a, and return its largest element over the sum of the sizes of its terms."""
    residual, size = work.residual, work.size
    for i in range(dual.shape[0]):
        residual[i] = work.load[i] - dual[i]
        size[i] = abs(work.load[i]) + abs(dual[i])
    for m in range(low.shape[0]):
        a = min(max(work.target[m], low[m]), high[m])
        if a != 0.0:
            for e in range(pattern.start[m], pattern.start[m + 1]):
                moment = work.scaled[e] * a
                residual[pattern.row[e]] -= moment
                size[pattern.row[e]] += abs(moment)
    worst = 0.0
    for i in range(dual.shape[0]):
        if size[i] > 0.0:
            worst = max(worst, abs(residual[i]) / size[i])
    return worst


@jit
def _newton_step(pattern, low, high, weights, work, careful):
    """Write the step of the dual and of the targets for the present free muscles; return whether there is one."""
    count = 0
    for m in range(weights.shape[0]):
        if low[m] <= work.target[m] < high[m]:
            work.free[count] = m
            count += 1
    cholesky.assemble(pattern, work.scaled, weights, work.free, count, work.hessian)
    pivot = 0.0 if careful else cholesky.factorize(pattern.first, work.hessian)
    if pivot > SMALL_PIVOT:
        cholesky.solve(pattern.first, work.hessian, work.residual, work.step)
    elif not lu.solve_augmented(
        pattern, work.scaled, weights, work.free, count, work.residual, work.matrix, work.step
    ):
        return False
    _set_targets(pattern, work.scaled, weights, work.step, work.target_step)
    return True
