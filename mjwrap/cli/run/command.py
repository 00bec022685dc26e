"""Simulate a model with its muscles along geodesic paths.

MODEL is an MJCF or MJB file, mjwrap:NAME (a model that comes with mjwrap), or myo_sim:NAME (myo-sim package).

Excitation is PATTERN for all muscles, NAME=PATTERN for the muscles and actuators whose names match (* and ? match any
characters), or a table (.csv, .sto, .mot, .npz) with a column 'time' and a column for each muscle or actuator that it
drives. Several entries may be given; a later one overrides earlier ones. Patterns (times in s, amplitudes in the
actuator's units, phases in turns):
  constant:LEVEL                          step:LEVEL@TIME
  sine:AMPLITUDE,HZ[,OFFSET[,PHASE]]      cosine:AMPLITUDE,HZ[,OFFSET[,PHASE]]
  pulses[:PEAK[,PERIOD]]                  random[:SEED[,HOLD]]

Examples:
  mjwrap run models/elbow/elbow.xml --duration 2 --excitation pulses --record elbow.rrd --plot elbow.png
  mjwrap run models/elbow/elbow.xml --duration 10 --excitation random --serve
  mjwrap run models/elbow/elbow.xml --excitation pulses 'BIC*=constant:0.2' --out elbow.npz --columns qpos,ctrl,length
  mjwrap run models/elbow/elbow.xml --excitation elbow.npz --mode wrench --csv again.csv --json
  mjwrap run models/five_surfaces/five_surfaces.xml --duration 4 --excitation sine:0.5,0.5,0.5 --video five.gif
  mjwrap run models/paper_case2/paper_case2.xml --duration 3 --prescribe cylinder_y=sine:0.02,1 --csv case2.csv
  mjwrap run myo_sim:myoarm_r --mode wrench --excitation random:3 'DELT*=constant:0.5' --out arm.sto
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from mjwrap.cli.common.arguments import (
    add_analysis,
    add_json,
    add_model,
    add_motion,
    add_recording,
    add_serving,
    joint_position,
    pixels,
    positive,
    read_kinds,
    recording_settings,
)
from mjwrap.cli.common.errors import UserError
from mjwrap.cli.run.run_files import FilmSettings, OutputSettings
from mjwrap.cli.run.running import RunCommandSettings, run
from mjwrap.files import SUFFIXES
from mjwrap.runs.engine import MODES, film_mode
from mjwrap.runs.models import INTEGRATORS
from mjwrap.runs.run_table import DEFAULT_KINDS, KINDS
from mjwrap.runs.simulation import RunSettings

COLUMNS = ",".join(DEFAULT_KINDS)
FILM_ONLY = ("camera", "background", "colors", "surfaces", "legend", "shadows")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_model(parser, "keyframe at which the simulation starts", "seed of the pattern 'random'")
    several = {"nargs": "+", "action": "extend", "default": []}
    add = parser.add_argument
    add("--duration", type=positive, default=1.0, metavar="S", help="simulated time (default %(default)s s)")
    add("--timestep", type=positive, metavar="S", help="time step (default: the model's)")
    add("--integrator", choices=INTEGRATORS, type=str.lower, help="integrator (default: the model's)")
    add("--mode", metavar="MODE", help="python: steps a MuscleSystem (default); wrench or "
        "transmission: runs the engine plugin in this mode (--video: wrench, for cables transmission)")  # fmt: skip
    add(
        "--excitation",
        **several,
        metavar="PATTERN|NAME=PATTERN|FILE",
        help="excitation of muscles and other actuators: see above",
    )
    add("--prescribe", **several, metavar="JOINT=PATTERN|FILE", help="joints that follow a constant, sine or cosine "
        "[rad, m; 90deg] or the columns of a table, whatever forces act on them")  # fmt: skip
    add("--qpos", **several, metavar="JOINT=VALUE", help="positions of joints at the start [rad, m; 90deg]")
    add("--strict", action="store_true", help="stop the run when the path of a muscle cannot be found")
    add("--sample", type=positive, default=0.005, metavar="S", help="time between samples of the outputs, "
        "rounded to whole time steps (default %(default)s s)")  # fmt: skip
    recording = parser.add_argument_group("recording")
    places = recording.add_mutually_exclusive_group()
    add_recording(recording, places)
    add_serving(recording, places, "serve the run")
    film = parser.add_argument_group("film").add_argument
    film("--video", metavar="FILE.mp4", help="write a film of the run, drawn by MuJoCo (.mp4, .gif)")
    film(
        "--video-size",
        type=pixels,
        default=(640, 480),
        metavar="WxH",
        help="pixels of the film (default 640x480)",
    )
    film("--fps", type=positive, default=30.0, metavar="N", help="frames per second of the film (default 30)")
    film(
        "--speed",
        type=positive,
        default=1.0,
        metavar="X",
        help="playback speed of the film: simulated seconds per second of film (default 1)",
    )
    film(
        "--camera",
        metavar="NAME",
        help="camera of the film: a camera of the model, or 'muscles', which looks at the muscles (default: a view of "
        "the whole model)",
    )
    film("--background", metavar="COLOUR", default=None, help="behind the model: light (default), dark, '#RRGGBB', or "
        "model, the model's own sky and scenery")  # fmt: skip
    film("--colors", choices=("muscle", "activation", "model"), help="colours of the muscles: one for each muscle, by "
        "activation, or the model's (default: one for each, if the model gives all the same)")  # fmt: skip
    either = argparse.BooleanOptionalAction
    film("--surfaces", action=either, default=None, help="show all wrapping surfaces, translucent, or none (default: "
        "those that the model shows)")  # fmt: skip
    film(
        "--legend",
        action=either,
        default=None,
        help="names beside their colours (default: for up to 12 muscles)",
    )
    film(
        "--shadows", action="store_true", default=None, help="draw shadows, which takes several times as long"
    )
    files = parser.add_argument_group("plot and tables").add_argument
    files(
        "--plot",
        metavar="FILE.png",
        help="plot joints, activations, lengths and tensions over time (.png, .pdf, .svg)",
    )
    files("--out", metavar="FILE", help=f"write a table over time in SI units ({', '.join(SUFFIXES)})")
    files("--csv", metavar="FILE.csv", help="write the table as CSV, with or without --out")
    files("--columns", default=COLUMNS, metavar="KINDS", help="quantities in the tables, separated by "
        f"commas: {', '.join(KINDS)} (default {COLUMNS})")  # fmt: skip
    add_analysis(files)
    add_motion(files)
    add_json(parser, "write the settings, the speed and the problems of the run")


def execute(options: argparse.Namespace) -> int:
    """Run the command and return its exit code."""
    return run(settings(options))


def settings(options: argparse.Namespace) -> RunCommandSettings:
    """Convert the arguments to settings; raises `UserError` if they contradict each other."""
    mode = options.mode or (film_mode(options.model) if options.video else MODES[0])
    if options.video and mode == MODES[0]:
        raise UserError("--video needs the engine plugin: leave --mode out, or write --mode wrench")
    if mode not in MODES:
        raise UserError(f"mode '{mode}' does not exist; modes: {', '.join(MODES)}")
    for name in FILM_ONLY:
        if getattr(options, name) is not None and not options.video:
            raise UserError(f"--{name} needs a film: add --video")
    if options.columns != COLUMNS and not (options.out or options.csv):
        raise UserError("--columns needs a table: add --out or --csv")
    places = (options.record, options.connect, options.serve)
    outputs = OutputSettings(
        recording=recording_settings(options, any(places), "--record, --connect or --serve"),
        film=_film(options),
        plot=options.plot,
        csv=options.csv,
        table=options.out,
        kinds=read_kinds(options.columns),
        analysis=options.analysis,
        motion=options.motion,
    )
    run_settings = RunSettings(
        duration=options.duration,
        sample=options.sample,
        timestep=options.timestep,
        integrator=options.integrator,
        mode=mode,
        excitation=options.excitation,
        seed=options.seed,
        prescribed=options.prescribe,
        keyframe=options.keyframe,
        positions=_positions(options.qpos),
        strict=options.strict,
        side_rule=options.side_rule,
    )
    port = options.port if options.serve else None
    return RunCommandSettings(options.model, run_settings, outputs, serve_port=port, json=options.json)


def _film(options: argparse.Namespace) -> FilmSettings | None:
    if not options.video:
        return None
    width, height = options.video_size
    return FilmSettings(
        options.video, width, height, options.fps, options.speed, options.camera,
        background=options.background or "light", colors=options.colors, surfaces=options.surfaces,
        legend=options.legend, shadows=bool(options.shadows),
    )  # fmt: skip


def _positions(entries: Sequence[str]) -> dict[str, float]:
    """Return start positions by joint from "JOINT=VALUE"."""
    found = {}
    for entry in entries:
        name, equals, text = entry.rpartition("=")
        if not equals:
            raise UserError(
                f"--qpos '{entry}': write JOINT=VALUE, such as {entry}=0.5 [rad or m] or {entry}=30deg"
            )
        found[name] = joint_position(text, f"'{entry}'")
    return found
