"""Muscles: force laws and their parameters, activation dynamics, energetics, and the simulation of a single muscle."""

from mjwrap.muscles.activation import ActivationDynamics
from mjwrap.muscles.laws import (
    ActuatorForce,
    DeGrooteFregly2016,
    Law,
    Millard2012,
    MuJoCoMuscle,
    PathActuator,
)

__all__ = [
    "ActivationDynamics",
    "ActuatorForce",
    "DeGrooteFregly2016",
    "Law",
    "Millard2012",
    "MuJoCoMuscle",
    "PathActuator",
]
