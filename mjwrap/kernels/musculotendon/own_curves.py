"""Curves of muscles that have their own: Millard's from the parameters in a file, and Thelen's.

h: address of a muscle's set of curves (`mjwrap/muscles/curve_sets.py`): its kind, the longest tendon [l_s] with which a
search for a balance starts, and then Thelen's constants, or the addresses of four tables of Bezier curves.
Each function here is that of the same name in `dispatch.py`.
"""

from __future__ import annotations

from mjwrap.kernels.compilation.jit import jit, no_inline
from mjwrap.kernels.musculotendon import bezier_tables, thelen
from mjwrap.kernels.musculotendon.bezier_tables import evaluate
from mjwrap.kernels.musculotendon.curve_memory import read

KIND, LONGEST_START = 0, 1
ACTIVE, VELOCITY, PASSIVE, TENDON = range(2, 6)  # addresses of the tables
BEZIER_SIZE = 6
BEZIER, THELEN = 1.0, 2.0  # kinds
# bound of w: the caller's bound of the fibre velocity is 100 v_max l_o, and Thelen's least `speed_scale` 0.25
MAX_VELOCITY = 400.0
MAX_STEPS = 80  # most Newton steps and bisections for a velocity; three or four are normal


@jit
def speed_scale(h, activation):
    """Return the share of v_max in which the force-velocity curve measures speeds, and its slope in activation."""
    if read(h, KIND) == THELEN:
        return thelen.SPEED_OFFSET + thelen.SPEED_GROWTH * activation, thelen.SPEED_GROWTH
    return 1.0, 0.0


@no_inline
def length_curves(h, x):
    """Return the active force-length curve, its slope, the passive one and its slope at fibre length x [l_o]."""
    if read(h, KIND) == THELEN:
        active, d_active = thelen.active(h, x)
        passive, d_passive = thelen.passive(h, x)
        return active, d_active, passive, d_passive
    active, d_active = evaluate(int(read(h, ACTIVE)), x)
    passive, d_passive = evaluate(int(read(h, PASSIVE)), x)
    return active, d_active, passive, d_passive


@no_inline
def velocity_curve(h, w):
    """Return the force-velocity curve and its slope at w, the fibre velocity by `speed_scale`."""
    if read(h, KIND) == THELEN:
        return thelen.velocity(h, w)
    return evaluate(int(read(h, VELOCITY)), w)


@no_inline
def velocity_force(h, activation, v):
    """Return the force-velocity curve at v [v_max l_o] and an activation, and its slopes in both."""
    scale, growth = speed_scale(h, activation)
    force, slope = velocity_curve(h, v / scale)
    slope /= scale
    return force, slope, -slope * v * growth / scale


@no_inline
def inverse_velocity(h, force):
    """Return the velocity, by `speed_scale`, at which the force-velocity curve has a value."""
    if read(h, KIND) == THELEN:
        return thelen.inverse_velocity(h, force)
    return bezier_tables.inverse(int(read(h, VELOCITY)), force)


@no_inline
def balancing_velocity(h, strength, damping, wanted, close):
    """Return w with strength f_v(w) + damping w = wanted, and f_v and its slope there; one of the factors is above 0.

    As `millard.balancing_velocity`: Newton steps in a bracket from the solution for a straight line.
    """
    low, high = -MAX_VELOCITY, MAX_VELOCITY
    if strength > 0.0:
        force = wanted / strength
        if read(h, KIND) == THELEN:
            w = thelen.inverse_velocity(h, force)
        else:
            w = bezier_tables.near_inverse(int(read(h, VELOCITY)), force)
        w = min(max(w, low), high)
        if damping > 0.0:
            held, _ = velocity_curve(h, w)
            steepness = (held - 1.0) / w if abs(w) > 1e-3 else velocity_curve(h, 0.0)[1]
            w = (wanted - strength) / (strength * steepness + damping)
    else:
        w = wanted / damping
    w = min(max(w, low), high)
    force = slope = step = 0.0
    for _ in range(MAX_STEPS):
        force, slope = velocity_curve(h, w)
        off = wanted - strength * force - damping * w
        if off > 0.0:
            low = w
        else:
            high = w
        steepness = strength * slope + damping
        new = w + off / steepness if steepness > 0.0 else 2.0 * MAX_VELOCITY
        if not low <= new <= high:
            new = 0.5 * (low + high)
        step = new - w
        w = new
        if abs(step) <= close * (1.0 + abs(w)):
            break
    return w, force + slope * step, slope


@no_inline
def balancing_velocity_force(h, activation, strength, damping, wanted, close):
    """Return v [v_max l_o] with strength f_v(v) + damping v = wanted, f_v, and its slopes in v and activation."""
    scale, growth = speed_scale(h, activation)
    w, force, slope = balancing_velocity(h, strength, damping * scale, wanted, close)
    slope /= scale
    return w * scale, force, slope, -slope * w * growth


@no_inline
def tendon_curve(h, x):
    """Return the tendon's force [F_max] and its slope at tendon length x [l_s], above one."""
    if read(h, KIND) == THELEN:
        return thelen.tendon(h, x)
    return evaluate(int(read(h, TENDON)), x)


@no_inline
def passive_energy(h, x):
    """Return the energy of the parallel elastic element [F_max l_o] at fibre length x [l_o]."""
    if read(h, KIND) == THELEN:
        return thelen.passive_energy(h, x)
    return bezier_tables.integral(int(read(h, PASSIVE)), x)


@no_inline
def tendon_energy(h, x):
    """Return the energy of the tendon [F_max l_s] at its length x [l_s], above one."""
    if read(h, KIND) == THELEN:
        return thelen.tendon_energy(h, x)
    return bezier_tables.integral(int(read(h, TENDON)), x)
