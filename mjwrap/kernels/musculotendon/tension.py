"""Tension of a muscle from activation, length and lengthening speed, for all laws.

`dispatch.py` lists the laws; `fiber.py` has pennation and tendon of those with a fibre. SI units; tension is never
negative.
"""

from __future__ import annotations

from mjwrap.kernels.compilation.jit import from_python
from mjwrap.kernels.musculotendon.dispatch import fiberless_force_parts, fiberless_tension, has_fiber
from mjwrap.kernels.musculotendon.fiber import rigid_force_parts, rigid_tension


@from_python
def tension(law, params, m, activation, length, speed):
    """Return the tension of muscle m [N] under its law, activation 0..1, length [m] and lengthening speed [m/s].

    For a law with a fibre this is the tension with a rigid tendon; with an elastic one the fibre length is a state.
    NaN for an unknown code.
    """
    if has_fiber(law):
        return rigid_tension(law, params, m, activation, length, speed)
    return fiberless_tension(law, params, m, activation, length, speed)


@from_python
def force_parts(law, params, m, activation, length, speed):
    """Return active and passive force of muscle m along its tendon [N], which may push; arguments as of `tension`.

    Their sum is `tension` where that is positive, and no force range limits it: what an optimisation needs, because
    the tension is not affine in the activation where it is kept from pushing. An elastic tendon counts as rigid.
    """
    if has_fiber(law):
        return rigid_force_parts(law, params, m, activation, length, speed)
    return fiberless_force_parts(law, params, m, activation, length, speed)
