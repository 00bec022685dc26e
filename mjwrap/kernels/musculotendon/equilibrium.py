"""Balance of fibre and tendon: forces and their slopes, and the fibre length or velocity at which they balance.

Lengths in l_o, velocities in v_max l_o, forces in F_max; tendon lengths in l_s. law: what `dispatch.curve_set` returns.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.musculotendon.dispatch import (
    balancing_velocity_force,
    exponential_tendon,
    length_curves,
    longest_start,
    tendon_curve,
    velocity_force,
)

# statuses
NORMAL = 0
AT_MINIMUM = 1  # the fibre is at its minimum length and does not balance the tendon
SLACK_TENDON = 2  # no tension; the fibre force is zero, too
NOT_CONVERGED = 3

MAX_EVALUATIONS = 150  # most evaluations of one solution; a step of a simulation takes two or three
# [F_max] imbalance from which one more Newton step ends far below 1e-8 ...
NEAR_BALANCE = 1e-6
# ... if that step changes the tendon by at most this [l_s]; the curvature of a tendon curve is at most 2e3
LAST_STEP = 1e-6
# [F_max] imbalance above which the step of an exponential tendon is taken in logarithms of the forces ...
LOG_IMBALANCE = 0.2
LOG_OFFSET = 0.2  # [F_max] ... to which this is added
MAX_VELOCITY = 100.0  # [v_max l_o] bound of the fibre velocity, where no force limits it


# --------------------------------------------------------------------------- balance of tendon and fibre


@jit
def balancing_velocity(law, activation, strength, damping, wanted, close):
    """Return v with strength f_v(v) + damping v = wanted, within a bound, f_v, and its slopes in v and activation.

    close: largest last Newton step; the error left is its square.
    """
    if damping == 0.0 and strength == 0.0:
        v = MAX_VELOCITY if wanted > 0.0 else (-MAX_VELOCITY if wanted < 0.0 else 0.0)
        force, slope, growth = velocity_force(law, activation, v)
        return v, force, slope, growth
    v, force, slope, growth = balancing_velocity_force(law, activation, strength, damping, wanted, close)
    return min(max(v, -MAX_VELOCITY), MAX_VELOCITY), force, slope, growth


@jit
def forces(law, activation, damping, height, ratio, unit_length, x, v):
    """Return forces and slopes [F_max]: the tendon's, its slope in x, the fibre's along the tendon, its slope in x, the
    tendon's slope in its length [l_s], the fibre's in activation and in velocity [v_max l_o].

    height, x [l_o]: fibre height and length, x above height; ratio: l_o / l_s; unit_length: length of the musculotendon
    unit [l_s]; v: fibre velocity.
    """
    along = math.sqrt(x * x - height * height)
    pull, stiffness = tendon_curve(law, unit_length - ratio * along)
    curves = length_curves(law, x)
    speeds = velocity_force(law, activation, v)
    return _combine_curves(activation, damping, height, ratio, x, v, along, pull, stiffness, curves, speeds)


@jit
def balanced_forces(law, activation, damping, height, ratio, unit_length, x, least, close):
    """Return the velocity that balances at fibre length x, and what `forces` returns there.

    At the length `least` the velocity is not negative. close as of `balancing_velocity`; with zero damping and
    activation the velocity may be the bound MAX_VELOCITY.
    """
    along = math.sqrt(x * x - height * height)
    pull, stiffness = tendon_curve(law, unit_length - ratio * along)
    curves = length_curves(law, x)
    wanted = pull * x / along - curves[2]
    v, speed, d_speed, growth = balancing_velocity(
        law, activation, activation * curves[0], damping, wanted, close
    )
    if v < 0.0 and x <= least:
        v = 0.0
        speed, d_speed, growth = velocity_force(law, activation, v)
    speeds = speed, d_speed, growth
    return v, _combine_curves(
        activation, damping, height, ratio, x, v, along, pull, stiffness, curves, speeds
    )


@jit
def _combine_curves(activation, damping, height, ratio, x, v, along, pull, stiffness, curves, speeds):
    """Return the results of `forces` from the values and slopes of the curves."""
    active, d_active, passive, d_passive = curves
    speed, d_speed, growth = speeds
    cosine = along / x
    strength = active * speed
    force = activation * strength + passive + damping * v
    slope = activation * d_active * speed + d_passive
    turning = force * height * height / (along * x * x)
    drag = (activation * active * d_speed + damping) * cosine
    return (
        pull, -stiffness * ratio / cosine, force * cosine, slope * cosine + turning,
        stiffness, (strength + activation * active * growth) * cosine, drag,
    )  # fmt: skip


@jit
def rest_imbalance(law, activation, height, ratio, unit_length, x):
    """Return the tendon force minus that of a fibre at rest [F_max], and its slope in x; arguments as of `forces`."""
    pull, d_pull, force, d_force, _, _, _ = forces(law, activation, 0.0, height, ratio, unit_length, x, 0.0)
    return pull - force, d_pull - d_force


@jit
def balance(law, activation, damping, height, ratio, unit_length, before, rate, low, high, start, close):
    """Return the fibre length [l_o] in [low, high] that balances, the tendon force [F_max], evaluations and status.

    The fibre velocity is (x - before) rate: for backward Euler, rate is one over (v_max x duration). At `low` the
    tendon has to pull at least as much as the fibre, else the result is `low`; at `high` at most as much. Newton steps
    begin at `start` and are kept in a bracket that every evaluation narrows. The first step from an imbalance of at
    most `close` [F_max] is the last one, unless it crosses the tendon's slack length, where the slope jumps. With close
    = 0 the steps end at rounding errors.
    """
    least, x, pull = low, start, 0.0
    last_step = LAST_STEP if close <= NEAR_BALANCE else close
    low_known = high_known = False
    along = max(unit_length - 1.0, 0.0) / ratio
    # fibre length at which the tendon has its slack length
    slack = math.sqrt(along * along + height * height)
    along = max(unit_length - longest_start(law), 0.0) / ratio
    shortest_start = min(max(math.sqrt(along * along + height * height), low), high)
    x = max(x, shortest_start)
    for k in range(1, MAX_EVALUATIONS + 1):
        pull, d_pull, force, d_force, _, _, drag = forces(
            law, activation, damping, height, ratio, unit_length, x, (x - before) * rate
        )
        d_force += drag * rate
        off, slope = pull - force, d_pull - d_force
        if off <= 0.0 and x <= least:
            return least, pull, k, AT_MINIMUM
        step = -off / slope if slope < 0.0 else 0.0
        if off > LOG_IMBALANCE and exponential_tendon(law) and force >= 0.0:
            # the exponential of the tendon dominates: the logarithms of both forces are nearly linear in x
            bend = d_pull / (pull + LOG_OFFSET) - d_force / (force + LOG_OFFSET)
            step = -math.log((pull + LOG_OFFSET) / (force + LOG_OFFSET)) / bend if bend < 0.0 else 0.0
        new = x + step
        if abs(step) <= 1e-15 * x and abs(off) <= NEAR_BALANCE:
            return x, pull, k, SLACK_TENDON if pull == 0.0 else NORMAL
        if (
            abs(off) <= close and slope < 0.0 and new > least and (x < slack) == (new < slack)
            and abs(step) * ratio * x <= last_step * math.sqrt(x * x - height * height)
        ):  # fmt: skip
            pull = max(pull + d_pull * step, 0.0)
            return new, pull, k, SLACK_TENDON if pull == 0.0 else NORMAL
        if off > 0.0:
            low, low_known = x, True
        else:
            high, high_known = x, True
        if step == 0.0 or (new <= low and low_known) or (new >= high and high_known):
            new = 0.5 * (low + high)
        new = min(max(new, low if x <= shortest_start else max(low, shortest_start)), high)
        if new == x:  # there is no number left inside the bracket
            return x, pull, k, SLACK_TENDON if pull == 0.0 else NORMAL
        x = new
    return x, pull, MAX_EVALUATIONS, NOT_CONVERGED
