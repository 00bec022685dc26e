"""Read the plugin's last results for an mjData, and set the excitations of muscles without an actuator."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
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
    """The plugin's results for the muscles of a model: copies, (n,) each, with units and signs as in `MuscleSystem`.

    Attributes:
        names: the muscles' names, in the order of all arrays.
        length: musculotendon lengths [m].
        velocity: lengthening speeds [m/s].
        tension: tensions [N], never negative.
        activation: activations [-].
        fiber_length: fibre lengths [m], 0 for a law without fibres.
        status: codes of `mjwrap.Status`.
        failures: number of steps without a path since the last reset.
        transmitted: whether MuJoCo's own actuator pulls the muscle; its force is then the tension.
    """

    names: list[str]
    length: Array
    velocity: Array
    tension: Array
    activation: Array
    fiber_length: Array
    status: NDArray[np.int64]
    failures: NDArray[np.int64]
    transmitted: NDArray[np.bool_]


def instances(model: mujoco.MjModel) -> list[int]:
    """Return the ids of mjwrap's instances in a model; `StateError` if there are none, or it is not a model."""
    validation.of_type(model, "MjModel", "model", StateError)
    found = own_instances(model)
    if not found:
        raise StateError(
            "this model does not contain the engine plugin; add it with mjwrap.install or mjwrap.load"
        )
    return found


def saved_modes(model: mujoco.MjModel) -> set[str]:
    """Return the modes in which the plugin drives the muscles of an installed model."""
    return {configuration_at(model._address, instance).mode for instance in instances(model)}


def block_address(data: mujoco.MjData, instance: int) -> int:
    """Return the address of an instance's block."""
    address = find_block(data._address, instance)
    if address == 0:
        raise StateError(
            "this mjData was made without the engine plugin; make a new one from the installed model"
        )
    return address


def head_of(block: int) -> NDArray[np.int64]:
    """Return the head of the block at an address (`callbacks/block.py`)."""
    return np.ctypeslib.as_array((ctypes.c_int64 * bk.HEAD).from_address(block))


def read(data: mujoco.MjData) -> Readout:
    """Return the plugin's last results for `data`: from `mj_forward`, or from the start of the last `mj_step`."""
    validation.of_type(data, "MjData", "data", StateError)
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
    """Set the tensions (n,) of a block's muscles that MuJoCo's actuators pull; return which ones (n,) these are."""
    head = head_of(block)
    output = _outputs(block + int(head[bk.A_TRANSMISSION]), int(head[bk.MUSCLES]))
    transmitted = output >= 0
    rows = output[transmitted]
    tension[transmitted] = 0.0 - data.model.actuator_gear[rows, 0] * data.actuator_force[rows]
    return transmitted


def _outputs(part: int, n: int) -> NDArray[np.int64]:
    """Return the outputs (n,) of the actuators that pull their muscles, -1 for others, from a part of a block."""
    head = np.ctypeslib.as_array((ctypes.c_int64 * tr.HEAD).from_address(part))
    if not head[tr.COUNT]:
        return np.full(n, -1, dtype=np.int64)
    return np.ctypeslib.as_array((ctypes.c_int64 * n).from_address(part + int(head[tr.A_OUTPUT])))


def excitations(data: mujoco.MjData) -> dict[str, Array]:
    """Return the excitation of every muscle by name, as a writable view (1,) of `data.plugin_state`.

    It is used for muscles without an actuator; for others the excitation is the control. A reset sets it to zero.
    """
    model, found = data.model, {}
    for instance in instances(model):
        first = int(model.plugin_stateadr[instance]) + 3  # the clock, then activation and fibre length
        for m, name in enumerate(configuration_at(model._address, instance).muscles):
            found[name] = data.plugin_state[first + PER_MUSCLE * m :][:1]
    return found
