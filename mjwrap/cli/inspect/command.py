"""List the muscles and cables of a model, with laws and wrapping surfaces, and report implausible parameters.

MODEL is an MJCF or MJB file, mjwrap:NAME (a model that comes with mjwrap), or myo_sim:NAME (myo-sim package).

The list also names the actuators that stay with MuJoCo, and why. To judge the parameters, the joints are moved over
their ranges, all together, to find the lengths that every muscle takes along its geodesic path. docs/parameters.md
gives the limits of what is plausible.

Examples:
  mjwrap inspect models/elbow/elbow.xml
  mjwrap inspect myo_sim:myoarm_r --quick --json
  mjwrap inspect myo_sim:myofullbody --keyframe standing --json report.json
"""

from __future__ import annotations

import argparse

from mjwrap.cli.common.arguments import add_json, add_model, joint_position
from mjwrap.cli.common.errors import UserError
from mjwrap.cli.inspect.inspecting import InspectSettings, inspect


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_model(parser, "keyframe of the rest pose", "seed of the random poses")
    add = parser.add_argument
    add(
        "--range",
        nargs="+",
        default=[],
        metavar="JOINT=LOW,HIGH",
        help="ranges of joints, in place of the model's [rad, m; 0deg,90deg]",
    )
    add(
        "--quick",
        action="store_true",
        help="judge only the parameters and the rest pose, without moving the joints",
    )
    add_json(parser, "write muscles, native actuators, findings, remarks and length ranges")
    add("--strict", action="store_true", help="exit with code 1 if something is implausible")


def execute(options: argparse.Namespace) -> int:
    """Run the command and return its exit code."""
    return inspect(settings(options))


def settings(options: argparse.Namespace) -> InspectSettings:
    """Convert the arguments to settings; raises `UserError` if they contradict each other."""
    ranges = dict(_read_range(entry) for entry in options.range)
    if ranges and options.quick:
        raise UserError("--range cannot be combined with --quick, which does not move the joints")
    return InspectSettings(
        model=options.model,
        keyframe=options.keyframe,
        seed=options.seed,
        side_rule=options.side_rule,
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
        raise UserError(f"--range '{entry}': write JOINT=LOW,HIGH")
    low, high = (joint_position(end, f"--range '{entry}'") for end in ends)
    return name, (low, high)
