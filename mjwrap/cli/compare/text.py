"""A comparison as text, and as values for JSON."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import mujoco
import numpy as np

import mjwrap
from mjwrap.comparison import (
    AGREE,
    Jump,
    MotionDifference,
    MuscleSummary,
    Outcome,
    PoseComparison,
    TableDifference,
    Verdict,
)
from mjwrap.comparison.verdict import Extreme
from mjwrap.text import aligned, counted

TITLES = {
    Outcome.AGREE: "equal",
    Outcome.OTHER_BRANCH: "other way round",
    Outcome.MUJOCO_NOT_GEODESIC: "MuJoCo not a geodesic",
    Outcome.NO_PATH: "no path exists",
    Outcome.MJWRAP_FAILED: "mjwrap failed",
    Outcome.MJWRAP_WRONG: "mjwrap wrong",
    Outcome.UNEXPLAINED: "unexplained",
    Outcome.WRONG_SIDE: "wrong side",
    Outcome.KINK: "kink or tie",
}
Say = Callable[[str], object]


def tell_poses(say: Say, found: PoseComparison, verdicts: dict[str, Verdict]) -> None:
    """Print the outcomes and the largest differences of each muscle, then the verdicts and the jumps."""
    both = [s for s in found.muscles.values() if not s.native_only]
    if both:
        _tell_table(say, found, both)
    say("\nwhich program is right, and why")
    equal = [s for s in both if s.counts[Outcome.AGREE.name] == s.poses and verdicts[s.name].right == "both"]
    if equal:
        length, velocity, arm = np.max([s.agreement for s in equal], axis=0)
        told = f"within {length:.0e} m, {velocity:.0e} m/s, {arm:.0e} m/rad"
        say(f"  both, equal at every pose {told}: {', '.join(s.name for s in equal)}")
    for name, (right, why) in verdicts.items():
        if found.muscles[name] not in equal:
            say(f"  {name}: {right}: {why}" if right != "-" else f"  {name}: {why}")
    for name, why in found.left_out.items():
        say(f"  {name}: not compared: {why}")
    far = [s for s in both if s.length.difference > AGREE * s.size]
    if far:
        say("\nlargest differences of length")
        for s in sorted(far, key=lambda s: -s.length.difference)[:10]:
            say(
                f"  {s.name}: MuJoCo {s.length.native:.6f} m, mjwrap {s.length.mjwrap:.6f} m at {where(s.length)}"
            )
    if found.jumps:
        _tell_jumps(say, found)


def _tell_table(say: Say, found: PoseComparison, both: list[MuscleSummary]) -> None:
    shown = [o for o in Outcome if o == Outcome.AGREE or found.total(o)]
    rows = [
        [
            found.noun(),
            "poses",
            *(TITLES[o] for o in shown),
            "largest difference: length [m]",
            "velocity [m/s]",
            "arm [m/rad]",
        ]
    ]
    for s in both:
        gaps = s.length.difference, s.velocity.difference, s.moment_arm.difference
        rows.append(
            [s.name, f"{s.poses}", *(f"{s.counts[o.name]}" for o in shown), *(f"{gap:.1e}" for gap in gaps)]
        )
    say("\n".join(aligned(rows)))


def _tell_jumps(say: Say, found: PoseComparison) -> None:
    """Print the largest jump of each program, muscle and joint."""
    jumps = found.jumps
    largest: dict[tuple[str, str, str], Jump] = {}
    for jump in jumps:
        key = jump.program, jump.muscle, jump.sweep
        if key not in largest or abs(jump.length) > abs(largest[key].length):
            largest[key] = jump
    say(
        f"\njumps along the sweeps: {len(jumps)}{starred(jumps)}; the largest of each {found.noun()} and joint"
    )
    for jump in sorted(largest.values(), key=lambda j: (j.program, j.muscle, j.sweep)):
        say(
            f"  {jump.program} {jump.muscle} at {jump.where}: {millimetres(jump.length)} mm, "
            f"moment arm {millimetres(-jump.slope)} mm; {jump.before} -> {jump.after}"
        )


def starred(jumps: Sequence[Jump]) -> str:
    """Return, as text, how many of the jumps are at coupled joints that were moved alone; empty if none."""
    alone = sum(jump.alone for jump in jumps)
    return f", {alone} of them (*) at coupled joints that were moved alone" if alone else ""


def millimetres(metres: float, digits: int = 3) -> str:
    """Return a difference in mm with its sign, or "0" if its digits are all zero."""
    text = f"{1e3 * metres:+.{digits}f}"
    return text if float(text) else "0"


def where(extreme: Extreme) -> str:
    """Return the place of a largest difference as text."""
    if extreme.motion in extreme.joints:
        return f"{extreme.motion} = {extreme.at:.6f}"
    told = ", ".join(f"{name} = {value:.4f}" for name, value in list(extreme.joints.items())[:6])
    return f"{extreme.motion} {extreme.at:g} ({told}{', ...' if len(extreme.joints) > 6 else ''})"


def tell_tables(say: Say, tables: Sequence[TableDifference], what: str) -> None:
    """Print the differences of both programs from another program's tables, largest first; what: is in them."""
    if not tables:
        return
    say("\ndifferences from the given tables: program minus table, in mm; spread: rms without the mean")
    rows = [[what, "program", "quantity", "rows", "mean", "spread", "largest", "at [s]"]]
    for d in sorted(tables, key=lambda d: -d.spread):
        quantity = f"moment arm, {d.about}" if d.about else "length"
        numbers = [millimetres(x, 4) for x in (d.mean, d.spread, d.largest)]
        rows.append([d.muscle, d.program, quantity, f"{d.rows}", *numbers, f"{d.time:g}"])
    say("\n".join(aligned(rows, (0, 1, 2))))


def unlike_routes(names: Sequence[str]) -> str:
    """Return a remark on muscles that MuJoCo pulls along another route, or not at all."""
    return f"MuJoCo's simulation has another route, or no tendon, for {', '.join(names)}: the motions must differ"


def tell_motion(
    say: Say, motion: MotionDifference, changed: list[str], entries: Sequence[str], unlike: Sequence[str]
) -> None:
    """Print the differences between the two simulations.

    changed: muscles whose law was replaced; unlike: those that MuJoCo pulls along another route, or not at all.
    """
    say(f"\nsimulation over {motion.time[-1]:g} s, excitation {' '.join(entries)}; mjwrap minus MuJoCo")
    if changed:
        those = counted(len(changed), "muscle")
        say(f"  {those} with another law: MuJoCo's curves in both (--law declared: their own law)")
    if unlike:
        say(f"  {unlike_routes(unlike)}")
    dof, gap, when = motion.worst()
    last, final = motion.final()
    if dof:
        say(f"  largest difference {gap:+.3g} {motion.unit(dof)} ({dof}, at {when:g} s)")
        say(f"  at the end {final:+.3g} {motion.unit(last)} ({last})")
    if motion.stopped:
        say(f"  ended early: {motion.stopped}")
    if motion.paths:
        say("  without a path at some steps of mjwrap's simulation:")
        say("\n".join(f"    {line}" for line in motion.paths.splitlines()))


def as_values(
    found: PoseComparison, verdicts: dict[str, Verdict], motion: MotionDifference | None
) -> dict[str, Any]:
    """Return the comparison as values."""
    content: dict[str, Any] = {
        "mujoco": mujoco.__version__,
        "mjwrap": mjwrap.__version__,
        "side_rule": found.side_rule,
        "poses": found.poses,
        "totals": {o.name.lower(): found.total(o) for o in Outcome},
        "muscles": {name: _muscle(s, verdicts[name]) for name, s in found.muscles.items()},
        "jumps": [_jump(jump) for jump in found.jumps],
        "left_out": found.left_out,
    }
    if motion is not None:
        dof, gap, when = motion.worst()
        last, final = motion.final()
        content["motion"] = {
            "duration": float(motion.time[-1]),
            "largest": {"joint": dof, "difference": gap, "time": when},
            "final": {"joint": last, "difference": final},
            "each": dict(zip(motion.dofs, np.abs(motion.difference).max(axis=0).tolist(), strict=True)),
            "stopped": motion.stopped,
            "paths_not_found": motion.paths,
        }
    return content


def _muscle(s: MuscleSummary, verdict: Verdict) -> dict[str, Any]:
    return {
        "right": verdict.right,
        "why": verdict.why,
        "poses": s.poses,
        "counts": {o.name.lower(): s.counts[o.name] for o in Outcome},
        "mujoco_faults": [
            {"fault": fault.name.lower(), "geom": geom, "poses": n, "largest": s.measures[fault, geom]}
            for (fault, geom), n in s.faults.most_common()
        ],
        "agreement": dict(zip(("length", "velocity", "moment_arm"), s.agreement.tolist(), strict=True)),
        "length": vars(s.length),
        "velocity": vars(s.velocity),
        "moment_arm": vars(s.moment_arm),
        "mjwrap_at_fault": [
            {"outcome": outcome.lower(), "motion": motion, "at": at, "joints": joints}
            for outcome, motion, at, joints in s.bad_poses
        ],
    }


def _jump(jump: Jump) -> dict[str, Any]:
    return vars(jump)
