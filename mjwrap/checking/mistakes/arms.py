"""Find muscles that move no joint at a pose, and moment arms that change sign over a joint's range."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.checking.mistakes.finding import Mistake, PossibleMistake, millimetres, muscle_of, quoted
from mjwrap.checking.mistakes.pose import Posed
from mjwrap.mjcf.joint_ranges import joint_range
from mjwrap.poses.joint_sweeps import PoseMaker
from mjwrap.text import counted, few

Array = NDArray[np.float64]
LEAST = 1e-3  # moment arm that counts as none, as a share of the muscle's size
CLEAR = 0.01  # least moment arm of either sign, as a share of the muscle's size
SHARE = 0.2  # the same, as a share of its largest moment arm
SAMPLES = 21  # poses of a sweep


def moment_arm_mistakes(posed: Posed) -> Iterator[PossibleMistake]:
    """Yield a finding for every muscle that has a path, crosses a joint, and moves no joint at the pose.

    In random motions of the independent joints the length of such a muscle does not change.
    """
    muscles, rng = posed.muscles, np.random.default_rng(0)
    if not muscles.n or not posed.model.nv:
        return
    matrix = posed.couplings.matrix(posed.data.qpos)
    moved = _moved(posed)
    scale = np.where(posed.turning, 1.0, np.median(posed.sizes))[posed.couplings.independent]
    rest, largest = posed.data.qpos.copy(), np.zeros(muscles.n)
    for _ in range(3):
        speeds = rng.uniform(0.5, 1.0, len(scale)) * rng.choice((-1.0, 1.0), len(scale)) * scale
        largest = np.fmax(largest, np.abs(posed.slopes(rest, matrix @ speeds)))
    for i in np.flatnonzero(posed.found & moved.any(axis=1) & (largest < LEAST * posed.sizes)):
        about = sorted({int(posed.model.dof_jntid[d]) for d in np.flatnonzero(posed.crossed[i])})
        joints = few([quoted(posed.model, "joint", j) for j in about])
        yield PossibleMistake(
            Mistake.NO_MOMENT_ARM,
            muscle_of(posed.model, muscles.declarations[i]),
            f"has no moment arm at the reference pose about the joints that it crosses ({joints})",
            "its path runs through the axis, or along it: check the places of its sites and the axis",
        )


def sign_changes(posed: Posed) -> Iterator[PossibleMistake]:
    """Yield findings about muscles whose moment arm about their main joint has both signs over the joint's range.

    The main joint is that about which a muscle has its largest moment arm. A muscle that crosses only this joint has a
    finding of its own; the others, among which a change is common, as at a shoulder, have one for each joint.
    """
    muscles, model = posed.muscles, posed.model
    maker = PoseMaker(model, posed.data.qpos)
    best, main = np.zeros(muscles.n), np.full(muscles.n, -1)
    told: dict[int, str] = {}
    for joint in maker.joints():
        turning = int(model.jnt_type[joint]) == int(mujoco.mjtJoint.mjJNT_HINGE)
        if maker.follows(joint) or not turning or joint_range(model, joint) is None:
            continue
        sweep = maker.sweep(joint, SAMPLES)
        arms = -np.array([posed.slopes(q, t) for q, t in zip(sweep.qpos, sweep.tangent, strict=True)])
        high, low = np.fmax.reduce(arms, axis=0), np.fmin.reduce(arms, axis=0)
        size = np.nan_to_num(np.fmax(np.abs(high), np.abs(low)))
        for i in np.flatnonzero(size > best).tolist():
            best[i], main[i] = size[i], joint
            told.pop(i, None)
            least = max(SHARE * size[i], CLEAR * posed.sizes[i])
            if high[i] > least and low[i] < -least:
                told[i] = _change(sweep.at, arms[:, i])
    alone = (_moved(posed).sum(axis=1) == 1).tolist()
    for i in sorted(i for i in told if alone[i]):
        yield PossibleMistake(
            Mistake.SIGN_CHANGE,
            muscle_of(posed.model, muscles.declarations[i]),
            f"has moment arms of both signs about {quoted(model, 'joint', int(main[i]))}: {told[i]}",
            "if it should pull one way throughout, add a surface that keeps it on its side of the joint, or check the "
            "joint's range",
        )
    for joint in range(model.njnt):
        several = [muscles.names[i] for i in sorted(told) if main[i] == joint and not alone[i]]
        if several:
            yield PossibleMistake(
                Mistake.SIGN_CHANGE,
                quoted(model, "joint", joint),
                f"is the main joint of {counted(len(several), 'muscle')} with moment arms of both signs over its "
                f"range, which cross other joints too: {few(several)}",
                "this is common at a shoulder or a trunk; check those that should pull one way",
            )


def _moved(posed: Posed) -> NDArray[np.bool_]:
    """Return which independent degrees of freedom (n, k) can change the length of each muscle."""
    matrix = np.abs(posed.couplings.matrix(posed.data.qpos))
    return (posed.crossed.astype(np.float64) @ matrix) > 0.0


def _change(at: Array, arms: Array) -> str:
    known = np.flatnonzero(np.isfinite(arms))
    pairs = zip(known[:-1].tolist(), known[1:].tolist(), strict=True)
    first, last = int(known[0]), int(known[-1])
    near = next(0.5 * (at[k] + at[m]) for k, m in pairs if (arms[k] > 0.0) != (arms[m] > 0.0))
    ends = (f"{_signed(arms[k])} at {np.degrees(at[k]):.3g} deg" for k in (first, last))
    return f"{', '.join(ends)}, zero near {np.degrees(near):.3g} deg"


def _signed(arm: float) -> str:
    return f"{'-' if arm < 0.0 else '+'}{millimetres(abs(float(arm)))}"
