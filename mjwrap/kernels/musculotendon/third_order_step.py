"""A fibre's step of third order beside an elastic tendon.

The fibre's velocity v at the end of a step of duration d, and its rate w there, satisfy
x − 2/3 d v + d² w / 6 = x_before + 1/3 d v_before, with v_before the velocity that balances at the beginning, and
w = λ v + φ from the derivative of the balance by time. With z = λ d a mode is multiplied by
(1 + z/3) / (1 − 2z/3 + z²/6): L-stable, as Radau's method of third order. λ and φ need not be exact: they are those of
a prediction of the end, made from the slopes at the beginning, so that what is left to solve is a balance with
v = (x − x_0) / r, as in a step of backward Euler. Two evaluations of the forces are normal, one of them the
prediction's.

Where the prediction fails, λ and φ are those after a step of backward Euler. Where the velocity changes by more than
WILD within the step, or that step was hard to find, it is that step itself which counts: it passes no equilibrium.

unit: law, activation, damping, fibre height [l_o], l_o / l_s and the unit's length [l_s], at the end of the step;
gains: by how much activation and that length are greater than at its beginning; pace: their rates at its end times d;
span: d v_max. Lengths in l_o, velocities in v_max l_o, forces in F_max.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.musculotendon.equilibrium import AT_MINIMUM, CLOSE, balance, balanced_forces, forces

SURE = 3e-2  # [F_max] imbalance of a prediction up to which its slopes are good enough for the scheme
SLOW = 0.25  # of an imbalance: where more than this is left after a Newton step, the prediction has failed
WILD = 0.4  # [v_max l_o] change of velocity within a step beyond which the step is backward Euler's
HARD = 4  # evaluations after which backward Euler's step is the last attempt, so that there are ten at most
GUESS = 1e-4  # last Newton step for the velocity at the beginning: the error left is its square
LOOSE = 1e-2  # [F_max] imbalance from which one more Newton step makes a backward Euler step good enough


@jit
def advance_third_order(unit, gains, pace, start, least, high, span):
    """Return the fibre length after a step, the tendon's force, evaluations and status.

    start: fibre length at the beginning, at least `least`, the shortest; high: one at which the tendon is slack, or
    `start`.
    """
    law, activation, damping, height, ratio, reach = unit
    v_before, now = balanced_forces(
        law, activation - gains[0], damping, height, ratio, reach - gains[1], start, least, GUESS
    )
    begun = (start, v_before)
    x, v, before, reduced, count, known = _predicted(unit, gains, pace, begun, now, least, high, span)
    if not known:
        x, pull, more, status = balance(
            law, activation, damping, height, ratio, reach, start, 1.0 / span, least, high, start, LOOSE
        )
        count += more
        euler, v = x, (x - start) / span
        if count <= HARD and status != AT_MINIMUM and abs(v - v_before) <= WILD:
            now = forces(law, activation, damping, height, ratio, reach, x, v)
            count += 1
            if now[6] > 0.0:
                x, v, before, reduced = _corrected(pace, begun, now, x, v, span)
                known = abs(v - v_before) <= WILD and least < x < high
        if not known:
            x, pull, more, status = balance(
                law, activation, damping, height, ratio, reach, start, 1.0 / span, least, high, euler, CLOSE
            )
            return x, pull, count + more, status
    x, pull, more, status = balance(
        law,
        activation,
        damping,
        height,
        ratio,
        reach,
        before,
        1.0 / reduced,
        least,
        max(high, before),
        x,
        CLOSE,
    )
    return x, pull, count + more, status


@jit
def _predicted(unit, gains, pace, begun, now, least, high, span):
    """Return x and v at the end, x_0 and r of the scheme there, evaluations, and whether they are good enough.

    now: what `forces` returns at the beginning.
    """
    law, activation, damping, height, ratio, reach = unit
    start, v_before = begun
    if not now[6] > 0.0:
        return start, v_before, start, 0.0, 0, False
    bend, reduced, before = _scheme(pace, begun, now, span)
    _, _, _, _, stiffness, strength, drag = now
    change = bend * (before - start) + (stiffness * gains[1] - strength * gains[0]) / drag
    v = (v_before + change) / max(1.0 - bend * reduced, 0.1)
    x = before + reduced * v
    count, known, left = 0, False, math.inf
    while not known and abs(v - v_before) <= WILD and least < x < high:
        now = forces(law, activation, damping, height, ratio, reach, x, v)
        count += 1
        off = abs(now[0] - now[2])
        if not (off <= SLOW * left and now[6] > 0.0):
            break
        left = off
        x, v, before, reduced = _corrected(pace, begun, now, x, v, span)
        known = off <= SURE and abs(v - v_before) <= WILD and least < x < high
    return x, v, before, reduced, count, known


@jit
def _corrected(pace, begun, now, x, v, span):
    """Return x and v after Newton's step from the `forces` at x and v, and x_0 and r of the scheme by their slopes."""
    bend, reduced, before = _scheme(pace, begun, now, span)
    slope = min(bend - 1.0 / reduced, -0.1 / reduced)
    x -= ((now[0] - now[2]) / now[6] + v - (x - before) / reduced) / slope
    return x, (x - before) / reduced, before, reduced


@jit
def _scheme(pace, begun, now, span):
    """Return the slope of the balancing velocity by x, and r and x_0 of x = x_0 + r v, by the slopes of `forces`."""
    _, d_pull, _, d_force, stiffness, strength, drag = now
    bend = (d_pull - d_force) / drag
    reduced = span * (2.0 / 3.0 - min(span * bend, 1.0) / 6.0)
    forcing = (stiffness * pace[1] - strength * pace[0]) / drag
    return bend, reduced, begun[0] + span * (begun[1] / 3.0 - forcing / 6.0)
