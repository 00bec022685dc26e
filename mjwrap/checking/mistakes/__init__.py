"""Find what is legal in a model and yet probably a mistake: elements that nothing reads, odd surfaces and routes."""

from mjwrap.checking.mistakes.finding import Mistake, PossibleMistake
from mjwrap.checking.mistakes.search import possible_mistakes

__all__ = ["Mistake", "PossibleMistake", "possible_mistakes"]
