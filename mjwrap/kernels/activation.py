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
    """Return the activation after `duration` [s] under constant excitation u: Runge-Kutta, stable at any step."""
    shortest = min(activation_time, deactivation_time)
    steps = int(math.ceil(duration / (0.25 * shortest)))
    if steps < 1:
        return a
    h = duration / steps
    for _ in range(steps):
        k1 = zajac_rate(u, a, activation_time, deactivation_time)
        k2 = zajac_rate(u, a + 0.5 * h * k1, activation_time, deactivation_time)
        k3 = zajac_rate(u, a + 0.5 * h * k2, activation_time, deactivation_time)
        k4 = zajac_rate(u, a + h * k3, activation_time, deactivation_time)
        a = min(max(a + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4), 0.0), 1.0)
    return a
