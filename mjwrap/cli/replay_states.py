"""From states over time to paths and forces: a recording, a table, or both."""

from __future__ import annotations

import argparse
import contextlib
import sys

import numpy as np

from mjwrap import MuscleSystem, Recorder, read_table
from mjwrap.cli.models import load, start_keyframe, start_state
from mjwrap.cli.output import Output
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
    failures = np.zeros(muscles.n, dtype=np.int64)
    with contextlib.ExitStack() as stack:
        samples = None
        if options.out:
            output = Output(options.out, "--out", SUFFIXES)
            samples = Samples(output, model, muscles, choose_kinds(options.columns))
        recorder = stack.enter_context(Recorder(model, muscles, recording)) if recording else None
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
    print(f"{options.file}: {len(states.time)} states of {options.model}, {span}", file=sys.stderr)
    for remark in states.remarks:
        print(f"  {remark}", file=sys.stderr)
    for name, count in zip(muscles.names, failures.tolist(), strict=True):
        if count:
            reason = muscles.reason(muscles.index(name))
            print(f"  {name}: no path at {count} states; at last {reason}", file=sys.stderr)
    for what, path in (("recording", options.record), ("table", options.out)):
        if path:
            print(f"{what + ':':10s} {path}")
    if interrupt.asked:
        raise KeyboardInterrupt
