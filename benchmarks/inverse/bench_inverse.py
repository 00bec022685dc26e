"""Time of muscle analysis and inverse dynamics for each frame of a motion, and their errors against slow twins.

    python benchmarks/inverse/bench_inverse.py MODEL ... [--frames 1000] [--rounds 5] [--jobs 1] [--json out.json]

MODEL is a file, "mjwrap:NAME", "myo_sim:NAME" or an .osim file. In the motion all independent hinges and slides swing
within their ranges. Times are medians and 95th percentiles over rounds, in µs a frame, in turn: CPU time of the
process, and wall time. The errors are those of the moment arms against differences along the coupled motion (median
and largest over some frames; the largest are at touchdowns and conditional points, where the arm jumps), and of the
forces against MuJoCo's mj_inverse with constraints disabled, relative to the largest force.
"""

from __future__ import annotations

import argparse
import copy
import json
from pathlib import Path
from time import perf_counter, process_time

import mujoco
import numpy as np

import mjwrap as mw
from mjwrap.inverse.inverse_dynamics import generalized_forces, joint_forces
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.runs import load

STEP, COMPARED = 4e-4, 5
_SCALAR = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", nargs="+", metavar="MODEL")
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    rows = [measure(name, options.frames, options.rounds, options.jobs) for name in options.models]
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n")


def measure(name: str, frames: int, rounds: int, jobs: int) -> dict[str, object]:
    """Return and print the row of a model."""
    model = mw.import_osim(name).spec.compile() if name.endswith(".osim") else load(name)
    muscles, motion = mw.MuscleSystem(model), swinging(model, frames).completed(model)
    works = {
        "muscle analysis": lambda: mw.muscle_analysis(muscles, motion, jobs=jobs),
        "inverse dynamics": lambda: generalized_forces(model, motion),
    }
    analysis = mw.muscle_analysis(muscles, motion)
    times: dict[str, list[float]] = {work: [] for work in works}
    walls: dict[str, list[float]] = {work: [] for work in works}
    for _ in range(rounds):
        for work, run in works.items():
            started, cpu = perf_counter(), process_time()
            run()
            times[work].append((process_time() - cpu) / frames * 1e6)
            walls[work].append((perf_counter() - started) / frames * 1e6)
    row: dict[str, object] = {"model": name, "muscles": muscles.n, "dofs": int(model.nv), "frames": frames}
    row |= {"independent": len(analysis.coordinates), "without path": int((analysis.status != 0).sum())}
    for work, found in times.items():
        row[f"{work}, CPU [us/frame]"] = [round(float(np.percentile(found, p)), 1) for p in (50, 95)]
        row[f"{work}, wall [us/frame]"] = [round(float(np.percentile(walls[work], p)), 1) for p in (50, 95)]
    row["arm errors [m]"] = arm_errors(muscles, motion, analysis)
    row["force error"] = force_error(model, motion)
    print(json.dumps(row))
    return row


def swinging(model: mujoco.MjModel, frames: int) -> mw.Motion:
    """Return a motion of a second at 1 Hz within the middle of all ranges."""
    rng, couplings = np.random.default_rng(3), CoupledJoints(model)
    time = np.arange(frames) / max(frames, 100)
    qpos = np.tile(model.qpos0, (frames, 1))
    for joint in range(model.njnt):
        if int(model.jnt_type[joint]) not in _SCALAR or joint in couplings.leader:
            continue
        at = int(model.jnt_qposadr[joint])
        low, high = (
            model.jnt_range[joint] if model.jnt_limited[joint] else qpos[0, at] + np.array([-0.3, 0.3])
        )
        wave = np.sin(2 * np.pi * time + rng.uniform(0.0, 6.3))
        qpos[:, at] = 0.5 * (low + high) + 0.15 * (high - low) * wave
    columns = np.ascontiguousarray(qpos.T)
    couplings.place(columns)
    return mw.Motion(time, columns.T)


def arm_errors(muscles: mw.MuscleSystem, motion: mw.Motion, analysis: mw.MuscleAnalysis) -> list[float]:
    """Return the median and the largest difference of arms from differences of fourth order."""
    model, data = muscles.model, mujoco.MjData(muscles.model)
    couplings, off = CoupledJoints(model), []

    def length(pose: np.ndarray) -> np.ndarray:
        data.qpos[:] = pose
        muscles.forward(data)
        return muscles.length

    for k in np.linspace(0, len(motion) - 1, COMPARED).astype(int):
        for i, dof in enumerate(couplings.independent.tolist()):
            at = {}
            for s in (-2, -1, 1, 2):
                pose, direction = motion.qpos[k].copy(), np.zeros(model.nv)
                direction[dof] = 1.0
                mujoco.mj_integratePos(model, pose, direction, s * STEP)
                couplings.place(pose)
                at[s] = length(pose)
            slope = (8 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12 * STEP)
            off.append(np.abs(analysis.moment_arm[k, :, i] + slope))
    return [float(np.median(off)), float(np.max(off))]


def force_error(model: mujoco.MjModel, motion: mw.Motion) -> float:
    """Return the largest difference of forces without elimination from mj_inverse, relative to the largest force."""
    whole = motion.completed(model)
    found, wanted = joint_forces(model, whole), np.zeros_like(whole.qvel)
    free = copy.copy(model)
    free.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data = mujoco.MjData(free)
    for k in range(len(whole)):
        data.qpos[:], data.qvel[:], data.qacc[:] = whole.qpos[k], whole.qvel[k], whole.qacc[k]
        mujoco.mj_inverse(free, data)
        wanted[k] = data.qfrc_inverse
    return float(np.abs(found - wanted).max() / np.abs(wanted).max())


if __name__ == "__main__":
    main()
