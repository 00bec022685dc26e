"""What the plugin last computed for a mjData, and the excitations of muscles without an actuator."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import StateError
from mjwrap.plugin import register as reg
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks.stage import PER_MUSCLE

Array = NDArray[np.float64]
_COLUMNS = ("length", "velocity", "tension", "activation", "fiber", "status", "failures")  # of the block


@dataclass(frozen=True)
class Readout:
    """The muscles of all instances in a model, copies: (n,) each, as `MuscleSystem` names and measures them."""

    names: list[str]
    length: Array
    velocity: Array
    tension: Array
    activation: Array
    fiber_length: Array
    status: NDArray[np.int64]
    failures: NDArray[
        np.int64
    ]  # steps since the last reset without a path, at which the last good force was held


def _instances(model: mujoco.MjModel) -> list[int]:
    named = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_PLUGIN, i) or "" for i in range(model.nplugin)]
    found = [i for i, name in enumerate(named) if name.endswith(reg.INSTANCE)]
    if not found:
        raise StateError("this model has no muscles in the engine plugin; install or load puts them there")
    return found


def read(data: mujoco.MjData) -> Readout:
    """Return what the plugin computed last for `data`: in `mj_forward`, or in `mj_step` at the state it began with."""
    names: list[str] = []
    columns: dict[str, list[Any]] = {name: [] for name in _COLUMNS}
    for instance in _instances(data.model):
        names += reg.claim_of(data.model._address, instance).muscles
        block = int(np.asarray(data.plugin_data)[instance])
        head = np.ctypeslib.as_array((ctypes.c_int64 * bk.HEAD).from_address(block))
        for name, parts in columns.items():
            kind = ctypes.c_int64 if name in ("status", "failures") else ctypes.c_double
            start = block + int(head[bk.A_ROUTES + bk.ARRAYS.index(name)])
            parts.append(np.ctypeslib.as_array((kind * int(head[bk.MUSCLES])).from_address(start)).copy())
    return Readout(names, *(np.concatenate(parts) for parts in columns.values()))


def excitations(data: mujoco.MjData) -> dict[str, Array]:
    """Return the excitation of every muscle by name, as a writable view (1,) of `data.plugin_state`.

    It counts where a muscle has no actuator, whose control is the excitation otherwise. A reset makes it zero.
    """
    model, found = data.model, {}
    for instance in _instances(model):
        first = int(model.plugin_stateadr[instance]) + 3  # the clock, then activation and fibre length
        for m, name in enumerate(reg.claim_of(model._address, instance).muscles):
            found[name] = data.plugin_state[first + PER_MUSCLE * m :][:1]
    return found
