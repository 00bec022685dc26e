"""Tension of a musculotendon unit from activation, length and lengthening speed.

A law has a code, a section or file of its own with its columns of `params`, and a row in `tension` below;
`mjwrap/muscles/laws.py` fills the columns. A law with a fibre gives its curves (`degroote_fregly.py`, `millard.py`);
pennation and the elastic tendon are `fiber.py`'s. SI units; tension is never negative.
"""

from __future__ import annotations

from mjwrap.kernels._jit import jit
from mjwrap.kernels.musculotendon import degroote_fregly, millard, mujoco_muscle
from mjwrap.kernels.musculotendon.fiber import rigid_tension

PATH_ACTUATOR = 0
MUJOCO = mujoco_muscle.CODE
DEGROOTE_FREGLY = degroote_fregly.CODE
MILLARD = millard.CODE
PARAMS = 21


@jit
def path_actuator(params, m, activation):
    """Tension = activation x optimal force [N], params column 0 (OpenSim's PathActuator, tension only)."""
    return max(activation * params[m, 0], 0.0)


@jit
def tension(law, params, m, activation, length, speed):
    """Return the tension of muscle m [N] under its law, activation 0..1, length [m] and lengthening speed [m/s].

    Of a law with a fibre this is the tension with a rigid tendon; an elastic one has the fibre's length as a state.
    """
    if law in (DEGROOTE_FREGLY, MILLARD):
        return rigid_tension(law, params, m, activation, length, speed)
    if law == MUJOCO:
        return mujoco_muscle.tension(params, m, activation, length, speed)
    return path_actuator(params, m, activation)
