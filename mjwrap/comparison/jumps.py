"""Find the jumps of length or slope of both programs along a sweep."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mjwrap.comparison.judge_geodesic import Fault
from mjwrap.comparison.paired_evaluation import Batch, Comparer, MusclePair, PathRecord
from mjwrap.comparison.verdict import slope
from mjwrap.poses.continuation import Found, Place
from mjwrap.poses.continuity import NARROW, jump_candidates, refine_jump, smallest_jumps
from mjwrap.poses.joint_sweeps import PoseMaker, PoseSequence
from mjwrap.poses.ties import KINK, TIE
from mjwrap.text import counted

BOTH = "the path that both have found bends"
EDGE = "a conditional path point comes or goes"
AS_MUCH = 1e-3  # largest difference of two jumps that are the same, as a share of their size
SAME_PLACE = 1e-6  # largest distance of one jump from itself, as a share of the sweep's range


@dataclass(frozen=True)
class Jump:
    """A jump of one program's path along a sweep.

    Attributes:
        program: "MuJoCo" or "mjwrap".
        muscle: name of the muscle.
        sweep: the joint that was swept.
        at: value of the joint at the jump [rad or m].
        length: change of length [m].
        slope: change of slope [m/rad or m/m].
        before: the path before the jump, in words.
        after: the path after the jump, in words.
        base: number of the pose around which the joint was swept.
        other_smooth: whether the other program had a path there that did not jump.
        alone: whether a coupled joint was moved alone, which no motion of the model does.
        cause: why no path has a continuous moment arm there, of either program, or that a conditional path point
            comes or goes; empty for all other jumps.
    """

    program: str
    muscle: str
    sweep: str
    at: float
    length: float
    slope: float
    before: str
    after: str
    base: int = 0
    other_smooth: bool = False
    alone: bool = False
    cause: str = ""

    @property
    def where(self) -> str:
        """The place of the jump as text, with a star if the joint was moved alone."""
        return f"{self.sweep}{' *' * self.alone} = {self.at:.6f}"


def find_jumps(comparer: Comparer, poses: PoseMaker, batch: Batch, joint: int, axis: int = 0) -> list[Jump]:
    """Return the jumps of both programs along an evaluated sweep of one joint."""
    motion, place = batch.motion, poses.maker(joint, axis)
    span, found = float(np.ptp(motion.at)), list[Jump]()
    mine = [pair.index for pair in batch.pairs if pair.mjwrap is not None]
    own = comparer.follower.jumps(place, batch.trace, motion.turning, mine)
    for pair in batch.pairs:
        told = [("MuJoCo", jump) for jump in _native_jumps(comparer, pair, place, motion)]
        told += [("mjwrap", jump) for i, jump in own if i == pair.index]
        for program, jump in told:
            before, after, cause = _sides(comparer, pair, program, place, jump[0], span)
            told_as = program, pair.name, motion.name, *jump, before, after, motion.base
            beside = NARROW * span
            ends = jump[0] - beside, jump[0] + beside
            edge = program == "mjwrap" and comparer.follower.is_conditional_edge(place, pair.index, *ends)
            cause = EDGE if edge else "" if jump[1] else cause
            found.append(Jump(*told_as, alone=motion.alone, cause=cause))
    found = [replace(jump, cause=jump.cause or _shared(jump, found, span)) for jump in found]
    return [_with_other_smooth(jump, found, batch) for jump in found]


def _shared(jump: Jump, found: list[Jump], span: float) -> str:
    """Return `BOTH` if the other program's moment arm jumps there by as much, and neither length does."""
    for other in found:
        same_place = other.muscle == jump.muscle and abs(other.at - jump.at) < SAME_PLACE * span
        as_much = abs(other.slope - jump.slope) <= AS_MUCH * abs(jump.slope)
        if other.program != jump.program and same_place and as_much and not (other.length or jump.length):
            return BOTH
    return ""


def _with_other_smooth(jump: Jump, found: list[Jump], batch: Batch) -> Jump:
    """Set whether the other program is smooth at a jump."""
    (pair,) = (pair for pair in batch.pairs if pair.name == jump.muscle)
    k = int(np.clip(np.searchsorted(batch.motion.at, jump.at), 1, len(batch.motion.at) - 1))
    near = SAME_PLACE * float(np.ptp(batch.motion.at))
    jumps_too = any(
        other.program != jump.program and other.muscle == jump.muscle and abs(other.at - jump.at) < near
        for other in found
    )
    has_path = pair.mjwrap is not None and not pair.status[k - 1 : k + 1].any()
    return replace(jump, other_smooth=has_path and not jumps_too)


def _native_jumps(comparer: Comparer, pair: MusclePair, place: Place, motion: PoseSequence) -> list[Found]:
    """Return the jumps of MuJoCo's tendon, whose path depends only on the pose."""

    def probe(at: float) -> tuple[float, float]:
        qpos, tangent = place(at)
        length, _, jacobian = comparer.native_at(qpos, np.zeros_like(tangent))
        return float(length[pair.tendon]), float(jacobian[pair.tendon] @ tangent)

    found: list[Found] = []
    span, least = float(np.ptp(motion.at)), smallest_jumps(pair.size, motion.turning)
    length, slopes, good = (
        pair.native.length,
        slope(pair.native, motion),
        np.ones(len(motion.at), dtype=np.bool_),
    )
    for k, bend in jump_candidates(motion.at, length, slopes, good, least):
        jump = refine_jump(probe, float(motion.at[k]), float(motion.at[k + 1]), span, bend, least)
        if jump is not None and all(abs(jump[0] - other[0]) >= SAME_PLACE * span for other in found):
            found.append(jump)
    return found


def _sides(
    comparer: Comparer,
    pair: MusclePair,
    program: str,
    place: Place,
    at: float,
    span: float,
) -> tuple[str, str, str]:
    """Describe the path on either side of a jump, and a cause that both programs have."""
    ends = [place(at + side * NARROW * span) for side in (-2.0, 2.0, 0.0)]
    qpos, tangent = (np.array(part) for part in zip(*ends, strict=True))
    motion = PoseSequence("", np.arange(3.0), qpos, tangent, np.zeros_like(tangent), False)
    for again in comparer.evaluate(motion).pairs:
        if again.name == pair.name:
            record = again.native if program == "MuJoCo" else again.mjwrap
            if record is not None:
                cause = TIE if again.tie[2] else KINK if again.kink[2] else ""
                return _words(record, 0), _words(record, 1), cause
    return "", "", ""


def _words(record: PathRecord, k: int) -> str:
    """Describe a path at pose k: the surfaces that it touches, and whether it is a true geodesic."""
    touched = int(record.touched[k].sum())
    text = f"{counted(touched, 'surface')} touched" if touched else "straight"
    if record.fault[k]:
        return f"{text}, {Fault(int(record.fault[k])).words.format(record.measure[k])}"
    turns = [
        f"{turn:+.2f}" for turn, on in zip(record.turns[k], record.touched[k], strict=True) if on and turn
    ]
    return text + (f", {' '.join(turns)} rad about the axis" if turns else "")
