"""One step of third order for the fibre length of a muscle with an elastic tendon.

The fibre velocity v at the end of a step of duration d, and its rate w there, satisfy

    x − 2/3 d v + d² w / 6 = x_before + 1/3 d v_before,

with v_before the velocity at which fibre and tendon balance at the beginning. Differentiating the balance by time
gives w = λ v + φ. With z = λ d a linear mode is multiplied by (1 + z/3) / (1 − 2z/3 + z²/6) in a step: the method is
L-stable, as Radau's method of third order. λ and φ need not be exact. They are taken at a predicted end of the step,
which follows from the slopes at its beginning. What remains to be solved is a balance with v = (x − x_0) / r, as in a
step of backward Euler. Usually this takes two evaluations of the forces, one of them for the prediction.

Where the prediction fails, λ and φ are taken after a step of backward Euler. Where the velocity changes by more than
MAX_VELOCITY_CHANGE within the step, or the backward Euler step took many evaluations, the backward Euler step itself is
the result: it does not overshoot an equilibrium.

Arguments of the functions below:

    unit              law, activation, damping, fibre height [l_o], l_o / l_s and the unit's length [l_s], at the end
    increments        activation and unit's length at the end less those at the beginning
    end_rates         rates of activation and unit's length at the end, times d
    scaled_duration   d v_max

Lengths in l_o, velocities in v_max l_o, forces in F_max.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.musculotendon.equilibrium import (
    AT_MINIMUM,
    NEAR_BALANCE,
    balance,
    balanced_forces,
    forces,
)

# [F_max] largest imbalance of a prediction whose slopes are good enough for the scheme
PREDICTION_TOL = 3e-2
# a Newton step that leaves more than this share of the imbalance: the prediction has failed
SLOW_CONVERGENCE = 0.25
# [v_max l_o] change of velocity within a step above which the step is one of backward Euler
MAX_VELOCITY_CHANGE = 0.4
# a backward Euler step that took more evaluations is the result itself; a step then takes ten at most
MAX_EULER_EVALUATIONS = 4
# largest last Newton step for the velocity at the beginning; the error that is left is its square
START_VELOCITY_TOL = 1e-4
# [F_max] imbalance from which one more Newton step makes a backward Euler step exact enough for the scheme
EULER_TOL = 1e-2


@jit
def advance_third_order(unit, increments, end_rates, start, least, high, scaled_duration):
    """Return the fibre length after a step, the tendon's force, evaluations and status.

    start: fibre length at the beginning; least: the shortest fibre length, at most `start`; high: a fibre length at
    which the tendon is slack, or `start`.
    """
    law, activation, damping, height, ratio, unit_length = unit
    v_before, now = balanced_forces(
        law,
        activation - increments[0],
        damping,
        height,
        ratio,
        unit_length - increments[1],
        start,
        least,
        START_VELOCITY_TOL,
    )
    begun = (start, v_before)
    x, v, before, reduced, count, known = _predicted(
        unit, increments, end_rates, begun, now, least, high, scaled_duration
    )
    if not known:
        x, pull, more, status = balance(
            law,
            activation,
            damping,
            height,
            ratio,
            unit_length,
            start,
            1.0 / scaled_duration,
            least,
            high,
            start,
            EULER_TOL,
        )
        count += more
        euler, v = x, (x - start) / scaled_duration
        if (
            count <= MAX_EULER_EVALUATIONS
            and status != AT_MINIMUM
            and abs(v - v_before) <= MAX_VELOCITY_CHANGE
        ):
            now = forces(law, activation, damping, height, ratio, unit_length, x, v)
            count += 1
            if now[6] > 0.0:
                x, v, before, reduced = _corrected(end_rates, begun, now, x, v, scaled_duration)
                known = abs(v - v_before) <= MAX_VELOCITY_CHANGE and least < x < high
        if not known:
            x, pull, more, status = balance(
                law,
                activation,
                damping,
                height,
                ratio,
                unit_length,
                start,
                1.0 / scaled_duration,
                least,
                high,
                euler,
                NEAR_BALANCE,
            )
            return x, pull, count + more, status
    x, pull, more, status = balance(
        law,
        activation,
        damping,
        height,
        ratio,
        unit_length,
        before,
        1.0 / reduced,
        least,
        max(high, before),
        x,
        NEAR_BALANCE,
    )
    return x, pull, count + more, status


@jit
def _predicted(unit, increments, end_rates, begun, now, least, high, scaled_duration):
    """Return x and v at the end, x_0 and r of the scheme there, evaluations, and whether they are good enough.

    begun: fibre length and velocity at the beginning; now: what `forces` returns there.
    """
    law, activation, damping, height, ratio, unit_length = unit
    start, v_before = begun
    if not now[6] > 0.0:
        return start, v_before, start, 0.0, 0, False
    bend, reduced, before = _scheme(end_rates, begun, now, scaled_duration)
    _, _, _, _, stiffness, strength, drag = now
    change = bend * (before - start) + (stiffness * increments[1] - strength * increments[0]) / drag
    v = (v_before + change) / max(1.0 - bend * reduced, 0.1)
    x = before + reduced * v
    count, known, left = 0, False, math.inf
    while not known and abs(v - v_before) <= MAX_VELOCITY_CHANGE and least < x < high:
        now = forces(law, activation, damping, height, ratio, unit_length, x, v)
        count += 1
        off = abs(now[0] - now[2])
        if not (off <= SLOW_CONVERGENCE * left and now[6] > 0.0):
            break
        left = off
        x, v, before, reduced = _corrected(end_rates, begun, now, x, v, scaled_duration)
        known = off <= PREDICTION_TOL and abs(v - v_before) <= MAX_VELOCITY_CHANGE and least < x < high
    return x, v, before, reduced, count, known


@jit
def _corrected(end_rates, begun, now, x, v, scaled_duration):
    """Return x and v after a Newton step with `now`, the `forces` at x and v, and x_0 and r of the scheme."""
    bend, reduced, before = _scheme(end_rates, begun, now, scaled_duration)
    slope = min(bend - 1.0 / reduced, -0.1 / reduced)
    x -= ((now[0] - now[2]) / now[6] + v - (x - before) / reduced) / slope
    return x, (x - before) / reduced, before, reduced


@jit
def _scheme(end_rates, begun, now, scaled_duration):
    """Return λ, the slope of the balancing velocity in x, and r and x_0 of x = x_0 + r v, from the slopes `now`."""
    _, d_pull, _, d_force, stiffness, strength, drag = now
    bend = (d_pull - d_force) / drag
    reduced = scaled_duration * (2.0 / 3.0 - min(scaled_duration * bend, 1.0) / 6.0)
    forcing = (stiffness * end_rates[1] - strength * end_rates[0]) / drag
    return bend, reduced, begun[0] + scaled_duration * (begun[1] / 3.0 - forcing / 6.0)
