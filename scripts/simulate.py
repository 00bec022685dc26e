#!/usr/bin/env python3
"""Simulate any model with its muscles along geodesic paths.

MODEL is an MJCF or MJB file, or myo_sim:NAME, a model that the myo_sim package composes.

Excitation is a pattern for all muscles, NAME=PATTERN for those whose names match (* and ? stand for anything; any
actuator may be named), or a CSV file with a column 'time' and one for each muscle or actuator that it drives. Several
may be given; a later one wins. Patterns (times in s, amplitudes in the actuator's units, phase in turns):
  constant:LEVEL                          step:LEVEL@TIME
  sine:AMPLITUDE,HZ[,OFFSET[,PHASE]]      cosine:AMPLITUDE,HZ[,OFFSET[,PHASE]]
  pulses[:PEAK[,PERIOD]]                  random[:SEED[,HOLD]]

Examples:
  simulate.py models/elbow/elbow.xml --duration 2 --excitation pulses --record out/elbow.rrd --plot out/elbow.png
  simulate.py models/paper_case2/paper_case2.xml --duration 3 --prescribe cylinder_y=sine:0.02,1 --csv out/case2.csv
"""

from __future__ import annotations

import argparse
import contextlib
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path

import mujoco
from _common import (
    INTEGRATORS,
    INTERRUPTED,
    Interrupt,
    Output,
    Parser,
    UserError,
    at_least,
    load,
    need_matplotlib,
    positive,
    progress_bar,
    run,
    start_keyframe,
    start_state,
)
from _history import CsvWriter, History
from _prescribe import Prescribed, check_free

from mjwrap import MuscleSystem, Recorder, Status
from mjwrap.errors import RecordingError
from mjwrap.excitation import Excitation

Log = Callable[[mujoco.MjData], object]


def read_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(
        prog="simulate",
        description=__doc__,
        allow_abbrev=False,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("model", help="MJCF or MJB file, or myo_sim:NAME")
    add("--duration", type=positive, default=1.0, metavar="S", help="simulated time (default %(default)s s)")
    add("--timestep", type=positive, metavar="S", help="instead of the model's")
    add("--integrator", choices=INTEGRATORS, type=str.lower, help="instead of the model's")
    add(
        "--excitation",
        nargs="+",
        action="extend",
        default=[],
        metavar="PATTERN|NAME=PATTERN|FILE",
        help="see above",
    )
    add("--prescribe", nargs="+", action="extend", default=[], metavar="JOINT=PATTERN|FILE", help="joints that follow "
        "a constant, sine or cosine [rad, m] or the columns of a CSV file, whatever pulls at them")  # fmt: skip
    add("--keyframe", metavar="NAME", help="start there")
    add(
        "--qpos",
        nargs="+",
        action="extend",
        default=[],
        metavar="JOINT=VALUE",
        help="start positions [rad, m]",
    )
    add("--record", metavar="FILE.rrd", help="recording for the rerun viewer (scripts/replay.py)")
    add(
        "--plot",
        metavar="FILE.png",
        help="joints, activations, lengths and tensions over time (png, pdf, svg)",
    )
    add("--csv", metavar="FILE.csv", help="the same as numbers, SI units")
    add(
        "--sample",
        type=positive,
        default=0.005,
        metavar="S",
        help="time between samples (default %(default)s s)",
    )
    add("--strict", action="store_true", help="stop where a muscle's path cannot be found")
    add(
        "--seed",
        type=at_least(0),
        default=0,
        metavar="N",
        help="for the pattern 'random' (default %(default)s)",
    )
    return parser.parse_args(arguments)


def simulate(options: argparse.Namespace) -> int:
    """Set up, run, and say what happened and where the files are."""
    model = load(options.model)
    if options.timestep is not None:
        model.opt.timestep = options.timestep
    if options.integrator is not None:
        model.opt.integrator = INTEGRATORS[options.integrator]
    muscles = MuscleSystem(model, strict=options.strict)
    data = start_state(model, start_keyframe(model, options.keyframe), options.qpos)
    excitation = Excitation(muscles, options.excitation, options.seed)
    prescribed = Prescribed(model, options.prescribe)
    check_free(prescribed.joints, options.qpos, model)

    plot = Output(options.plot, "--plot", (".png", ".pdf", ".svg")) if options.plot else None
    table = Output(options.csv, "--csv", (".csv",)) if options.csv else None
    if plot is not None:
        need_matplotlib()
    history = History(muscles)
    with contextlib.ExitStack() as stack:
        logs: list[Log] = [history.log] if plot is not None else []
        writer = CsvWriter(table, model, muscles) if table is not None else None
        if writer is not None:
            logs.append(writer.log)
        if options.record:
            logs.append(stack.enter_context(_recorder(model, muscles, options.record)).log)
        with Interrupt() as interrupt:
            wall = advance(model, data, muscles, excitation, prescribed, options, logs, interrupt)
        if writer is not None:
            writer.close()
        if plot is not None:
            from _plot_run import plot_run

            plot_run(plot, f"{Path(options.model).name}, {data.time:.4g} s", model, muscles, history)
    report(options, model, data, muscles, wall)
    if interrupt.asked:
        print("simulate: stopped by Ctrl-C; the files hold what was simulated", file=sys.stderr)
        return INTERRUPTED
    return 0


def _recorder(model: mujoco.MjModel, muscles: MuscleSystem, path: str) -> Recorder:
    """Return a recorder; what is wrong with its place is the user's to mend."""
    try:
        return Recorder(model, muscles, path)
    except RecordingError as error:
        raise UserError(str(error)) from None


def advance(
    model: mujoco.MjModel, data: mujoco.MjData, muscles: MuscleSystem, excitation: Excitation, prescribed: Prescribed,
    options: argparse.Namespace, logs: list[Log], interrupt: Interrupt,
) -> float:  # fmt: skip
    """Run for the asked duration or until Ctrl-C; return the wall time [s]."""
    timestep = float(model.opt.timestep)
    steps = max(1, math.ceil(options.duration / timestep - 1e-6))
    stride = max(1, round(options.sample / timestep))
    prescribed.place(data)
    excitation.write(data)
    muscles.forward(data)  # compiles where that is still to do, before the clock starts
    inside = [i for i, status in enumerate(muscles.status) if status == Status.ENDPOINT_INSIDE]
    for i in inside[:1]:
        raise UserError(f"muscle '{muscles.names[i]}' has no path at the start: {muscles.reason(i)}")
    started = time.perf_counter()
    bar = progress_bar(steps * timestep, "s", "simulating")
    try:
        for k in range(steps):
            if k % stride == 0:
                sample(data, muscles, logs)
                bar.update(0.0 if k == 0 else stride * timestep)
            if interrupt.asked:
                break
            prescribed.drive(data)
            muscles.step(data)
            prescribed.place(data)
            excitation.write(data)
        else:
            sample(data, muscles, logs)
    finally:
        bar.close()
    return time.perf_counter() - started


def sample(data: mujoco.MjData, muscles: MuscleSystem, logs: list[Log]) -> None:
    """Log the present state, muscles included."""
    if logs:
        muscles.forward(data)
        for log in logs:
            log(data)


def report(
    options: argparse.Namespace,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    muscles: MuscleSystem,
    wall: float,
) -> None:
    """Print what was run, how fast, what went wrong, and where the files are."""
    kind = mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_").lower()
    s = "s" * (muscles.n != 1)
    print(f"{options.model}: {muscles.n} muscle{s}, {kind}, time step {1e3 * model.opt.timestep:g} ms")
    print(f"simulated {data.time:.6g} s in {wall:.3g} s: {data.time / max(wall, 1e-9):.3g} times real time")
    if muscles.native:
        print(f"{len(muscles.native)} stay with MuJoCo's own tendons:")
        for name, reason in muscles.native.items():
            print(f"  {name}: {reason}")
    failed = muscles.report()
    if failed:
        print("paths not found (the last good force was held):")
        print("\n".join(f"  {line}" for line in failed.splitlines()))
    for what, path in (("recording", options.record), ("plot", options.plot), ("csv", options.csv)):
        if path:
            print(f"{what + ':':10s} {path}")


def main(arguments: list[str] | None = None) -> int:
    """Run the script; see `_common.run` for exit codes."""
    options = read_arguments(arguments)
    return run("simulate", lambda: simulate(options))


if __name__ == "__main__":
    sys.exit(main())
