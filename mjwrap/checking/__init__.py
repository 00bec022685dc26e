"""Laws that hold on every model, checked on one: paths, derivatives, forces, energy, continuity, each with a figure."""

from mjwrap.checking.outcome import Check, Checks
from mjwrap.checking.run import check_model

__all__ = ["Check", "Checks", "check_model"]
