"""Compare MuJoCo's built-in tendon wrapping with mjwrap's paths on the same model, side by side.

MODEL is an MJCF or MJB file, or myo_sim:NAME, a model that the myo-sim package composes. Every joint is swept over its
range, around the start pose and around the middle of all ranges, and random poses are drawn. Each path is judged by
its geometry: is it straight or a true geodesic, tangential where it meets the surface, nowhere below it, and a local
minimum of length? Where the two differ, the verdict says which is right and why. Then both run forward with the same
controls.

Examples:
  mjwrap compare models/elbow/elbow.xml --plot compare.png
  mjwrap compare myo_sim:myoarm_r --report arm.html
  mjwrap compare arm.xml --states motion.mot --lengths lengths.sto --moment-arms elbow=arms.sto
  mjwrap compare myo_sim:myoarm_r --samples 101 --bases 1 --muscles 'LAT*' DELT1 --json compare.json
"""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Sequence

from mjwrap.cli.common.arguments import add_json, add_model, at_least, not_negative
from mjwrap.cli.common.errors import UserError
from mjwrap.cli.compare.comparing import CompareSettings, GivenTables, compare


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which arguments there are."""
    add_model(parser, "start pose", "of all that is random")
    add = parser.add_argument
    add("--muscles", nargs="+", metavar="NAME", help="only these (* and ? stand for anything)")
    add(
        "--samples",
        type=at_least(3),
        default=41,
        metavar="N",
        help="poses of a sweep, and random ones (%(default)s)",
    )
    add(
        "--bases",
        type=at_least(0),
        default=8,
        metavar="N",
        help="further poses to sweep around (%(default)s)",
    )
    add(
        "--duration", type=not_negative, default=1.0, metavar="S", help="of the motion; 0: none (%(default)s)"
    )
    add(
        "--excitation",
        nargs="+",
        default=["random"],
        metavar="PATTERN",
        help="as mjwrap run takes it (random)",
    )
    add("--law", choices=("mujoco", "declared"), default="mujoco", help="in mjwrap's run: MuJoCo's own curves, so that "
        "both differ by the path alone, or the declared law")  # fmt: skip
    add("--states", metavar="FILE", help="a motion (.sto, .mot, .csv, .npz) at which other tables were made")
    add("--lengths", metavar="FILE", help="OpenSim's table of lengths along --states, to compare with both")
    add(
        "--moment-arms",
        nargs="+",
        default=[],
        metavar="JOINT=FILE",
        help="OpenSim's tables of moment arms there",
    )
    add("--plot", metavar="FILE.png", help="picture of it all (png, pdf, svg)")
    add("--report", metavar="FILE.html", help="a page with a table of all muscles, plots and verdicts")
    add("--csv", metavar="FILE.csv", help="a row for every muscle and pose that tells something; with tables of "
        "another program FILE_tables.csv too")  # fmt: skip
    add(
        "--csv-all",
        action="store_true",
        help="a row for every muscle and pose: hundreds of MB for a whole arm",
    )
    add_json(parser, "all figures")
    add("--check", action="store_true", help="exit code 1 where mjwrap is not right")


def execute(options: argparse.Namespace) -> int:
    """Compare, and return the exit code."""
    return compare(settings(options))


def settings(options: argparse.Namespace) -> CompareSettings:
    """Return what the arguments ask for; `UserError` where they do not fit together."""
    if options.csv_all and not options.csv:
        raise UserError("--csv-all says what a table holds: it goes with --csv")
    return CompareSettings(
        model=options.model,
        keyframe=options.keyframe,
        seed=options.seed,
        muscles=options.muscles,
        samples=options.samples,
        bases=options.bases,
        duration=options.duration,
        excitation=options.excitation,
        law=options.law,
        given=_given_tables(options.states, options.lengths, options.moment_arms),
        plot=options.plot,
        page=options.report,
        csv=options.csv,
        csv_all=options.csv_all,
        json=options.json,
        check=options.check,
        command=shlex.join(["mjwrap", "compare", *options.given]),
    )


def _given_tables(states: str | None, lengths: str | None, arms: Sequence[str]) -> GivenTables | None:
    if not lengths and not arms:
        if states:
            raise UserError("--states needs --lengths or --moment-arms: tables to compare at these states")
        return None
    if not states:
        raise UserError("--lengths and --moment-arms need --states: the motion at which they were computed")
    by_joint = {}
    for entry in arms:
        joint, mark, file = entry.partition("=")
        if not mark or not joint or not file:
            raise UserError(f"--moment-arms '{entry}': write JOINT=FILE")
        by_joint[joint] = file
    return GivenTables(states, lengths, by_joint)
