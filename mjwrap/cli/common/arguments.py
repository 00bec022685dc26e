"""Arguments that several commands take, the settings that they become, and argument types with limits."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from typing import Any

from mjwrap.cli.common.errors import UserError
from mjwrap.cli.common.recorded import LOCAL, RecordingSettings
from mjwrap.errors import TableError

MODEL_HELP = "MJCF or MJB file, mjwrap:NAME (comes with mjwrap), or myo_sim:NAME (myo-sim package)"
INITIAL_POSE = "qpos0, the model's initial pose"
RECORDING_DETAILS = (
    "rate",
    "groups",
    "force_scale",
)  # options that change a recording but do not ask for one


def add_model(parser: argparse.ArgumentParser, keyframe: str, seed: str) -> None:
    """Add MODEL, --keyframe and --seed; keyframe, seed: the help texts of these two options."""
    add = parser.add_argument
    add("model", metavar="MODEL", help=MODEL_HELP)
    add("--keyframe", metavar="NAME", help=f"{keyframe} (default: {INITIAL_POSE})")
    add("--seed", type=at_least(0), default=0, metavar="N", help=f"{seed} (default %(default)s)")
    add_side_rule(parser)


def add_side_rule(parser: Any) -> None:
    """Add the option --side-rule to a parser or group."""
    parser.add_argument(
        "--side-rule",
        type=int,
        choices=(3, 4),
        metavar="3|4",
        help="whose rule picks, at the reference pose, the way round a cylinder that the side site of a tendon means: "
        "that of MuJoCo 3 or 4 (default: the running MuJoCo's, or the one that an installed model has stored)",
    )


def add_tendons(parser: Any, what: str) -> None:
    """Add the option --tendons; what: the verb of the command."""
    parser.add_argument(
        "--tendons", action="store_true", help=f"{what} spatial tendons without an actuator, too"
    )


def positive(text: str) -> float:
    """Convert an argument to a finite number above zero."""
    value = _number(text)
    if not (math.isfinite(value) and value > 0.0):
        raise argparse.ArgumentTypeError(f"{text} must be a finite number above zero")
    return value


def not_negative(text: str) -> float:
    """Convert an argument to a finite number, zero or more."""
    value = _number(text)
    if not (math.isfinite(value) and value >= 0.0):
        raise argparse.ArgumentTypeError(f"{text} must be a finite number, zero or more")
    return value


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number") from None


def at_least(least: int) -> Callable[[str], int]:
    """Return an argparse type: a whole number of at least `least`."""

    def whole(text: str) -> int:
        value = int(text)
        if value < least:
            raise argparse.ArgumentTypeError(f"{text} must be {least} or more")
        return value

    whole.__name__ = "whole number"
    return whole


def pixels(text: str) -> tuple[int, int]:
    """Convert WIDTHxHEIGHT to two whole numbers, from 1 to 16384 pixels each."""
    width, _, height = text.partition("x")
    if not (width.isdigit() and height.isdigit() and all(1 <= int(x) <= 16384 for x in (width, height))):
        raise argparse.ArgumentTypeError(f"'{text}' is not a size in pixels; write it like 640x480")
    return int(width), int(height)


def port(text: str) -> int:
    """Convert an argument to a port number that has a successor: the server uses both."""
    number = at_least(1)(text)
    if number >= 65535:
        raise argparse.ArgumentTypeError(f"{text} must lie between 1 and 65534")
    return number


def number(text: str, where: str) -> float:
    """Return a finite number; otherwise raise a `UserError` that begins with `where`."""
    try:
        value = float(text)
    except ValueError:
        raise UserError(f"{where}: {text!r} is not a number") from None
    if not math.isfinite(value):
        raise UserError(f"{where}: {text} is not finite")
    return value


def joint_position(text: str, where: str) -> float:
    """Return a finite position [rad or m], in rad also of "90deg"; else a `UserError` that begins with `where`."""
    from mjwrap.runs.angles import position  # with MuJoCo, which --help does not need

    try:
        value = position(text)
    except ValueError:
        raise UserError(f"{where}: {text!r} is not a number, or degrees such as 90deg") from None
    if not math.isfinite(value):
        raise UserError(f"{where}: {text} is not finite")
    return value


def positions(entries: Sequence[str], option: str) -> dict[str, float]:
    """Return positions [rad or m] by joint from "JOINT=VALUE"; VALUE as for `joint_position`."""
    found = {}
    for entry in entries:
        name, equals, text = entry.rpartition("=")
        if not equals or not name:
            raise UserError(
                f"{option} '{entry}': write JOINT=VALUE, such as {entry or 'knee'}=0.5 [rad or m]"
            )
        found[name] = joint_position(text, f"'{entry}'")
    return found


def span(text: str, option: str) -> tuple[float, float]:
    """Return two increasing positions [rad or m] from "LOW,HIGH", each as for `joint_position`."""
    ends = text.split(",")
    if len(ends) != 2:
        raise UserError(f"{option} '{text}': write LOW,HIGH, such as 0,1.57 or 0deg,90deg")
    low, high = (joint_position(end, f"{option} '{text}'") for end in ends)
    if not high > low:
        raise UserError(f"{option} '{text}': the second number must be larger")
    return low, high


def add_analysis(add: Callable[..., object]) -> None:
    """Add the option --analysis; add: the add_argument of a parser or group."""
    add(
        "--analysis",
        metavar="PREFIX",
        help="write lengths, moment arms, fibres, forces, powers and metabolic power to files named as by OpenSim: "
        "PREFIX_MuscleAnalysis_Length.sto, ..._MomentArm_JOINT.sto, PREFIX_ProbeReporter_probes.sto",
    )


def add_motion(add: Callable[..., object]) -> None:
    """Add the option --motion; add: the add_argument of a parser or group."""
    add("--motion", metavar="FILE.mot", help="write the coordinates of an imported model as a motion that OpenSim "
        "replays, named as in its .osim file, in rad and m (.mot, .sto)")  # fmt: skip


def add_json(parser: argparse.ArgumentParser, what: str) -> None:
    """Add the option --json, whose file name may be left out."""
    parser.add_argument(
        "--json",
        nargs="?",
        const="-",
        metavar="FILE.json",
        help=f"{what} as JSON; without a file name, or with -, to standard output in place of the text",
    )


def read_kinds(text: str) -> list[str]:
    """Return the kinds in a list such as "length,moment_arm"; an unknown one is a `UserError` that lists all kinds."""
    from mjwrap.runs.run_table import (
        check_kinds,  # with the muscles, which replaying a recording does not need
    )

    try:
        return check_kinds(kind.strip() for kind in text.split(","))
    except TableError as error:
        raise UserError(f"--columns: {error}") from None


def add_recording(parser: Any, places: Any) -> None:
    """Add the options of a recording; places: the group of options that exclude each other."""
    add = parser.add_argument
    add("--record", metavar="FILE.rrd", help="write a recording for the rerun viewer (see mjwrap replay)")
    places.add_argument(
        "--connect",
        nargs="?",
        const=LOCAL,
        metavar="URL",
        help="stream to a running viewer (rerun+http://HOST:PORT/proxy; default: the viewer on this machine)",
    )
    add = parser.add_argument
    add(
        "--rate",
        type=positive,
        metavar="HZ",
        help="number of states per simulated second in the recording's curves (default: all)",
    )
    add("--groups", nargs="+", action="extend", default=[], metavar="NAME=PATTERN,...", help="muscles whose curves "
        "are shown together (* and ? match any characters; default: muscles that move the same body)")  # fmt: skip
    add(
        "--force-scale",
        type=positive,
        metavar="M/N",
        help="length of the recording's force arrows per newton (default: chosen to fit the model)",
    )


def add_serving(parser: Any, places: Any, what: str) -> None:
    """Add the options that serve a recording to a browser."""
    places.add_argument(
        "--serve", action="store_true", help=f"{what} to a browser on this machine until Ctrl-C"
    )
    parser.add_argument(
        "--port",
        type=port,
        default=9090,
        metavar="N",
        help="port of the server; port N + 1 is used too (default %(default)s)",
    )


def recording_settings(options: argparse.Namespace, recorded: bool, places: str) -> RecordingSettings:
    """Return what the options of `add_recording` ask for.

    recorded: whether a recording is asked for; places: the options that ask for one. Raises `UserError` if an option of
    a recording is given without a recording, or a group has no patterns.
    """
    for name in RECORDING_DETAILS:
        if getattr(options, name) and not recorded:
            raise UserError(f"--{name.replace('_', '-')} needs a recording: add {places}")
    return RecordingSettings(
        path=options.record,
        connect=options.connect or "",
        rate=options.rate,
        groups=_read_groups(options.groups),
        force_scale=options.force_scale,
    )


def _read_groups(entries: Sequence[str]) -> dict[str, list[str]] | None:
    """Return groups of muscles from "NAME=PATTERN,PATTERN"; None where there are no entries."""
    found: dict[str, list[str]] = {}
    for entry in entries:
        name, _, text = entry.partition("=")
        patterns = [pattern.strip() for pattern in text.split(",")]
        if not name or not all(patterns):
            raise UserError(f"--groups '{entry}': write NAME=PATTERN,PATTERN, for example 'flexors=BIC*,BRA'")
        found.setdefault(name, []).extend(patterns)
    return found or None
