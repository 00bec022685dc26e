"""Angles that a user gives: with their unit, and whether they can be meant for a joint.

Degrees that are taken as radians are the most common mistake with angles: 90 rad are 14 turns.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mjwrap.errors import MjwrapError, ModelError, SignalError, TableError
from mjwrap.files import Table
from mjwrap.mjcf import name_of
from mjwrap.mjcf.joint_ranges import TURNS, joint_range
from mjwrap.poses.angles import Angle, farthest

OUTSIDE = 0.1  # [rad] a measured motion may leave a joint's range by less
_DEGREES = re.compile(r"(deg|°)$")
_HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)


def position(text: str) -> float:
    """Return a position from "0.5" [rad or m], or "90deg" or "90°" as an `Angle` [rad]; `ValueError` for other text."""
    number, found = _DEGREES.subn("", text.strip())
    return Angle(math.radians(float(number))) if found else float(number)


def pattern_in_radians(text: str) -> tuple[str, bool]:
    """Return a pattern of a prescribed motion with its angles in rad, and whether some were in degrees.

    A number alone is a constant. Angles are LEVEL, AMPLITUDE and OFFSET; `SignalError` where another value, such as a
    frequency, is in degrees.
    """
    try:
        alone = position(text)
        return f"constant:{float(alone)!r}", isinstance(alone, Angle)
    except ValueError:
        pass
    kind, _, rest = text.partition(":")
    parts = rest.split(",")
    given = [_DEGREES.search(part.strip()) is not None for part in parts]
    if not any(given):
        return text, False
    if any(given[k] for k in range(len(parts)) if k not in (0, 2)):
        raise SignalError(f"'{text}': only a level, an amplitude or an offset can be in degrees")
    try:
        parts = [repr(float(position(part))) if deg else part for part, deg in zip(parts, given, strict=True)]
    except ValueError:
        raise SignalError(f"'{text}': write an angle in degrees like 90deg") from None
    return f"{kind}:{','.join(parts)}", True


def check_position(
    model: mujoco.MjModel, joint: int, values: ArrayLike, entry: str, error: type[MjwrapError] = ModelError
) -> None:
    """Check positions [rad or m] of a hinge or slide that a user gives.

    Raises `error`, which begins with `entry`, for a position half a turn or more outside a hinge's range (more than two
    turns where that is no limit), and for degrees about a slide. Warns of other positions outside the range, and of
    more than two turns without a range.
    """
    given = np.atleast_1d(np.asarray(values, dtype=np.float64))
    turning, own = int(model.jnt_type[joint]) == _HINGE, joint_range(model, joint)
    name = name_of(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
    if not turning and isinstance(values, Angle):
        raise error(f"{entry}: joint '{name}' is a slide: give its position in m, without deg")
    low, high = own or (-math.inf, math.inf)
    outside = np.maximum(low - given, given - high)
    k = int(np.argmax(np.abs(given) if own is None else outside))
    value, unit = float(given[k]), "rad" if turning else "m"
    instead = "" if isinstance(values, Angle) else f"; if degrees are meant, write {value:g}deg"
    if turning and outside[k] > farthest(model, joint):
        raise error(
            f"{entry}: {value:g} rad are {abs(value) / (2.0 * math.pi):.3g} turns, far outside the range of joint "
            f"'{name}', {low:.4g} to {high:.4g} rad{instead}"
        )
    if outside[k] > 0.0:
        warnings.warn(
            f"{entry} lies outside the joint's range, {low:g} to {high:g} {unit}" + instead * turning,
            stacklevel=3,
        )
    elif turning and own is None and abs(value) > TURNS:
        warnings.warn(
            f"{entry}: {value:g} rad are {abs(value) / (2.0 * math.pi):.3g} turns of joint '{name}'{instead}",
            stacklevel=3,
        )


def check_column(model: mujoco.MjModel, joint: int, table: Table, column: str, own: bool = False) -> None:
    """Check the positions of a hinge in a column of a table, in the unit that its header gives.

    own: a column of a table that mjwrap wrote, in rad, whose motion may have gone anywhere. Raises `TableError` if the
    positions are half a turn or more outside the joint's range (more than two turns where that is no limit), unless
    `own`; else warns, and also of positions more than `OUTSIDE` outside it, unless `own`, and of more than two turns of
    a hinge without a range, which a wheel may make.
    """
    if int(model.jnt_type[joint]) != _HINGE:
        return
    values = np.radians(table[column]) if table.in_degrees else table[column]
    span = joint_range(model, joint)
    low, high = span or (0.0, 0.0)
    outside = np.maximum(low - values, values - high)
    far = farthest(model, joint)
    if not len(values) or not np.nanmax(outside) > (OUTSIDE if span is not None and not own else far):
        return
    k = int(np.nanargmax(outside))
    name = name_of(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
    instead = (
        "its header says that it is in degrees (inDegrees=yes)"
        if table.in_degrees
        else "if the table is in degrees, write inDegrees=yes into its header (in a CSV file: a first line '# "
        "inDegrees=yes')"
    )
    value = float(values[k])
    if outside[k] > far:
        ranges = "has no range" if span is None else f"has a range of {low:.4g} to {high:.4g} rad"
        told = (
            f": {table[column][k]:g} at time {table.time[k]:g} s is {abs(value) / (2.0 * math.pi):.3g} turns, and "
            f"joint '{name}' {ranges}"
        )
    else:
        told = (
            f" reaches {value:.4g} rad at time {table.time[k]:g} s, outside the range of joint '{name}', {low:.4g} to "
            f"{high:.4g} rad"
        )
    words = f"'{table.source}', column '{column}'{told}; {instead}"
    if span is not None and not own and outside[k] > far:
        raise TableError(words)
    warnings.warn(words, stacklevel=3)


def unit_taken(model: mujoco.MjModel, table: Table, joints: Mapping[str, int]) -> str:
    """Return a remark on the unit in which hinges are read, if the table's header does not give it, else "".

    joints: the joint of each column that gives a position.
    """
    turning = [c for c, j in joints.items() if int(model.jnt_type[j]) == _HINGE and not c.startswith("qpos")]
    if not turning or "inDegrees" in table.metadata:
        return ""
    return f"angles in '{table.source}' are taken as radians, because its header does not say inDegrees=yes"
