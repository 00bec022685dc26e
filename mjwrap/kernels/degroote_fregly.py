"""De Groote-Fregly 2016 (doi 10.1007/s10439-016-1591-9): its curves, with the constants that OpenSim corrected.

Each curve returns its value and its slope. Fibre lengths in optimal lengths, fibre velocities in maximum contraction
velocities (lengthening positive), tendon lengths in slack lengths, forces in maximum isometric forces.
"""

from __future__ import annotations

import math

from mjwrap.kernels._jit import jit

CODE = 2
LEAST = 0.2  # shortest fibre [l_o]: there the passive curve is zero, and negative below

PASSIVE_STIFFNESS = 4.0 / 0.6
PASSIVE_OFFSET = math.exp(PASSIVE_STIFFNESS * (LEAST - 1.0))
PASSIVE_SCALE = math.exp(4.0) - PASSIVE_OFFSET
D1, D2, D3, D4 = -0.3211346127989808, -8.149, -0.374, 0.8825327733249912
TENDON_STIFFNESS = math.log(6.0) / 0.049


@jit
def active(x):
    """Active force-length curve: three Gaussian-like terms; positive everywhere."""
    width = 0.162384573599574 + 0.063303448465465 * x
    d = (x - 1.055033428970575) / width
    first = 0.8150671134243542 * math.exp(-0.5 * d * d)
    slope = -first * d * (1.0 - 0.063303448465465 * d) / width
    d = (x - 1.0) / 0.353553390593274
    third = 0.1 * math.exp(-0.5 * d * d)
    slope -= third * d / 0.353553390593274
    width = -0.029947116970696 + 0.200356847296188 * x
    if width == 0.0:  # the second term vanishes there with all its derivatives
        return first + third, slope
    d = (x - 0.716775413397760) / width
    second = 0.433004984392647 * math.exp(-0.5 * d * d)
    if second > 0.0:
        slope -= second * d * (1.0 - 0.200356847296188 * d) / width
    return first + third + second, slope


@jit
def passive(x):
    """Passive force-length curve, exponential, zero at 0.2 and one at 1.6 optimal fibre lengths."""
    grown = math.exp(PASSIVE_STIFFNESS * (x - 1.0))
    return (grown - PASSIVE_OFFSET) / PASSIVE_SCALE, grown * (PASSIVE_STIFFNESS / PASSIVE_SCALE)


@jit
def velocity(v):
    """Force-velocity curve, about zero at -1 and one at 0; unbounded, and negative below -1."""
    s = D2 * v + D3
    return D1 * math.asinh(s) + D4, D1 * D2 / math.sqrt(s * s + 1.0)


@jit
def inverse_velocity(force):
    """Velocity at which `velocity` has the given value."""
    return (math.sinh((force - D4) / D1) - D3) / D2


@jit
def tendon(x):
    """Tendon force-length curve, one at 4.9 % strain. Negative below the slack length: whoever uses it clamps it."""
    grown = 0.2 * math.exp(TENDON_STIFFNESS * (x - 1.0))
    return grown - 0.2, TENDON_STIFFNESS * grown


@jit
def passive_energy(x):
    """Integral of the passive curve from 0.2, where it is zero, to x: nowhere negative [F_max l_o]."""
    past = PASSIVE_STIFFNESS * (x - LEAST)
    return PASSIVE_OFFSET * (math.expm1(past) - past) / (PASSIVE_STIFFNESS * PASSIVE_SCALE)


@jit
def tendon_energy(x):
    """Integral of the tendon curve from the slack length to x [F_max l_s]."""
    past = TENDON_STIFFNESS * (x - 1.0)
    return 0.2 * (math.expm1(past) - past) / TENDON_STIFFNESS
