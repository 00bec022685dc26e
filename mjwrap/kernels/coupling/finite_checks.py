"""Checks for numbers that are not finite, made at every step."""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import from_python


@from_python
def first_bad(values):
    """Return the index of the first entry of (n,) that is not finite, or -1."""
    for i in range(values.shape[0]):
        if not math.isfinite(values[i]):
            return i
    return -1


@from_python
def all_finite(qpos, qvel, act, ctrl, mocap_pos, mocap_quat, excitation):
    """Return whether every entry of a simulation's state and inputs is finite."""
    for values in (qpos, qvel, act, ctrl, excitation):
        if first_bad(values) >= 0:
            return False
    for k in range(mocap_pos.shape[0]):
        if first_bad(mocap_pos[k]) >= 0 or first_bad(mocap_quat[k]) >= 0:
            return False
    return True
