"""MuJoCo's activation at the end of a step, which actuators with `actearly` use for their force.

As `mj_nextActivation` and the dynamics in `mj_fwdActuation` (engine_support.c, engine_forward.c), up to rounding.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.musculotendon.mujoco_muscle import MINVAL

INTEGRATOR, FILTER, FILTER_EXACT, MUSCLE = 0, 1, 2, 3  # dyntype


@jit
def _muscle_rate(ctrl, act, rise, fall, width):
    """Return `mju_muscleDynamics` [1/s]: rise and fall [s], width of the smooth switch between them (0: none)."""
    held = min(max(act, 0.0), 1.0)
    up, down = rise * (0.5 + 1.5 * held), fall / (0.5 + 1.5 * held)
    difference = min(max(ctrl, 0.0), 1.0) - act
    if width < MINVAL:
        time = up if difference > 0.0 else down
    else:
        x = min(max(difference / width + 0.5, 0.0), 1.0)
        time = down + (up - down) * (x * x * x * (3.0 * x * (2.0 * x - 5.0) + 10.0))
    return difference / max(MINVAL, time)


@jit
def next_activation(dynamics, constants, m, act, ctrl, timestep):
    """Return the activation of muscle m after one step [s]; constants (n, 5): dynprm (3), then limits (2).

    NaN for dynamics that are not listed above.
    """
    if dynamics == INTEGRATOR:
        following = act + ctrl * timestep
    elif dynamics == MUSCLE:
        rate = _muscle_rate(ctrl, act, constants[m, 0], constants[m, 1], constants[m, 2])
        following = act + rate * timestep
    elif dynamics != FILTER and dynamics != FILTER_EXACT:
        return math.nan
    else:
        time = max(MINVAL, constants[m, 0])
        rate = (ctrl - act) / time
        if dynamics == FILTER:
            following = act + rate * timestep
        else:
            following = act + rate * time * (1.0 - math.exp(-timestep / time))
    return min(max(following, constants[m, 3]), constants[m, 4])
