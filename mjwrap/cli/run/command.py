"""Simulate any model with its muscles along geodesic paths.

MODEL is an MJCF or MJB file, or myo_sim:NAME, a model that the myo-sim package composes.

Excitation is a pattern for all muscles, NAME=PATTERN for those whose names match (* and ? stand for anything; any
actuator may be named), or a table (.csv, .sto, .mot, .npz) with a column 'time' and one for each muscle or actuator
that it drives. Several may be given; a later one wins. Patterns (times in s, amplitudes in the actuator's units, phase
in turns):
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
import contextlib
import math
import sys
import time
from typing import NamedTuple

import mujoco
import numpy as np

from mjwrap import Status, __version__
from mjwrap.cli.common.arguments import add_analysis, add_model, pixels, positive
from mjwrap.cli.common.errors import UserError
from mjwrap.cli.common.models import INTEGRATORS, set_state, start_keyframe
from mjwrap.cli.common.output import Report, add_json, opened
from mjwrap.cli.common.progress import progress_bar
from mjwrap.cli.common.recorded import add_recording, add_serving, check_how, end, serve_until_stopped
from mjwrap.cli.common.stopping import Interrupt, Stopped
from mjwrap.cli.run.engine import MODES, Engine, start_engine
from mjwrap.cli.run.outputs import OUTPUTS, Log, open_outputs
from mjwrap.cli.run.prescribe import Prescribed, check_free
from mjwrap.cli.run.samples import KINDS, USUAL
from mjwrap.files import SUFFIXES
from mjwrap.files.atomic import uninterrupted
from mjwrap.recording import Server, serve
from mjwrap.runs.excitation import Excitation
from mjwrap.text import counted


class Spent(NamedTuple):
    """Wall time [s]: of the simulation, and of sampling, drawing and writing it."""

    simulation: float
    outputs: float


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which arguments there are."""
    add_model(parser, "start there", "for the pattern 'random'")
    several = {"nargs": "+", "action": "extend", "default": []}
    add = parser.add_argument
    add("--duration", type=positive, default=1.0, metavar="S", help="simulated time (default %(default)s s)")
    add("--timestep", type=positive, metavar="S", help="instead of the model's")
    add("--integrator", choices=INTEGRATORS, type=str.lower, help="instead of the model's")
    add("--mode", metavar="MODE", help="what runs the muscles: python, in steps (default); or the engine plugin, as "
        "mjwrap.install knows it: wrench (default with --video), transmission")  # fmt: skip
    add("--excitation", **several, metavar="PATTERN|NAME=PATTERN|FILE", help="see above")
    add("--prescribe", **several, metavar="JOINT=PATTERN|FILE", help="joints that follow a constant, sine or cosine "
        "[rad, m] or the columns of a table, whatever pulls at them")  # fmt: skip
    add("--qpos", **several, metavar="JOINT=VALUE", help="start positions [rad, m]")
    add("--strict", action="store_true", help="stop where a muscle's path cannot be found")
    add("--sample", type=positive, default=0.005, metavar="S", help="time between samples, rounded to whole time "
        "steps (default %(default)s s)")  # fmt: skip
    recording = parser.add_argument_group("recording")
    places = recording.add_mutually_exclusive_group()
    add_recording(recording, places)
    add_serving(recording, places, "show the run")
    film = parser.add_argument_group("film").add_argument
    film("--video", metavar="FILE.mp4", help="film, drawn offscreen by MuJoCo (mp4, gif)")
    film("--video-size", type=pixels, default=(640, 480), metavar="WxH", help="of the film (default 640x480)")
    film("--fps", type=positive, default=30.0, metavar="N", help="frames a second of the film (default 30)")
    film(
        "--speed",
        type=positive,
        default=1.0,
        metavar="X",
        help="simulated seconds a second of it (default 1)",
    )
    film(
        "--camera",
        metavar="NAME",
        help="a camera of the model, for the film, or 'muscles', one that looks at them (default: all of the model)",
    )
    files = parser.add_argument_group("plot and tables").add_argument
    files(
        "--plot",
        metavar="FILE.png",
        help="joints, activations, lengths and tensions over time (png, pdf, svg)",
    )
    files("--out", metavar="FILE", help=f"table over time, SI units ({', '.join(SUFFIXES)})")
    files("--csv", metavar="FILE.csv", help="another table, or the only one, as CSV")
    files("--columns", default=USUAL, metavar="KINDS", help="what the tables hold, of "
        f"{', '.join(KINDS)} (default {USUAL})")  # fmt: skip
    add_analysis(files)
    add_json(parser, "what was run, how fast, and what went wrong")


def execute(options: argparse.Namespace) -> int:
    """Set up, run, and say what happened and where the files are."""
    options.mode = options.mode or ("wrench" if options.video else MODES[0])
    if options.video and options.mode == MODES[0]:
        raise UserError(
            "--video shows the muscles of the engine plugin: leave --mode out, or let it be wrench"
        )
    if options.mode not in MODES:
        raise UserError(f"mode '{options.mode}' does not exist; modes: {', '.join(MODES)}")
    if options.camera and not options.video:
        raise UserError("--camera is for a film: it goes with --video")
    if options.columns != USUAL and not (options.out or options.csv):
        raise UserError("--columns says what a table holds: it goes with --out or --csv")
    places = (options.record, options.connect, options.serve)
    check_how(options, any(places), "--record, --connect or --serve")
    engine = start_engine(options.model, options.mode, options.strict)
    for model in {id(m): m for m in (engine.model, engine.muscles.model)}.values():
        if options.timestep is not None:
            model.opt.timestep = options.timestep
        if options.integrator is not None:
            model.opt.integrator = INTEGRATORS[options.integrator]
    set_state(engine.model, engine.data, start_keyframe(engine.model, options.keyframe), options.qpos)
    excitation = Excitation(engine.muscles, options.excitation, options.seed)
    prescribed = Prescribed(engine.model, options.prescribe)
    check_free(prescribed.joints, options.qpos, engine.model)
    report = Report(options.json)
    with contextlib.ExitStack() as stack:
        server = start_server(options, stack)
        with contextlib.ExitStack() as outputs:
            with uninterrupted():
                logs, closes = open_outputs(options, engine, outputs, server.connect if server else "")
            begin(engine, excitation, prescribed)
            with Interrupt() as interrupt:
                spent = advance(engine, excitation, prescribed, options, logs, interrupt)
                closing = time.perf_counter()
                for close in closes:
                    close()
                outputs.close()
        if logs:
            spent = spent._replace(outputs=spent.outputs + time.perf_counter() - closing)
        tell(report, options, engine, spent)
        report.finish(facts(options, engine, spent, interrupt.asked))
        if interrupt.asked:
            name = interrupt.asked.name
            print(f"mjwrap run: stopped by {name}; the files hold what was simulated", file=sys.stderr)
            return interrupt.asked.code
        if server:
            told = "mjwrap run: done, and still served; Ctrl-C stops serving"
            return serve_until_stopped(server, lambda: print(told, file=sys.stderr))
        return 0


def start_server(options: argparse.Namespace, stack: contextlib.ExitStack) -> Server | None:
    """Start what --serve asks for and say where it is, so that a browser can follow the run."""
    if not options.serve:
        return None
    with uninterrupted():
        server = opened(lambda: serve(port=options.port))
        stack.callback(end, server)
    print(f"mjwrap run: open {server.address}", file=sys.stderr)
    return server


def begin(engine: Engine, excitation: Excitation, prescribed: Prescribed) -> None:
    """Put the model where it starts; compiles where that is still to do, before the clock starts."""
    prescribed.place(engine.data)
    excitation.write(engine.data)
    engine.look()
    muscles = engine.muscles
    inside = muscles.held & (muscles.status == Status.ENDPOINT_INSIDE)
    for i in np.flatnonzero(inside)[:1].tolist():
        raise UserError(f"muscle '{muscles.names[i]}' has no path at the start: {muscles.reason(i)}")


def advance(
    engine: Engine, excitation: Excitation, prescribed: Prescribed, options: argparse.Namespace, logs: list[Log],
    interrupt: Interrupt,
) -> Spent:  # fmt: skip
    """Run for the asked duration or until it is to stop; return the time that it took."""
    data, timestep = engine.data, float(engine.model.opt.timestep)
    steps = max(1, math.ceil(options.duration / timestep - 1e-6))
    stride = max(1, round(options.sample / timestep))
    started, outputs = time.perf_counter(), 0.0
    bar = progress_bar(steps * timestep, "s", "simulating")
    try:
        for k in range(steps):
            if k % stride == 0:
                outputs += sample(engine, logs)
                bar.update(0.0 if k == 0 else stride * timestep)
            if interrupt.asked:
                break
            prescribed.drive(data)
            engine.step()
            prescribed.place(data)
            excitation.write(data)
        else:
            outputs += sample(engine, logs)
    finally:
        bar.close()
    return Spent(time.perf_counter() - started - outputs, outputs)


def sample(engine: Engine, logs: list[Log]) -> float:
    """Log the present state, muscles included; return the time [s] that it took."""
    started = time.perf_counter()
    if logs:
        engine.look()
        for log in logs:
            log(engine.seen)
    return time.perf_counter() - started


def tell(report: Report, options: argparse.Namespace, engine: Engine, spent: Spent) -> None:
    """Say what was run, how fast, what went wrong, and where the files are."""
    muscles, simulated = engine.muscles, engine.data.time
    mode = "" if options.mode == MODES[0] else f", plugin mode {options.mode}"
    step = f"{_integrator(engine.model)}, time step {1e3 * engine.model.opt.timestep:g} ms"
    report.say(f"{options.model}: {counted(muscles.n, 'muscle')}, {step}{mode}")
    wall = spent.simulation
    rate = f"simulated {simulated:.6g} s in {wall:.3g} s: {simulated / max(wall, 1e-9):.3g} times real time"
    report.say(rate + (f"; {spent.outputs:.3g} s for the files" if spent.outputs > 0.05 * wall else ""))
    if not muscles.n and not muscles.native:
        report.say("the model declares no muscle that mjwrap could drive; only MuJoCo moved it")
    if muscles.native:
        report.say(f"{counted(len(muscles.native), 'actuator')} left to MuJoCo:")
        for name, reason in muscles.native.items():
            report.say(f"  {name}: {reason}")
    failed = engine.failures()
    if failed:
        report.say("muscles without a path at some steps:")
        for name, why in failed.items():
            report.say(f"  {name}: {why}")
    for what, option in OUTPUTS:
        if getattr(options, option):
            report.say(f"{what + ':':10s} {getattr(options, option)}")


def facts(
    options: argparse.Namespace, engine: Engine, spent: Spent, stopped: Stopped | None
) -> dict[str, object]:
    """Return the same as values."""
    return {
        "model": options.model,
        "mjwrap": __version__,
        "mujoco": mujoco.__version__,
        "mode": options.mode,
        "muscles": engine.muscles.names,
        "native": engine.muscles.native,
        "integrator": _integrator(engine.model),
        "timestep": float(engine.model.opt.timestep),
        "simulated": float(engine.data.time),
        "wall": spent.simulation,
        "wall_files": spent.outputs,
        "stopped_by": stopped.name if stopped else None,
        "paths_not_found": engine.failures(),
        "files": {what: getattr(options, option) for what, option in OUTPUTS if getattr(options, option)},
    }


def _integrator(model: mujoco.MjModel) -> str:
    return mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_").lower()
