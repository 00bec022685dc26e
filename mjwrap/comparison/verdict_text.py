"""The verdict on each muscle in a sentence: which program is right, and why."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from mjwrap.comparison.judge_geodesic import Fault
from mjwrap.comparison.jumps import EDGE, Jump
from mjwrap.comparison.verdict import MuscleSummary, Outcome
from mjwrap.poses.ties import KINK, TIE
from mjwrap.text import counted


class Verdict(NamedTuple):
    """Which program is right, and why.

    right: "both", "mjwrap", "MuJoCo", "neither", "-" (not compared), or "mjwrap in motion": both are right at every
    single pose, but MuJoCo's path jumps from pose to pose. why: the reason, in words.
    """

    right: str
    why: str


def verdict(summary: MuscleSummary, jumps: Sequence[Jump]) -> Verdict:
    """Return the verdict on a muscle from its summary and its own jumps."""
    if summary.native_only:
        seen = _native_faults(summary, summary.poses, set(Fault))
        told = "; ".join(part for part in (seen, _jumps(jumps, "MuJoCo")) if part)
        return Verdict(
            "-", f"stays with MuJoCo: {summary.native_only}" + (f". MuJoCo's path: {told}" if told else "")
        )
    counts, poses = summary.counts, summary.poses
    breaks = [jump for jump in jumps if jump.cause]
    jumps = [jump for jump in jumps if not jump.cause]
    own_jumps, native_jumps = _jumps(jumps, "mjwrap"), _jumps(jumps, "MuJoCo")
    if summary.at_fault or own_jumps:
        return Verdict("MuJoCo", "; ".join(part for part in (_own_faults(summary), own_jumps) if part))
    no_path = counts[Outcome.NO_PATH.name]
    if no_path == poses:
        return Verdict("neither", _native_faults(summary, poses, {Fault.ENDPOINT_INSIDE}))
    parts = []
    if counts[Outcome.MUJOCO_NOT_GEODESIC.name]:
        parts.append(_native_faults(summary, poses, set(Fault) - {Fault.ENDPOINT_INSIDE}))
    if native_jumps:
        smooth = all(jump.other_smooth for jump in jumps if jump.program == "MuJoCo")
        parts.append(
            f"{native_jumps}, where mjwrap's path {'continues smoothly' if smooth else 'continues or ends'}"
        )
    parts += _other_ways(summary)
    parts += _breaks(summary, breaks)
    right = "mjwrap in motion" if native_jumps else "both"
    if counts[Outcome.MUJOCO_NOT_GEODESIC.name]:
        right = "mjwrap"
    if counts[Outcome.AGREE.name]:
        length, velocity, arm = summary.agreement
        parts.append(
            f"equal at {counts[Outcome.AGREE.name]} of {poses} poses, within {length:.0e} m, {velocity:.0e} m/s, "
            f"{arm:.0e} m/rad"
        )
    if no_path:
        inside = _native_faults(summary, poses, {Fault.ENDPOINT_INSIDE})
        parts.append(inside or f"at {no_path} of {poses} poses neither has a geodesic path")
    return Verdict(right, "; ".join(parts))


def _other_ways(summary: MuscleSummary) -> list[str]:
    """Return, as text, at how many poses both go round a cylinder in different ways, and why."""
    longer = "longer" if summary.longer_branch > 0.0 else "shorter"
    cold = summary.cold_branches
    moving = summary.counts[Outcome.OTHER_BRANCH.name] - summary.ties - cold
    told = (
        "the two go round the cylinder in different ways, both true geodesics "
        f"(mjwrap's up to {1e3 * abs(summary.longer_branch):.3g} mm {longer})"
    )
    found = []
    if moving:
        found.append(
            f"at {moving} of {summary.poses} poses {told}: MuJoCo chooses the side anew at every pose; mjwrap keeps it "
            "along a sweep, because a string cannot pass through the cylinder"
        )
    if cold:
        found.append(
            f"at {cold} of {summary.poses} random poses {told}: MuJoCo chooses the side anew at every pose; mjwrap "
            "starts on the side to which its rule for side sites (side_rule), or its own hint, leads"
        )
    return found


def _breaks(summary: MuscleSummary, jumps: Sequence[Jump]) -> list[str]:
    """Return, as text, where no path has a derivative, so that each program may have another one."""
    found = []
    if summary.ties:
        found.append(
            f"at {counted(summary.ties, 'pose')} the straight line passes through a sphere's centre: all ways round "
            "are equally long, and each program takes one of them"
        )
    kinks = summary.counts[Outcome.KINK.name]
    if kinks:
        found.append(
            f"at {counted(kinks, 'pose')} {KINK}; or {TIE}: no moment arm exists there, and the two programs need not "
            "give the same one"
        )
    for cause in dict.fromkeys(jump.cause for jump in jumps):
        here = [jump for jump in jumps if jump.cause == cause]
        who = " and ".join(p for p in ("MuJoCo", "mjwrap") if any(jump.program == p for jump in here))
        if cause == EDGE:
            size = 1e3 * max(abs(jump.length) for jump in here)
            found.append(f"the length of {who} jumps by up to {size:.3g} mm where {cause}: that is no fault")
            continue
        arm = 1e3 * max(abs(jump.slope) for jump in here)
        found.append(
            f"the moment arm (not the length) of {who} jumps by up to {arm:.3g} mm where {cause}: that is no fault"
        )
    return found


def _native_faults(summary: MuscleSummary, poses: int, kinds: set[Fault]) -> str:
    """Return the faults of MuJoCo's path as text, by kind and geom."""
    told = []
    for (fault, geom), count in summary.faults.most_common():
        if fault in kinds:
            at = f" (geom '{geom}')" if geom else ""
            words = fault.words.format(summary.measures[fault, geom])
            told.append(f"MuJoCo's path is not a geodesic at {count} of {poses} poses{at}: {words}")
    return "; ".join(told)


def _own_faults(summary: MuscleSummary) -> str:
    """Return the faults of mjwrap's path as text."""
    told = []
    failed = summary.counts[Outcome.MJWRAP_FAILED.name]
    if failed:
        reasons = ", ".join(summary.statuses)
        told.append(
            f"mjwrap found no path at {counted(failed, 'pose')} where MuJoCo's is a true geodesic ({reasons})"
        )
    sides = summary.counts[Outcome.WRONG_SIDE.name]
    if sides:
        told.append(
            f"at {counted(sides, 'pose')} mjwrap does not start on the side to which its side site leads at the "
            "reference pose"
        )
    for words, count in summary.own_faults.most_common(3):
        told.append(f"mjwrap's path is not a geodesic at {counted(count, 'pose')}: {words}")
    unexplained = summary.counts[Outcome.UNEXPLAINED.name]
    if unexplained:
        length, velocity, arm = summary.agreement
        told.append(
            f"at {counted(unexplained, 'pose')} both are judged to be the same geodesic, but differ by up to "
            f"{length:.0e} m, {velocity:.0e} m/s, {arm:.0e} m/rad"
        )
    return "; ".join(told)


def _jumps(jumps: Sequence[Jump], program: str) -> str:
    """Return the number and size of the jumps of a program's path as text."""
    own = [jump for jump in jumps if jump.program == program]
    if not own:
        return ""
    length, slope = max(abs(jump.length) for jump in own), max(abs(jump.slope) for jump in own)
    alone, often = sum(jump.alone for jump in own), counted(len(own), "time")
    arm = f"by up to {1e3 * slope:.3g} mm"
    if alone:
        often += f" ({alone if alone < len(own) else 'all'} with a coupled joint moved alone)"
    if not length:
        return f"{program}'s moment arm (not its length) jumps {often}, {arm}"
    return f"{program} jumps {often}, by up to {1e3 * length:.3g} mm" + (
        f", its moment arm {arm}" if slope else ""
    )
