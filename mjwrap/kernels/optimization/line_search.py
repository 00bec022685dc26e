"""How far to go along a Newton step on the dual.

The dual function is convex and piecewise quadratic along a step: its derivative is piecewise linear and increases.
"""

from __future__ import annotations

from mjwrap.kernels.compilation.jit import jit

SUFFICIENT = 0.05  # share of the derivative at the start that may be left
MAX_EVALUATIONS = 60


@jit
def derivative(weights, low, high, target, target_step, at_start, square, t):
    """Return the dual function's derivative along a step at the share t of it, and the derivative's slope there.

    at_start: the derivative at t = 0; square: that of the dual's step.
    """
    value, slope = at_start + t * square, square
    for m in range(weights.shape[0]):
        change = target_step[m]
        if change != 0.0:
            now = target[m] + t * change
            held = min(max(now, low[m]), high[m])
            value += weights[m] * change * (held - min(max(target[m], low[m]), high[m]))
            if held == now:
                slope += weights[m] * change * change
    return value, slope


@jit
def step_length(weights, low, high, target, target_step, at_start, square):
    """Return the share of a step to take, at most 1; arguments as of `derivative`, at_start < 0.

    It is the whole step if the dual function falls all along it, and else a share where its derivative is small.
    """
    left, right, t = 0.0, 1.0, 1.0
    for _ in range(MAX_EVALUATIONS):
        value, slope = derivative(weights, low, high, target, target_step, at_start, square, t)
        if abs(value) <= -SUFFICIENT * at_start or (value < 0.0 and t == 1.0):
            break
        if value < 0.0:
            left = t
        else:
            right = t
        t -= value / slope
        if not left < t < right:
            t = 0.5 * (left + right)
    return t
