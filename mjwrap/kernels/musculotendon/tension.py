"""Tension of a musculotendon unit from activation, length and lengthening speed.

`table.py` lists the laws. Pennation and the tendon of those with a fibre are `fiber.py`'s. SI units; tension is never
negative.
"""

from __future__ import annotations

from mjwrap.kernels._jit import jit
from mjwrap.kernels.musculotendon.fiber import rigid_tension
from mjwrap.kernels.musculotendon.table import fiberless_tension, has_fiber


@jit
def tension(law, params, m, activation, length, speed):
    """Return the tension of muscle m [N] under its law, activation 0..1, length [m] and lengthening speed [m/s].

    Of a law with a fibre this is the tension with a rigid tendon; an elastic one has the fibre's length as a state.
    NaN for a code that is no law's.
    """
    if has_fiber(law):
        return rigid_tension(law, params, m, activation, length, speed)
    return fiberless_tension(law, params, m, activation, length, speed)
