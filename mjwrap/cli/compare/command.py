"""Compare MuJoCo's built-in tendon wrapping with mjwrap's paths on the same model.

MODEL is an MJCF or MJB file, mjwrap:NAME (a model that comes with mjwrap), or myo_sim:NAME (myo-sim package).

Every joint is swept over its range, around the start pose and around further poses, and random poses are drawn. Each
path is judged by its geometry: it must be straight or a geodesic on the surface, meet the surface tangentially, never
pass below it, and be a local minimum of length. If the two paths differ, a verdict says which one is right, and why.
Then both models are simulated with the same controls.

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

from mjwrap.cli.common.arguments import add_json, add_model, add_tendons, at_least, not_negative
from mjwrap.cli.common.errors import UserError
from mjwrap.cli.compare.comparing import CompareSettings, GivenTables, compare


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_model(parser, "keyframe of the start pose", "seed of random poses, velocities and patterns")
    add = parser.add_argument
    add(
        "--muscles",
        nargs="+",
        metavar="NAME",
        help="compare only these muscles and cables (* and ? match any characters)",
    )
    add_tendons(parser, "compare")
    add(
        "--samples",
        type=at_least(3),
        default=41,
        metavar="N",
        help="number of poses along a sweep, and of random poses (default %(default)s)",
    )
    add(
        "--bases",
        type=at_least(0),
        default=8,
        metavar="N",
        help="number of further poses to sweep around (default %(default)s)",
    )
    add(
        "--duration",
        type=not_negative,
        default=1.0,
        metavar="S",
        help="duration of the simulation; 0: no simulation (default %(default)s s)",
    )
    add(
        "--excitation",
        nargs="+",
        default=["random"],
        metavar="PATTERN",
        help="excitation in the simulation, as for mjwrap run (default: random)",
    )
    add("--law", choices=("mujoco", "declared"), default="mujoco", help="muscle law in mjwrap's simulation. mujoco: "
        "MuJoCo's curves, so that only the paths differ (default); declared: each muscle's own law")  # fmt: skip
    add(
        "--states",
        metavar="FILE",
        help="motion (.sto, .mot, .csv, .npz) along which the other tables were computed",
    )
    add(
        "--lengths",
        metavar="FILE",
        help="table of lengths along --states, such as OpenSim's, to compare with both",
    )
    add(
        "--moment-arms",
        nargs="+",
        default=[],
        metavar="JOINT=FILE",
        help="tables of moment arms about a joint along --states, such as OpenSim's",
    )
    add(
        "--data",
        nargs="+",
        default=[],
        metavar="[QUANTITY=]FILE",
        help="tables of lengths or moment arms over a joint's position, for --plot: drawn over both programs' curves, "
        "as by mjwrap plot",
    )
    add("--plot", metavar="FILE.png", help="plot the comparison (.png, .pdf, .svg)")
    add(
        "--report",
        metavar="FILE.html",
        help="write a page with a table of all muscles and cables, plots and verdicts",
    )
    add("--csv", metavar="FILE.csv", help="write a row for every muscle and pose, without sweeps that "
        "change nothing; with tables of another program also FILE_tables.csv")  # fmt: skip
    add(
        "--csv-all",
        action="store_true",
        help="write all rows to --csv: hundreds of MB for a whole arm",
    )
    add_json(parser, "write all results")
    add("--check", action="store_true", help="exit with code 1 if a path of mjwrap is wrong")


def execute(options: argparse.Namespace) -> int:
    """Run the command and return its exit code."""
    return compare(settings(options))


def settings(options: argparse.Namespace) -> CompareSettings:
    """Convert the arguments to settings; raises `UserError` if they contradict each other."""
    if options.data and not options.plot:
        raise UserError("--data needs a plot: add --plot")
    if options.csv_all and not options.csv:
        raise UserError("--csv-all needs a table: add --csv")
    return CompareSettings(
        model=options.model,
        keyframe=options.keyframe,
        seed=options.seed,
        side_rule=options.side_rule,
        muscles=options.muscles,
        samples=options.samples,
        bases=options.bases,
        duration=options.duration,
        excitation=options.excitation,
        law=options.law,
        given=_given_tables(options.states, options.lengths, options.moment_arms),
        data=options.data,
        plot=options.plot,
        page=options.report,
        csv=options.csv,
        csv_all=options.csv_all,
        json=options.json,
        check=options.check,
        command=shlex.join(["mjwrap", "compare", *options.given]),
        tendons=options.tendons,
    )


def _given_tables(states: str | None, lengths: str | None, arms: Sequence[str]) -> GivenTables | None:
    if not lengths and not arms:
        if states:
            raise UserError("--states needs --lengths or --moment-arms: tables to compare with")
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
