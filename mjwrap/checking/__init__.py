"""Tests that must pass on every model, each with its worst error; and what is legal, but probably a mistake."""

from mjwrap.checking.all_checks import check_model
from mjwrap.checking.mistakes import Mistake, PossibleMistake, possible_mistakes
from mjwrap.checking.outcome import Check, Checks

__all__ = ["Check", "Checks", "Mistake", "PossibleMistake", "check_model", "possible_mistakes"]
