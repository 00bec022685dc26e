"""Compare MuJoCo's tendons with mjwrap's paths; report as text, values, plot, page and tables."""

from __future__ import annotations

import contextlib
import fnmatch
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco

from mjwrap import MuscleSystem, Table, read_table
from mjwrap.cli.common.errors import FAULTS, RUN_FAILED, UserError
from mjwrap.cli.common.figures import need_matplotlib
from mjwrap.cli.common.output import Report, open_output
from mjwrap.cli.common.outputs import Outputs
from mjwrap.cli.common.progress import Stages
from mjwrap.cli.compare.data_panels import data_panels
from mjwrap.cli.compare.rows import PoseRows, write_tables
from mjwrap.cli.compare.text import as_values, tell_motion, tell_poses, tell_tables
from mjwrap.comparison import (
    PoseComparison,
    compare_motion,
    compare_poses,
    compare_tables,
    verdict,
    with_native_laws,
)
from mjwrap.comparison.tables import TableColumn
from mjwrap.mjcf import dof_names
from mjwrap.runs.excitation import Excitation
from mjwrap.runs.models import load, start_keyframe, start_state
from mjwrap.runs.state_tables import read_states
from mjwrap.system import CableSystem, kinds
from mjwrap.text import counted, nearest, noun


@dataclass(frozen=True)
class GivenTables:
    """Files of another program: states of a motion, lengths along it, and moment arms along it by joint."""

    states: str
    lengths: str | None
    moment_arms: Mapping[str, str]


@dataclass(frozen=True)
class CompareSettings:
    """The settings of `mjwrap compare`.

    model: a file or a model by name. keyframe: the start pose, None for qpos0. side_rule: of mjwrap's paths, as for
    `MuscleSystem`. muscles: patterns of names, None for all. samples: number of poses along a sweep, and of random
    poses. bases: number of further poses to sweep around. duration: of the simulation [s], 0 for none. excitation: as
    `Excitation` takes it. law: "mujoco" simulates both with MuJoCo's curves, "declared" mjwrap with the declared law.
    data: tables over a joint's position, for the plot. plot, page, csv, json: files, or None; json may be "-" for
    standard output. csv_all: write every row to csv. check: exit code 1 if a path of mjwrap is wrong. command: the
    command line of this comparison. tendons: compare tendons without an actuator, too.
    """

    model: str
    keyframe: str | None
    seed: int
    side_rule: int | None
    muscles: Sequence[str] | None
    samples: int
    bases: int
    duration: float
    excitation: Sequence[str]
    law: str
    given: GivenTables | None
    data: Sequence[str]
    plot: str | None
    page: str | None
    csv: str | None
    csv_all: bool
    json: str | None
    check: bool
    command: str
    tendons: bool = False


def compare(settings: CompareSettings) -> int:
    """Compare, report, write the files, and return the exit code."""
    model = load(settings.model)
    key = start_keyframe(model, settings.keyframe)
    start = start_state(model, key)
    muscles = CableSystem(model, side_rule=settings.side_rule, tendons=settings.tendons)
    names = choose(muscles, settings.muscles)
    Excitation(muscles, settings.excitation, settings.seed)  # a mistake here is reported early
    plot = open_output(settings.plot, "--plot", ".png", ".pdf", ".svg") if settings.plot else None
    page = open_output(settings.page, "--report", ".html", ".htm") if settings.page else None
    table = open_output(settings.csv, "--csv", ".csv") if settings.csv else None
    report = Report(settings.json)
    given = read_tables(settings.given, model, muscles, start) if settings.given else None
    if plot is not None or page is not None:
        need_matplotlib("--plot" if plot is not None else "--report")
    panels = data_panels(model, settings.data, start.qpos, settings.side_rule, report.say)
    columns: list[TableColumn] = []
    tables = (
        compare_tables(model, *given, side_rule=settings.side_rule, each=columns.append)
        if given is not None
        else []
    )
    if settings.csv and given is not None:
        write_tables(open_output(tables_path(settings.csv), "--csv", ".csv"), columns)
    rows = PoseRows(table, dof_names(model), settings.csv_all) if table is not None else None
    found = compare_all(model, names, settings, start, rows)
    verdicts = {
        name: verdict(summary, [jump for jump in found.jumps if jump.muscle == name])
        for name, summary in found.muscles.items()
    }
    report.say(
        f"{settings.model}: {found.counted(found.muscles)} at {counted(found.poses, 'pose')} each; MuJoCo "
        f"{mujoco.__version__}, mjwrap with MuJoCo {found.side_rule}'s rule for side sites"
    )
    tell_poses(report.say, found, verdicts)
    outputs, told = Outputs("compare"), {}
    if rows is not None:
        outputs.attempt("csv", lambda: told.update(csv=f" ({rows.close()})"))

    tell_tables(report.say, tables, found.noun())
    motion = None
    if settings.duration > 0.0 and not model.nv:
        report.say("\nno simulation: the model has no joint")
    elif settings.duration > 0.0:
        moved, changed = with_native_laws(model) if settings.law == "mujoco" else (model, [])
        motion = compare_motion(
            moved,
            settings.excitation,
            settings.duration,
            key=key,
            seed=settings.seed,
            side_rule=settings.side_rule,
        )
        tell_motion(report.say, motion, changed, settings.excitation, found.unlike)
    if plot is not None:
        from mjwrap.cli.compare.plot import plot_comparison

        title = f"{Path(settings.model).name}: MuJoCo {mujoco.__version__} and mjwrap, {found.poses} poses"
        outputs.attempt("plot", lambda: plot_comparison(plot, title, found, motion, panels))
    if page is not None:
        from mjwrap.cli.compare.page import write_page

        outputs.attempt(
            "report",
            lambda: write_page(page, settings.model, settings.command, found, verdicts, motion, tables),
        )
    files = {"plot": settings.plot, "report": settings.page, "csv": settings.csv}
    if settings.csv and given is not None:
        files["tables"] = tables_path(settings.csv)
    for what, path in outputs.completed({what: path for what, path in files.items() if path}).items():
        report.say(f"{what + ':':10s} {path}{told.get(what, '')}")
    asked = {name: getattr(settings, name) for name in ("model", "samples", "bases", "seed")}
    report.finish({**asked, **as_values(found, verdicts, motion), "tables": [vars(d) for d in tables]})
    wrong = found.at_fault or any(jump.program == "mjwrap" and not jump.cause for jump in found.jumps)
    if outputs.failed:
        return RUN_FAILED
    return FAULTS if settings.check and wrong else 0


def tables_path(path: str) -> str:
    """Return the file for the given tables, beside the file of `--csv`."""
    return str(Path(path).with_name(f"{Path(path).stem}_tables.csv"))


def read_tables(
    given: GivenTables, model: mujoco.MjModel, muscles: MuscleSystem, start: mujoco.MjData
) -> tuple[Any, Any, Table | None, dict[str, Table]]:
    """Return times (T,) [s] and qpos (T, nq) of the given motion, lengths, and moment arms by joint."""
    states = read_states(model, muscles, start, read_table(given.states))
    arms = {joint: read_table(file) for joint, file in given.moment_arms.items()}
    return states.time, states.qpos, read_table(given.lengths) if given.lengths else None, arms


def compare_all(
    model: mujoco.MjModel, names: list[str] | None, settings: CompareSettings, start: mujoco.MjData,
    rows: PoseRows | None,
) -> PoseComparison:  # fmt: skip
    """Compare at all poses with a progress bar."""
    with contextlib.closing(Stages("motions", "comparing")) as progress:
        return compare_poses(
            model, names=names, samples=settings.samples, bases=settings.bases, seed=settings.seed,
            base=start.qpos, each=rows.add if rows is not None else None, side_rule=settings.side_rule,
            tendons=settings.tendons, progress=progress,
        )  # fmt: skip


def choose(muscles: MuscleSystem, wanted: Sequence[str] | None) -> list[str] | None:
    """Return the names of the muscles that the patterns `wanted` match, None for all."""
    known = [*muscles.names, *muscles.native]
    if not known:
        raise UserError("the model has no muscles and no actuators on spatial tendons: nothing to compare")
    if wanted is None:
        return None
    found: list[str] = []
    for pattern in wanted:
        fit = [name for name in fnmatch.filter(known, pattern) if name not in found]
        if not fit and pattern not in found:
            kind = kinds(muscles).values()
            raise UserError(
                f"no {noun(kind)} '{pattern}'{nearest(pattern, known)}; {noun(kind, True)}: {', '.join(known)}"
            )
        found += fit
    return found
