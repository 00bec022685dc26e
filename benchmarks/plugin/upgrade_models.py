"""Real models with one call of `install`, otherwise unchanged: muscles taken over, behaviour in a run, jumps.

For every model: which muscles mjwrap drives and which stay native, with the reasons; a run under seeded random
excitation (every actuator's control anew ten times a second), beside the native model under the same controls, with the
steps at which a muscle had no path; and sweeps of every joint along which the length or the slope of MuJoCo's tendons
jumps, and whether mjwrap's path does (`mjwrap.comparison`). A star marks a joint that an equality couples to another
and that was moved alone. The models are MJCF files or myo_sim:NAME.

Exit code 1 if a run is not finite or becomes unstable while its native twin does not, or if a path of mjwrap
jumps; 2 for a bad argument.
"""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import mjwrap as mw
from mjwrap.comparison import Jump, compare_poses
from mjwrap.comparison.motion import unstable
from mjwrap.mjcf import name_of, read_declarations
from mjwrap.mjcf.couplings import read_couplings
from mjwrap.paths import Status
from mjwrap.plugin import read
from mjwrap.runs.models import load_spec

MODELS = [f"myo_sim:{name}" for name in ("myolegs", "myoarm_r", "myohand_r", "myotorso", "myofullbody")]
HOLD = 0.1  # [s] that a control is held
Row = dict[str, Any]


def move(model: mujoco.MjModel, seconds: float, seed: int) -> Row:
    """Run a model from its first keyframe, or from qpos0, under random excitation; return what happened."""
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    steps, hold = round(seconds / model.opt.timestep), max(1, round(HOLD / model.opt.timestep))
    low, high = np.where(model.actuator_ctrllimited[:, None], model.actuator_ctrlrange, (0.0, 1.0)).T
    lost: Counter[str] = Counter()
    reasons: Counter[str] = Counter()
    done = 0
    for k in range(steps):
        if k % hold == 0:
            data.ctrl[:] = rng.uniform(low, high)
        mujoco.mj_step(model, data)
        if unstable(data) or not (np.isfinite(data.qpos).all() and np.isfinite(data.qvel).all()):
            break
        done += 1
        if model.nplugin:
            muscles = read(data)
            for m in np.flatnonzero(muscles.status):
                lost[muscles.names[m]] += 1
                reasons[Status(int(muscles.status[m])).message] += 1
    return {
        "steps": done,
        "wanted": steps,
        "lost": lost,
        "reasons": reasons,
    }


def look(native: mujoco.MjModel, samples: int, bases: int, seed: int) -> Row:
    """Return the jumps of both programs' paths along sweeps of every joint of a model, and how many were looked at."""
    found = compare_poses(native, samples=samples, bases=bases, seed=seed)
    wrapped = [name for name, summary in found.muscles.items() if summary.curves and _wraps(native, name)]
    coupled = [name_of(native, mujoco.mjtObj.mjOBJ_JOINT, c.joint) for c in read_couplings(native)]
    return {
        "poses": found.poses,
        "wrapped": len(wrapped),
        "jumps": found.jumps,
        "coupled": coupled,
        "left_out": found.left_out,
    }


def _wraps(model: mujoco.MjModel, muscle: str) -> bool:
    """Return whether the tendon of an actuator has a geom."""
    tendon = int(model.actuator(muscle).trnid[0])
    first = int(model.tendon_adr[tendon])
    kinds = model.wrap_type[first : first + int(model.tendon_num[tendon])]
    return bool(
        np.isin(kinds, (int(mujoco.mjtWrap.mjWRAP_SPHERE), int(mujoco.mjtWrap.mjWRAP_CYLINDER))).any()
    )


def measure(name: str, options: argparse.Namespace) -> Row:
    """Return all figures of one model."""
    native = load_spec(name).compile()
    upgraded = mw.install(load_spec(name))
    declared = read_declarations(native)
    row: Row = {"model": name, "taken_over": len(declared.muscles), "native": declared.native}
    row["run"] = move(upgraded, options.seconds, options.seed)
    row["native_run"] = move(native, options.seconds, options.seed)
    if options.samples:
        row |= look(native, options.samples, options.bases, options.seed)
    return row


def largest(jumps: list[Jump], coupled: list[str]) -> dict[str, Jump]:
    """Return one jump of every muscle: of the largest length, then slope, along a free joint if there is one."""
    order = sorted(jumps, key=lambda jump: (jump.sweep in coupled, -abs(jump.length), -abs(jump.slope)))
    found: dict[str, Jump] = {}
    for jump in order:
        found.setdefault(jump.muscle, jump)
    return found


def reason_words(native: dict[str, str]) -> str:
    """Return why muscles stay native, with names left out and how many there are of each."""
    kinds = Counter(
        " ".join(word for word in reason.split() if "'" not in word) for reason in native.values()
    )
    return "; ".join(f"{count} {kind}" for kind, count in kinds.most_common())


def tell(row: Row) -> None:
    """Print the figures of one model as Markdown."""
    run, twin, why = row["run"], row["native_run"], reason_words(row["native"])
    print(f"\n### {row['model']}\n")
    print(f"{row['taken_over']} muscles taken over, {len(row['native'])} native{': ' * bool(why)}{why}.")
    lost = "".join(f"; {name} at {count} steps" for name, count in run["lost"].most_common())
    print(
        f"Run: {run['steps']} of {run['wanted']} steps (native {twin['steps']}), {sum(run['lost'].values())} times "
        f"no path{lost}."
    )
    for reason, count in run["reasons"].items():
        print(f"Why: {reason} ({count}).")
    if "poses" in row:
        tell_jumps(row)


def tell_jumps(row: Row) -> None:
    """Print the jumps of one model as Markdown."""
    coupled = row["coupled"]
    ours = [jump for jump in row["jumps"] if jump.program == "mjwrap"]
    theirs = largest([jump for jump in row["jumps"] if jump.program != "mjwrap"], coupled)
    print(
        f"Sweeps: {row['poses']} poses; of {row['wrapped']} wrapped tendons {len(theirs)} jump in MuJoCo "
        f"{mujoco.__version__}, {len(largest(ours, coupled))} in mjwrap."
    )
    if row["jumps"]:
        print("\n| muscle | joint | at [rad or m] | length by [mm] | slope by [mm/rad or mm/m] | mjwrap |")
        print("|---|---|---|---|---|---|")
    shown = sorted(theirs.values(), key=lambda jump: -abs(jump.length))
    for jump in shown + sorted(ours, key=lambda jump: jump.muscle):
        beside = "native" if jump.muscle in row["native"] else ("smooth" if jump.other_smooth else "no path")
        if jump.program == "mjwrap":
            beside = f"jumps: {jump.before}, then {jump.after}"
        print(
            f"| {jump.muscle} | {jump.sweep}{'*' * (jump.sweep in coupled)} | {jump.at:.4f} | {1e3 * jump.length:+.1f} "
            f"| {1e3 * jump.slope:+.1f} | {beside} |"
        )


def main() -> int:
    """Run the benchmark; return the exit code."""
    parser = argparse.ArgumentParser(description="Real models with their muscles in the engine plugin.")
    parser.add_argument(
        "models", nargs="*", default=MODELS, help=f"MJCF files or myo_sim:NAME ({' '.join(MODELS)})"
    )
    parser.add_argument("--seconds", type=float, default=10.0, help="length of the run (default 10)")
    parser.add_argument(
        "--samples", type=int, default=101, help="poses of a sweep; 0: no sweeps (default 101)"
    )
    parser.add_argument("--bases", type=int, default=2, help="further poses to sweep around (default 2)")
    parser.add_argument("--seed", type=int, default=0, help="of excitation and poses (default 0)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures to FILE")
    options = parser.parse_args()
    if options.samples < 0 or 0 < options.samples < 3 or options.bases < 0 or options.seconds < 0.0:
        parser.error("--seconds and --bases must not be negative, --samples must be 0, or 3 at least")
    if options.json and not options.json.resolve().parent.is_dir():
        parser.error(f"--json: there is no folder {options.json.resolve().parent}")
    mujoco.set_mju_user_warning(lambda text: None)
    warnings.filterwarnings(
        "ignore", "Attaching a spec"
    )  # of myo_sim's making, about saving the model as XML
    for name in options.models:
        try:
            mw.install(load_spec(name))
        except mw.ModelError as error:
            parser.error(f"{name}: {error}")
    print(f"mjwrap {mw.__version__}, MuJoCo {mujoco.__version__}")
    rows, bad = [], False
    for name in options.models:
        row = measure(name, options)
        tell(row)
        sys.stdout.flush()
        unfinished = row["run"]["steps"] < min(row["run"]["wanted"], row["native_run"]["steps"])
        bad = bad or unfinished or any(jump.program == "mjwrap" for jump in row.get("jumps", []))
        rows.append(row | {"jumps": [asdict(jump) for jump in row.get("jumps", [])]})
        if options.json:
            options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
