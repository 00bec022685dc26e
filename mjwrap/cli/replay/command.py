"""Look at a recording, or at a file of states: in rerun's own viewer, in a browser, or say what it holds.

FILE is a recording (.rrd), or a table of states over time (.sto, .mot, .csv, .npz) of the model that --model names.
Its columns: qpos:JOINT, qvel:JOINT, act:ACTUATOR or activation:MUSCLE and fiber_length:MUSCLE, as mjwrap run writes
them; qpos[0] and so on; JOINT/value, JOINT/speed, MUSCLE/activation or just JOINT, as in OpenSim's files. An NPZ file
may have arrays time, qpos, qvel and act instead. Paths and forces are computed again from them.

Without an option the viewer opens, or where there is no display the recording is served to a browser.

Examples:
  mjwrap replay elbow.rrd
  mjwrap replay elbow.rrd --info
  mjwrap replay elbow.npz --model models/elbow/elbow.xml --record again.rrd
  mjwrap replay ik.mot --model arm.xml --out paths.sto --columns length,moment_arm
"""

from __future__ import annotations

import argparse
from pathlib import Path

from mjwrap.cli.common.arguments import (
    HOW,
    add_analysis,
    add_json,
    add_recording,
    add_serving,
    read_kinds,
    recording_settings,
)
from mjwrap.cli.common.errors import UserError
from mjwrap.cli.replay.settings import ReplaySettings, StatesSettings
from mjwrap.cli.replay.showing import replay
from mjwrap.files import SUFFIXES

COLUMNS = "length,velocity,tension"  # of a table, unless others are asked for


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which arguments there are."""
    add = parser.add_argument
    add("file", metavar="FILE", help="recording (.rrd), or table of states (.sto, .mot, .csv, .npz)")
    what = parser.add_mutually_exclusive_group()
    add_serving(parser, what, "serve it")
    what.add_argument("--info", action="store_true", help="say what it holds, and stop")
    states = parser.add_argument_group("for a table of states")
    states.add_argument("--model", metavar="MODEL", help="MJCF or MJB file, or myo_sim:NAME")
    states.add_argument("--keyframe", metavar="NAME", help="what the table does not name is as there")
    add_recording(states, states)
    states.add_argument("--out", metavar="FILE", help="paths and forces as a table")
    states.add_argument("--columns", default=COLUMNS, metavar="KINDS", help="what it holds, as mjwrap run has it "
        "(default %(default)s)")  # fmt: skip
    add_analysis(states.add_argument)
    add_json(parser, "what the file holds")


def execute(options: argparse.Namespace) -> int:
    """Show, record or describe a file, and return the exit code."""
    return replay(settings(options))


def settings(options: argparse.Namespace) -> ReplaySettings:
    """Return what the arguments ask for; `UserError` where they do not fit together."""
    is_table = Path(options.file).suffix.lower() in SUFFIXES
    for option in () if is_table else ("model", "keyframe", "record", "connect", *HOW, "out", "analysis"):
        if getattr(options, option):
            raise UserError(
                f"--{option.replace('_', '-')} goes with a table of states, and '{options.file}' is none"
            )
    return ReplaySettings(
        file=options.file,
        states=_states(options) if is_table else None,
        serve=options.serve,
        port=options.port,
        info=options.info,
        json=options.json,
    )


def _states(options: argparse.Namespace) -> StatesSettings:
    if not options.model:
        raise UserError(f"'{options.file}' is a table of states: --model says of which model")
    if options.columns != COLUMNS and not options.out:
        raise UserError("--columns says what a table holds: it goes with --out")
    kept = options.record or options.out or options.analysis or options.connect
    if kept and options.serve:
        raise UserError(
            "--serve is for what is not kept: leave --record, --connect, --out and --analysis away, or replay the "
            "recording"
        )
    # what is neither kept nor only described is recorded for the viewer
    recorded = bool(options.record or options.connect) or not (kept or options.info or options.json)
    return StatesSettings(
        model=options.model,
        keyframe=options.keyframe,
        recording=recording_settings(options, recorded, "--record or --connect"),
        table=options.out,
        kinds=read_kinds(options.columns),
        analysis=options.analysis,
    )
