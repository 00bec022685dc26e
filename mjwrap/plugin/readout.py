"""Reads what the plugin last computed for an mjData, and sets the excitations of muscles without an actuator."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import StateError
from mjwrap.mjcf.marks import own_instances
from mjwrap.plugin.blocks.table import find_block
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks import transmission as tr
from mjwrap.plugin.callbacks.saving import PER_MUSCLE
from mjwrap.plugin.spec.configuration import configuration_at

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
    failures: NDArray[np.int64]  # steps since the last reset without a path
    transmitted: NDArray[np.bool_]  # pulled by MuJoCo's own actuator, whose force this tension is


def instances(model: mujoco.MjModel) -> list[int]:
    """Return the ids of mjwrap's instances in a model; `StateError` where there is none."""
    found = own_instances(model)
    if not found:
        raise StateError("this model has no muscles in the engine plugin; install or load puts them there")
    return found


def block_address(data: mujoco.MjData, instance: int) -> int:
    """Return the address of an instance's block."""
    address = find_block(data._address, instance)
    if address == 0:
        raise StateError("this mjData has no muscles of the engine plugin: it was made without them")
    return address


def head_of(block: int) -> NDArray[np.int64]:
    """Return the head of the block at an address (`callbacks/block.py`)."""
    return np.ctypeslib.as_array((ctypes.c_int64 * bk.HEAD).from_address(block))


def read(data: mujoco.MjData) -> Readout:
    """Return what the plugin computed last for `data`: in `mj_forward`, or in `mj_step` at the state it began with."""
    names: list[str] = []
    columns: dict[str, list[Any]] = {name: [] for name in (*_COLUMNS, "transmitted")}
    for instance in instances(data.model):
        names += configuration_at(data.model._address, instance).muscles
        block = block_address(data, instance)
        head = head_of(block)
        for name in _COLUMNS:
            kind = ctypes.c_int64 if name in ("status", "failures") else ctypes.c_double
            start = block + int(head[bk.A_ROUTES + bk.ARRAYS.index(name)])
            columns[name].append(
                np.ctypeslib.as_array((kind * int(head[bk.MUSCLES])).from_address(start)).copy()
            )
        columns["transmitted"].append(transmit(data, block, columns["tension"][-1]))
    return Readout(names, *(np.concatenate(parts) for parts in columns.values()))


def transmit(data: mujoco.MjData, block: int, tension: Array) -> NDArray[np.bool_]:
    """Set the tensions (n,) of a block's muscles that MuJoCo's own actuators pull; return which ones (n,) they are."""
    head = head_of(block)
    output = _outputs(block + int(head[bk.A_TRANSMISSION]), int(head[bk.MUSCLES]))
    transmitted = output >= 0
    rows = output[transmitted]
    tension[transmitted] = 0.0 - data.model.actuator_gear[rows, 0] * data.actuator_force[rows]
    return transmitted


def _outputs(part: int, n: int) -> NDArray[np.int64]:
    """Return the outputs (n,) of actuators that pull their muscles, -1 elsewhere, from a part of a block."""
    head = np.ctypeslib.as_array((ctypes.c_int64 * tr.HEAD).from_address(part))
    if not head[tr.COUNT]:
        return np.full(n, -1, dtype=np.int64)
    return np.ctypeslib.as_array((ctypes.c_int64 * n).from_address(part + int(head[tr.A_OUTPUT])))


def excitations(data: mujoco.MjData) -> dict[str, Array]:
    """Return the excitation of every muscle by name, as a writable view (1,) of `data.plugin_state`.

    It counts where a muscle has no actuator, whose control is the excitation otherwise. A reset makes it zero.
    """
    model, found = data.model, {}
    for instance in instances(model):
        first = int(model.plugin_stateadr[instance]) + 3  # the clock, then activation and fibre length
        for m, name in enumerate(configuration_at(model._address, instance).muscles):
            found[name] = data.plugin_state[first + PER_MUSCLE * m :][:1]
    return found
