"""From states over time to paths and forces: a recording, a table, or both."""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Callable

import mujoco
import numpy as np

from mjwrap import MuscleSystem, read_table
from mjwrap.cli.common.models import load, start_keyframe, start_state
from mjwrap.cli.common.output import Report, open_output
from mjwrap.cli.common.progress import progress_bar
from mjwrap.cli.common.recorded import open_recorder
from mjwrap.cli.common.stopping import Interrupt
from mjwrap.cli.run.analysis import Analysis
from mjwrap.cli.run.samples import Samples, choose_kinds
from mjwrap.cli.run.states import read_states
from mjwrap.files import SUFFIXES
from mjwrap.files.atomic import uninterrupted
from mjwrap.text import counted


def recompute(options: argparse.Namespace, recording: str | None) -> None:
    """Evaluate the muscles at every state of a table; Ctrl-C keeps what is done."""
    model = load(options.model)
    data = start_state(model, start_keyframe(model, options.keyframe))
    muscles = MuscleSystem(model)
    states = read_states(model, muscles, data, read_table(options.file))
    report = Report(options.json)
    failures = np.zeros(muscles.n, dtype=np.int64)
    with contextlib.ExitStack() as stack:
        with uninterrupted():
            logs, close = open_outputs(options, model, muscles, recording, stack)
        states.put(muscles, data, 0)
        muscles.forward(data)  # compiles where that is still to do
        bar = progress_bar(len(states.time), "states", "computing paths")
        done = 0
        with Interrupt() as interrupt, contextlib.closing(bar):
            while done < len(states.time) and not (done and interrupt.asked):
                states.put(muscles, data, done)
                muscles.forward(data)
                failures += muscles.status != 0
                for log in logs:
                    log(data)
                done += 1
                bar.update(1)
            close()
            stack.close()
    span = f"{states.time[0]:g} s to {states.time[done - 1]:g} s"
    without = {
        name: f"no path at {counted(count, 'state')}; at last {muscles.reason(i)}"
        for i, (name, count) in enumerate(zip(muscles.names, failures.tolist(), strict=True))
        if count
    }
    report.say(f"{options.file}: {counted(done, 'state')} of {options.model}, {span}")
    for line in (*states.remarks, *(f"{name}: {why}" for name, why in without.items())):
        report.say(f"  {line}")
    outputs = (("recording", options.record), ("table", options.out), ("analysis", options.analysis))
    files = {what: path for what, path in outputs if path}
    for what, path in files.items():
        report.say(f"{what + ':':10s} {path}")
    report.finish({
        "file": options.file, "model": options.model, "muscles": muscles.names, "states": done,
        "start": states.time[0], "end": states.time[done - 1], "remarks": states.remarks, "paths_not_found": without,
        "files": files,
    })  # fmt: skip
    if interrupt.asked:
        raise interrupt.asked


def open_outputs(
    options: argparse.Namespace, model: mujoco.MjModel, muscles: MuscleSystem, recording: str | None,
    stack: contextlib.ExitStack,
) -> tuple[list[Callable[[mujoco.MjData], object]], Callable[[], None]]:  # fmt: skip
    """Open what was asked for: what to call at each state, and what at the end."""
    tables: list[Samples | Analysis] = []
    if options.out:
        output = open_output(options.out, "--out", *SUFFIXES)
        tables.append(Samples(output, model, muscles, choose_kinds(options.columns)))
    if options.analysis:
        tables.append(Analysis(options.analysis, model, muscles))
    logs: list[Callable[[mujoco.MjData], object]] = [table.log for table in tables]
    if recording or options.connect:
        logs.append(open_recorder(options, model, muscles, stack, recording, options.connect or "").log)

    def close() -> None:
        for table in tables:
            table.close()

    return logs, close
