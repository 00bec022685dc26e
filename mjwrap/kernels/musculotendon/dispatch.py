"""Choice of the curves by the muscle law: codes of the laws, their properties, and a function for each curve.

Each law has a file with its mathematics, and a line in each function below that needs it; `mjwrap/muscles/laws.py`
fills its columns of `params`. No other kernel compares codes. A code that is not listed gives NaN, and the muscle gets
the status NON_FINITE.

Fibre lengths in l_o, fibre velocities in v_max l_o, tendon lengths in l_s, forces in F_max.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import from_python, jit
from mjwrap.kernels.musculotendon import degroote_fregly, millard, mujoco_muscle, path_actuator

PATH_ACTUATOR = path_actuator.CODE
MUJOCO = mujoco_muscle.CODE
DEGROOTE_FREGLY = degroote_fregly.CODE
MILLARD = millard.CODE
PARAMS = 21  # number of columns of the table of parameters

WITH_FIBER = (DEGROOTE_FREGLY, MILLARD)
WITHOUT_FIBER = (PATH_ACTUATOR, MUJOCO)
# laws whose tendon curve is an exponential: the search for a balance takes its logarithm
EXPONENTIAL_TENDON = (DEGROOTE_FREGLY,)
NAN = math.nan


@from_python
def is_law_code(law):
    """Return whether a number is the code of a law."""
    return law in WITH_FIBER or law in WITHOUT_FIBER


@from_python
def has_fiber(law):
    """Return whether a law has a fibre and a tendon, rigid or elastic."""
    return law in WITH_FIBER


@jit
def exponential_tendon(law):
    """Return whether the logarithm of the tendon force is nearly linear where the force is large."""
    return law in EXPONENTIAL_TENDON


# -------------------------------------------------------------------------------- laws without a fibre


@jit
def fiberless_tension(law, params, m, activation, length, speed):
    """Return the tension [N] of a law without a fibre from activation 0..1, length [m] and lengthening speed [m/s]."""
    if law == MUJOCO:
        return mujoco_muscle.tension(params, m, activation, length, speed)
    if law == PATH_ACTUATOR:
        return path_actuator.tension(params, m, activation)
    return NAN


# ------------------------------------------------------------------------- curves of laws with a fibre


@from_python
def length_curves(law, x):
    """Return the active force-length curve, its slope, the passive one and its slope at fibre length x [l_o]."""
    if law == MILLARD:
        active, d_active = millard.active(x)
        passive, d_passive = millard.passive(x)
        return active, d_active, passive, d_passive
    if law == DEGROOTE_FREGLY:
        active, d_active = degroote_fregly.active(x)
        passive, d_passive = degroote_fregly.passive(x)
        return active, d_active, passive, d_passive
    return NAN, NAN, NAN, NAN


@from_python
def velocity_curve(law, v):
    """Return the force-velocity curve and its slope at fibre velocity v [v_max l_o]."""
    if law == MILLARD:
        return millard.velocity(v)
    if law == DEGROOTE_FREGLY:
        return degroote_fregly.velocity(v)
    return NAN, NAN


@jit
def inverse_velocity(law, force):
    """Return the fibre velocity [v_max l_o] at which the force-velocity curve has a value."""
    if law == MILLARD:
        return millard.inverse_velocity(force)
    if law == DEGROOTE_FREGLY:
        return degroote_fregly.inverse_velocity(force)
    return NAN


@jit
def law_balancing_velocity(law, strength, damping, wanted, close):
    """Return v with strength f_v(v) + damping v = wanted, and f_v and its slope there; one of the factors is above 0.

    close: largest last Newton step; the error left is its square. `equilibrium.balancing_velocity` bounds it.
    """
    if law == MILLARD:
        return millard.balancing_velocity(strength, damping, wanted, close)
    if law == DEGROOTE_FREGLY:
        return degroote_fregly.balancing_velocity(strength, damping, wanted, close)
    return NAN, NAN, NAN


@jit
def tendon_curve(law, x):
    """Return the tendon's force [F_max] and its slope at tendon length x [l_s]: both zero where it is slack."""
    if x <= 1.0:
        return 0.0, 0.0
    if law == MILLARD:
        return millard.tendon(x)
    if law == DEGROOTE_FREGLY:
        return degroote_fregly.tendon(x)
    return NAN, NAN


@jit
def passive_energy(law, x):
    """Return the energy of the parallel elastic element [F_max l_o] at fibre length x [l_o]; zero where it is slack."""
    if law == MILLARD:
        return millard.passive_energy(x)
    if law == DEGROOTE_FREGLY:
        return degroote_fregly.passive_energy(x)
    return NAN


@jit
def tendon_energy(law, x):
    """Return the energy of the tendon [F_max l_s] at its length x [l_s], zero where it is slack."""
    if x <= 1.0:
        return 0.0
    if law == MILLARD:
        return millard.tendon_energy(x)
    if law == DEGROOTE_FREGLY:
        return degroote_fregly.tendon_energy(x)
    return NAN
