"""List the muscles of a model: what is taken over, by which law, over which surfaces, and what stays with MuJoCo.

MODEL is an MJCF or MJB file, or myo_sim:NAME, a model that the myo-sim package composes. Then parameters that are
implausible: all joints are moved over their ranges together, muscles run along geodesic paths. Limits that count as
plausible: docs/parameters.md.

Examples:
  mjwrap inspect models/elbow/elbow.xml
  mjwrap inspect myo_sim:myoarm_r --quick --json
  mjwrap inspect myo_sim:myofullbody --keyframe standing --json report.json
"""

from __future__ import annotations

import argparse

from mjwrap.cli.common.arguments import add_json, add_model, number
from mjwrap.cli.common.errors import UserError
from mjwrap.cli.inspect.inspecting import InspectSettings, inspect


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which arguments there are."""
    add_model(parser, "rest pose", "of the drawn poses")
    add = parser.add_argument
    add(
        "--range",
        nargs="+",
        default=[],
        metavar="JOINT=LOW,HIGH",
        help="of a joint, instead of the model's [rad, m]",
    )
    add(
        "--quick",
        action="store_true",
        help="judge the parameters and the rest pose only, not the joints' ranges",
    )
    add_json(parser, "muscles, native actuators, findings, remarks and length ranges")
    add("--strict", action="store_true", help="exit code 1 where something is implausible")


def execute(options: argparse.Namespace) -> int:
    """Inspect, and return the exit code."""
    return inspect(settings(options))


def settings(options: argparse.Namespace) -> InspectSettings:
    """Return what the arguments ask for; `UserError` where they do not fit together."""
    ranges = dict(_read_range(entry) for entry in options.range)
    if ranges and options.quick:
        raise UserError("--range is for the joints' ranges, which --quick does not look at")
    return InspectSettings(
        model=options.model,
        keyframe=options.keyframe,
        seed=options.seed,
        ranges=ranges,
        quick=options.quick,
        strict=options.strict,
        json=options.json,
    )


def _read_range(entry: str) -> tuple[str, tuple[float, float]]:
    """Return a joint's name and range from "JOINT=LOW,HIGH"."""
    name, _, text = entry.rpartition("=")
    ends = text.split(",")
    if not name or len(ends) != 2:
        raise UserError(f"--range '{entry}' must be JOINT=LOW,HIGH")
    low, high = (number(end, f"--range '{entry}'") for end in ends)
    return name, (low, high)
