"""Tension of a musculotendon unit from activation, length and lengthening speed: one section per law.

A law is a function (params row, activation, length, speed) -> tension and one row in `tension` below. Its columns of
`params` are named beside it; `mjwrap/muscles.py` fills them. SI units; tension is never negative.
"""

from __future__ import annotations

import math

from mjwrap.kernels._jit import jit

PATH_ACTUATOR = 0
MUJOCO = 1
DEGROOTE_FREGLY = 2
PARAMS = 16

MINVAL = 1e-15  # mjMINVAL


# ---------------------------------------------------------------------------------- path actuator
# params: 0 optimal force [N]


@jit
def path_actuator(params, m, activation):
    """Tension = activation x optimal force (OpenSim's PathActuator, tension only)."""
    return max(activation * params[m, 0], 0.0)


# --------------------------------------------------------------------------------- MuJoCo's muscle
# params: 0 range0, 1 range1, 2 force, 3 scale, 4 lmin, 5 lmax, 6 vmax, 7 fpmax, 8 fvmax (MuJoCo's gainprm),
#         9, 10 length range of the actuator, 11 acc0, 12 gear, 13, 14 force range (-inf, inf where not limited)


@jit
def mujoco_gain_length(x, lmin, lmax):
    """Active force-length curve of `mju_muscleGainLength`."""
    if x < lmin or x > lmax:
        return 0.0
    a, b = 0.5 * (lmin + 1.0), 0.5 * (1.0 + lmax)
    if x <= a:
        y = (x - lmin) / max(MINVAL, a - lmin)
        return 0.5 * y * y
    if x <= 1.0:
        y = (1.0 - x) / max(MINVAL, 1.0 - a)
        return 1.0 - 0.5 * y * y
    if x <= b:
        y = (x - 1.0) / max(MINVAL, b - 1.0)
        return 1.0 - 0.5 * y * y
    y = (lmax - x) / max(MINVAL, lmax - b)
    return 0.5 * y * y


@jit
def mujoco_muscle(params, m, activation, length, speed):
    """MuJoCo's force-length-velocity muscle: `mju_muscleGain`, `mju_muscleBias` (engine_util_misc.c).

    Where MuJoCo's would push (negative activation, or a force range above zero) there is no tension.
    """
    gear = params[m, 12]
    range0 = params[m, 0]
    force = params[m, 2]
    if force < 0.0:
        force = params[m, 3] / max(MINVAL, params[m, 11])
    optimal = (params[m, 10] - params[m, 9]) / max(MINVAL, params[m, 1] - range0)
    x = range0 + (gear * length - params[m, 9]) / max(MINVAL, optimal)
    v = gear * speed / max(MINVAL, optimal * params[m, 6])
    y = params[m, 8] - 1.0
    if v <= -1.0:
        rate = 0.0
    elif v <= 0.0:
        rate = (v + 1.0) * (v + 1.0)
    elif v <= y:
        rate = params[m, 8] - (y - v) * (y - v) / max(MINVAL, y)
    else:
        rate = params[m, 8]
    gain = -force * mujoco_gain_length(x, params[m, 4], params[m, 5]) * rate
    b = 0.5 * (1.0 + params[m, 5])
    if x <= 1.0:
        bias = 0.0
    elif x <= b:
        z = (x - 1.0) / max(MINVAL, b - 1.0)
        bias = -force * params[m, 7] * 0.5 * z * z
    else:
        z = (x - b) / max(MINVAL, b - 1.0)
        bias = -force * params[m, 7] * (0.5 + z)
    total = min(max(gain * activation + bias, params[m, 13]), params[m, 14])
    return max(-gear * total, 0.0)


# ------------------------------------------------------------------ De Groote-Fregly 2016, rigid tendon
# params: 0 F_max [N], 1 l_o [m], 2 l_s [m], 3 pennation at l_o [rad], 4 v_max [l_o/s], 5 fibre damping


@jit
def dgf_active(x):
    """Active force-length curve: three Gaussian-like terms; constants as OpenSim corrected them."""
    d1 = (x - 1.055033428970575) / (0.162384573599574 + 0.063303448465465 * x)
    d3 = (x - 1.0) / 0.353553390593274
    total = 0.8150671134243542 * math.exp(-0.5 * d1 * d1) + 0.1 * math.exp(-0.5 * d3 * d3)
    width = -0.029947116970696 + 0.200356847296188 * x
    if width != 0.0:
        d2 = (x - 0.716775413397760) / width
        total += 0.433004984392647 * math.exp(-0.5 * d2 * d2)
    return total


@jit
def dgf_passive(x):
    """Passive force-length curve, exponential, zero at 0.2 and one at 1.6 optimal fibre lengths."""
    offset = math.exp(4.0 * (0.2 - 1.0) / 0.6)
    return (math.exp(4.0 * (x - 1.0) / 0.6) - offset) / (math.exp(4.0) - offset)


@jit
def dgf_velocity(v):
    """Force-velocity curve; v in maximum contraction velocities, lengthening positive."""
    return -0.3211346127989808 * math.asinh(-8.149 * v - 0.374) + 0.8825327733249912


@jit
def dgf_tendon(x):
    """Tendon force-length curve for 4.9 % strain at maximum isometric force; x in slack lengths."""
    return 0.2 * math.exp(math.log(6.0) / 0.049 * (x - 1.0)) - 0.2


@jit
def dgf_rigid(params, m, activation, length, speed):
    """De Groote-Fregly 2016 with a rigid tendon and constant fibre height (doi 10.1007/s10439-016-1591-9).

    No tension where the unit is shorter than its tendon, nor where the model's force would be negative (fast
    shortening of a passive, damped fibre): a tendon cannot push.
    """
    optimal = params[m, 1]
    along = length - params[m, 2]
    if along <= 0.0:
        return 0.0
    height = optimal * math.sin(params[m, 3])
    fibre = math.sqrt(along * along + height * height)
    cosine = along / fibre
    v = speed * cosine / (params[m, 4] * optimal)
    x = fibre / optimal
    activation = min(max(activation, 0.0), 1.0)
    normalised = activation * dgf_active(x) * dgf_velocity(v) + dgf_passive(x) + params[m, 5] * v
    return max(params[m, 0] * normalised * cosine, 0.0)


# ------------------------------------------------------------------------------------------ dispatch


@jit
def tension(law, params, m, activation, length, speed):
    """Return the tension of muscle m [N] under its law, activation 0..1, length [m] and lengthening speed [m/s]."""
    if law == DEGROOTE_FREGLY:
        return dgf_rigid(params, m, activation, length, speed)
    if law == MUJOCO:
        return mujoco_muscle(params, m, activation, length, speed)
    return path_actuator(params, m, activation)
