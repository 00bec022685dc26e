"""Memory of the engine plugin over a million steps, a thousand loads of a model, copies, and changes of numbers.

Every kind of use first runs a tenth of its rounds, so that caches fill. Then the process's memory (resident set,
after a garbage collection) is measured ten times. Exit code 1 if the last measurement exceeds the first by more than
the limit of that kind, 2 for a bad argument. Linux only: it reads /proc/self/statm.
"""

from __future__ import annotations

import argparse
import copy
import ctypes
import gc
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import mujoco

import mjwrap as mw

ELBOW = Path(__file__).parents[2] / "models" / "elbow" / "elbow.xml"
LOOKS = 10
PAGE = 4096


class Use(NamedTuple):
    """A kind of use: one round of it (given a running number), how many rounds, and what growth is allowed [kB].

    A leak of 64 bytes a round would be above the limits.
    """

    name: str
    unit: str
    round: Callable[[int], object]
    rounds: int
    limit: int


def resident() -> int:
    """Return the process's memory [kB], after what is free has been given back."""
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * PAGE // 1024


def install(force: float = 0.0) -> mujoco.MjModel:
    """Return the elbow in the plugin; force [N]: added to every muscle's, so that models differ."""
    spec = mujoco.MjSpec.from_file(str(ELBOW))
    for actuator in spec.actuators:
        actuator.gainprm[2] = actuator.biasprm[2] = abs(actuator.gainprm[2]) + force
    return mw.install(spec)


def uses(steps: int, loads: int) -> list[Use]:
    """Return all kinds of use."""
    model = install()
    data, other = mujoco.MjData(model), mujoco.MjData(model)
    data.ctrl[:] = 0.3

    def load(k: int) -> None:
        loaded = install(1.0 + k)
        fresh = mujoco.MjData(loaded)
        mujoco.mj_step(loaded, fresh, nstep=2)

    def copied(k: int) -> None:
        twin = copy.copy(data)
        mujoco.mj_step(model, twin)
        mujoco.mj_copyData(other, model, twin)
        mujoco.mj_resetData(model, other)
        mujoco.mj_step(model, mujoco.MjData(copy.copy(model)))

    def change(k: int) -> None:
        model.numeric_data[:] *= 1.001 if k % 2 else 1.0 / 1.001
        model.geom_size[:] *= 1.001 if k % 2 else 1.0 / 1.001
        mujoco.mj_step(model, data)

    return [
        Use("steps", "1,000 steps", lambda k: mujoco.mj_step(model, data, nstep=1000), steps // 1000, 64),
        Use("loads", "loads of a model", load, loads, 1024),
        Use("copies", "mjData made, copied, reset, freed", copied, loads, 64),
        Use("changes", "changes of numbers", change, loads, 256),
    ]


def soak(use: Use) -> list[int]:
    """Run one kind of use; return what the process held [kB], LOOKS times after the first tenth."""
    done, held = 0, []
    for look in range(LOOKS + 1):
        until = use.rounds * (look + 1) // (LOOKS + 1)
        for k in range(done, until):
            use.round(k)
        done = until
        held.append(resident())
    return held


def main() -> int:
    """Run the soak; return the exit code."""
    parser = argparse.ArgumentParser(description="Memory of the engine plugin over a long use.")
    parser.add_argument("--steps", type=int, default=1_000_000, help="time steps (default 1,000,000)")
    parser.add_argument(
        "--loads", type=int, default=1000, help="loads, copies and changes, each (default 1000)"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures to FILE")
    options = parser.parse_args()
    if options.steps < 20_000 or options.loads < 200:
        parser.error("fewer than 20,000 steps or 200 loads show nothing: caches fill first")
    if options.json and not options.json.resolve().parent.is_dir():
        parser.error(f"--json: there is no folder {options.json.resolve().parent}")
    print(f"mjwrap {mw.__version__}, MuJoCo {mujoco.__version__}; resident memory [kB]")
    grown: list[str] = []
    rows: dict[str, dict[str, object]] = {}
    for use in uses(options.steps, options.loads):
        began = time.perf_counter()
        held = soak(use)
        took, growth = time.perf_counter() - began, held[-1] - held[1]
        rows[use.name] = {"rounds": use.rounds, "resident_kB": held, "growth_kB": growth, "seconds": took}
        print(
            f"{use.rounds:6d} {use.unit:35s}{held[1]:9d} after {use.rounds * 2 // (LOOKS + 1):4d}, {held[-1]:9d} "
            f"at the end, growth {growth:5d} (limit {use.limit}), {took:.0f} s"
        )
        if growth > use.limit:
            grown.append(use.name)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    if grown:
        print(f"memory grows with: {', '.join(grown)}", file=sys.stderr)
    return 1 if grown else 0


if __name__ == "__main__":
    sys.exit(main())
