"""Balance of fibre and tendon: the forces and their slopes, and the search for the root.

Lengths in l_o, velocities in v_max l_o, forces in F_max; tendon lengths in l_s.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.musculotendon.dispatch import (
    exponential_tendon,
    law_balancing_velocity,
    length_curves,
    tendon_curve,
    velocity_curve,
)

NORMAL = 0
AT_MINIMUM = 1  # the fibre is at its minimum length, and does not balance the tendon
SLACK_TENDON = 2  # no tension; the fibre's own force is zero too
NOT_CONVERGED = 3

MAX_EVALUATIONS = 150  # evaluations in one solution; a step of a simulation takes two or three
NEAR_BALANCE = 1e-6  # [F_max] imbalance from which one more Newton step ends far below 1e-8
LAST_STEP = 1e-6  # [l_s] largest such step of the tendon: the curvature of a tendon's curve is at most 2e3
LONGEST_START = 1.08  # [l_s] tendon length from which at most the iteration starts
# [F_max] imbalance above which an exponential tendon is taken by its logarithm, and what is added to the forces for it
LOG_IMBALANCE, LOG_OFFSET = 0.2, 0.2
MAX_VELOCITY = 100.0  # [v_max l_o] bound of a fibre velocity that nothing resists


# --------------------------------------------------------------------------- balance of tendon and fibre


@jit
def balancing_velocity(law, strength, damping, wanted, close):
    """Return v with strength f_v(v) + damping v = wanted, within a bound, and the force-velocity curve and its slope.

    close: largest last Newton step; the error left is its square.
    """
    if damping == 0.0 and strength == 0.0:
        v = MAX_VELOCITY if wanted > 0.0 else (-MAX_VELOCITY if wanted < 0.0 else 0.0)
        force, slope = velocity_curve(law, v)
        return v, force, slope
    v, force, slope = law_balancing_velocity(law, strength, damping, wanted, close)
    return min(max(v, -MAX_VELOCITY), MAX_VELOCITY), force, slope


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
    speed, d_speed = velocity_curve(law, v)
    return _combine_curves(
        activation, damping, height, ratio, x, v, along, pull, stiffness, curves, speed, d_speed
    )


@jit
def balanced_forces(law, activation, damping, height, ratio, unit_length, x, least, close):
    """Return the velocity that balances at x, and what `forces` does there; none shortens at the `least` length.

    close as of `balancing_velocity`; with zero damping and activation the bound may stand for the velocity.
    """
    along = math.sqrt(x * x - height * height)
    pull, stiffness = tendon_curve(law, unit_length - ratio * along)
    curves = length_curves(law, x)
    wanted = pull * x / along - curves[2]
    v, speed, d_speed = balancing_velocity(law, activation * curves[0], damping, wanted, close)
    if v < 0.0 and x <= least:
        v = 0.0
        speed, d_speed = velocity_curve(law, v)
    return v, _combine_curves(
        activation, damping, height, ratio, x, v, along, pull, stiffness, curves, speed, d_speed
    )


@jit
def _combine_curves(activation, damping, height, ratio, x, v, along, pull, stiffness, curves, speed, d_speed):
    """Return what `forces` does from the curves' values and slopes."""
    active, d_active, passive, d_passive = curves
    cosine = along / x
    strength = active * speed
    force = activation * strength + passive + damping * v
    slope = activation * d_active * speed + d_passive
    turning = force * height * height / (along * x * x)
    drag = (activation * active * d_speed + damping) * cosine
    return (
        pull, -stiffness * ratio / cosine, force * cosine, slope * cosine + turning,
        stiffness, strength * cosine, drag,
    )  # fmt: skip


@jit
def rest_imbalance(law, activation, height, ratio, unit_length, x):
    """Return the tendon's force less that of a fibre at rest [F_max] and the slope in x; arguments as of `forces`."""
    pull, d_pull, force, d_force, _, _, _ = forces(law, activation, 0.0, height, ratio, unit_length, x, 0.0)
    return pull - force, d_pull - d_force


@jit
def balance(law, activation, damping, height, ratio, unit_length, before, rate, low, high, start, close):
    """Return the fibre length [l_o] in [low, high] that balances, the tendon's force [F_max], evaluations and status.

    The fibre's velocity is (x - before) rate: for backward Euler, rate is one over (v_max x duration).
    The tendon must pull no less than the fibre at `low`, else the fibre rests there, and no more at `high`. Newton's
    steps from `start`, kept in a bracket that every evaluation narrows. A step taken within `close` [F_max] of balance
    is the last, unless it crosses the tendon's slack length, where the slope jumps; with close zero the steps end at
    rounding.
    """
    least, x, pull = low, start, 0.0
    last_step = LAST_STEP if close <= NEAR_BALANCE else close
    low_known = high_known = False
    along = max(unit_length - 1.0, 0.0) / ratio
    slack = math.sqrt(along * along + height * height)  # at this fibre length the tendon begins to pull
    along = max(unit_length - LONGEST_START, 0.0) / ratio
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
            # the tendon's exponential outweighs all else: the logarithms of both forces are nearly straight
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
        if new == x:  # the bracket has no number inside
            return x, pull, k, SLACK_TENDON if pull == 0.0 else NORMAL
        x = new
    return x, pull, MAX_EVALUATIONS, NOT_CONVERGED
