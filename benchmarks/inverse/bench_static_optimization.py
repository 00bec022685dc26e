"""Speed of static optimisation: frames per second of the whole chain, from positions to activations.

    python benchmarks/inverse/bench_static_optimization.py [--models arm legs "full body"] [--frames N] [--json FILE]
    python benchmarks/inverse/bench_static_optimization.py --opensim MODEL.osim [--frames N]

The first form takes models of the package myo_sim, along a smooth motion about their first pose. A run is everything:
velocities and accelerations by splines, paths, moment arms, forces, inverse dynamics, optimisation. It prints the
median over the repetitions, in CPU time of the process on one thread, the shares of the parts, and how much faster two
threads are by the clock on the wall, which needs two idle cores. With --target, exit code 1 where a limb is below 5,000
frames a second, the full body below 1,000, or two threads below 1.7 times one.

The second form needs the package `opensim`. It runs OpenSim's StaticOptimization and mjwrap on the same file along the
same motion of its coordinates, one after the other in one process, and prints the ratio; with --target, exit code 1
below 500.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import mjwrap as mw
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.runs import load

MODELS = {"arm": "myoarm", "legs": "myolegs", "full body": "myofullbody"}
LEAST = {"full body": 1000.0}  # frames a second
LEAST_LIMB, LEAST_THREADS, LEAST_RATIO = 5000.0, 1.7, 500.0
REPETITIONS = 5
RATE = 200.0  # frames per second of motion


def main() -> int:
    arguments = read_arguments()
    if arguments.opensim:
        rows = [beside_opensim(arguments.opensim, arguments.frames)]
    else:
        rows = [measure(label, arguments.frames) for label in arguments.models]
    if arguments.json:
        Path(arguments.json).write_text(json.dumps(rows, indent=1) + "\n")
    return int(arguments.target and not all(row["reached"] for row in rows))


def read_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--models", nargs="+", default=list(MODELS), choices=list(MODELS))
    parser.add_argument("--opensim", help="an .osim file to run both on")
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--json")
    parser.add_argument("--target", action="store_true")
    return parser.parse_args()


def smooth_motion(model: mujoco.MjModel, frames: int) -> mw.Motion:
    """Return a motion of all hinges and slides about the first pose, within their ranges, with their followers."""
    rng = np.random.default_rng(1)
    when = np.arange(frames) / RATE
    start = model.key_qpos[0] if model.nkey else model.qpos0
    qpos = np.tile(start, (frames, 1))
    for joint in range(model.njnt):
        if int(model.jnt_type[joint]) < 2:  # free or ball
            continue
        at = int(model.jnt_qposadr[joint])
        low, high = model.jnt_range[joint] if model.jnt_limited[joint] else (-1.0, 1.0)
        size = 0.15 * (high - low)
        middle = min(max(float(start[at]), low + size), high - size)
        qpos[:, at] = middle + size * np.sin(
            2.0 * np.pi * rng.uniform(0.4, 1.0) * when + rng.uniform(0.0, 6.3)
        )
    placed = np.ascontiguousarray(qpos.T)
    CoupledJoints(model).place(placed)
    return mw.Motion(when, np.ascontiguousarray(placed.T))


def seconds(run: Callable[[], Any], clock: Callable[[], float]) -> float:
    """Return the median time of a call that was made once before."""
    run()
    times = []
    for _ in range(REPETITIONS):
        begin = clock()
        run()
        times.append(clock() - begin)
    return statistics.median(times)


def measure(label: str, frames: int) -> dict[str, Any]:
    """Return and print a row of one model of myo_sim."""
    model = load(f"myo_sim:{MODELS[label]}")
    muscles = mw.MuscleSystem(model)
    motion = smooth_motion(model, frames)
    whole, cpu = motion.completed(model), time.process_time
    parts = {
        "splines": seconds(lambda: motion.completed(model), cpu),
        "muscles": seconds(lambda: mw.muscle_analysis(muscles, whole), cpu),
        "dynamics": seconds(lambda: mw.inverse_dynamics(model, whole), cpu),
    }
    one = seconds(lambda: mw.static_optimization(muscles, motion, jobs=1), cpu)
    parts["optimisation"] = max(one - sum(parts.values()), 0.0)
    walls = [
        seconds(lambda jobs=jobs: mw.static_optimization(muscles, motion, jobs=jobs), time.perf_counter)
        for jobs in (1, 2)
    ]
    found = mw.static_optimization(muscles, motion)
    row = {
        "model": label, "muscles": muscles.n, "coordinates": len(found.coordinates), "frames": frames,
        "frames per second": frames / one, "two threads over one": walls[0] / walls[1],
        "microseconds": {name: 1e6 * each / frames for name, each in parts.items()},
        "solved": int(found.solved.sum()),
    }  # fmt: skip
    enough = row["frames per second"] >= LEAST.get(label, LEAST_LIMB)
    row["reached"] = bool(enough and row["two threads over one"] >= LEAST_THREADS and found.solved.all())
    shares = ", ".join(f"{name} {each:.0f}" for name, each in row["microseconds"].items())
    print(
        f"{label}: {muscles.n} muscles, {row['coordinates']} coordinates, {row['solved']} of {frames} frames solved; "
        f"{row['frames per second']:,.0f} frames a second (us: {shares}); "
        f"two threads x {row['two threads over one']:.2f}",
        flush=True,
    )
    return row


def beside_opensim(path: str, frames: int) -> dict[str, Any]:
    """Return and print a row of both programs on one model."""
    import opensim
    from freeze_static_optimization import add_reserves, run

    opensim.Logger.setLevelString("Error")
    spec = mw.import_osim(path).spec
    model = spec.compile()
    motion = smooth_motion(model, frames)
    muscles = mw.MuscleSystem(model)
    mine = seconds(
        lambda: mw.static_optimization(muscles, motion, jobs=1, **mw.OPENSIM_PARITY), time.process_time
    )
    with tempfile.TemporaryDirectory() as folder:
        theirs = opensim.Model(path)
        add_reserves(theirs, 1.0)
        theirs.printToXML(str(Path(folder, "model.osim")))
        values = [coordinate_values(model, qpos) for qpos in motion.qpos]
        names = list(values[0])
        lines = [
            "motion",
            "version=1",
            f"nRows={frames}",
            f"nColumns={len(names) + 1}",
            "inDegrees=no",
            "endheader",
        ]
        lines.append("\t".join(["time", *names]))
        for when, row in zip(motion.time, values, strict=True):
            lines.append("\t".join(f"{x:.17g}" for x in (when, *row.values())))
        Path(folder, "motion.mot").write_text("\n".join([*lines, ""]))
        begin = time.process_time()
        run(str(Path(folder, "model.osim")), str(Path(folder, "motion.mot")), folder, motion.time[-1], 1e-4)
        other = time.process_time() - begin
    ratio = other / mine
    each = 1e6 * other / frames, 1e6 * mine / frames
    print(f"{Path(path).name}: OpenSim {each[0]:,.0f} us, mjwrap {each[1]:.0f} us a frame: {ratio:.0f} times")
    reached = ratio >= LEAST_RATIO
    return {"model": Path(path).name, "frames": frames, "microseconds": each, "reached": reached}


def coordinate_values(model: mujoco.MjModel, qpos: np.ndarray) -> dict[str, float]:
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    return mw.osim.coordinates(model, data)


if __name__ == "__main__":
    sys.exit(main())
