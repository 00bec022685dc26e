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
import os
import sys
import tempfile
from pathlib import Path

from mjwrap.cli.common.arguments import add_analysis
from mjwrap.cli.common.errors import UserError
from mjwrap.cli.common.output import Report, add_json, say
from mjwrap.cli.common.recorded import HOW, add_recording, add_serving, check_how, serve_until_stopped
from mjwrap.errors import RecordingError
from mjwrap.files.atomic import uninterrupted
from mjwrap.recording import Summary, open_native, read_summary, serve
from mjwrap.text import counted

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
    """Look at the whole file first, so that a damaged one is an error here and not an empty viewer."""
    try:
        if Path(options.file).suffix.lower() in (".sto", ".mot", ".csv", ".npz"):
            return replay_states(options)
        for option in ("model", "keyframe", "record", "connect", *HOW, "out", "analysis"):
            if getattr(options, option):
                raise UserError(
                    f"--{option.replace('_', '-')} goes with a table of states, and '{options.file}' is none"
                )
        return show(options, options.file)
    except RecordingError as error:
        raise UserError(str(error)) from None


def show(options: argparse.Namespace, path: str) -> int:
    """Say what a recording holds, or show it."""
    summary = read_summary(path)
    if options.info or options.json:
        report = Report(options.json)
        report.say(describe(summary))
        report.finish({name: str(x) if isinstance(x, Path) else x for name, x in vars(summary).items()})
        return 0
    if options.serve or not has_display():
        with uninterrupted():
            server = serve(path, options.port)
        return serve_until_stopped(server, lambda: say(f"open {server.address}\nCtrl-C stops serving"))
    return open_native(path)


def replay_states(options: argparse.Namespace) -> int:
    """Record what the states of a table look like, and show it, unless it is only to be kept."""
    from mjwrap.cli.replay.states import recompute

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
    if kept or options.info or options.json:
        check_how(options, bool(options.record or options.connect), "--record or --connect")
        recompute(options, options.record)
        return 0
    with tempfile.TemporaryDirectory(prefix="mjwrap-") as folder:
        path = os.path.join(folder, f"{Path(options.file).stem}.rrd")
        recompute(options, path)
        return show(options, path)


def describe(summary: Summary) -> str:
    """What a recording holds, a fact a line."""
    lines = [
        f"file      {summary.path} ({summary.path.stat().st_size / 1e6:.1f} MB)",
        f"model     {summary.model}",
        f"time      {summary.start:g} s to {summary.end:g} s, {counted(summary.states, 'state')}",
        f"muscles   {len(summary.muscles)}: {', '.join(summary.muscles)}",
        f"entities  {len(summary.entities)}:",
    ]
    return "\n".join(lines + [f"    {path}" for path in summary.entities])


def has_display() -> bool:
    """Whether a window can be opened."""
    return sys.platform in ("darwin", "win32") or any(
        os.environ.get(v) for v in ("DISPLAY", "WAYLAND_DISPLAY")
    )
