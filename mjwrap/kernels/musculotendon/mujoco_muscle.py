"""MuJoCo's own `<muscle>` curves (`mju_muscleGain`, `mju_muscleBias` in engine_util_misc.c).

Columns of params: 0 range0, 1 range1, 2 force, 3 scale, 4 lmin, 5 lmax, 6 vmax, 7 fpmax, 8 fvmax (MuJoCo's gainprm),
9, 10 length range of the actuator, 11 acc0, 12 gear, 13, 14 force range (-inf, inf where not limited); of the passive
force (biasprm): 15 range0, 16 range1, 17 force, 18 scale, 19 lmax, 20 fpmax.
"""

from __future__ import annotations

from mjwrap.kernels.compilation.jit import jit

CODE = 1
RANGE, ACC0, GEAR, LIMITS, PASSIVE = 9, 11, 12, 13, 15  # first columns of the groups above
MINVAL = 1e-15  # mjMINVAL


@jit
def gain_length(x, lmin, lmax):
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
def _scale(params, m, column):
    """Return peak force [N] and optimal length of the four columns range0, range1, force, scale from `column` on."""
    force = params[m, column + 2]
    if force < 0.0:
        force = params[m, column + 3] / max(MINVAL, params[m, 11])
    width = max(MINVAL, params[m, column + 1] - params[m, column])
    return force, (params[m, 10] - params[m, 9]) / width


@jit
def gain_and_bias(params, m, length, speed):
    """Return gain and bias [N] of MuJoCo's force-length-velocity muscle: `mju_muscleGain`, `mju_muscleBias`."""
    gear = params[m, 12]
    force, optimal = _scale(params, m, 0)
    x = params[m, 0] + (gear * length - params[m, 9]) / max(MINVAL, optimal)
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
    gain = -force * gain_length(x, params[m, 4], params[m, 5]) * rate
    force, optimal = _scale(params, m, 15)
    x = params[m, 15] + (gear * length - params[m, 9]) / max(MINVAL, optimal)
    b = 0.5 * (1.0 + params[m, 19])
    if x <= 1.0:
        bias = 0.0
    elif x <= b:
        z = (x - 1.0) / max(MINVAL, b - 1.0)
        bias = -force * params[m, 20] * 0.5 * z * z
    else:
        z = (x - b) / max(MINVAL, b - 1.0)
        bias = -force * params[m, 20] * (0.5 + z)
    return gain, bias


@jit
def tension(params, m, activation, length, speed):
    """Return the tension [N] of MuJoCo's muscle.

    Where MuJoCo's actuator would push (negative activation, or a force range above zero) the tension is zero.
    """
    gain, bias = gain_and_bias(params, m, length, speed)
    total = min(max(gain * activation + bias, params[m, 13]), params[m, 14])
    return max(-params[m, 12] * total, 0.0)


@jit
def force_parts(params, m, activation, length, speed):
    """Return active and passive tension [N], whose sum is `tension` where neither it nor a force range clamps it."""
    gain, bias = gain_and_bias(params, m, length, speed)
    return -params[m, 12] * gain * activation, -params[m, 12] * bias
