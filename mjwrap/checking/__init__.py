"""Tests that must pass on every model: paths, derivatives, forces, energy, continuity; each gives its worst error."""

from mjwrap.checking.all_checks import check_model
from mjwrap.checking.outcome import Check, Checks

__all__ = ["Check", "Checks", "check_model"]
