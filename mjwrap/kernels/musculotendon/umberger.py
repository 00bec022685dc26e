"""Metabolic power of a muscle: Umberger (2010, doi 10.1098/rsif.2010.0084), Umberger, Gerritsen and Martin (2003,
doi 10.1080/1025584031000091678), with the options of OpenSim's `Umberger2010MuscleMetabolicsProbe`.

Per muscle mass [W/kg], with A the excitation u where it is above the activation a and (u + a)/2 elsewhere, S the
aerobic factor, r the slow-twitch ratio, f the active force-length curve where the fibre is longer than optimal and 1
elsewhere, and v the fibre velocity in v_max:
  activation + maintenance heat  S A^0.6 (128 (1 - r) + 25) (0.4 + 0.6 f)
  shortening heat                S A^2 f (min(-250 v, 100) r - 153 v (1 - r))
  lengthening heat               S A f c 250 v, c = 4 (2003) or 0.3 (2010)
  work                           -F v_M of the active fibre force; its negative part counts as zero in the 2010 model
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import jit

# Columns of the constants: muscle mass [kg], slow-twitch ratio, aerobic factor, least heat rate [W/kg], factor of
# effort, 1 for recruitment after Bhargava, 1 for negative work (2003), 1 where a muscle's power must not be negative.
MASS, SLOW, AEROBIC, LEAST_HEAT, EFFORT, RECRUITMENT, NEGATIVE_WORK, FORBID_NEGATIVE = range(8)
CONSTANTS = 8

SLOW_HEAT = 25.0  # W/kg, activation and maintenance of slow-twitch fibres; 128 more for fast-twitch ones
FAST_HEAT = 128.0
ACTIVATION_SHARE = 0.4  # share of activation in this heat; it does not depend on the overlap of filaments
# W/kg at 1 v_max; slow-twitch fibres are 2.5 times slower than fast-twitch ones
SLOW_SHORTENING = 100.0 * 2.5
SLOW_LIMIT = 100.0  # W/kg, limit of the slow-twitch shortening heat
FAST_SHORTENING = 153.0
LENGTHENING_2003 = 4.0  # times the slow-twitch coefficient of shortening
LENGTHENING_2010 = 0.3


@jit
def slow_share(ratio, excitation):
    """Return the slow-twitch share of recruited fibres (Bhargava et al. 2004, doi 10.1016/S0021-9290(03)00239-2)."""
    slow = ratio * math.sin(0.5 * math.pi * excitation)
    half = math.sin(0.25 * math.pi * excitation)
    fast = (1.0 - ratio) * 2.0 * half * half  # 1 - cos, without its rounding
    return slow / (slow + fast) if slow + fast > 0.0 else 1.0


@jit
def metabolic_power(constants, m, activation, excitation, x, v, multiplier, active_power):
    """Return activation, maintenance, shortening, resting heat, mechanical work and their sum of muscle m [W].

    x: fibre length [l_o]; v: fibre velocity [v_max], lengthening positive; multiplier: active force-length curve at x;
    active_power [W]: power of the active fibre force, positive in shortening. Resting heat is added up to the least
    heat rate. With FORBID_NEGATIVE, shortening heat is increased so that the sum is not negative.
    """
    mass, aerobic, effort = constants[m, MASS], constants[m, AEROBIC], constants[m, EFFORT]
    if mass == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    a = effort * min(max(activation, 0.0), 1.0)
    u = effort * min(max(excitation, 0.0), 1.0)
    drive = u if u > a else 0.5 * (u + a)
    slow = constants[m, SLOW]
    if constants[m, RECRUITMENT] != 0.0:
        slow = slow_share(slow, u)
    overlap = multiplier if x > 1.0 else 1.0

    heat = mass * aerobic * drive**0.6 * (FAST_HEAT * (1.0 - slow) + SLOW_HEAT)
    started, maintained = ACTIVATION_SHARE * heat, (1.0 - ACTIVATION_SHARE) * heat * overlap

    if v <= 0.0:
        rate = slow * min(-SLOW_SHORTENING * v, SLOW_LIMIT) - (1.0 - slow) * FAST_SHORTENING * v
        shortening = mass * aerobic * drive * drive * overlap * rate
    else:
        factor = LENGTHENING_2003 if constants[m, NEGATIVE_WORK] != 0.0 else LENGTHENING_2010
        shortening = mass * aerobic * drive * overlap * factor * SLOW_SHORTENING * v

    # beyond v_max a force-velocity curve may be negative, so that the active force pushes: this counts as no work
    work = effort * active_power if active_power * v <= 0.0 else 0.0
    if constants[m, NEGATIVE_WORK] == 0.0:
        work = max(work, 0.0)
    if constants[m, FORBID_NEGATIVE] != 0.0:
        shortening += max(-(started + maintained + shortening + work), 0.0)
    heat = started + maintained + shortening
    resting = max(mass * constants[m, LEAST_HEAT] - heat, 0.0)
    return started, maintained, shortening, resting, work, heat + resting + work
