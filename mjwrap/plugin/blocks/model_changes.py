"""List the regions of an mjModel from which the muscles' arrays were made; `callbacks/sync.py` compares them.

If numbers in these regions are changed while the model is in use, the muscles change with them. Changed names and texts
take effect in new mjData only, and so do ids and kinds, unless another model is used with the same mjData.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.kernels import layout
from mjwrap.kernels.musculotendon.dispatch import MUJOCO
from mjwrap.mjcf import MuscleDeclaration, Node
from mjwrap.model.arrays import Plan
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks.sync import BIAS, BINDING, CONTROL, DRIVE, POINTERS, REGION
from mjwrap.plugin.mujoco_c.fingerprint import buffer_layout
from mjwrap.plugin.mujoco_c.offsets import check_pointer
from mjwrap.surfaces.rows import surface_rows

Words = NDArray[np.int64]
_MUSCLE_BIAS = int(mujoco.mjtBias.mjBIAS_MUSCLE)
_STRUCTURE = (
    "body_rootid", "site_bodyid", "geom_bodyid", "geom_type", "geom_dataid", "tendon_adr", "tendon_num", "wrap_type",
    "wrap_objid", "wrap_prm", "actuator_trntype", "actuator_trnid", "actuator_gaintype", "actuator_biastype",
    "actuator_dyntype", "actuator_actadr", "actuator_actnum", "actuator_ctrllimited", "actuator_forcelimited",
    "actuator_group", "numeric_adr", "numeric_size", "tuple_adr", "tuple_size", "tuple_objtype", "tuple_objid",
    "tuple_objprm", "eq_type", "eq_obj1id", "eq_obj2id",
)  # fmt: skip


class Watch(NamedTuple):
    """The regions of a model that are watched, as `callbacks/sync.py` describes them.

    plain, derived, structure: lists of regions (k, 3); ..._seen: the bytes that these contain now. bound (k, 5): the
    rows that copy plain numbers. drives, pointers: the parts of MuJoCo's laws and controls that are compared directly.
    """

    plain: Words
    plain_seen: bytes
    derived: Words
    derived_seen: bytes
    structure: Words
    structure_seen: bytes
    bound: Words
    drives: Words
    pointers: Words


class _Lists:
    """Collect regions and bindings of one model."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.bound: list[tuple[int, ...]] = []
        self.regions: list[tuple[int, int, int]] = []
        self.seen: list[bytes] = []
        self.plain: dict[str, list[int]] = {}  # rows that `bound` reads, by array
        self.pointers: dict[str, int] = {}

    def pointer(self, name: str) -> int:
        """Return the offset of the pointer to an array, verified in this model."""
        if name not in self.pointers:
            self.pointers[name] = buffer_layout().arrays[name]
            check_pointer(self.model, name, self.pointers[name])
        return self.pointers[name]

    def watch(self, name: str, first: int = 0, rows: int = -1) -> None:
        """Add rows of an array as a region, counted in numbers of the array; rows = -1: all from the first on."""
        array = getattr(self.model, name)
        part = array[first : len(array) if rows < 0 else first + rows]
        if part.size:
            self.regions.append((self.pointer(name), first * array.strides[0], part.size))
            self.seen.append(part.tobytes())

    def watch_bytes(self, name: str) -> None:
        """Add a whole array as a region of bytes."""
        array = getattr(self.model, name)
        if array.size:
            self.regions.append((self.pointer(name), 0, array.nbytes))
            self.seen.append(array.tobytes())

    def bind(self, name: str, row: int, column: int, count: int, which: int, number: int) -> None:
        """Copy `count` numbers of an array's row from a column on into a block's array."""
        array = getattr(self.model, name)
        first = row * array.strides[0] + 8 * column
        self.bound.append((self.pointer(name), first, count, which, number))
        self.plain.setdefault(name, []).append(row)

    def take(self) -> tuple[Words, bytes]:
        """Return the regions collected since the last call, and their contents."""
        regions = np.array(self.regions, dtype=np.int64).reshape(-1, REGION)
        found = regions, b"".join(self.seen)
        self.regions, self.seen = [], []
        return found


def _drive(lists: _Lists, plan: Plan, m: int, actuator: int) -> tuple[int, int, int, int]:
    """Return the row of `drives` of muscle m."""
    model = lists.model
    follows = CONTROL if actuator >= 0 and np.isfinite(plan.ctrl_high[m]) else 0
    if actuator >= 0 and model.actuator_actearly[actuator]:  # mjwrap computes its next activation
        lists.watch("actuator_dynprm", actuator, 1)
        lists.watch("actuator_actrange", actuator, 1)
    if actuator < 0 or plan.law[m] != MUJOCO:
        return -1, -1, follows, 0
    output = int(model.actuator_outadr[actuator])
    if int(model.actuator_biastype[actuator]) == _MUSCLE_BIAS:
        follows |= BIAS
    return actuator, output, follows, 0


def _bind_surface(lists: _Lists, k: int, node: Node) -> None:
    """Bind the sizes of node k to its geom if they are equal to the geom's sizes, else watch these."""
    if node.sizes >= 0 or node.surface is None:
        return  # the numerics are watched together
    if not node.surface.geom_columns:
        lists.watch("geom_size", node.geom, 1)
        return
    row = surface_rows(node.surface)[0]
    for size, column in node.surface.geom_columns:
        if np.isfinite(row[column]):  # a cylinder's half length is infinite unless it is declared
            lists.bind("geom_size", node.geom, size, 1, bk.A_NODE, k * layout.ROW + column)


def watch(model: mujoco.MjModel, plan: Plan, muscles: list[MuscleDeclaration]) -> Watch:
    """Return the regions on which the arrays of these muscles depend, in a model with the layout of `model`."""
    lists = _Lists(model)
    k = 0
    drives = np.zeros((len(muscles), DRIVE), dtype=np.int64)
    for m, muscle in enumerate(muscles):
        drives[m] = _drive(lists, plan, m, muscle.actuator)
        for node in (node for route in muscle.routes for node in route.nodes):
            _bind_surface(lists, k, node)
            k += 1 if node.surface is None else node.surface.touches
    lists.watch("numeric_data")
    derived = lists.take()
    for name, rows in lists.plain.items():
        lists.watch(name, min(rows), max(rows) - min(rows) + 1)
    plain = lists.take()
    for name in _STRUCTURE:
        lists.watch_bytes(name)
    bound = np.array(lists.bound, dtype=np.int64).reshape(-1, BINDING)
    sizes = [(name, getattr(model, name).size) for name in POINTERS]
    pointers = [(lists.pointer(name), size) if size else (0, 0) for name, size in sizes]
    return Watch(*plain, *derived, *lists.take(), bound, drives, np.array(pointers, dtype=np.int64))
