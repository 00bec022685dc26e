"""First-order activation dynamics from excitation u to activation a, both clamped to [0, 1].

Each form has a code, a function for the rate, one for a step under constant excitation, and a line in `rate` and
`advance` below.
"""

from __future__ import annotations

import math

import numpy as np

from mjwrap.kernels.compilation.jit import jit

ZAJAC = 0
SMOOTH = 1

# Gauss-Legendre nodes and weights on [0, 1], for the time integral of the smooth form.
NODES = tuple(float(0.5 + 0.5 * x) for x in np.polynomial.legendre.leggauss(8)[0])
WEIGHTS = tuple(float(0.5 * w) for w in np.polynomial.legendre.leggauss(8)[1])
PANEL = 0.5  # width of a panel in ln |u - a|; the relative error of the quadrature over it is about 1e-13
PANELS = 80  # most panels; |u - a| has fallen below 1e-17 of its value then
MAX_STEPS = 20  # most Newton steps in the last panel; two or three are normal


@jit
def rate(form, u, a, activation_time, deactivation_time, smoothing):
    """Return da/dt [1/s] under either form, NaN under another; smoothing is the smooth form's b."""
    if form == SMOOTH:
        return smooth_rate(u, a, activation_time, deactivation_time, smoothing)
    if form == ZAJAC:
        return zajac_rate(u, a, activation_time, deactivation_time)
    return math.nan


@jit
def advance(form, a, u, activation_time, deactivation_time, smoothing, duration):
    """Return the activation after `duration` [s] under constant excitation u and either form, NaN under another."""
    if form == SMOOTH:
        return advance_smooth(a, u, activation_time, deactivation_time, smoothing, duration)
    if form == ZAJAC:
        return advance_activation(a, u, activation_time, deactivation_time, duration)
    return math.nan


@jit
def rate_above(form, u, a, times, m, least):
    """Return da/dt [1/s] of an activation that is not less than `least`; times (n, 3 or more): constants."""
    held = least if a < least else a
    growth = rate(form, u, held, times[m, 0], times[m, 1], times[m, 2])
    return 0.0 if growth < 0.0 and held <= least and least > 0.0 else growth


@jit
def advance_above(form, a, u, times, m, least, duration):
    """Return the activation after `duration` [s], not less than `least`; times (n, 3 or more): constants."""
    held = least if a < least else a
    new = advance(form, held, u, times[m, 0], times[m, 1], times[m, 2], duration)
    return least if new < least else new  # what is not a number stays that


# ------------------------------------------------------------------------------------ Zajac, MuJoCo


@jit
def zajac_rate(u, a, activation_time, deactivation_time):
    """Return da/dt [1/s] as MuJoCo computes it (`mju_muscleDynamics`; Millard et al. 2013, doi 10.1115/1.4023390)."""
    u = min(max(u, 0.0), 1.0)
    a = min(max(a, 0.0), 1.0)
    if u > a:
        return (u - a) / (activation_time * (0.5 + 1.5 * a))
    return (u - a) * (0.5 + 1.5 * a) / deactivation_time


@jit
def advance_activation(a, u, activation_time, deactivation_time, duration):
    """Return the activation after `duration` [s] under constant excitation u: the exact solution of `zajac_rate`.

    With z = 0.5 + 1.5 u and the distance w = |u - a|, a fall is logistic, w' = -w (z + 1.5 w) / tau_d, and a rise has
    w' = -w / (tau_a (z - 1.5 w)), so that y = 1.5 w / z obeys ln y - y = ln y_0 - y_0 - t / (tau_a z).
    """
    u = min(max(u, 0.0), 1.0)
    a = min(max(a, 0.0), 1.0)
    z = 0.5 + 1.5 * u
    if u <= a:
        left = math.exp(-duration * z / deactivation_time)
        return u + (a - u) * left * z / (z + 1.5 * (a - u) * (1.0 - left))
    y = 1.5 * (u - a) / z
    right = math.log(y) - y - duration / (activation_time * z)
    # s = ln y; the residual is concave in s and negative at the start, so that Newton's method converges from below
    s = right
    for _ in range(50):
        y = math.exp(s)
        step = (right - s + y) / (1.0 - y)
        s += step
        if step <= 1e-16 * (1.0 - s):
            break
    return min(max(u - z / 1.5 * math.exp(s), a), u)


# ----------------------------------------------------------------------------- De Groote et al., smooth


@jit
def smooth_rate(u, a, activation_time, deactivation_time, smoothing):
    """Return da/dt [1/s] of De Groote et al. 2016 (doi 10.1007/s10439-016-1591-9), with smoothing b.

    The share of the rising time constant is (1 + tanh(b (u - a))) / 2, where Zajac's form switches.
    """
    u = min(max(u, 0.0), 1.0)
    a = min(max(a, 0.0), 1.0)
    share = 0.5 + 0.5 * math.tanh(smoothing * (u - a))
    z = 0.5 + 1.5 * a
    return (share / (activation_time * z) + (1.0 - share) * z / deactivation_time) * (u - a)


@jit
def _time_per_fall(w, u, rises, activation_time, deactivation_time, smoothing):
    """Return dt / d(-ln w) [s] of the smooth form at the distance w = |u - a|."""
    z = 0.5 + 1.5 * (u - w if rises else u + w)
    rest = math.exp(-2.0 * smoothing * w)  # ratio of the smaller share to the larger
    up, down = (1.0, rest) if rises else (rest, 1.0)
    return (
        activation_time
        * deactivation_time
        * z
        * (1.0 + rest)
        / (up * deactivation_time + down * z * z * activation_time)
    )


@jit
def advance_smooth(a, u, activation_time, deactivation_time, smoothing, duration):
    """Return the activation after `duration` [s] under constant excitation u: `smooth_rate` solved to about 1e-13.

    The distance w = |u - a| falls monotonically, and the time is an integral over s = -ln w with a smooth, bounded
    integrand: Gauss quadrature over panels of s, and Newton's method for the s in the last panel at which the duration
    is reached.
    """
    u = min(max(u, 0.0), 1.0)
    a = min(max(a, 0.0), 1.0)
    w, rises = abs(u - a), u > a
    if w == 0.0 or duration <= 0.0:
        return a
    left = duration
    for _ in range(PANELS):
        pace = _time_per_fall(w, u, rises, activation_time, deactivation_time, smoothing)
        fall = min(left / pace, PANEL)
        last = True
        for _ in range(MAX_STEPS):
            time = 0.0
            for k in range(len(NODES)):
                at = w * math.exp(-fall * NODES[k])
                time += WEIGHTS[k] * _time_per_fall(
                    at, u, rises, activation_time, deactivation_time, smoothing
                )
            time *= fall
            last = fall < PANEL or time > left
            if not last:
                break
            end = w * math.exp(-fall)
            step = (left - time) / _time_per_fall(
                end, u, rises, activation_time, deactivation_time, smoothing
            )
            fall = min(max(fall + step, 0.0), PANEL)
            if abs(step) <= 1e-8 * (1e-3 + fall):  # the error left is its square
                break
        w *= math.exp(-fall)
        left -= time
        if last:
            break
    return u - w if rises else u + w
