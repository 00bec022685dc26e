"""From a motion to muscle forces: muscle analysis and inverse dynamics."""

from mjwrap.inverse.external_force import ExternalForce
from mjwrap.inverse.external_loads import ExternalLoads
from mjwrap.inverse.inverse_dynamics import inverse_dynamics
from mjwrap.inverse.motion import Motion
from mjwrap.inverse.muscle_analysis import MuscleAnalysis, muscle_analysis

__all__ = [
    "ExternalForce",
    "ExternalLoads",
    "Motion",
    "MuscleAnalysis",
    "inverse_dynamics",
    "muscle_analysis",
]
