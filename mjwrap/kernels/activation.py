"""First-order activation dynamics from excitation u to activation a, both held in [0, 1]."""

from __future__ import annotations

import math

from mjwrap.kernels._jit import jit


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
    s = right  # ln y; the residual is concave in it and negative here, so Newton climbs to the root and never passes it
    for _ in range(50):
        y = math.exp(s)
        step = (right - s + y) / (1.0 - y)
        s += step
        if step <= 1e-16 * (1.0 - s):
            break
    return min(max(u - z / 1.5 * math.exp(s), a), u)
