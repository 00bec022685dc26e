"""`MuscleSystem`: drives the muscles of a model; the only package that reads and writes mjData."""

from mjwrap.system.muscle_system import MuscleSystem

__all__ = ["MuscleSystem"]
