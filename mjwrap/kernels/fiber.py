"""What the laws with a fibre have in common: pennation, tension under a rigid tendon, and with an elastic tendon the
static equilibrium, one backward Euler step of the fibre length, and the fibre velocity that balances a state.

F_max f_T(l_T / l_s) = F_max (a f_al f_v + f_pe + β v) cos α, with the fibre at constant height h = l_o sin α_0, so that
l_T = l − p, p² = l_M² − h², cos α = p / l_M. A tendon cannot push: f_T is zero below the slack length, whatever a law's
curve says.
SI units at the border; inside, lengths in l_o, velocities in v_max l_o, forces in F_max.
"""

from __future__ import annotations

import math

from mjwrap.kernels import degroote_fregly, millard
from mjwrap.kernels._jit import jit

# Columns of params: F_max [N], l_o [m], l_s [m], pennation at l_o [rad], v_max [l_o/s], fibre damping [F_max per v_max
# l_o], 1 where the tendon is elastic, fibre height [m], shortest fibre length [m].
F_MAX, OPTIMAL, SLACK, PENNATION, V_MAX, DAMPING, ELASTIC, HEIGHT, LEAST = range(9)
MILLARD = millard.CODE

NORMAL = 0
AT_MINIMUM = 1  # the fibre is at its minimum length, and does not balance the tendon
SLACK_TENDON = 2  # no tension; the fibre's own force is zero too
NOT_CONVERGED = 3

MOST = 60  # evaluations in one solution; a step of a simulation takes two to six
CLOSE = 1e-6  # [F_max] imbalance from which one more Newton step ends far below 1e-8
LOOSE = 1e-2  # [F_max] the same for a first estimate
STRAINED = 1.08  # [l_s] tendon length from which at most the iteration starts
STEEP, OFFSET = (
    0.2,
    0.2,
)  # [F_max] imbalance above which an exponential tendon is taken by its logarithm; its offset
FASTEST = 100.0  # [v_max l_o] bound of a fibre velocity that nothing resists
SPACING = 0.02  # [l_o] between looks for the first equilibrium
FAR = 2.0  # [l_o] beyond which passive force alone grows: there is one equilibrium at most


# ------------------------------------------------------------------------------- a law's curves, by code


@jit
def length_curves(law, x):
    """Return the active force-length curve, its slope, the passive one and its slope at fibre length x [l_o]."""
    if law == MILLARD:
        active, d_active = millard.active(x)
        passive, d_passive = millard.passive(x)
    else:
        active, d_active = degroote_fregly.active(x)
        passive, d_passive = degroote_fregly.passive(x)
    return active, d_active, passive, d_passive


@jit
def velocity_curve(law, v):
    """Return the force-velocity curve and its slope at fibre velocity v [v_max l_o]."""
    if law == MILLARD:
        return millard.velocity(v)
    return degroote_fregly.velocity(v)


@jit
def inverse_velocity(law, force):
    """Return the fibre velocity [v_max l_o] at which the force-velocity curve has a value."""
    if law == MILLARD:
        return millard.inverse_velocity(force)
    return degroote_fregly.inverse_velocity(force)


@jit
def tendon_curve(law, x):
    """Return the tendon's force [F_max] and its slope at tendon length x [l_s]: both zero where it is slack."""
    if x <= 1.0:
        return 0.0, 0.0
    if law == MILLARD:
        return millard.tendon(x)
    return degroote_fregly.tendon(x)


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


# --------------------------------------------------------------------------- balance of tendon and fibre


@jit
def forces(law, activation, damping, height, ratio, reach, x, before, rate):
    """Return forces [F_max] and slopes: the tendon's, its slope in x, the fibre's along the tendon, its slope in x, the
    tendon's slope in its length [l_s], the fibre's in activation and in velocity [v_max l_o].

    height, x, before [l_o]: fibre height, length now and before; ratio l_o / l_s; reach: unit's length [l_s];
    rate: one over (v_max x duration), zero where the fibre is at rest. x must be above height.
    """
    along = math.sqrt(x * x - height * height)
    cosine = along / x
    pull, stiffness = tendon_curve(law, reach - ratio * along)
    active, d_active, passive, d_passive = length_curves(law, x)
    v = (x - before) * rate
    speed, d_speed = velocity_curve(law, v)
    force = activation * active * speed + passive + damping * v
    slope = activation * (d_active * speed + active * d_speed * rate) + d_passive + damping * rate
    turning = force * height * height / (along * x * x)
    drag = (activation * active * d_speed + damping) * cosine
    return (
        pull, -stiffness * ratio / cosine, force * cosine, slope * cosine + turning,
        stiffness, active * speed * cosine, drag,
    )  # fmt: skip


@jit
def rest_imbalance(law, activation, height, ratio, reach, x):
    """Return the tendon's force less that of a fibre at rest [F_max] and the slope in x; arguments as of `forces`."""
    pull, d_pull, force, d_force, _, _, _ = forces(law, activation, 0.0, height, ratio, reach, x, x, 0.0)
    return pull - force, d_pull - d_force


@jit
def balance(law, activation, damping, height, ratio, reach, before, rate, low, high, start, close):
    """Return the fibre length [l_o] in [low, high] that balances, the tendon's force [F_max], evaluations and status.

    The tendon must pull no less than the fibre at `low`, else the fibre rests there, and no more at `high`. Newton's
    steps from `start`, kept in a bracket that every evaluation narrows. A step taken within `close` [F_max] of balance
    is the last, unless it crosses the tendon's slack length, where the slope jumps; with close zero the steps end at
    rounding.
    """
    least, x, pull = low, start, 0.0
    low_known = high_known = False
    along = max(reach - 1.0, 0.0) / ratio
    slack = math.sqrt(along * along + height * height)  # at this fibre length the tendon begins to pull
    along = max(reach - STRAINED, 0.0) / ratio
    strained = min(max(math.sqrt(along * along + height * height), low), high)
    x = max(x, strained)
    for k in range(1, MOST + 1):
        pull, d_pull, force, d_force, _, _, _ = forces(
            law, activation, damping, height, ratio, reach, x, before, rate
        )
        off, slope = pull - force, d_pull - d_force
        if off <= 0.0 and x <= least:
            return least, pull, k, AT_MINIMUM
        step = -off / slope if slope < 0.0 else 0.0
        if off > STEEP and law != MILLARD and force >= 0.0:
            # the tendon's exponential outweighs all else: the logarithms of both forces are nearly straight
            bend = d_pull / (pull + OFFSET) - d_force / (force + OFFSET)
            step = -math.log((pull + OFFSET) / (force + OFFSET)) / bend if bend < 0.0 else 0.0
        new = x + step
        if abs(step) <= 1e-15 * x and abs(off) <= CLOSE:
            return x, pull, k, SLACK_TENDON if pull == 0.0 else NORMAL
        if abs(off) <= close and slope < 0.0 and new > least and (x < slack) == (new < slack):
            pull = max(pull + d_pull * step, 0.0)
            return new, pull, k, SLACK_TENDON if pull == 0.0 else NORMAL
        if off > 0.0:
            low, low_known = x, True
        else:
            high, high_known = x, True
        if step == 0.0 or (new <= low and low_known) or (new >= high and high_known):
            new = 0.5 * (low + high)
        new = min(max(new, low if x <= strained else max(low, strained)), high)
        if new == x:  # the bracket has no number inside
            return x, pull, k, SLACK_TENDON if pull == 0.0 else NORMAL
        x = new
    return x, pull, MOST, NOT_CONVERGED


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
    the others those at its beginning. The fibre's velocity v there and its rate w satisfy
    l − 2/3 d v + d² w / 6 = fiber + 1/3 d v_before, with d the duration, v_before the velocity that balances at the
    beginning, and w = λ v + φ from the balance's derivative by time, λ and φ as of a backward Euler step. A mode λ is
    multiplied by (1 + z/3) / (1 − 2z/3 + z²/6), z = λ d: L-stable, as Radau's method of third order.
    """
    if params[m, ELASTIC] == 0.0 or duration <= 0.0:
        return _at_once(law, params, m, activation, length, fiber, duration)
    optimal, slack, damping, fastest = (
        params[m, OPTIMAL],
        params[m, SLACK],
        params[m, DAMPING],
        params[m, V_MAX],
    )
    height, least = params[m, HEIGHT] / optimal, params[m, LEAST] / optimal
    ratio, reach = optimal / slack, length / slack
    activation = min(max(activation, 0.0), 1.0)
    before = max(fiber / optimal, least)
    taut = _taut(params, m, length)
    span = duration * fastest
    v = fiber_rate(law, params, m, activation_before, length_before, before * optimal) / (fastest * optimal)
    x, pull, count, status = balance(
        law,
        activation,
        damping,
        height,
        ratio,
        reach,
        before,
        1.0 / span,
        least,
        max(taut, before),
        before,
        LOOSE,
    )
    if status != AT_MINIMUM and status != NOT_CONVERGED:
        _, d_pull, _, d_force, stiffness, strength, drag = forces(
            law, activation, damping, height, ratio, reach, x, before, 1.0 / span
        )
        if drag > 0.0:
            growth = min(span * (d_pull - d_force) / drag + 1.0, 1.0)  # λ duration
            forcing = (stiffness * speed / slack - strength * activation_rate) / drag
            before += span * (v / 3.0 - duration * forcing / 6.0)
            rate = 1.0 / (span * (2.0 / 3.0 - growth / 6.0))
            x, pull, more, status = balance(
                law,
                activation,
                damping,
                height,
                ratio,
                reach,
                before,
                rate,
                least,
                max(taut, before),
                x,
                CLOSE,
            )
            count += more + 1
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
    if high <= low:
        return low * optimal, 0, SLACK_TENDON
    off, slope = rest_imbalance(law, activation, height, ratio, reach, low)
    if off <= 0.0:
        return low * optimal, 1, AT_MINIMUM
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
    strength = activation * active
    wanted = pull * x / along - passive if along > 0.0 else math.inf  # at a right angle
    v = _balancing_velocity(law, strength, damping, wanted)
    if fiber <= params[m, LEAST] and v < 0.0:
        return 0.0
    return v * params[m, V_MAX] * optimal


@jit
def _balancing_velocity(law, strength, damping, wanted):
    """Return v with strength f_v(v) + damping v = wanted, kept within a bound."""
    if damping == 0.0 and strength == 0.0:
        return FASTEST if wanted > 0.0 else (-FASTEST if wanted < 0.0 else 0.0)
    low, high, v = -FASTEST, FASTEST, 0.0
    if damping == 0.0:
        v = inverse_velocity(law, wanted / strength)
        return min(max(v, low), high)
    for _ in range(2 * MOST):
        force, slope = velocity_curve(law, v)
        off = wanted - strength * force - damping * v
        if off > 0.0:
            low = v
        else:
            high = v
        slope = strength * slope + damping
        new = v + off / slope if slope > 0.0 else math.inf
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - v) <= 1e-15 * (1.0 + abs(v)):
            return new
        v = new
    return v
