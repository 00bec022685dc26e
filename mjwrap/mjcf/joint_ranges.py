"""The range in which a joint is meant to move: that of its limit, or one that the model gives without a limit."""

from __future__ import annotations

import math

import mujoco

TURNS = 4.0 * math.pi  # [rad] a hinge seldom turns further
EXTENTS = 10.0  # a slide without a limit seldom moves further than so many times the model's size
_KINDS = mujoco.mjtJoint
_FREE, _BALL = int(_KINDS.mjJNT_FREE), int(_KINDS.mjJNT_BALL)
_SLIDE = int(_KINDS.mjJNT_SLIDE)


def joint_range(model: mujoco.MjModel, joint: int) -> tuple[float, float] | None:
    """Return the range of a joint [rad or m], of a ball (0, largest angle); None if it has none, as a free joint.

    The range of a limit is returned as it is. One without a limit counts if it increases, and if it can be meant.
    MuJoCo compiles it as it is written, so it has to be in rad even in a file in degrees: a hinge's of more than two
    turns and a ball's beyond half a turn are not used, nor a slide's of more than ten times the model's extent.
    """
    kind = int(model.jnt_type[joint])
    if kind == _FREE:
        return None
    low, high = (float(x) for x in model.jnt_range[joint])
    if model.jnt_limited[joint]:
        return low, high
    if kind == _BALL:
        return (0.0, high) if low == 0.0 and 0.0 < high <= math.pi else None
    most = EXTENTS * float(model.stat.extent) if kind == _SLIDE else TURNS
    return (low, high) if 0.0 < high - low <= most else None
