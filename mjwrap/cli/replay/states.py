"""Compute paths and forces at the states of a table; write a recording, tables, or both."""

from __future__ import annotations

import contextlib
from dataclasses import replace

import mujoco
import numpy as np

from mjwrap import MuscleSystem, read_table
from mjwrap.cli.common.errors import RUN_FAILED
from mjwrap.cli.common.output import Report, open_analysis, open_motion, open_output
from mjwrap.cli.common.outputs import Outputs
from mjwrap.cli.common.progress import progress_bar
from mjwrap.cli.common.recorded import open_recorder
from mjwrap.cli.common.stopping import Interrupt
from mjwrap.cli.replay.settings import StatesSettings
from mjwrap.files import SUFFIXES
from mjwrap.files.atomic import uninterrupted
from mjwrap.osim.motions import MotionFile
from mjwrap.runs.models import load, start_keyframe, start_state
from mjwrap.runs.muscle_analysis_tables import MuscleAnalysisTables
from mjwrap.runs.run_table import RunTableFile
from mjwrap.runs.state_tables import read_states
from mjwrap.system import CableSystem
from mjwrap.text import counted


def recompute(
    file: str, settings: StatesSettings, *, recording: str | None = None, json: str | None = None
) -> int:
    """Evaluate the muscles at every state of a table; Ctrl-C keeps the states computed so far.

    recording: the file of the recording if the settings name none. json: as `Report` takes it.
    """
    model = load(settings.model)
    data = start_state(model, start_keyframe(model, settings.keyframe))
    muscles = CableSystem(model, side_rule=settings.side_rule)
    states = read_states(model, muscles, data, read_table(file))
    report = Report(json)
    failures = np.zeros(muscles.n, dtype=np.int64)
    with contextlib.ExitStack() as stack:
        with uninterrupted():
            outputs = open_outputs(settings, model, muscles, recording, stack)
        states.put(muscles, data, 0)
        muscles.forward(data)  # compiles the kernels if necessary
        bar = progress_bar(len(states.time), "states", "computing paths")
        done = 0
        with Interrupt() as interrupt, contextlib.closing(bar):
            while done < len(states.time) and not (done and interrupt.asked):
                states.put(muscles, data, done)
                muscles.forward(data)
                failures += muscles.status != 0
                if outputs.any_logs:
                    outputs.log(data)
                done += 1
                bar.update(1)
            outputs.close()
    span = f"{states.time[0]:g} s to {states.time[done - 1]:g} s"
    without = {
        name: f"no path at {counted(count, 'state')}; last reason: {muscles.reason(i)}"
        for i, (name, count) in enumerate(zip(muscles.names, failures.tolist(), strict=True))
        if count
    }
    report.say(f"{file}: {counted(done, 'state')} of {settings.model}, {span}")
    for line in (*states.remarks, *(f"{name}: {why}" for name, why in without.items())):
        report.say(f"  {line}")
    asked = {
        "recording": settings.recording.path, "table": settings.table, "analysis": settings.analysis,
        "motion": settings.motion,
    }  # fmt: skip
    files = outputs.completed({what: path for what, path in asked.items() if path})
    for what, path in files.items():
        report.say(f"{what + ':':10s} {path}")
    report.finish({
        "file": file, "model": settings.model, "muscles": muscles.names, "states": done,
        "start": states.time[0], "end": states.time[done - 1], "remarks": states.remarks, "paths_not_found": without,
        "files": files, "failed": outputs.failed,
    })  # fmt: skip
    if interrupt.asked:
        raise interrupt.asked
    return RUN_FAILED if outputs.failed else 0


def open_outputs(
    settings: StatesSettings, model: mujoco.MjModel, muscles: MuscleSystem, recording: str | None,
    stack: contextlib.ExitStack,
) -> Outputs:  # fmt: skip
    """Open the outputs; `stack` closes what has to be closed if the command ends with an error."""
    outputs = Outputs("replay")
    if settings.table:
        output = open_output(settings.table, "--out", *SUFFIXES)
        table = RunTableFile(output, model, muscles, settings.kinds)
        outputs.add("table", table.log, table.close)
    if settings.analysis:
        analysis = MuscleAnalysisTables(settings.analysis, model, muscles, open_analysis)
        outputs.add("analysis", analysis.log, analysis.close)
    if settings.motion:
        motion = MotionFile(open_motion(settings.motion), model)
        outputs.add("motion", motion.log, motion.close)
    recorded = settings.recording if recording is None else replace(settings.recording, path=recording)
    if recorded.wanted:
        recorder = open_recorder(recorded, model, muscles, stack)
        outputs.add("recording", recorder.log, recorder.close)
    return outputs
