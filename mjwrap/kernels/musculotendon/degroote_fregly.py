"""Curves of De Groote et al. 2016 (doi 10.1007/s10439-016-1591-9), with the constants that OpenSim corrected.

Each curve returns its value and its slope. Fibre lengths in optimal lengths, fibre velocities in maximum contraction
velocities (lengthening positive), tendon lengths in slack lengths, forces in maximum isometric forces.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import jit

CODE = 2
LEAST = 0.2  # shortest fibre [l_o]: there the passive curve is zero; below it would be negative

PASSIVE_STIFFNESS = 4.0 / 0.6
PASSIVE_OFFSET = math.exp(PASSIVE_STIFFNESS * (LEAST - 1.0))
PASSIVE_SCALE = math.exp(4.0) - PASSIVE_OFFSET
D1, D2, D3, D4 = -0.3211346127989808, -8.149, -0.374, 0.8825327733249912
TENDON_STIFFNESS = math.log(6.0) / 0.049
LARGEST_EXPONENT = 100.0  # an exponential is continued linearly above this exponent, so that it stays finite
LARGEST_ASINH = 8.0  # bound of |asinh| in the force-velocity curve; reached at 180 v_max
MAX_STEPS = 60  # most Newton steps for a velocity; three or four are normal


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
def _exponential(z):
    """Return exp(z) and its slope."""
    low = min(z, LARGEST_EXPONENT)
    slope = math.exp(low)
    return slope * (1.0 + (z - low)), slope


@jit
def passive(x):
    """Passive force-length curve, exponential, zero at 0.2 and one at 1.6 optimal fibre lengths."""
    value, slope = _exponential(PASSIVE_STIFFNESS * (x - 1.0))
    return (value - PASSIVE_OFFSET) / PASSIVE_SCALE, slope * (PASSIVE_STIFFNESS / PASSIVE_SCALE)


@jit
def velocity(v):
    """Force-velocity curve, about zero at -1 and one at 0; unbounded, and negative below -1."""
    s = D2 * v + D3
    root = math.sqrt(s * s + 1.0)
    return D1 * math.copysign(math.log(abs(s) + root), s) + D4, D1 * D2 / root  # a logarithm: asinh


@jit
def inverse_velocity(force):
    """Velocity at which `velocity` has the given value."""
    return (math.sinh((force - D4) / D1) - D3) / D2


@jit
def balancing_velocity(strength, damping, wanted, close):
    """Return v with strength f_v(v) + damping v = wanted, and f_v and its slope there; one of the factors is above 0.

    With s = D2 v + D3 = sinh y this is a y + b sinh y = c, convex on the root's side of zero, so that Newton's method
    converges from beyond the root. The last step is at most `close`; the error left is its square.
    """
    a, b = -D1 * strength, -damping / D2
    c = strength * D4 + b * D3 - wanted
    size = abs(c)
    y = min(size / (a + b), LARGEST_ASINH)
    if y > 1.0 and b > 0.0:
        y = min(y, math.log(size / b + math.sqrt(size / b * (size / b) + 1.0)))
    sinh = cosh = step = 0.0
    for _ in range(MAX_STEPS):
        grown = math.exp(y)
        shrunk = 1.0 / grown
        sinh, cosh = 0.5 * (grown - shrunk), 0.5 * (grown + shrunk)
        step = (size - a * y - b * sinh) / (a + b * cosh)
        if abs(step) <= close or y + step >= LARGEST_ASINH:
            break
        y += step
    y = min(y + step, LARGEST_ASINH)
    if abs(step) > 1e-5:
        grown = math.exp(y)
        sinh, cosh = 0.5 * (grown - 1.0 / grown), 0.5 * (grown + 1.0 / grown)
    else:
        sinh, cosh = sinh + step * (cosh + 0.5 * step * sinh), cosh + step * (sinh + 0.5 * step * cosh)
    sign = math.copysign(1.0, c)
    return (sign * sinh - D3) / D2, D1 * sign * y + D4, D1 * D2 / cosh


@jit
def tendon(x):
    """Tendon force-length curve, one at 4.9 % strain; negative below the slack length, where callers use zero."""
    value, slope = _exponential(TENDON_STIFFNESS * (x - 1.0))
    return 0.2 * value - 0.2, 0.2 * TENDON_STIFFNESS * slope


@jit
def passive_energy(x):
    """Integral of the passive curve from 0.2, where it is zero, to x; never negative [F_max l_o]."""
    past = PASSIVE_STIFFNESS * (x - LEAST)
    return PASSIVE_OFFSET * (math.expm1(past) - past) / (PASSIVE_STIFFNESS * PASSIVE_SCALE)


@jit
def tendon_energy(x):
    """Integral of the tendon curve from the slack length to x [F_max l_s]."""
    past = TENDON_STIFFNESS * (x - 1.0)
    return 0.2 * (math.expm1(past) - past) / TENDON_STIFFNESS
