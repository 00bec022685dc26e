"""Find joints whose ranges look like degrees taken for radians, or the reverse, and models in millimetres."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from mjwrap.checking.mistakes.finding import Mistake, PossibleMistake, quoted
from mjwrap.checking.mistakes.pose import Posed
from mjwrap.mjcf.joint_ranges import TURNS, joint_range

NARROW = np.radians(5.0)  # [rad] a hinge with a smaller range hardly moves
IDLE = np.radians(0.3)  # [rad] a hinge that stays within this is meant to stand still
LONG = 20.0  # [m] of all muscles
_HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)


def joint_mistakes(posed: Posed) -> Iterator[PossibleMistake]:
    """Yield findings about the ranges of the hinges that muscles cross, and about the unit of length."""
    model = posed.model
    used = {int(model.dof_jntid[d]) for d in np.flatnonzero(posed.crossed.any(axis=0))}
    for joint in sorted(used):
        low, high = (float(x) for x in model.jnt_range[joint])
        if low > high:
            yield PossibleMistake(
                Mistake.JOINT_RANGE,
                quoted(model, "joint", joint),
                f"has a range from {low:.4g} down to {high:.4g}, which MuJoCo does not enforce",
                "write its lower end first",
            )
        if int(model.jnt_type[joint]) != _HINGE or not model.jnt_limited[joint]:
            continue
        if joint in posed.couplings.leader:
            continue
        if high - low > TURNS:
            yield PossibleMistake(
                Mistake.JOINT_RANGE,
                quoted(model, "joint", joint),
                f"has a range of {low:.4g} to {high:.4g} rad, {(high - low) / (2 * np.pi):.3g} turns",
                'if these are degrees, leave out <compiler angle="radian"/>',
            )
        elif high - low < NARROW and max(abs(low), abs(high)) > IDLE:
            low_deg, high_deg = np.degrees([low, high])
            yield PossibleMistake(
                Mistake.JOINT_RANGE,
                quoted(model, "joint", joint),
                f"has a range of {low_deg:.3g} to {high_deg:.3g} degrees, in which it hardly moves",
                'if these are radians, write <compiler angle="radian"/>',
            )
    yield from _keyframes(model)
    sizes, gravity = posed.sizes, float(np.linalg.norm(model.opt.gravity))
    if len(sizes) and sizes.min() > LONG and gravity > 0.1:
        yield PossibleMistake(
            Mistake.UNITS,
            "model",
            f"has muscles that are {sizes.min():.3g} to {sizes.max():.3g} m long, and a gravity of {gravity:.3g} m/s²",
            "lengths in MJCF are in metres: if these are millimetres, scale the model, or its gravity and forces",
        )


def _keyframes(model: mujoco.MjModel) -> Iterator[PossibleMistake]:
    """Yield a finding for every keyframe that puts a hinge half a turn or more outside its range."""
    for key in range(model.nkey):
        for joint in range(model.njnt):
            own = joint_range(model, joint)
            if int(model.jnt_type[joint]) != _HINGE or own is None:
                continue
            low, high = own
            value = float(model.key_qpos[key, model.jnt_qposadr[joint]])
            if max(low - value, value - high) > np.pi:
                yield PossibleMistake(
                    Mistake.KEYFRAME,
                    quoted(model, "keyframe", key),
                    f"puts {quoted(model, 'joint', joint)} at {value:.4g} rad, {abs(value) / (2 * np.pi):.3g} turns, "
                    f"and its range is {low:.4g} to {high:.4g} rad",
                    f"qpos of a keyframe is in rad, whatever <compiler angle=...> says: {value:.4g} degrees are "
                    f"{np.radians(value):.4g}",
                )
                break
