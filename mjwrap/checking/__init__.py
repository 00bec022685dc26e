"""Checks of laws that must hold on every model: paths, derivatives, forces, energy, continuity, each with a figure."""

from mjwrap.checking.all_checks import check_model
from mjwrap.checking.outcome import Check, Checks

__all__ = ["Check", "Checks", "check_model"]
