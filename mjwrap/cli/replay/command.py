"""Show a recording or a table of states in rerun's viewer or in a browser, or describe it.

FILE is a recording (.rrd), or a table of states over time (.sto, .mot, .csv, .npz) of the model given by --model. The
columns of a table are named as by mjwrap run (qpos:JOINT, qvel:JOINT, act:ACTUATOR, or activation:MUSCLE and
fiber_length:MUSCLE), by index (qpos[0] and so on), or as in OpenSim's files (JOINT/value, JOINT/speed,
MUSCLE/activation, or JOINT alone). An NPZ file may contain arrays time, qpos, qvel and act instead. Paths and forces
are computed again from the states.

Without options the viewer opens; if there is no display, the recording is served to a browser.

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
    INITIAL_POSE,
    MODEL_HELP,
    RECORDING_DETAILS,
    add_analysis,
    add_json,
    add_motion,
    add_recording,
    add_serving,
    add_side_rule,
    read_kinds,
    recording_settings,
)
from mjwrap.cli.common.errors import UserError
from mjwrap.cli.replay.settings import ReplaySettings, StatesSettings
from mjwrap.cli.replay.showing import replay
from mjwrap.files import SUFFIXES

COLUMNS = "length,velocity,tension"  # default of --columns


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    add = parser.add_argument
    add("file", metavar="FILE", help="recording (.rrd), or table of states (.sto, .mot, .csv, .npz)")
    what = parser.add_mutually_exclusive_group()
    add_serving(parser, what, "serve the recording")
    what.add_argument("--info", action="store_true", help="print the contents of FILE and stop")
    states = parser.add_argument_group("options for a table of states")
    states.add_argument("--model", metavar="MODEL", help=f"model of the states: {MODEL_HELP}")
    states.add_argument(
        "--keyframe",
        metavar="NAME",
        help=f"keyframe for values missing from the table (default: {INITIAL_POSE})",
    )
    add_side_rule(states)
    add_recording(states, states)
    states.add_argument("--out", metavar="FILE", help="write the computed paths and forces as a table")
    states.add_argument(
        "--columns",
        default=COLUMNS,
        metavar="KINDS",
        help="quantities in the table, as for mjwrap run (default %(default)s)",
    )
    add_analysis(states.add_argument)
    add_motion(states.add_argument)
    add_json(parser, "write the contents of FILE")


def execute(options: argparse.Namespace) -> int:
    """Run the command and return its exit code."""
    return replay(settings(options))


def settings(options: argparse.Namespace) -> ReplaySettings:
    """Convert the arguments to settings; raises `UserError` if they contradict each other."""
    _refuse_models(options.file)
    is_table = Path(options.file).suffix.lower() in SUFFIXES
    for option in (
        ()
        if is_table
        else (
            "model",
            "keyframe",
            "side_rule",
            "record",
            "connect",
            *RECORDING_DETAILS,
            "out",
            "analysis",
            "motion",
        )
    ):
        if getattr(options, option):
            raise UserError(
                f"--{option.replace('_', '-')} needs a table of states, and '{options.file}' is not one"
            )
    return ReplaySettings(
        file=options.file,
        states=_states(options) if is_table else None,
        serve=options.serve,
        port=options.port,
        info=options.info,
        json=options.json,
    )


def _refuse_models(file: str) -> None:
    """Raise `UserError`, which says what to do with it, if FILE is a model."""
    name = file.lower()
    if name.endswith(".osim"):
        raise UserError(
            f"'{file}' is a model of OpenSim: mjwrap import {file} makes a MuJoCo model of it; replay "
            f"shows recordings (.rrd), and tables of states ({', '.join(SUFFIXES)}) of the MuJoCo model that --model "
            "names"
        )
    if name.endswith((".xml", ".mjb", ".urdf")) or name.startswith(("mjwrap:", "myo_sim:")):
        raise UserError(
            f"'{file}' is a model, not a recording or a table of states; to make a recording of it: mjwrap run {file} "
            "--excitation pulses --record run.rrd"
        )


def _states(options: argparse.Namespace) -> StatesSettings:
    if not options.model:
        raise UserError(f"'{options.file}' is a table of states: name its model with --model")
    if options.columns != COLUMNS and not options.out:
        raise UserError("--columns needs a table: add --out")
    kept = options.record or options.out or options.analysis or options.motion or options.connect
    if kept and options.serve:
        raise UserError(
            "--serve cannot be combined with --record, --connect, --out, --analysis or --motion; to see a written "
            "recording, replay it"
        )
    # without an output and without --info or --json, a recording is made for the viewer
    recorded = bool(options.record or options.connect) or not (kept or options.info or options.json)
    return StatesSettings(
        model=options.model,
        keyframe=options.keyframe,
        side_rule=options.side_rule,
        recording=recording_settings(options, recorded, "--record or --connect"),
        table=options.out,
        kinds=read_kinds(options.columns),
        analysis=options.analysis,
        motion=options.motion,
    )
