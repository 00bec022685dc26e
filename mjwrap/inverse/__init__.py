"""From a motion to muscle forces: muscle analysis, inverse dynamics and joint reactions."""

from mjwrap.inverse.external_force import ExternalForce
from mjwrap.inverse.external_loads import ExternalLoads
from mjwrap.inverse.inverse_dynamics import inverse_dynamics
from mjwrap.inverse.joint_reactions import joint_reactions
from mjwrap.inverse.motion import Motion
from mjwrap.inverse.muscle_analysis import MuscleAnalysis, muscle_analysis

__all__ = [
    "ExternalForce",
    "ExternalLoads",
    "Motion",
    "MuscleAnalysis",
    "inverse_dynamics",
    "joint_reactions",
    "muscle_analysis",
]
