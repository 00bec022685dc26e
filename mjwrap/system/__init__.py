"""`MuscleSystem`: drives the muscles of a model; the only package that reads and writes mjData."""

from mjwrap.system.cables import CableSystem, is_cable, kinds, twin_of
from mjwrap.system.muscle_system import MuscleSystem
from mjwrap.system.muscle_view import pulls_as_cable

__all__ = ["CableSystem", "MuscleSystem", "is_cable", "kinds", "pulls_as_cable", "twin_of"]
