"""Small checks and updates on whole arrays that every step needs."""

from __future__ import annotations

import math

from mjwrap.kernels._jit import jit
from mjwrap.kernels.activation import advance_activation


@jit
def first_bad(values):
    """Return the index of the first entry of (n,) that is not finite, or -1."""
    for i in range(values.shape[0]):
        if not math.isfinite(values[i]):
            return i
    return -1


@jit
def all_finite(qpos, qvel, act, ctrl, mocap_pos, mocap_quat, excitation):
    """Return whether every entry of a simulation's state and inputs is finite."""
    for values in (qpos, qvel, act, ctrl, excitation):
        if first_bad(values) >= 0:
            return False
    for k in range(mocap_pos.shape[0]):
        if first_bad(mocap_pos[k]) >= 0 or first_bad(mocap_quat[k]) >= 0:
            return False
    return True


FROM_ACT, FROM_CTRL, OWN, DIRECT = 0, 1, 2, 3  # where a muscle's activation comes from


@jit
def gather_activation(source, index, low, high, act, ctrl, own, excitation, activation):
    """Write the activation of every muscle (n,).

    FROM_ACT: act[index]; FROM_CTRL: ctrl[index] clamped to [low, high]; OWN: mjwrap's state; DIRECT: the excitation.
    """
    for m in range(source.shape[0]):
        if source[m] == FROM_ACT:
            activation[m] = act[index[m]]
        elif source[m] == FROM_CTRL:
            activation[m] = min(max(ctrl[index[m]], low[m]), high[m])
        elif source[m] == OWN:
            activation[m] = own[m]
        else:
            activation[m] = excitation[m]


@jit
def advance_own(source, excitation, times, duration, own, out):
    """Write to `out` the activations that mjwrap integrates itself, `duration` [s] after `own`."""
    for m in range(source.shape[0]):
        out[m] = own[m]
        if source[m] == OWN:
            out[m] = advance_activation(own[m], excitation[m], times[m, 0], times[m, 1], duration)
