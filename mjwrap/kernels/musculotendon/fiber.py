"""What the laws with a fibre have in common: pennation, tension under a rigid tendon, and with an elastic tendon the
static equilibrium, one backward Euler step of the fibre length, and the fibre velocity that balances a state.

F_max f_T(l_T / l_s) = F_max (a f_al f_v + f_pe + β v) cos α, with the fibre at constant height h = l_o sin α_0, so that
l_T = l − p, p² = l_M² − h², cos α = p / l_M. A tendon cannot push: f_T is zero below the slack length, whatever a law's
curve says.
SI units at the border; inside, lengths in l_o, velocities in v_max l_o, forces in F_max.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.musculotendon.dispatch import length_curves, tendon_curve, velocity_curve
from mjwrap.kernels.musculotendon.equilibrium import (
    AT_MINIMUM,
    CLOSE,
    MOST,
    NORMAL,
    SLACK_TENDON,
    balance,
    balancing_velocity,
    rest_imbalance,
)
from mjwrap.kernels.musculotendon.third_order_step import advance_third_order

# Columns of params: F_max [N], l_o [m], l_s [m], pennation at l_o [rad], v_max [l_o/s], fibre damping [F_max per v_max
# l_o], 1 where the tendon is elastic, fibre height [m], shortest fibre length [m].
F_MAX, OPTIMAL, SLACK, PENNATION, V_MAX, DAMPING, ELASTIC, HEIGHT, LEAST = range(9)

EXACT = 1e-8  # last Newton step of `fiber_rate` for a velocity [v_max]: the error left is its square
SPACING = 0.02  # [l_o] between looks for the first equilibrium
FAR = 2.0  # [l_o] beyond which passive force alone grows: there is one equilibrium at most


# ------------------------------------------------------------------------------------- forces, SI units


@jit
def fiber_force(law, params, m, activation, fiber, fiber_speed):
    """Return the force of fibres along the tendon [N] at their length [m] and speed [m/s]; negative where they push."""
    height = params[m, HEIGHT]
    cosine = math.sqrt(max(fiber * fiber - height * height, 0.0)) / fiber
    return cosine * _along_fiber(law, params, m, activation, fiber, fiber_speed)


@jit
def _along_fiber(law, params, m, activation, fiber, fiber_speed):
    optimal = params[m, OPTIMAL]
    v = fiber_speed / (params[m, V_MAX] * optimal)
    active, _, passive, _ = length_curves(law, fiber / optimal)
    speed, _ = velocity_curve(law, v)
    activation = min(max(activation, 0.0), 1.0)
    return params[m, F_MAX] * (activation * active * speed + passive + params[m, DAMPING] * v)


@jit
def tendon_force(law, params, m, length, fiber):
    """Return the tension of an elastic tendon [N] beside a fibre of a given length [m], zero where it is slack."""
    height = params[m, HEIGHT]
    along = math.sqrt(max(fiber * fiber - height * height, 0.0))
    force, _ = tendon_curve(law, (length - along) / params[m, SLACK])
    return params[m, F_MAX] * force


@jit
def rigid_fiber(params, m, length):
    """Return the fibre length [m] beside a rigid tendon; its height where the unit is shorter than its tendon."""
    along = max(length - params[m, SLACK], 0.0)
    height = params[m, HEIGHT]
    return math.sqrt(along * along + height * height)


@jit
def rigid_tension(law, params, m, activation, length, speed):
    """Return the tension [N] with a rigid tendon and constant fibre height.

    No tension where the unit is shorter than its tendon, nor where the model's force would be negative (fast
    shortening of a passive, damped fibre): a tendon cannot push.
    """
    along = length - params[m, SLACK]
    if along <= 0.0:
        return 0.0
    fiber = rigid_fiber(params, m, length)
    cosine = along / fiber
    return max(cosine * _along_fiber(law, params, m, activation, fiber, speed * cosine), 0.0)


@jit
def advance_fiber(law, params, m, activation, length, fiber, duration):
    """Return fibre length [m], tension [N], evaluations and status after one backward Euler step of `duration` [s].

    activation and length [m] are those at the end of the step, where tendon and fibre balance to 1e-8 F_max; fiber [m]
    is the length at its beginning. With duration 0 the fibre stays as it is, and the tension is its tendon's.
    """
    if params[m, ELASTIC] == 0.0 or duration <= 0.0:
        return _at_once(law, params, m, activation, length, fiber, duration)
    optimal, slack = params[m, OPTIMAL], params[m, SLACK]
    height, least = params[m, HEIGHT] / optimal, params[m, LEAST] / optimal
    before = max(fiber / optimal, least)
    x, pull, count, status = balance(
        law, min(max(activation, 0.0), 1.0), params[m, DAMPING], height, optimal / slack, length / slack,
        before, 1.0 / (duration * params[m, V_MAX]), least, max(_taut(params, m, length), before), before, CLOSE,
    )  # fmt: skip
    return x * optimal, pull * params[m, F_MAX], count, status


@jit
def step_fiber(
    law,
    params,
    m,
    activation_before,
    activation,
    activation_rate,
    length_before,
    length,
    speed,
    fiber,
    duration,
):
    """Return what `advance_fiber` does, after a step of third order.

    activation, its rate [1/s], length [m] and speed [m/s], of the unit's lengthening, are those at the end of the step,
    the others those at its beginning. Method: `third_order_step.py`.
    """
    if params[m, ELASTIC] == 0.0 or duration <= 0.0:
        return _at_once(law, params, m, activation, length, fiber, duration)
    optimal, slack, damping = params[m, OPTIMAL], params[m, SLACK], params[m, DAMPING]
    height, least = params[m, HEIGHT] / optimal, params[m, LEAST] / optimal
    start = max(fiber / optimal, least)
    activation_before = min(max(activation_before, 0.0), 1.0)
    activation = min(max(activation, 0.0), 1.0)
    unit = (law, activation, damping, height, optimal / slack, length / slack)
    gains = (activation - activation_before, (length - length_before) / slack)
    pace = (duration * activation_rate, duration * speed / slack)
    x, pull, count, status = advance_third_order(
        unit, gains, pace, start, least, max(_taut(params, m, length), start), duration * params[m, V_MAX]
    )
    return x * optimal, pull * params[m, F_MAX], count, status


@jit
def _taut(params, m, length):
    """Return the fibre length [l_o] at which the tendon is just as long as when slack."""
    along = max(length - params[m, SLACK], 0.0)
    height = params[m, HEIGHT]
    return math.sqrt(along * along + height * height) / params[m, OPTIMAL]


@jit
def _at_once(law, params, m, activation, length, fiber, duration):
    """Return what `advance_fiber` does where there is nothing to solve: a rigid tendon, or no time."""
    if params[m, ELASTIC] != 0.0:
        pull = tendon_force(law, params, m, length, fiber)
        return fiber, pull, 0, NORMAL if pull > 0.0 else SLACK_TENDON
    new = rigid_fiber(params, m, length)
    if length <= params[m, SLACK]:
        return new, 0.0, 0, SLACK_TENDON
    v = (new - fiber) / duration if duration > 0.0 else 0.0
    return new, max(fiber_force(law, params, m, activation, new, v), 0.0), 0, NORMAL


@jit
def equilibrium(law, params, m, activation, length):
    """Return the fibre length [m] at which a fibre at rest balances its tendon, evaluations and status.

    Past about 1.2 optimal lengths there can be several; this is the shortest, which the fibre comes to from slack.
    Where the fibre pulls more than the tendon at its minimum length already, it is that.
    """
    if params[m, ELASTIC] == 0.0:
        return rigid_fiber(params, m, length), 0, NORMAL if length > params[m, SLACK] else SLACK_TENDON
    optimal, slack = params[m, OPTIMAL], params[m, SLACK]
    height, low = params[m, HEIGHT] / optimal, params[m, LEAST] / optimal
    ratio, reach = optimal / slack, length / slack
    activation = min(max(activation, 0.0), 1.0)
    along = max(length - slack, 0.0) / optimal
    high = math.sqrt(along * along + height * height)
    off, slope = rest_imbalance(law, activation, height, ratio, reach, low)
    if off <= 0.0 or high <= low:
        return low * optimal, 1, AT_MINIMUM if off < 0.0 else SLACK_TENDON
    count = 1
    while low < high:
        new = min(low + SPACING, high) if low < FAR else high
        off, d_new = rest_imbalance(law, activation, height, ratio, reach, new)
        count += 1
        if off > 0.0 and slope < 0.0 and d_new > 0.0:
            new, off, more = _lowest(law, activation, height, ratio, reach, low, new)
            count += more
        if off <= 0.0:
            break
        low, slope = new, d_new
    else:
        return high * optimal, count, NORMAL  # rounding at the slack length itself
    x, _, more, status = balance(
        law, activation, 0.0, height, ratio, reach, low, 0.0, low, new, 0.5 * (low + new), 0.0
    )
    return x * optimal, count + more, status


@jit
def _lowest(law, activation, height, ratio, reach, low, high):
    """Return where between low and high the imbalance is least, or no more than zero, its value, and evaluations."""
    middle, off = low, 1.0
    count = 0
    while count < MOST and high - low > 1e-12:
        middle = 0.5 * (low + high)
        off, slope = rest_imbalance(law, activation, height, ratio, reach, middle)
        count += 1
        if off <= 0.0:
            break
        if slope < 0.0:
            low = middle
        else:
            high = middle
    return middle, off, count


@jit
def fiber_rate(law, params, m, activation, length, fiber):
    """Return the fibre velocity [m/s] that balances an elastic tendon at a fibre length [m]: the explicit equation.

    At its minimum length and below, a fibre does not shorten. Without damping and force there is no such velocity;
    a bound of 100 maximum contraction velocities stands for it.
    """
    optimal, slack, damping = params[m, OPTIMAL], params[m, SLACK], params[m, DAMPING]
    activation = min(max(activation, 0.0), 1.0)
    x, height = fiber / optimal, params[m, HEIGHT] / optimal
    along = math.sqrt(max(x * x - height * height, 0.0))
    pull, _ = tendon_curve(law, (length - along * optimal) / slack)
    active, _, passive, _ = length_curves(law, x)
    wanted = pull * x / along - passive if along > 0.0 else math.inf  # at a right angle
    v, _, _ = balancing_velocity(law, activation * active, damping, wanted, EXACT)
    if fiber <= params[m, LEAST] and v < 0.0:
        return 0.0
    return v * params[m, V_MAX] * optimal
