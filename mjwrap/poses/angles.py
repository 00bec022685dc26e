"""Ranges of joints that a caller gives: whether they can be meant in radians."""

from __future__ import annotations

import math

import mujoco

from mjwrap.errors import ModelError
from mjwrap.mjcf import name_of
from mjwrap.mjcf.joint_ranges import TURNS, joint_range

BEYOND = math.pi  # [rad] no position of a hinge with a limit can be meant that is further outside
_HINGE, _SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)


class Angle(float):
    """A position [rad] that was given in degrees, so it fits hinges only."""


def farthest(model: mujoco.MjModel, joint: int) -> float:
    """Return how far outside a hinge's range, or from 0 without one, a position can be meant [rad]."""
    return BEYOND if model.jnt_limited[joint] else TURNS


def check_range(model: mujoco.MjModel, joint: int, low: float, high: float, degrees: str = "") -> None:
    """Raise `ModelError` for a range [rad] of a hinge that only degrees can explain.

    That is one that goes beyond the model's own range by half a turn or more, by more than two turns where that is no
    limit, or that spans more than two turns without a limit. degrees: what to write if degrees are meant; "" for what
    to write in Python.
    """
    name = name_of(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
    entry = f"range of joint '{name}'"
    for end in (low, high):
        if isinstance(end, Angle) and int(model.jnt_type[joint]) == _SLIDE:
            raise ModelError(f"{entry}: it is a slide: give its range in m, without deg")
    if int(model.jnt_type[joint]) != _HINGE or isinstance(low, Angle) or isinstance(high, Angle):
        return
    own = joint_range(model, joint)
    limited = bool(model.jnt_limited[joint])
    outside = max(own[0] - low, high - own[1]) if own is not None else 0.0
    if outside > farthest(model, joint) or (not limited and high - low > TURNS):
        turns = (high - low) / (2.0 * math.pi)
        beside = f", and the model's range is {own[0]:.4g} to {own[1]:.4g} rad" if own is not None else ""
        raise ModelError(
            f"{entry}: {low:g} to {high:g} rad are {turns:.3g} turns{beside}; if degrees are meant, write "
            + (degrees or f"np.radians(({low:g}, {high:g}))")
        )
