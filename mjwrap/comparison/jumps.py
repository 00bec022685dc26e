"""Jumps of length or slope of both programs along a sweep."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mjwrap.comparison.geometry import Fault
from mjwrap.comparison.twins import Batch, Comparer, PathRecord, Twin
from mjwrap.comparison.verdict import slope
from mjwrap.continuity import NARROW, Probe, odd_intervals, refine_jump
from mjwrap.poses import Motion, PoseMaker
from mjwrap.wording import counted

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Jump:
    """A jump of one program's path: where, by how much [m, m/rad], and what the path was before and after.

    base: the number of the pose around which the joint was swept; other_smooth: whether the other program had a path
    there that did not jump; alone: whether the joint is coupled to another one, so that no motion leads there.
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

    @property
    def where(self) -> str:
        """Where it is, with a star where the joint was moved alone."""
        return f"{self.sweep}{' *' * self.alone} = {self.at:.6f}"


def find_jumps(comparer: Comparer, poses: PoseMaker, batch: Batch, joint: int, axis: int = 0) -> list[Jump]:
    """Return the jumps of both programs along a sweep of one joint that has been evaluated."""
    motion, place = batch.motion, poses.maker(joint, axis)
    found: list[Jump] = []
    for twin in batch.twins:
        for program, record in (("MuJoCo", twin.native), ("mjwrap", twin.mjwrap)):
            if record is None:
                continue
            good = np.ones(len(motion.at), dtype=np.bool_) if program == "MuJoCo" else twin.status == 0
            seen: list[float] = []
            for k, bend in odd_intervals(motion.at, record.length, slope(record, motion), good):
                probe = (
                    _native_probe(comparer, twin, place)
                    if program == "MuJoCo"
                    else _mjwrap_probe(comparer, twin, place, motion, k, poses.base)
                )
                ends = float(motion.at[k]), float(motion.at[k + 1])
                jump = refine_jump(probe, *ends, float(np.ptp(motion.at)), bend)
                if jump is None or any(abs(jump[0] - other) < 1e-6 for other in seen):
                    continue
                seen.append(jump[0])
                before, after = _sides(comparer, twin, program, place, jump[0], float(np.ptp(motion.at)))
                found.append(
                    Jump(
                        program, twin.name, motion.name, *jump, before, after, motion.base, alone=motion.alone
                    )
                )
    return [_beside(jump, found, batch) for jump in found]


def _beside(jump: Jump, found: list[Jump], batch: Batch) -> Jump:
    """Note whether the other program was smooth where this one jumps."""
    (twin,) = (twin for twin in batch.twins if twin.name == jump.muscle)
    k = int(np.clip(np.searchsorted(batch.motion.at, jump.at), 1, len(batch.motion.at) - 1))
    jumps_too = any(
        other.program != jump.program and other.muscle == jump.muscle and abs(other.at - jump.at) < 1e-6
        for other in found
    )
    has_path = twin.mjwrap is not None and not twin.status[k - 1 : k + 1].any()
    return replace(jump, other_smooth=has_path and not jumps_too)


def _native_probe(comparer: Comparer, twin: Twin, place: Callable[[float], tuple[Array, Array]]) -> Probe:
    def probe(at: float) -> tuple[float, float]:
        qpos, tangent = place(at)
        length, _, jacobian = comparer.native_at(qpos, np.zeros_like(tangent))
        return float(length[twin.tendon]), float(jacobian[twin.tendon] @ tangent)

    return probe


def _mjwrap_probe(
    comparer: Comparer,
    twin: Twin,
    place: Callable[[float], tuple[Array, Array]],
    motion: Motion,
    k: int,
    base: Array,
) -> Probe:
    """Return a probe that comes to every place from sample k, on the branch that the sweep had there."""
    assert twin.mjwrap is not None
    still = np.zeros(motion.tangent.shape[1])
    comparer.muscles.reset(comparer.data)
    cold = comparer.mjwrap_at(motion.qpos[k], still)[0][twin.index]
    same_branch = abs(cold - twin.mjwrap.length[k]) < 1e-9

    def probe(at: float) -> tuple[float, float]:
        comparer.muscles.reset(comparer.data)
        if same_branch:
            comparer.mjwrap_at(motion.qpos[k], still)
        else:
            comparer.walk(base, motion.qpos[0])
            for qpos in motion.qpos[: k + 1]:
                comparer.mjwrap_at(qpos, still)
        qpos, tangent = place(at)
        length, _, jacobian, _ = comparer.mjwrap_at(qpos, still)
        return float(length[twin.index]), float(jacobian[twin.index] @ tangent)

    return probe


def _sides(
    comparer: Comparer,
    twin: Twin,
    program: str,
    place: Callable[[float], tuple[Array, Array]],
    at: float,
    span: float,
) -> tuple[str, str]:
    """Say what the path was on either side of a jump."""
    ends = [place(at - 2.0 * NARROW * span), place(at + 2.0 * NARROW * span)]
    qpos, tangent = (np.array(part) for part in zip(*ends, strict=True))
    motion = Motion("", np.arange(2.0), qpos, tangent, np.zeros_like(tangent), False)
    for again in comparer.evaluate(motion).twins:
        if again.name == twin.name:
            record = again.native if program == "MuJoCo" else again.mjwrap
            if record is not None:
                return _words(record, 0), _words(record, 1)
    return "", ""


def _words(record: PathRecord, k: int) -> str:
    """Say what a path is at pose k: which surfaces it touches, and whether it is a true geodesic."""
    touched = int(record.touched[k].sum())
    text = f"{counted(touched, 'surface')} touched" if touched else "straight"
    if record.fault[k]:
        return f"{text}, {Fault(int(record.fault[k])).words.format(record.measure[k])}"
    turns = [
        f"{turn:+.2f}" for turn, on in zip(record.turns[k], record.touched[k], strict=True) if on and turn
    ]
    return text + (f", {' '.join(turns)} rad about the axis" if turns else "")
