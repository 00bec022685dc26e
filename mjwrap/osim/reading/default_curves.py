"""The curves that OpenSim gives to muscles and ligaments that list none: knots of SIMM splines, x and y."""

from __future__ import annotations

import numpy as np

from mjwrap.osim.description.functions import Piecewise
from mjwrap.osim.reading.splines import simm_spline

Knots = tuple[tuple[float, ...], tuple[float, ...]]

ACTIVE_FORCE_LENGTH: Knots = (
    (
        -5.30769, -4.30769, -1.92308, -0.884615, -0.269231, 0.230769, 0.461538, 0.52725, 0.62875, 0.71875, 0.86125,
        1.045, 1.2175, 1.43875, 1.5, 1.61539, 2.0, 2.96154, 3.69231, 5.46154, 9.9019
    ),
    (
        0.012188, 0.021899, 0.036466, 0.052493, 0.075312, 0.114158, 0.157859, 0.226667, 0.636667, 0.856667, 0.95,
        0.993333, 0.77, 0.246667, 0.193821, 0.133252, 0.072683, 0.044417, 0.036341, 0.021899, 0.007332
    ),
)  # fmt: skip
PASSIVE_FORCE_LENGTH: Knots = (
    (
        -5.0, 0.998, 0.999, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.601, 1.602, 5.0
    ),
    (
        0.0, 0.0, 0.0, 0.0, 0.035, 0.12, 0.26, 0.55, 1.17, 2.0, 2.0, 2.0, 2.0
    ),
)  # fmt: skip
TENDON_FORCE_LENGTH: Knots = (
    (
        -10.0, -0.002, -0.001, 0.0, 0.00131, 0.00281, 0.00431, 0.00581, 0.00731, 0.00881, 0.0103, 0.0118, 0.0123,
        9.2, 9.201, 9.202, 20.0
    ),
    (
        0.0, 0.0, 0.0, 0.0, 0.0108, 0.0257, 0.0435, 0.0652, 0.0915, 0.123, 0.161, 0.208, 0.227, 345.0, 345.0, 345.0,
        345.0
    ),
)  # fmt: skip
FORCE_VELOCITY: Knots = (
    (
        -1.001, -1.0, -0.95, -0.9, -0.85, -0.8, -0.75, -0.7, -0.65, -0.6, -0.55, -0.5, -0.45, -0.4, -0.35, -0.3,
        -0.25, -0.2, -0.15, -0.1, -0.05, 0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6,
        0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 1.0
    ),
    (
        0.0, 0.0, 0.010417, 0.021739, 0.034091, 0.047619, 0.0625, 0.078947, 0.097222, 0.117647, 0.140625, 0.166667,
        0.196429, 0.230769, 0.270833, 0.318182, 0.375, 0.444444, 0.53125, 0.642857, 0.791667, 1.0, 1.48201, 1.60157,
        1.65579, 1.68674, 1.70675, 1.72075, 1.7311, 1.73906, 1.74537, 1.75049, 1.75474, 1.75831, 1.76136, 1.764,
        1.7663, 1.76832, 1.77012, 1.77172, 1.77316, 1.77445
    ),
)  # fmt: skip

OF_MUSCLES: dict[str, dict[str, Knots]] = {
    "Schutte1993Muscle_Deprecated": {
        "tendon_force_length_curve": TENDON_FORCE_LENGTH,
        "active_force_length_curve": ACTIVE_FORCE_LENGTH,
        "passive_force_length_curve": PASSIVE_FORCE_LENGTH,
    },
    "RigidTendonMuscle": {
        "active_force_length_curve": ACTIVE_FORCE_LENGTH,
        "passive_force_length_curve": PASSIVE_FORCE_LENGTH,
        "force_velocity_curve": FORCE_VELOCITY,
    },
}


def spline_through(knots: Knots) -> Piecewise:
    """Return the SIMM spline through knots."""
    return simm_spline(np.array(knots[0]), np.array(knots[1]))
