"""Which moments no activations within their bounds can give."""

from __future__ import annotations

from mjwrap.kernels.compilation.jit import from_python
from mjwrap.kernels.optimization.problem import entry

MARGIN = 1e-9  # share of all terms by which the wanted moments must exceed what muscles can do


@from_python
def prove_infeasible(pattern, frames, objective, results, infeasible):
    """Write, for every frame (T,), whether its moments b are proved to be out of reach without reserves.

    The multipliers y are the direction of the proof: yᵀ b / ρ is more than the largest Σ a cᵀy within the bounds.
    """
    start, row, stiffness = pattern.start, pattern.row, objective.stiffness
    for t in range(infeasible.shape[0]):
        gap = size = 0.0
        for i in range(stiffness.shape[0]):
            gap += results.dual[t, i] * stiffness[i] * frames.wanted[t, i]
        size += abs(gap)
        for m in range(objective.weights.shape[0]):
            pull = 0.0
            for e in range(start[m], start[m + 1]):
                part = results.dual[t, row[e]] * stiffness[row[e]] * entry(pattern, frames, t, m, e)
                pull += part
                size += abs(part) * max(abs(frames.low[t, m]), abs(frames.high[t, m]))
            gap -= max(pull * frames.low[t, m], pull * frames.high[t, m])
        infeasible[t] = gap > MARGIN * size
