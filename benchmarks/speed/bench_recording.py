"""Cost of recording: an elbow simulated with and without a Recorder, in turns, in one run.

Prints medians over the turns: wall and processor time of a step (other load on the machine shows in the first, not
in the second), of a call of `log` with its share of the writing, and of what happens once: making the Recorder and
logging the first state (open), writing the last batch and reading the table of contents back (close). A run should be
several batches long: --steps.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

import mujoco
import numpy as np

from mjwrap import MuscleSystem, Recorder
from mjwrap.runs.models import load

ROOT = Path(__file__).resolve().parents[2]
STEPS_BEFORE = 100


def simulate(
    model: mujoco.MjModel, steps: int, path: Path | None, rate: float | None = None
) -> dict[str, float]:
    """Simulate `steps` steps, with a call of `log` after each one where there is a path; times in seconds."""
    muscles, data = MuscleSystem(model), mujoco.MjData(model)
    muscles.step(data, nstep=STEPS_BEFORE)
    opened = time.perf_counter()
    recorder = Recorder(model, muscles, path, rate=rate) if path else None
    if recorder:
        recorder.log(data)
    wall, thread, process = time.perf_counter(), time.thread_time(), time.process_time()
    phase = np.arange(model.nu)
    for _ in range(steps):
        data.ctrl[:] = 0.5 + 0.5 * np.sin(3.0 * data.time + phase)
        muscles.step(data)
        if recorder:
            recorder.log(data)
    ended = time.perf_counter()
    took = {
        "wall": ended - wall,
        "thread": time.thread_time() - thread,
        "process": time.process_time() - process,
    }
    if recorder:
        recorder.close()
        took |= {"open": wall - opened, "close": time.perf_counter() - ended}
    muscles.release()
    return took


def measure(model: mujoco.MjModel, steps: int, turns: int, rate: float | None) -> dict[str, float]:
    """Medians over the turns, per step in microseconds, per run in milliseconds."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bench.rrd"
        simulate(model, steps, path, rate)  # loads rerun, compiles what is still to be compiled
        pairs = [(simulate(model, steps, None), simulate(model, steps, path, rate)) for _ in range(turns)]
        size = path.stat().st_size

    def step_us(kind: str, turn: int) -> float:
        return 1e6 * float(np.median([pair[turn][kind] for pair in pairs])) / steps

    def extra_us(kind: str) -> float:
        return 1e6 * float(np.median([recorded[kind] - plain[kind] for plain, recorded in pairs])) / steps

    report = {f"{kind}_step_us": step_us(kind, 0) for kind in ("wall", "thread", "process")}
    report |= {f"{kind}_log_us": extra_us(kind) for kind in ("wall", "thread", "process")}
    report |= {
        f"{name}_ms": 1e3 * float(np.median([pair[1][name] for pair in pairs])) for name in ("open", "close")
    }
    report["muscles"] = float(MuscleSystem(model).n)
    return report | {"file_bytes": float(size), "steps": float(steps), "turns": float(turns)}


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="bench_recording", description=__doc__, allow_abbrev=False)
    parser.add_argument(
        "--model", default=str(ROOT / "models/elbow/elbow.xml"), help="MJCF file, or myo_sim:NAME"
    )
    parser.add_argument(
        "--rate",
        type=float,
        help="states recorded a second of simulated time; one at every step if not given",
    )
    parser.add_argument("--steps", type=int, default=50_000, help="of a run (default %(default)s)")
    parser.add_argument("--turns", type=int, default=5, help="runs of each kind (default %(default)s)")
    parser.add_argument("--json", metavar="FILE", help="write the numbers there too")
    options = parser.parse_args()
    model = load(options.model)
    report = measure(model, options.steps, options.turns, options.rate)
    states = f"{options.rate:g} Hz" if options.rate else "at every step"
    print(
        f"{Path(options.model).name}, {int(report['muscles'])} muscles, {options.steps} steps of "
        f"{model.opt.timestep:g} s; curves {states}, paths 60 Hz"
    )
    for kind, what in (
        ("wall", "wall clock"),
        ("thread", "processor, main thread"),
        ("process", "processor, all threads"),
    ):
        step, log = report[f"{kind}_step_us"], report[f"{kind}_log_us"]
        print(f"{what:24s} a step {step:7.2f} µs, a log {log:6.2f} µs: {100 * log / step:5.1f} %")
    print(
        f"open {report['open_ms']:.0f} ms, close {report['close_ms']:.0f} ms, {report['file_bytes'] / 1e6:.1f} MB"
    )
    if options.json:
        machine = {
            "cores": os.cpu_count(),
            "processor": platform.machine(),
            "python": platform.python_version(),
        }
        versions = {name: version(name) for name in ("mujoco", "numpy", "rerun-sdk")}
        Path(options.json).write_text(
            json.dumps(report | {"machine": machine, "versions": versions}, indent=2)
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
