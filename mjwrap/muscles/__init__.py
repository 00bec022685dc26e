"""Muscles: force laws and their parameters, activation dynamics, energetics, and the simulation of a single muscle."""

from mjwrap.muscles.activation import ActivationDynamics
from mjwrap.muscles.laws import (
    ActuatorForce,
    DeGrooteFregly2016,
    Law,
    Ligament,
    Millard2012,
    MuJoCoMuscle,
    PathActuator,
    PathSpring,
    Thelen2003,
)

__all__ = [
    "ActivationDynamics",
    "ActuatorForce",
    "DeGrooteFregly2016",
    "Law",
    "Ligament",
    "Millard2012",
    "MuJoCoMuscle",
    "PathActuator",
    "PathSpring",
    "Thelen2003",
]
