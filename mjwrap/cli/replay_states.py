"""From states over time to paths and forces: a recording, a table, or both."""

from __future__ import annotations

import argparse
import contextlib

import numpy as np

from mjwrap import MuscleSystem, Recorder, read_table
from mjwrap.cli.models import load, start_keyframe, start_state
from mjwrap.cli.output import Report, open_output, opened
from mjwrap.cli.progress import Interrupt, progress_bar
from mjwrap.cli.samples import Samples, choose_kinds
from mjwrap.cli.states import read_states
from mjwrap.files import SUFFIXES


def recompute(options: argparse.Namespace, recording: str | None) -> None:
    """Evaluate the muscles at every state of a table; Ctrl-C keeps what is done."""
    model = load(options.model)
    data = start_state(model, start_keyframe(model, options.keyframe))
    muscles = MuscleSystem(model)
    states = read_states(model, muscles, data, read_table(options.file))
    report = Report(options.json)
    failures = np.zeros(muscles.n, dtype=np.int64)
    with contextlib.ExitStack() as stack:
        samples = None
        if options.out:
            output = open_output(options.out, "--out", *SUFFIXES)
            samples = Samples(output, model, muscles, choose_kinds(options.columns))
        recorder = None
        if recording:
            recorder = stack.enter_context(opened(lambda: Recorder(model, muscles, recording)))
        bar = progress_bar(len(states.time), "states", "computing paths")
        with Interrupt() as interrupt, contextlib.closing(bar):
            for k in range(len(states.time)):
                if interrupt.asked:
                    break
                states.put(data, k)
                muscles.forward(data)
                failures += muscles.status != 0
                if recorder is not None:
                    recorder.log(data)
                if samples is not None:
                    samples.log(data)
                bar.update(1)
        if samples is not None:
            samples.close()
    span = f"{states.time[0]:g} s to {states.time[-1]:g} s"
    without = {
        name: f"no path at {count} states; at last {muscles.reason(i)}"
        for i, (name, count) in enumerate(zip(muscles.names, failures.tolist(), strict=True))
        if count
    }
    report.say(f"{options.file}: {len(states.time)} states of {options.model}, {span}")
    for line in (*states.remarks, *(f"{name}: {why}" for name, why in without.items())):
        report.say(f"  {line}")
    files = {what: path for what, path in (("recording", options.record), ("table", options.out)) if path}
    for what, path in files.items():
        report.say(f"{what + ':':10s} {path}")
    report.finish({
        "file": options.file, "model": options.model, "muscles": muscles.names, "states": len(states.time),
        "start": states.time[0], "end": states.time[-1], "remarks": states.remarks, "paths_not_found": without,
        "files": files,
    })  # fmt: skip
    if interrupt.asked:
        raise KeyboardInterrupt
