"""Curves of Millard et al. 2013 (doi 10.1115/1.4023390), damped equilibrium model, with OpenSim's default shapes.

Each curve returns its value and its slope. Fibre lengths in optimal lengths, fibre velocities in maximum contraction
velocities (lengthening positive), tendon lengths in slack lengths, forces in maximum isometric forces.
"""

from __future__ import annotations

import numpy as np

from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.musculotendon import bezier

CODE = 3
LEAST = 0.4441  # shortest fibre with active force [l_o]
MAX_VELOCITY = 100.0  # [v_max l_o] bound of the fibre velocity, where no force limits it
MAX_STEPS = 80  # most Newton steps and bisections for a velocity; three or four are normal


def _active():
    x0, x1, x2, x3, shallow = LEAST, 0.73, 1.0, 1.8123, 0.8616
    wide = 0.05 * x2  # half the plateau
    y1 = 1.0 - shallow * (x2 - wide - x1)
    rise = 1.25 * y1 / (x1 - x0)
    low, high = x0 + 0.5 * (x1 - x0), x1 + 0.5 * (x2 - wide - x1)
    y_high = y1 + 0.5 * (1.0 - y1)
    fall, middle = -1.0 / ((x3 - wide) - (x2 + wide)), 0.5 * (x2 + wide + x3)
    ends = [
        (x0, 0.0, 0.0, low, 0.5 * y1, rise),
        (low, 0.5 * y1, rise, high, y_high, shallow),
        (high, y_high, shallow, x2, 1.0, 0.0),
        (x2, 1.0, 0.0, middle, 0.5, fall),
        (middle, 0.5, fall, x3, 0.0, 0.0),
    ]
    return bezier.corners(ends, [1.0] * 5)


def _velocity():
    most, near_zero, isometric, near_most = 1.4, 0.25, 5.0, 0.15
    short, long = 0.5 * near_zero * 0.1, most - 0.5 * near_most * 0.1
    ends = [
        (-1.0, 0.0, 0.0, -0.9, short, near_zero),
        (-0.9, short, near_zero, 0.0, 1.0, isometric),
        (0.0, 1.0, isometric, 0.9, long, near_most),
        (0.9, long, near_most, 1.0, most, 0.0),
    ]
    return bezier.corners(ends, [0.6, 0.6, 0.9, 0.9])


def _passive():
    strain, low, high = 0.7, 0.2, 2.0 / 0.7
    toe = min(0.1 / high, 0.1 * strain)
    y = low * 0.5 * toe
    ends = [(1.0, 0.0, 0.0, 1.0 + toe, y, low), (1.0 + toe, y, low, 1.0 + strain, 1.0, high)]
    return bezier.corners(ends, [0.75, 0.75])


def _tendon():
    strain, toe = 0.049, 2.0 / 3.0
    stiffness = 1.375 / strain
    x_toe = 1.0 + strain + (toe - 1.0) / stiffness
    x_middle = 1.0 + strain + (0.5 * toe - 1.0) / stiffness
    x_start = 1.0 + (x_toe - 1.0) / 10.0
    slope = 0.5 * toe / (x_middle - x_start)
    x = x_start + 0.5 * (x_middle - x_start)
    y = slope * (x - x_start)
    return bezier.corners([(1.0, 0.0, 0.0, x, y, slope), (x, y, slope, x_toe, toe, stiffness)], [0.5, 0.5])


_ACTIVE = _active()
_ACTIVE_PIECES, _ACTIVE_CELLS = bezier.tabulate(_ACTIVE)
_VELOCITY = _velocity()
_VELOCITY_PIECES, _VELOCITY_CELLS = bezier.tabulate(_VELOCITY)
_SPEEDS, _FORCES = bezier.sampled(_VELOCITY, 1001)
_VELOCITIES = np.interp(np.linspace(0.0, 1.4, 65), _FORCES, _SPEEDS)  # start of iterations, by force
_PASSIVE = _passive()
_PASSIVE_PIECES, _PASSIVE_CELLS = bezier.tabulate(_PASSIVE)
_TENDON = _tendon()
_TENDON_PIECES, _TENDON_CELLS = bezier.tabulate(_TENDON)


@jit
def active(x):
    """Active force-length curve; zero at 0.4441 and below, and at 1.8123 and above (damped: no minimum force)."""
    return bezier.evaluate(_ACTIVE_PIECES, _ACTIVE_CELLS, x)


@jit
def passive(x):
    """Passive force-length curve: zero up to optimal fibre length, one at 1.7."""
    return bezier.evaluate(_PASSIVE_PIECES, _PASSIVE_CELLS, x)


@jit
def velocity(v):
    """Force-velocity curve: zero at -1 and below, 1.4 at 1 and above."""
    return bezier.evaluate(_VELOCITY_PIECES, _VELOCITY_CELLS, v)


@jit
def inverse_velocity(force):
    """Velocity at which `velocity` has the given value; -1 or 1 outside the range of values."""
    return bezier.inverse(_VELOCITY, force)


@jit
def balancing_velocity(strength, damping, wanted, close):
    """Return v with strength f_v(v) + damping v = wanted, and f_v and its slope there; one of the factors is above 0.

    The start is the solution for a straight line through the curve's points at rest and at the velocity that balances
    without damping. Newton steps are kept in a bracket. The last step is at most `close`; the error left is its square.
    """
    low, high = -MAX_VELOCITY, MAX_VELOCITY
    v = 0.0
    excess = wanted - strength
    if strength > 0.0:
        force = min(max(wanted / strength, 0.0), 1.4)
        place = force * (64 / 1.4)
        k = min(int(place), 63)
        v = _VELOCITIES[k] + (place - k) * (_VELOCITIES[k + 1] - _VELOCITIES[k])
        steepness = (force - 1.0) / v if abs(force - 1.0) > 0.02 else 5.0
        v = excess / (strength * steepness + damping)
    else:
        v = excess / damping
    v = min(max(v, low), high)
    force = slope = step = 0.0
    for _ in range(MAX_STEPS):
        force, slope = velocity(v)
        off = wanted - strength * force - damping * v
        if off > 0.0:
            low = v
        else:
            high = v
        steepness = strength * slope + damping
        new = v + off / steepness if steepness > 0.0 else 2.0 * MAX_VELOCITY
        if not low <= new <= high:
            new = 0.5 * (low + high)
        step = new - v
        v = new
        if abs(step) <= close * (1.0 + abs(v)):
            break
    return v, force + slope * step, slope


@jit
def tendon(x):
    """Tendon force-length curve: zero up to the slack length, one at 4.9 % strain, linear above two thirds."""
    return bezier.evaluate(_TENDON_PIECES, _TENDON_CELLS, x)


@jit
def passive_energy(x):
    """Integral of the passive curve up to x: zero up to optimal fibre length [F_max l_o]."""
    return bezier.integral(_PASSIVE, x)


@jit
def tendon_energy(x):
    """Integral of the tendon curve up to x: zero up to the slack length [F_max l_s]."""
    return bezier.integral(_TENDON, x)
