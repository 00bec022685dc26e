"""From a motion to muscle forces: muscle analysis, inverse dynamics, static optimisation, joint reactions."""

from mjwrap.inverse.external_force import ExternalForce
from mjwrap.inverse.external_loads import ExternalLoads
from mjwrap.inverse.inverse_dynamics import inverse_dynamics
from mjwrap.inverse.joint_reactions import joint_reactions
from mjwrap.inverse.motion import Motion
from mjwrap.inverse.muscle_analysis import MuscleAnalysis, muscle_analysis
from mjwrap.inverse.static_optimization import OPENSIM_PARITY, StaticOptimization, static_optimization

__all__ = [
    "OPENSIM_PARITY",
    "ExternalForce",
    "ExternalLoads",
    "Motion",
    "MuscleAnalysis",
    "StaticOptimization",
    "inverse_dynamics",
    "joint_reactions",
    "muscle_analysis",
    "static_optimization",
]
