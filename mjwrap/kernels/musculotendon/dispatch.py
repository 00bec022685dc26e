"""Choice of the curves by the muscle law: codes of the laws, their properties, and a function for each curve.

Each law has a file with its mathematics, and a line in each function below that needs it; `mjwrap/muscles/laws.py`
fills its columns of `params`. No other kernel compares codes. A code that is not listed gives NaN, and the muscle gets
the status NON_FINITE.

Where a muscle has curves of its own, the functions of curves take their address in place of the code: `curve_set`
returns what to give them.

Fibre lengths in l_o, fibre velocities in v_max l_o, tendon lengths in l_s, forces in F_max.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import from_python, jit
from mjwrap.kernels.musculotendon import (
    degroote_fregly,
    ligament,
    millard,
    mujoco_muscle,
    own_curves,
    path_actuator,
    path_spring,
    thelen,
)
from mjwrap.kernels.musculotendon.curve_memory import LEAST_ADDRESS, read

PATH_ACTUATOR = path_actuator.CODE
MUJOCO = mujoco_muscle.CODE
DEGROOTE_FREGLY = degroote_fregly.CODE
MILLARD = millard.CODE
THELEN = thelen.CODE
LIGAMENT = ligament.CODE
PATH_SPRING = path_spring.CODE
PARAMS = 21  # number of columns of the table of parameters

CURVES = 9  # column of the address of a muscle's own curves, 0 where it has those of its law; laws with a fibre only

WITH_FIBER = (DEGROOTE_FREGLY, MILLARD, THELEN)
WITHOUT_FIBER = (PATH_ACTUATOR, MUJOCO, LIGAMENT, PATH_SPRING)
PASSIVE = (LIGAMENT, PATH_SPRING)
# laws whose tendon curve is an exponential: the search for a balance takes its logarithm
EXPONENTIAL_TENDON = (DEGROOTE_FREGLY,)
LONGEST_START = (
    1.08  # [l_s] longest tendon with which an iteration starts, for curves that are not a muscle's own
)
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
def is_passive(law):
    """Return whether a law's tension does not depend on activation, and it stores energy without a fibre."""
    return law in PASSIVE


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
    if law == LIGAMENT:
        return ligament.tension(params, m, length)
    if law == PATH_SPRING:
        return path_spring.tension(params, m, length, speed)
    return NAN


@jit
def fiberless_force_parts(law, params, m, activation, length, speed):
    """Return active and passive tension [N] of a law without a fibre, before it is kept from pushing."""
    if law == MUJOCO:
        return mujoco_muscle.force_parts(params, m, activation, length, speed)
    if law == PATH_ACTUATOR:
        return path_actuator.tension(params, m, activation), 0.0
    return 0.0 * activation, fiberless_tension(law, params, m, activation, length, speed)


@jit
def fiberless_energy(law, params, m, length):
    """Return the energy [J] that a law without a fibre stores at a length [m]."""
    if law == LIGAMENT:
        return ligament.energy(params, m, length)
    if law == PATH_SPRING:
        return path_spring.energy(params, m, length)
    return 0.0


@jit
def fiberless_elastic_tension(law, params, m, length):
    """Return the slope of `fiberless_energy` in length [N]: the tension without its damping."""
    if law == LIGAMENT:
        return ligament.tension(params, m, length)
    if law == PATH_SPRING:
        return path_spring.tension(params, m, length, 0.0)
    return 0.0


# ------------------------------------------------------------------------- curves of laws with a fibre


@from_python
def curve_set(law, params, m):
    """Return what the functions below take for the curves of muscle m: the code of its law, or an address."""
    address = params[m, CURVES]
    return int(address) if address >= LEAST_ADDRESS else int(law)


@jit
def longest_start(law):
    """Return the longest tendon [l_s] with which a search for a balance starts."""
    return read(law, own_curves.LONGEST_START) if law >= LEAST_ADDRESS else LONGEST_START


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
    if law >= LEAST_ADDRESS:
        return own_curves.length_curves(law, x)
    return NAN, NAN, NAN, NAN


@from_python
def velocity_force(law, activation, v):
    """Return the force-velocity curve at v [v_max l_o], and its slopes in v and in activation."""
    if law >= LEAST_ADDRESS:
        return own_curves.velocity_force(law, activation, v)
    force, slope = velocity_curve(law, v)
    return force, slope, 0.0


@from_python
def velocity_curve(law, v):
    """Return the force-velocity curve and its slope at fibre velocity v [v_max l_o]; Thelen's at full activation.

    `velocity_force` is the curve at any activation, which changes Thelen's only.
    """
    if law == MILLARD:
        return millard.velocity(v)
    if law == DEGROOTE_FREGLY:
        return degroote_fregly.velocity(v)
    if law >= LEAST_ADDRESS:
        return own_curves.velocity_curve(law, v)
    return NAN, NAN


@jit
def inverse_velocity(law, force):
    """Return the fibre velocity [v_max l_o] at which `velocity_curve` has a value."""
    if law == MILLARD:
        return millard.inverse_velocity(force)
    if law == DEGROOTE_FREGLY:
        return degroote_fregly.inverse_velocity(force)
    if law >= LEAST_ADDRESS:
        return own_curves.inverse_velocity(law, force)
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
    if law >= LEAST_ADDRESS:
        return own_curves.balancing_velocity(law, strength, damping, wanted, close)
    return NAN, NAN, NAN


@jit
def balancing_velocity_force(law, activation, strength, damping, wanted, close):
    """Return v with strength f_v(v) + damping v = wanted at an activation, f_v, and its slopes in v and activation.

    Arguments as of `law_balancing_velocity`.
    """
    if law >= LEAST_ADDRESS:
        return own_curves.balancing_velocity_force(law, activation, strength, damping, wanted, close)
    v, force, slope = law_balancing_velocity(law, strength, damping, wanted, close)
    return v, force, slope, 0.0


@jit
def tendon_curve(law, x):
    """Return the tendon's force [F_max] and its slope at tendon length x [l_s]: both zero where it is slack."""
    if x <= 1.0:
        return 0.0, 0.0
    if law == MILLARD:
        return millard.tendon(x)
    if law == DEGROOTE_FREGLY:
        return degroote_fregly.tendon(x)
    if law >= LEAST_ADDRESS:
        return own_curves.tendon_curve(law, x)
    return NAN, NAN


@jit
def passive_energy(law, x):
    """Return the energy of the parallel elastic element [F_max l_o] at fibre length x [l_o]; zero where it is slack."""
    if law == MILLARD:
        return millard.passive_energy(x)
    if law == DEGROOTE_FREGLY:
        return degroote_fregly.passive_energy(x)
    if law >= LEAST_ADDRESS:
        return own_curves.passive_energy(law, x)
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
    if law >= LEAST_ADDRESS:
        return own_curves.tendon_energy(law, x)
    return NAN
