"""Time of a simulation step under MuscleSystem.step and under native mj_step of the same model.

The native twin is the same file without mjwrap's declarations: MuJoCo's own tendons and muscles pull. Blocks of steps
of both alternate and start from the same state; ratios are taken between neighbours. A third kind of block runs with
every compiled kernel and every MuJoCo call timed, for a rough breakdown; what is left is Python. mjwrap's model still
holds the native tendons, and MuJoCo still computes them. Times are the CPU time of the thread. Exit code 1 where a path
was not found, 2 for a bad argument.
"""

from __future__ import annotations

import argparse
import importlib
import json
import pkgutil
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import thread_time as clock
from typing import Any

import mujoco
import numpy as np
from numba.core.registry import CPUDispatcher

import mjwrap as mw
from mjwrap import kernels

ELBOW = Path(__file__).parents[2] / "models" / "elbow" / "elbow.xml"
INTEGRATORS = ("Euler", "RK4")
BLOCK = 100  # steps between two looks at the clock
Row = dict[str, Any]


def load(path: Path, declared: bool, integrator: str) -> mujoco.MjModel:
    """Load a model with or without its mjwrap tuples."""
    spec = mujoco.MjSpec.from_file(str(path))
    if not declared:
        for element in list(spec.tuples):
            spec.delete(element)
    model = spec.compile()
    model.opt.integrator = int(getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}"))
    return model


def cases() -> tuple[list[tuple[str, Path, bool]], str]:
    """Return label, file and whether mjwrap's declarations count; and why one is missing."""
    found = [("elbow, De Groote-Fregly", ELBOW, True), ("elbow, MuJoCo's curves", ELBOW, False)]
    try:
        import myo_sim
    except ImportError as error:
        return found, f"myo_sim's elbow: no ({error})"
    return [*found, ("myo_sim's elbow", Path(myo_sim.get_xml_path("elbow")), False)], ""


class Meter:
    """Adds up the time spent in wrapped functions, less what the wrapping itself takes."""

    def __init__(self) -> None:
        self.spent = 0.0
        self.calls = 0
        self.cost = 0.0
        noop = self.wrap(lambda: None)
        for _ in range(2000):
            noop()
        self.cost = self.spent / self.calls
        self.spent, self.calls = 0.0, 0

    def wrap(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function with its time added to this meter."""

        def timed(*arguments: Any, **options: Any) -> Any:
            began = clock()
            try:
                return function(*arguments, **options)
            finally:
                self.spent += clock() - began
                self.calls += 1

        return timed

    def per_step(self, steps: int) -> float:
        """Microseconds per step."""
        return 1e6 * max(self.spent - self.calls * self.cost, 0.0) / steps


@contextmanager
def metered(kernel: Meter, engine: Meter) -> Iterator[None]:
    """Time every compiled kernel that is called from Python, and MuJoCo's steps, for the length of a with block."""
    changed: list[tuple[Any, str, Any]] = []

    def replace(module: Any, name: str, meter: Meter) -> None:
        changed.append((module, name, getattr(module, name)))
        setattr(module, name, meter.wrap(getattr(module, name)))

    for found in pkgutil.walk_packages(kernels.__path__, f"{kernels.__name__}."):
        module = importlib.import_module(found.name)
        for name, value in list(vars(module).items()):
            if isinstance(value, CPUDispatcher):
                replace(module, name, kernel)
    for name in ("mj_step1", "mj_step2", "mj_step"):
        replace(mujoco, name, engine)
    try:
        yield
    finally:
        for module, name, value in changed:
            setattr(module, name, value)


class Runner:
    """One model that is run in blocks from the same start; muscles: None for the native twin."""

    def __init__(self, path: Path, declared: bool, integrator: str, native: bool) -> None:
        self.model = load(path, declared and not native, integrator)
        self.data = mujoco.MjData(self.model)
        self.muscles = None if native else mw.MuscleSystem(self.model)

    def block(self) -> float:
        """Run one block; return microseconds per step."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[0], self.data.ctrl[:], self.data.act[:] = 1.0, 0.3, 0.3
        if self.muscles is not None:
            self.muscles.reset(self.data)
        began = clock()
        for _ in range(BLOCK):
            if self.muscles is None:
                mujoco.mj_step(self.model, self.data)
            else:
                self.muscles.step(self.data)
        return 1e6 * (clock() - began) / BLOCK


def measure(path: Path, declared: bool, integrator: str, repeats: int) -> Row:
    """Return the figures of one model under one integrator."""
    ours, native = (Runner(path, declared, integrator, twin) for twin in (False, True))
    assert ours.muscles is not None
    kernel, engine = Meter(), Meter()
    for runner in (ours, native):
        runner.block()
    times = []
    for k in range(repeats):
        pair = [ours.block(), native.block()] if k % 2 else [native.block(), ours.block()][::-1]
        times.append(pair)
        with metered(kernel, engine):
            ours.block()
    mine, theirs = np.array(times).T
    steps = repeats * BLOCK
    row: Row = {
        "muscles": ours.muscles.n,
        "failures": int(ours.muscles.failures.sum()),
        "mjwrap": float(np.median(mine)),
        "mjwrap_p95": float(np.percentile(mine, 95)),
        "native": float(np.median(theirs)),
        "native_p95": float(np.percentile(theirs, 95)),
        "ratio": float(np.median(mine / theirs)),
        "per_muscle": float(np.median(mine - theirs) / ours.muscles.n),
        "kernels": kernel.per_step(steps),
        "kernel_calls": kernel.calls / steps,
    }
    # under RK4 kernels run inside mj_step's callback: their time and the callback's Python are in mj_step's
    row["engine"] = engine.per_step(steps) if integrator == "Euler" else row["native"]
    row["python"] = max(row["mjwrap"] - row["kernels"] - row["engine"], 0.0)
    return row


def main() -> int:
    """Run the benchmark; return the exit code."""
    parser = argparse.ArgumentParser(description="Time per step of MuscleSystem.step and of native mj_step.")
    parser.add_argument(
        "--repeats", type=int, default=30, help=f"blocks of {BLOCK} steps of each (default 30)"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures to FILE")
    options = parser.parse_args()
    if options.repeats < 1:
        parser.error(f"--repeats must be at least 1, not {options.repeats}")
    if options.json and not options.json.resolve().parent.is_dir():
        parser.error(f"--json: there is no folder {options.json.resolve().parent}")
    print(
        f"mjwrap {mw.__version__}, MuJoCo {mujoco.__version__}; microseconds of CPU time per step, median (p95)"
    )
    print(
        f"{'':25}{'':7}{'mjwrap':>15}{'native':>15}{'ratio':>7}{'a muscle':>10}"
        f"   of mjwrap's: {'MuJoCo':>7}{'kernels':>9}{'(calls)':>9}{'Python':>8}"
    )
    found, missing = cases()
    rows: dict[str, Row] = {}
    for label, path, declared in found:
        for integrator in INTEGRATORS:
            row = rows[f"{label}, {integrator}"] = measure(path, declared, integrator, options.repeats)
            print(
                f"{label:25}{integrator:7}{row['mjwrap']:7.1f} ({row['mjwrap_p95']:.1f}){row['native']:8.1f} "
                f"({row['native_p95']:.1f}){row['ratio']:7.2f}{row['per_muscle']:10.2f}{'':16}{row['engine']:8.1f}"
                f"{row['kernels']:9.1f}{row['kernel_calls']:9.1f}{row['python']:8.1f}"
                + (f"   FAILURES {row['failures']}" if row["failures"] else "")
            )
    if missing:
        print(missing)
    if options.json:
        try:
            options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        except OSError as error:
            print(f"bench_step.py: cannot write {options.json}: {error.strerror}", file=sys.stderr)
            return 2
    return 1 if any(row["failures"] for row in rows.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
