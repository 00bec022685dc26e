"""Kinds of arguments, for argparse: numbers within limits."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable


def positive(text: str) -> float:
    """Return a finite number above zero, for argparse."""
    value = float(text)
    if not (math.isfinite(value) and value > 0.0):
        raise argparse.ArgumentTypeError(f"{text} must be a finite number above zero")
    return value


def not_negative(text: str) -> float:
    """Return a finite number, zero or more, for argparse."""
    value = float(text)
    if not (math.isfinite(value) and value >= 0.0):
        raise argparse.ArgumentTypeError(f"{text} must be a finite number, zero or more")
    return value


def at_least(least: int) -> Callable[[str], int]:
    """Return the argparse type of a whole number of at least `least`."""

    def whole(text: str) -> int:
        value = int(text)
        if value < least:
            raise argparse.ArgumentTypeError(f"{text} must be {least} or more")
        return value

    whole.__name__ = "whole number"
    return whole
