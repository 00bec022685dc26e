"""Plot lengths, moment arms and forces of muscles over a joint, with tables of data over them.

Several models are drawn together.

The joint is moved over its range; joints that are coupled to it follow, and all others stay in the start pose. Without
--muscle all muscles and cables that the joint moves are drawn. Muscles are at rest at --activation; forces are those
along the tendon. Cables, which MuJoCo's own actuators pull, have lengths and moment arms only.

--data lays tables (.csv, .sto, .mot, .npz) over the curves, as points or, where a column NAME has NAME_low and
NAME_high or NAME_std beside it, as bands. The first column, or the one called by the joint's name, is the position. A
head may state its unit: 'elbow [deg]', 'BRA [mm]'. Without one, positions in a .csv file are in degrees, those in .sto
and .mot files as inDegrees says, and values are in SI units.

Examples:
  mjwrap plot models/elbow/elbow.xml --joint elbow_flexion -o elbow.png
  mjwrap plot models/elbow/elbow.xml myo_sim:myoarm_r --joint elbow_flexion elbow_flexion_r --muscle BRA -o bra.png
  mjwrap plot models/elbow/elbow.xml --joint elbow_flexion --quantity tension moment --activation 0.5 --csv elbow.csv
"""

from __future__ import annotations

import argparse
from typing import Any

from mjwrap.cli.common.arguments import MODEL_HELP, add_side_rule, at_least, not_negative, positions, span
from mjwrap.cli.common.errors import UserError
from mjwrap.cli.common.measured import MeasuredTables
from mjwrap.cli.plot.plotting import PlotSettings, plot
from mjwrap.files.columns import UNITS
from mjwrap.poses import QUANTITIES

DEFAULT = ("length", "moment_arm")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    several: dict[str, Any] = {"nargs": "+", "action": "extend"}
    add = parser.add_argument
    add("model", nargs="+", metavar="MODEL", help=MODEL_HELP)
    add("--joint", nargs="+", required=True, metavar="NAME", help="hinge or slide to move; one for all models, or "
        "one for each")  # fmt: skip
    add("--muscle", "--muscles", **several, dest="muscles", metavar="NAME",
        help="draw only these muscles (* and ? match any characters)")  # fmt: skip
    add("--quantity", **several, choices=tuple(QUANTITIES), metavar="NAME", help="what to draw: "
        f"{', '.join(QUANTITIES)} (default {' '.join(DEFAULT)})")  # fmt: skip
    add("--range", metavar="LOW,HIGH", help="positions of the joint [rad, m]; degrees as 10deg,90deg (default: the "
        "joint's range)")  # fmt: skip
    add(
        "--samples",
        type=at_least(2),
        default=91,
        metavar="N",
        help="number of positions (default %(default)s)",
    )
    add("--activation", type=not_negative, default=1.0, metavar="A", help="activation of the muscles for forces and "
        "fibre lengths (default %(default)s)")  # fmt: skip
    add("--keyframe", metavar="NAME", help="keyframe with the pose of the other joints (default: qpos0)")
    add(
        "--qpos",
        **several,
        metavar="JOINT=VALUE",
        help="positions of other joints [rad, m]; degrees as 90deg",
    )
    add("--native", action="store_true", help="draw MuJoCo's own tendons, too")
    add_side_rule(parser)
    data = parser.add_argument_group("data").add_argument
    data("--data", **several, metavar="[QUANTITY=]FILE", help="tables over the joint's position to lay over the "
         "curves; QUANTITY says what a table holds, where several are drawn")  # fmt: skip
    data("--data-unit", choices=[unit for unit in UNITS if unit not in ("1", "-")], metavar="UNIT",
         help="unit of values whose column states none, such as mm (default: SI units)")  # fmt: skip
    data("--states", metavar="FILE", help="motion from which tables over time take the joint's position")
    files = parser.add_argument_group("files").add_argument
    files("-o", "--out", metavar="FILE.png", help="the picture (.png, .pdf, .svg)")
    files("--csv", metavar="FILE.csv", help="write the curves as a table; of one model, --data reads it")


def execute(options: argparse.Namespace) -> int:
    """Run the command and return its exit code."""
    return plot(settings(options))


def settings(options: argparse.Namespace) -> PlotSettings:
    """Convert the arguments to settings; raises `UserError` if they contradict each other."""
    if not options.out and not options.csv:
        raise UserError("nothing to write: add -o FILE.png or --csv FILE.csv")
    if len(options.joint) not in (1, len(options.model)):
        raise UserError(
            f"{len(options.joint)} joints for {len(options.model)} models: give one for all, or one for each"
        )
    if options.activation > 1.0:
        raise UserError(f"--activation {options.activation:g}: must lie between 0 and 1")
    if (options.states or options.data_unit) and not options.data:
        raise UserError(f"--{'states' if options.states else 'data-unit'} needs a table: add --data")
    joints = options.joint * (len(options.model) if len(options.joint) == 1 else 1)
    data = MeasuredTables(options.data, options.data_unit, options.states) if options.data else None
    return PlotSettings(
        models=options.model,
        joints=joints,
        muscles=options.muscles,
        quantities=list(dict.fromkeys(options.quantity or DEFAULT)),
        span=span(options.range, "--range") if options.range else None,
        samples=options.samples,
        activation=options.activation,
        keyframe=options.keyframe,
        positions=positions(options.qpos or [], "--qpos"),
        native=options.native,
        side_rule=options.side_rule,
        data=data,
        picture=options.out,
        csv=options.csv,
    )
