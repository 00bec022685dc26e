"""Run a model: open the outputs, show the progress, and report."""

from __future__ import annotations

import contextlib
import sys
import time
from dataclasses import dataclass, replace

import mujoco

from mjwrap import __version__
from mjwrap.cli.common.errors import RUN_FAILED
from mjwrap.cli.common.output import Report, opened
from mjwrap.cli.common.outputs import Outputs
from mjwrap.cli.common.progress import progress_bar
from mjwrap.cli.common.recorded import end, serve_until_stopped
from mjwrap.cli.common.stopping import Interrupt, Stopped
from mjwrap.cli.run.ending import UNSAVED, ended, positions, undriven
from mjwrap.cli.run.mistakes import warn
from mjwrap.cli.run.run_files import OutputSettings, open_outputs
from mjwrap.errors import ModelError
from mjwrap.files.atomic import uninterrupted
from mjwrap.mjcf.couplings import read_couplings
from mjwrap.recording import Server, serve
from mjwrap.runs.engine import MODES
from mjwrap.runs.simulation import RunSettings, Simulation, WallTime
from mjwrap.system import CableSystem
from mjwrap.text import counted, counted_paths


@dataclass(frozen=True)
class RunCommandSettings:
    """The settings of `mjwrap run`.

    model: a file or a model by name. serve_port: port on which the run is served to a browser, or None. json: a file
    for the report as values, "-" for standard output, or None.
    """

    model: str
    run: RunSettings
    outputs: OutputSettings
    serve_port: int | None = None
    json: str | None = None


def run(settings: RunCommandSettings) -> int:
    """Run a model, report, and return the exit code."""
    simulation = Simulation(settings.model, settings.run, option="--prescribe")
    report = Report(settings.json)
    with contextlib.ExitStack() as stack:
        server = start_server(settings.serve_port, stack)
        with contextlib.ExitStack() as held:
            with uninterrupted():
                wanted = settings.outputs
                if server:
                    wanted = replace(wanted, recording=replace(wanted.recording, connect=server.connect))
                outputs = open_outputs(wanted, settings.model, simulation.engine, held)
            try:
                simulation.begin()
            except ModelError:  # an end lies inside a surface, which may be too large
                warn(settings.model, simulation)
                raise
            warn(settings.model, simulation)
            with Interrupt() as interrupt:
                spent = advance(simulation, outputs, interrupt)
                closing = time.perf_counter()
                outputs.close()
                spent = spent._replace(outputs=spent.outputs + time.perf_counter() - closing)
        files = outputs.completed(settings.outputs.files)
        tell(report, settings, simulation, spent, files)
        report.finish(
            facts(settings, simulation, spent, interrupt.asked) | {"files": files, "failed": outputs.failed}
        )
        if interrupt.asked:
            name = interrupt.asked.name
            print(
                f"mjwrap run: stopped by {name}; the files contain the run up to this moment", file=sys.stderr
            )
            return interrupt.asked.code
        if server:
            told = f"mjwrap run: the run is complete and still served; press Ctrl-C to stop\n{_open(server)}"
            served = serve_until_stopped(server, lambda: print(told, file=sys.stderr))
            return served or (RUN_FAILED if outputs.failed else 0)
        return RUN_FAILED if outputs.failed else 0


def start_server(port: int | None, stack: contextlib.ExitStack) -> Server | None:
    """Start the server of --serve and print its address, so that a browser can follow the run."""
    if port is None:
        return None
    with uninterrupted():
        server = opened(lambda: serve(port=port))
        stack.callback(end, server)
    print(
        f"mjwrap run: rerun serves its viewer for a browser on this machine at port {port}, and the run at port "
        f"{port + 1}, until Ctrl-C\n{_open(server)}",
        file=sys.stderr,
    )
    return server


def _open(server: Server) -> str:
    """Return the line with the address, which comes last."""
    return f"mjwrap run: open {server.address}"


def advance(simulation: Simulation, outputs: Outputs, interrupt: Interrupt) -> WallTime:
    """Run with a progress bar until the end or a signal."""
    bar = progress_bar(simulation.duration, "s", "simulating")
    with contextlib.closing(bar):
        logs = [outputs.log] if outputs.any_logs else []
        return simulation.advance(logs, progress=bar.update, stopped=lambda: interrupt.asked)


def tell(
    report: Report,
    settings: RunCommandSettings,
    simulation: Simulation,
    spent: WallTime,
    files: dict[str, str],
) -> None:
    """Print the settings, the speed and the problems of the run, and its files."""
    engine, muscles = simulation.engine, simulation.muscles
    simulated = engine.data.time
    cables = len(muscles.cables) if isinstance(muscles, CableSystem) else 0
    mode = "" if settings.run.mode == MODES[0] else f", plugin mode {settings.run.mode}"
    step = f"{_integrator(engine.model)}, time step {1e3 * engine.model.opt.timestep:g} ms"
    report.say(f"{settings.model}: {counted_paths(muscles.n, cables)}, {step}{mode}")
    wall = spent.simulation
    rate = f"simulated {simulated:.6g} s in {wall:.3g} s: {simulated / max(wall, 1e-9):.3g} times real time"
    report.say(rate + (f"; {spent.outputs:.3g} s for the files" if spent.outputs > 0.05 * wall else ""))
    for remark in simulation.prescribed.remarks:
        report.say(remark)
    if not muscles.n and not muscles.native:
        switched = any(len(each.equalities) > 1 for each in read_couplings(muscles.model))
        done = "mjwrap only switched the pieces of its couplings" if switched else "MuJoCo alone simulated it"
        report.say(f"the model declares no muscle for mjwrap; {done}")
    if muscles.native:
        report.say(f"{counted(len(muscles.native), 'actuator')} left to MuJoCo:")
        for name, reason in muscles.native.items():
            report.say(f"  {name}: {reason}")
    failed = engine.failures()
    if failed:
        report.say("without a path at some steps:")
        for name, why in failed.items():
            report.say(f"  {name}: {why}")
    if sentence := simulation.pushes.told():
        report.say(sentence)
    report.say(ended(simulation))
    if sentence := undriven(simulation):
        report.say(sentence)
    for what, path in files.items():
        report.say(f"{what + ':':10s} {path}")
    wanted = settings.outputs
    if not (wanted.files or wanted.recording.wanted or settings.json or settings.serve_port):
        report.say(UNSAVED)


def facts(
    settings: RunCommandSettings, simulation: Simulation, spent: WallTime, stopped: Stopped | None
) -> dict[str, object]:
    """Return the report as values."""
    engine = simulation.engine
    return {
        "model": settings.model,
        "mjwrap": __version__,
        "mujoco": mujoco.__version__,
        "mode": settings.run.mode,
        "muscles": engine.muscles.names,
        "native": engine.muscles.native,
        "integrator": _integrator(engine.model),
        "timestep": float(engine.model.opt.timestep),
        "simulated": float(engine.data.time),
        "positions": positions(simulation),
        "undriven": undriven(simulation),
        "pushes": simulation.pushes.found(),
        "wall": spent.simulation,
        "wall_files": spent.outputs,
        "stopped_by": stopped.name if stopped else None,
        "paths_not_found": engine.failures(),
    }


def _integrator(model: mujoco.MjModel) -> str:
    return mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_").lower()
