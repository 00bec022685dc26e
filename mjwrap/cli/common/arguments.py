"""Arguments that several commands take, and kinds of arguments: numbers within limits."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable


def add_model(parser: argparse.ArgumentParser, keyframe: str, seed: str) -> None:
    """Add MODEL, --keyframe and --seed; keyframe: what the pose of the keyframe is for, seed: of what."""
    add = parser.add_argument
    add("model", metavar="MODEL", help="MJCF or MJB file, or myo_sim:NAME")
    add("--keyframe", metavar="NAME", help=f"{keyframe} (default: the model's own)")
    add("--seed", type=at_least(0), default=0, metavar="N", help=f"{seed} (default %(default)s)")


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


def port(text: str) -> int:
    """Return a port that has a next one, for argparse."""
    number = at_least(1)(text)
    if number >= 65535:
        raise argparse.ArgumentTypeError(f"{text} must lie between 1 and 65534")
    return number


def add_analysis(add: Callable[..., object]) -> None:
    """Add the option --analysis by a parser's or group's add_argument."""
    add(
        "--analysis",
        metavar="PREFIX",
        help="lengths, fibre lengths, tensions and moment arms as OpenSim's MuscleAnalysis names them: "
        "PREFIX_MuscleAnalysis_Length.sto, ..._MomentArm_JOINT.sto",
    )
