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
import contextlib
import fnmatch
import shlex
from pathlib import Path
from typing import Any

import mujoco

from mjwrap import MuscleSystem, Table, read_table
from mjwrap.cli.common.arguments import add_model, at_least, not_negative
from mjwrap.cli.common.errors import FAULTS, UserError
from mjwrap.cli.common.models import load, start_keyframe, start_state
from mjwrap.cli.common.output import Report, add_json, open_output
from mjwrap.cli.common.progress import Stages, need_matplotlib
from mjwrap.cli.compare.rows import PoseRows, write_tables
from mjwrap.cli.compare.text import as_values, tell_motion, tell_poses, tell_tables
from mjwrap.cli.run.states import read_states
from mjwrap.comparison import (
    PoseComparison,
    compare_motion,
    compare_poses,
    compare_tables,
    verdict,
    with_native_laws,
)
from mjwrap.comparison.tables import Beside
from mjwrap.mjcf import dof_names
from mjwrap.runs.excitation import Excitation
from mjwrap.text import counted


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
    """Compare, and say and write what came of it."""
    model = load(options.model)
    key = start_keyframe(model, options.keyframe)
    start = start_state(model, key)
    muscles = MuscleSystem(model)
    names = choose(muscles, options.muscles)
    Excitation(muscles, options.excitation, options.seed)  # so that a mistake in it shows before the work
    plot = open_output(options.plot, "--plot", ".png", ".pdf", ".svg") if options.plot else None
    page = open_output(options.report, "--report", ".html", ".htm") if options.report else None
    if options.csv_all and not options.csv:
        raise UserError("--csv-all says what a table holds: it goes with --csv")
    table = open_output(options.csv, "--csv", ".csv") if options.csv else None
    report = Report(options.json)
    given = read_tables(options, model, muscles, start)
    if plot is not None or page is not None:
        need_matplotlib()
    beside: list[Beside] = []
    tables = compare_tables(model, *given, each=beside.append) if given is not None else []
    if table is not None and given is not None:
        write_tables(open_output(tables_path(options.csv), "--csv", ".csv"), beside)
    rows = PoseRows(table, dof_names(model), options.csv_all) if table is not None else None
    found = compare_all(model, names, options, start, rows)
    verdicts = {
        name: verdict(summary, [jump for jump in found.jumps if jump.muscle == name])
        for name, summary in found.muscles.items()
    }
    report.say(
        f"{options.model}: {counted(len(found.muscles), 'muscle')} at {counted(found.poses, 'pose')} each"
    )
    tell_poses(report.say, found, verdicts)
    told = {"csv": f" ({rows.close()})"} if rows is not None else {}

    tell_tables(report.say, tables)
    motion = None
    if options.duration > 0.0 and not model.nv:
        report.say("\nno motion: the model has no joint")
    elif options.duration > 0.0:
        moved, changed = with_native_laws(model) if options.law == "mujoco" else (model, [])
        motion = compare_motion(moved, options.excitation, options.duration, key=key, seed=options.seed)
        tell_motion(report.say, motion, changed, options.excitation)
    if plot is not None:
        from mjwrap.cli.compare.plot import plot_comparison

        title = f"{Path(options.model).name}: MuJoCo {mujoco.__version__} and mjwrap, {found.poses} poses"
        plot_comparison(plot, title, found, motion)
    if page is not None:
        from mjwrap.cli.compare.page import write_page

        command = shlex.join(["mjwrap", "compare", *options.given])
        write_page(page, options.model, command, found, verdicts, motion, tables)
    files = {"plot": options.plot, "report": options.report, "csv": options.csv}
    if options.csv and given is not None:
        files["tables"] = tables_path(options.csv)
    for what, path in files.items():
        if path:
            report.say(f"{what + ':':10s} {path}{told.get(what, '')}")
    asked = {name: getattr(options, name) for name in ("model", "samples", "bases", "seed")}
    report.finish({**asked, **as_values(found, verdicts, motion), "tables": [vars(d) for d in tables]})
    wrong = found.at_fault or any(jump.program == "mjwrap" for jump in found.jumps)
    return FAULTS if options.check and wrong else 0


def tables_path(path: str) -> str:
    """Return the name of the file beside `--csv` that the given tables go to."""
    return str(Path(path).with_name(f"{Path(path).stem}_tables.csv"))


Given = tuple[Any, Any, Table | None, dict[str, Table]]  # time, qpos, lengths, moment arms by joint


def read_tables(
    options: argparse.Namespace, model: mujoco.MjModel, muscles: MuscleSystem, start: mujoco.MjData
) -> Given | None:
    """Return the motion and the tables of another program that were asked for, or None."""
    if not options.lengths and not options.moment_arms:
        if options.states:
            raise UserError("--states needs --lengths or --moment-arms: tables to compare at these states")
        return None
    if not options.states:
        raise UserError("--lengths and --moment-arms need --states: the motion at which they were computed")
    states = read_states(model, muscles, start, read_table(options.states))
    arms = {}
    for entry in options.moment_arms:
        joint, mark, file = entry.partition("=")
        if not mark or not joint or not file:
            raise UserError(f"--moment-arms '{entry}': write JOINT=FILE")
        arms[joint] = read_table(file)
    return states.time, states.qpos, read_table(options.lengths) if options.lengths else None, arms


def compare_all(
    model: mujoco.MjModel, names: list[str] | None, options: argparse.Namespace, start: mujoco.MjData,
    rows: PoseRows | None,
) -> PoseComparison:  # fmt: skip
    """Compare at all poses, with a progress bar."""
    with contextlib.closing(Stages("motions", "comparing")) as progress:
        return compare_poses(
            model, names=names, samples=options.samples, bases=options.bases, seed=options.seed,
            base=start.qpos, each=rows.add if rows is not None else None, progress=progress,
        )  # fmt: skip


def choose(muscles: MuscleSystem, wanted: list[str] | None) -> list[str] | None:
    """Return the names of the muscles that the patterns `wanted` match, None for all."""
    known = [*muscles.names, *muscles.native]
    if not known:
        raise UserError("the model has no muscles: nothing to compare")
    if wanted is None:
        return None
    found: list[str] = []
    for pattern in wanted:
        fit = [name for name in fnmatch.filter(known, pattern) if name not in found]
        if not fit and pattern not in found:
            raise UserError(f"no muscle '{pattern}'; muscles: {', '.join(known)}")
        found += fit
    return found
