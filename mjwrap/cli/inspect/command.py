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
import copy
from typing import Any

from mjwrap import MuscleSystem, implausible, length_ranges
from mjwrap.calibration.joints import JointSpace
from mjwrap.cli.common.arguments import add_model
from mjwrap.cli.common.errors import FAULTS, UserError
from mjwrap.cli.common.models import load, number, start_keyframe, start_state
from mjwrap.cli.common.output import Report, add_json
from mjwrap.cli.inspect.declared import as_values, table
from mjwrap.text import counted


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
    """Say what is declared, search, and say what was found."""
    model = load(options.model)
    rest = start_state(model, start_keyframe(model, options.keyframe)).qpos
    joints = dict(read_range(entry) for entry in options.range)
    if joints and options.quick:
        raise UserError("--range is for the joints' ranges, which --quick does not look at")
    JointSpace(copy.copy(model), rest, joints)  # so that a mistake in a range shows before the work
    report = Report(options.json)
    muscles = MuscleSystem(model)
    if not muscles.names and not muscles.native:
        raise UserError("the model has no muscles: nothing to inspect")
    report.say(
        f"{options.model}: {counted(muscles.n, 'muscle')} along geodesic paths, {len(muscles.native)} with MuJoCo's own"
    )
    report.say(table(model, muscles.declarations))
    for name, reason in muscles.native.items():
        report.say(f"{name}: stays with MuJoCo: {reason}")
    ranges = {} if options.quick else length_ranges(muscles, ranges=joints, base=rest, seed=options.seed)
    found = implausible(muscles, ranges=ranges, rest=rest)
    report.say(found.table())
    values: dict[str, Any] = {
        "model": options.model,
        "muscles": [as_values(model, muscle) for muscle in muscles.declarations],
        "native": muscles.native,
    }
    report.finish(values | found.as_dict())
    return FAULTS if options.strict and found.findings else 0


def read_range(entry: str) -> tuple[str, tuple[float, float]]:
    """Return a joint's name and range from "JOINT=LOW,HIGH"."""
    name, _, text = entry.rpartition("=")
    ends = text.split(",")
    if not name or len(ends) != 2:
        raise UserError(f"--range '{entry}' must be JOINT=LOW,HIGH")
    low, high = (number(end, f"--range '{entry}'") for end in ends)
    return name, (low, high)
