#!/usr/bin/env python3
"""Find implausible muscle parameters in a model, and how short and long every muscle gets.

MODEL is an MJCF or MJB file, or myo_sim:NAME, a model that the myo_sim package composes. All joints are moved over
their ranges together, muscles run along geodesic paths. Limits that count as plausible: docs/parameters.md.

Examples:
  inspect_muscles.py models/elbow/elbow.xml
  inspect_muscles.py myo_sim:myofullbody --keyframe standing --json out/report.json
"""

from __future__ import annotations

import argparse
import json
import sys

from _common import (
    RUN_FAILED,
    Output,
    Parser,
    UserError,
    at_least,
    load,
    number,
    run,
    start_keyframe,
    start_state,
)

from mjwrap import MuscleSystem, implausible, length_ranges


def read_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(
        prog="inspect_muscles",
        description=__doc__,
        allow_abbrev=False,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("model", help="MJCF or MJB file, or myo_sim:NAME")
    add("--keyframe", metavar="NAME", help="rest pose (default: the model's own)")
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
    add("--seed", type=at_least(0), default=0, metavar="N", help="of the drawn poses (%(default)s)")
    add("--json", metavar="FILE.json", help="findings, remarks and length ranges")
    add("--strict", action="store_true", help="exit code 1 where something is implausible")
    return parser.parse_args(arguments)


def inspect(options: argparse.Namespace) -> int:
    """Search, print and write what was found."""
    model = load(options.model)
    rest = start_state(model, start_keyframe(model, options.keyframe), []).qpos
    joints = dict(read_range(entry) for entry in options.range)
    facts = Output(options.json, "--json", (".json",)) if options.json else None
    muscles = MuscleSystem(model)
    if not muscles.names and not muscles.native:
        raise UserError("the model has no muscles: nothing to inspect")
    ranges = {} if options.quick else length_ranges(muscles, ranges=joints, base=rest, seed=options.seed)
    report = implausible(muscles, ranges=ranges, rest=rest)
    print(report.table())
    if facts is not None:
        with facts.writing():
            json.dump(
                {"model": options.model, **report.as_dict()}, facts.open_text(), indent=1, allow_nan=False
            )
        facts.publish()
        print(f"json:  {options.json}")
    return RUN_FAILED if options.strict and report.findings else 0


def read_range(entry: str) -> tuple[str, tuple[float, float]]:
    """Return a joint's name and range from "JOINT=LOW,HIGH"."""
    name, _, text = entry.rpartition("=")
    ends = text.split(",")
    if not name or len(ends) != 2:
        raise UserError(f"--range '{entry}' must be JOINT=LOW,HIGH")
    low, high = (number(end, f"--range '{entry}'") for end in ends)
    return name, (low, high)


def main(arguments: list[str] | None = None) -> int:
    """Run the script; see `_common.run` for exit codes."""
    options = read_arguments(arguments)
    return run("inspect_muscles", lambda: inspect(options))


if __name__ == "__main__":
    sys.exit(main())
