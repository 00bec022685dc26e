"""OpenSim's PathSpring: a damped spring along a path, which pulls only.

Columns of params: 0 stiffness [N/m], 1 resting length [m], 2 dissipation [s/m].
"""

from __future__ import annotations

from mjwrap.kernels.compilation.jit import jit

CODE = 6
STIFFNESS, RESTING, DISSIPATION = range(3)


@jit
def tension(params, m, length, speed):
    """Return stiffness x stretch x (1 + dissipation x speed) [N], zero where that is negative or without stretch."""
    stretch = max(length - params[m, RESTING], 0.0)
    return max(params[m, STIFFNESS] * stretch * (1.0 + params[m, DISSIPATION] * speed), 0.0)


@jit
def energy(params, m, length):
    """Return the stored energy [J], zero without stretch."""
    stretch = max(length - params[m, RESTING], 0.0)
    return 0.5 * params[m, STIFFNESS] * stretch * stretch
