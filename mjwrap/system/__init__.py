"""MuscleSystem: the only reader and writer of mjData."""

from mjwrap.system.muscle_system import MuscleSystem

__all__ = ["MuscleSystem"]
