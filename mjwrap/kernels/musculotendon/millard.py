"""Curves of Millard et al. 2013 (doi 10.1115/1.4023390), damped equilibrium model, with OpenSim's default shapes.

`own_curves.py` has the curves of muscles with shapes of their own, and of those without damping.

Each curve returns its value and its slope. Fibre lengths in optimal lengths, fibre velocities in maximum contraction
velocities (lengthening positive), tendon lengths in slack lengths, forces in maximum isometric forces.
"""

from __future__ import annotations

import numpy as np

from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.musculotendon import bezier, bezier_shapes
from mjwrap.kernels.musculotendon.millard_numbers import defaults

CODE = 3
LEAST = defaults("ActiveForceLengthCurve")[0]  # shortest fibre with active force [l_o]
MAX_VELOCITY = 100.0  # [v_max l_o] bound of the fibre velocity, where no force limits it
MAX_STEPS = 80  # most Newton steps and bisections for a velocity; three or four are normal


_ACTIVE = bezier_shapes.active(
    *defaults("ActiveForceLengthCurve")[:-1], least=0.0
)  # damped: no minimum force
_ACTIVE_PIECES, _ACTIVE_CELLS = bezier.tabulate(_ACTIVE)
_VELOCITY = bezier_shapes.velocity(*defaults("ForceVelocityCurve"))
_VELOCITY_PIECES, _VELOCITY_CELLS = bezier.tabulate(_VELOCITY)
_SPEEDS, _FORCES = bezier.sampled(_VELOCITY, 1001)
_VELOCITIES = np.interp(np.linspace(0.0, 1.4, 65), _FORCES, _SPEEDS)  # start of iterations, by force
_PASSIVE = bezier_shapes.passive(*defaults("FiberForceLengthCurve"))
_PASSIVE_PIECES, _PASSIVE_CELLS = bezier.tabulate(_PASSIVE)
_TENDON = bezier_shapes.tendon(*defaults("TendonForceLengthCurve"))
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
