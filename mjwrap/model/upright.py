"""Which way is up in a model: against gravity, along z in most models and along y in those of OpenSim."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def up_axis(model: mujoco.MjModel) -> tuple[int, int]:
    """Return the axis of the world that points up most, 0 to 2, and its sign; z without gravity."""
    gravity = np.asarray(model.opt.gravity)
    if not gravity.any():
        return 2, 1
    axis = int(np.abs(gravity).argmax())
    return axis, 1 if gravity[axis] < 0.0 else -1


def turned_upright(model: mujoco.MjModel) -> Array:
    """Return the rotation (3, 3) that takes z to the axis that points up; its first column points along x or y."""
    axis, sign = up_axis(model)
    if axis == 2:
        return np.diag([1.0, float(sign), float(sign)])
    up = sign * np.eye(3)[axis]
    first = np.eye(3)[1 if axis == 0 else 0]
    return np.column_stack([first, np.cross(up, first), up])
