"""Curves of Thelen 2003 (doi 10.1115/1.1531112) as OpenSim's Thelen2003Muscle has them, with a muscle's own constants.

The force-velocity curve depends on activation by its width only: at activation a it is f_v(v / (0.25 + 0.75 a)). The
functions below have w = v / (0.25 + 0.75 a) in v's place. Beyond the curve's two ends it goes on as a straight line: at
zero force, and at a share of the largest force while lengthening. It has a corner at rest, where its slope doubles.

Each curve returns its value and its slope, in the units of `dispatch.py`. h: address of the constants (`SIZE` doubles).
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.musculotendon.curve_memory import read

CODE = 4
LEAST = 0.01  # shortest fibre [l_o]; the curves have none
LARGEST_EXPONENT = 100.0  # an exponential is continued linearly above this exponent, so that it stays finite
SPEED_OFFSET, SPEED_GROWTH = 0.25, 0.75  # v_max at activation a is this share of v_max: offset + growth a

# Places of the constants, after the two of every muscle with its own curves (`own_curves.py`).
ACTIVE_SHAPE, PASSIVE_SHAPE, FIBER_STRAIN, CONCENTRIC, MOST, THRESHOLD = range(2, 8)
TOE_STRAIN, STIFFNESS = 8, 9
SIZE = 10

TOE_SHAPE, TOE_FORCE = (
    3.0,
    33.0 / 100.0,
)  # shape of the tendon's exponential, force at which it becomes straight


def tendon_constants(strain: float) -> tuple[float, float]:
    """Return the strain at which the tendon's curve becomes straight, and its slope there, from that at F_max."""
    grown = math.exp(TOE_SHAPE)
    toe = 99.0 * strain * grown / (166.0 * grown - 67.0)
    return toe, 0.67 / (strain - toe)


@jit
def _exponential(z):
    """Return exp(z) - 1 and its slope."""
    low = min(z, LARGEST_EXPONENT)
    value = math.expm1(low)
    return value + (value + 1.0) * (z - low), value + 1.0


@jit
def active(h, x):
    """Active force-length curve, a bell; positive everywhere."""
    past, width = x - 1.0, read(h, ACTIVE_SHAPE)
    value = math.exp(-past * past / width)
    return value, -2.0 * past / width * value


@jit
def passive(h, x):
    """Passive force-length curve: zero up to optimal fibre length, one at the fibre's strain at F_max."""
    if x <= 1.0:
        return 0.0, 0.0
    rate = read(h, PASSIVE_SHAPE) / read(h, FIBER_STRAIN)
    value, slope = _exponential(rate * (x - 1.0))
    scale = 1.0 / math.expm1(read(h, PASSIVE_SHAPE))
    return value * scale, slope * rate * scale


@jit
def velocity(h, w):
    """Force-velocity curve: zero at -1, one at rest."""
    concentric, most = read(h, CONCENTRIC), read(h, MOST)
    if w <= -1.0:
        slope = concentric / (1.0 + concentric)
        return (w + 1.0) * slope, slope
    if w <= 0.0:
        below = 1.0 - w / concentric
        return (1.0 + w) / below, (1.0 + 1.0 / concentric) / (below * below)
    steep = 2.0 + 2.0 / concentric
    end = read(h, THRESHOLD) * most
    w_end = (end - 1.0) * (most - 1.0) / (steep * (most - end))
    if w >= w_end:
        slope = steep * (most - end) * (most - end) / ((most - 1.0) * (most - 1.0))
        return end + slope * (w - w_end), slope
    below = most - 1.0 + steep * w
    return (most - 1.0 + steep * most * w) / below, steep * (most - 1.0) * (most - 1.0) / (below * below)


@jit
def inverse_velocity(h, force):
    """Return w at which `velocity` has the given value."""
    concentric, most = read(h, CONCENTRIC), read(h, MOST)
    if force <= 0.0:
        return -1.0 + (1.0 + 1.0 / concentric) * force
    if force <= 1.0:
        return (force - 1.0) / (1.0 + force / concentric)
    steep = 2.0 + 2.0 / concentric
    end = read(h, THRESHOLD) * most
    near = min(force, end)
    w = (near - 1.0) * (most - 1.0) / (steep * (most - near))
    return w + (force - near) * (most - 1.0) * (most - 1.0) / (steep * (most - end) * (most - end))


@jit
def tendon(h, x):
    """Tendon force-length curve: an exponential up to a third of F_max, then straight; zero without strain."""
    strain, toe = x - 1.0, read(h, TOE_STRAIN)
    if strain > toe:
        return TOE_FORCE + read(h, STIFFNESS) * (strain - toe), read(h, STIFFNESS)
    scale, rate = TOE_FORCE / math.expm1(TOE_SHAPE), TOE_SHAPE / toe
    grown = math.expm1(rate * max(strain, 0.0))
    return scale * grown, scale * rate * (grown + 1.0)


@jit
def passive_energy(h, x):
    """Integral of the passive curve up to x: zero up to optimal fibre length [F_max l_o]."""
    past = x - 1.0
    if past <= 0.0:
        return 0.0
    rate = read(h, PASSIVE_SHAPE) / read(h, FIBER_STRAIN)
    return (math.expm1(rate * past) / rate - past) / math.expm1(read(h, PASSIVE_SHAPE))


@jit
def tendon_energy(h, x):
    """Integral of the tendon curve from the slack length to x [F_max l_s]."""
    strain, toe = x - 1.0, read(h, TOE_STRAIN)
    low = min(strain, toe)
    rate = TOE_SHAPE / toe
    energy = TOE_FORCE / math.expm1(TOE_SHAPE) * (math.expm1(rate * low) / rate - low)
    past = max(strain - toe, 0.0)
    return energy + past * (TOE_FORCE + 0.5 * read(h, STIFFNESS) * past)
