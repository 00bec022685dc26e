"""The fibre and its tendon, for all laws that have them: pennation, tension with a rigid tendon, and with an elastic
tendon the static equilibrium, a step of the fibre length, and the fibre velocity at which fibre and tendon balance.

F_max f_T(l_T / l_s) = F_max (a f_al f_v + f_pe + β v) cos α, with the fibre at constant height h = l_o sin α_0, so that
l_T = l − p, p² = l_M² − h², cos α = p / l_M. A tendon cannot push: f_T is zero below the slack length, also where a
law's own curve is not.
SI units at the border; inside, lengths in l_o, velocities in v_max l_o, forces in F_max.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import from_python, jit
from mjwrap.kernels.musculotendon.dispatch import (
    CURVES,
    curve_set,
    length_curves,
    tendon_curve,
    velocity_force,
)
from mjwrap.kernels.musculotendon.equilibrium import (
    AT_MINIMUM,
    MAX_EVALUATIONS,
    NEAR_BALANCE,
    NORMAL,
    SLACK_TENDON,
    balance,
    balancing_velocity,
    rest_imbalance,
)
from mjwrap.kernels.musculotendon.third_order_step import advance_third_order

# Columns of params: F_max [N], l_o [m], l_s [m], pennation at l_o [rad], v_max [l_o/s], fibre damping [F_max per v_max
# l_o], 1 where the tendon is elastic, fibre height [m], shortest fibre length [m]; CURVES of `dispatch.py`; the least
# activation, which a smaller one counts as.
F_MAX, OPTIMAL, SLACK, PENNATION, V_MAX, DAMPING, ELASTIC, HEIGHT, LEAST = range(9)
MIN_ACTIVATION = CURVES + 1

# [v_max] largest last Newton step of `fiber_rate` for a velocity; the error that is left is its square
LAST_VELOCITY_STEP = 1e-8
# [l_o] distance of the fibre lengths at which `equilibrium` looks for the first change of sign
ROOT_SPACING = 0.02
# [l_o] fibre length from which only the passive force grows: at most one equilibrium is left
SINGLE_ROOT = 2.0


# ------------------------------------------------------------------------------------- forces, SI units


@from_python
def held_activation(params, m, activation):
    """Return the activation within the least one of muscle m and 1."""
    return min(max(activation, params[m, MIN_ACTIVATION]), 1.0)


@jit
def fiber_force(law, params, m, activation, fiber, fiber_speed):
    """Return the fibre force along the tendon [N] from fibre length [m] and speed [m/s]; negative where it pushes."""
    height = params[m, HEIGHT]
    cosine = math.sqrt(max(fiber * fiber - height * height, 0.0)) / fiber
    return cosine * _along_fiber(law, params, m, activation, fiber, fiber_speed)


@jit
def _along_fiber(law, params, m, activation, fiber, fiber_speed):
    """Return the fibre force along the fibre [N]; arguments as of `fiber_force`."""
    active, elastic, damped = _parts_along_fiber(law, params, m, activation, fiber, fiber_speed)
    return params[m, F_MAX] * (active + elastic + damped)


@jit
def _parts_along_fiber(law, params, m, activation, fiber, fiber_speed):
    """Return the active, the passive elastic and the damping force along the fibre [F_max]; see `fiber_force`."""
    optimal = params[m, OPTIMAL]
    v = fiber_speed / (params[m, V_MAX] * optimal)
    curves = curve_set(law, params, m)
    active, _, passive, _ = length_curves(curves, fiber / optimal)
    activation = held_activation(params, m, activation)
    speed, _, _ = velocity_force(curves, activation, v)
    return activation * active * speed, passive, params[m, DAMPING] * v


@jit
def tendon_force(law, params, m, length, fiber):
    """Return the tension of an elastic tendon [N] from the lengths of unit and fibre [m]; zero where it is slack."""
    height = params[m, HEIGHT]
    along = math.sqrt(max(fiber * fiber - height * height, 0.0))
    force, _ = tendon_curve(curve_set(law, params, m), (length - along) / params[m, SLACK])
    return params[m, F_MAX] * force


@jit
def rigid_fiber(params, m, length):
    """Return the fibre length [m] with a rigid tendon; the fibre height where the unit is shorter than its tendon."""
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
def rigid_force_parts(law, params, m, activation, length, speed):
    """Return active and passive force along the tendon [N], whose sum is `rigid_tension` where that is positive.

    The passive force, elastic and damping, may be negative. Both are zero where the unit is shorter than its tendon.
    """
    along = length - params[m, SLACK]
    if along <= 0.0:
        return 0.0, 0.0
    fiber = rigid_fiber(params, m, length)
    cosine = along / fiber
    active, elastic, damped = _parts_along_fiber(law, params, m, activation, fiber, speed * cosine)
    scale = cosine * params[m, F_MAX]
    return scale * active, scale * (elastic + damped)


@jit
def advance_fiber(law, params, m, activation, length, fiber, duration):
    """Return fibre length [m], tension [N], evaluations and status after one backward Euler step of `duration` [s].

    activation and length [m] are those at the end of the step, where tendon and fibre balance to 1e-8 F_max; fiber [m]
    is the fibre length at the beginning. With duration 0 the fibre length stays, and the tension is the tendon's.
    """
    if params[m, ELASTIC] == 0.0 or duration <= 0.0:
        return _step_without_solving(law, params, m, activation, length, fiber, duration)
    optimal, slack = params[m, OPTIMAL], params[m, SLACK]
    height, least = params[m, HEIGHT] / optimal, params[m, LEAST] / optimal
    before = max(fiber / optimal, least)
    high = max(_fiber_at_slack_length(params, m, length), before)
    x, pull, count, status = balance(
        curve_set(law, params, m), held_activation(params, m, activation), params[m, DAMPING], height,
        optimal / slack, length / slack, before, 1.0 / (duration * params[m, V_MAX]), least, high, before, NEAR_BALANCE,
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
    """Return fibre length [m], tension [N], evaluations and status after one step of third order.

    activation, its rate [1/s], the unit's length [m] and lengthening speed [m/s] are those at the end of the step;
    activation_before, length_before and fiber are those at its beginning. Method: `third_order_step.py`.
    """
    if params[m, ELASTIC] == 0.0 or duration <= 0.0:
        return _step_without_solving(law, params, m, activation, length, fiber, duration)
    optimal, slack, damping = params[m, OPTIMAL], params[m, SLACK], params[m, DAMPING]
    height, least = params[m, HEIGHT] / optimal, params[m, LEAST] / optimal
    start = max(fiber / optimal, least)
    activation_before = held_activation(params, m, activation_before)
    activation = held_activation(params, m, activation)
    unit = (curve_set(law, params, m), activation, damping, height, optimal / slack, length / slack)
    increments = (activation - activation_before, (length - length_before) / slack)
    end_rates = (duration * activation_rate, duration * speed / slack)
    high = max(_fiber_at_slack_length(params, m, length), start)
    x, pull, count, status = advance_third_order(
        unit, increments, end_rates, start, least, high, duration * params[m, V_MAX]
    )
    return x * optimal, pull * params[m, F_MAX], count, status


@jit
def _fiber_at_slack_length(params, m, length):
    """Return the fibre length [l_o] at which the tendon has its slack length."""
    along = max(length - params[m, SLACK], 0.0)
    height = params[m, HEIGHT]
    return math.sqrt(along * along + height * height) / params[m, OPTIMAL]


@jit
def _step_without_solving(law, params, m, activation, length, fiber, duration):
    """Return what `advance_fiber` does where there is no equation to solve: a rigid tendon, or a duration of 0."""
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

    Beyond about 1.2 optimal lengths there can be several; the shortest is returned, which a fibre reaches from a slack
    tendon. Where the fibre pulls more than the tendon even at its minimum length, the minimum length is returned.
    """
    if params[m, ELASTIC] == 0.0:
        return rigid_fiber(params, m, length), 0, NORMAL if length > params[m, SLACK] else SLACK_TENDON
    optimal, slack = params[m, OPTIMAL], params[m, SLACK]
    height, low = params[m, HEIGHT] / optimal, params[m, LEAST] / optimal
    ratio, unit_length = optimal / slack, length / slack
    activation = held_activation(params, m, activation)
    curves = curve_set(law, params, m)
    along = max(length - slack, 0.0) / optimal
    high = math.sqrt(along * along + height * height)
    off, slope = rest_imbalance(curves, activation, height, ratio, unit_length, low)
    if off <= 0.0 or high <= low:
        return low * optimal, 1, AT_MINIMUM if off < 0.0 else SLACK_TENDON
    count = 1
    while low < high:
        new = min(low + ROOT_SPACING, high) if low < SINGLE_ROOT else high
        off, d_new = rest_imbalance(curves, activation, height, ratio, unit_length, new)
        count += 1
        if off > 0.0 and slope < 0.0 and d_new > 0.0:
            new, off, more = _lowest(curves, activation, height, ratio, unit_length, low, new)
            count += more
        if off <= 0.0:
            break
        low, slope = new, d_new
    else:
        return high * optimal, count, NORMAL  # rounding at the slack length itself
    x, _, more, status = balance(
        curves, activation, 0.0, height, ratio, unit_length, low, 0.0, low, new, 0.5 * (low + new), 0.0
    )
    return x * optimal, count + more, status


@jit
def _lowest(law, activation, height, ratio, unit_length, low, high):
    """Return a fibre length in [low, high] at which the imbalance is at most zero, or else the one where it is least.

    Returns (fibre length [l_o], imbalance [F_max], evaluations).
    """
    middle, off = low, 1.0
    count = 0
    while count < MAX_EVALUATIONS and high - low > 1e-12:
        middle = 0.5 * (low + high)
        off, slope = rest_imbalance(law, activation, height, ratio, unit_length, middle)
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
    """Return the fibre velocity [m/s] at which the fibre balances an elastic tendon, at a fibre length [m].

    At its minimum length and below, a fibre does not shorten. Without damping and active force no velocity balances;
    the bound of 100 maximum contraction velocities is returned.
    """
    optimal, slack, damping = params[m, OPTIMAL], params[m, SLACK], params[m, DAMPING]
    activation = held_activation(params, m, activation)
    curves = curve_set(law, params, m)
    x, height = fiber / optimal, params[m, HEIGHT] / optimal
    along = math.sqrt(max(x * x - height * height, 0.0))
    pull, _ = tendon_curve(curves, (length - along * optimal) / slack)
    active, _, passive, _ = length_curves(curves, x)
    wanted = pull * x / along - passive if along > 0.0 else math.inf  # at a right angle
    v, _, _, _ = balancing_velocity(
        curves, activation, activation * active, damping, wanted, LAST_VELOCITY_STEP
    )
    if fiber <= params[m, LEAST] and v < 0.0:
        return 0.0
    return v * params[m, V_MAX] * optimal
