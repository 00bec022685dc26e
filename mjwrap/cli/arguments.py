"""Kinds of arguments, for argparse: numbers within limits."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable


def positive(text: str) -> float:
    """Return a finite number above zero, for argparse."""
    value = _number(text)
    if not (math.isfinite(value) and value > 0.0):
        raise argparse.ArgumentTypeError(f"{text} must be a finite number above zero")
    return value


def not_negative(text: str) -> float:
    """Return a finite number, zero or more, for argparse."""
    value = _number(text)
    if not (math.isfinite(value) and value >= 0.0):
        raise argparse.ArgumentTypeError(f"{text} must be a finite number, zero or more")
    return value


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no number") from None


def at_least(least: int) -> Callable[[str], int]:
    """Return the argparse type of a whole number of at least `least`."""

    def whole(text: str) -> int:
        value = int(text)
        if value < least:
            raise argparse.ArgumentTypeError(f"{text} must be {least} or more")
        return value

    whole.__name__ = "whole number"
    return whole


def pixels(text: str) -> tuple[int, int]:
    """Read WIDTHxHEIGHT, from 1 to 16384 pixels each."""
    width, _, height = text.partition("x")
    if not (width.isdigit() and height.isdigit() and all(1 <= int(x) <= 16384 for x in (width, height))):
        raise argparse.ArgumentTypeError(f"'{text}' is no size in pixels; write it like 640x480")
    return int(width), int(height)
