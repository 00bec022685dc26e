"""The table of all blocks: the block of each instance of each mjData.

Unpickling an mjData, in this or another process, overwrites its plugin_data with that of the original. So plugin_data
contains no address but the index of an entry in this table, from 1 on. Every callback checks that the entry belongs to
its mjData. If not, plugin_data is a copy; the callback then searches the right entry and writes its index there.
`mjwrap/plugin/blocks/table.py` fills the table, under a lock; an entry without an owner is free.
"""

from __future__ import annotations

import ctypes
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba.core import cgutils, types

from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks._cache import jit
from mjwrap.plugin.callbacks.memory import intrinsic, read_int32, read_int64, write_int64

CAPACITY = 1 << 16  # entries
# the 64-bit integers of an entry: address of the mjData or 0, instance, address of its block
OWNER, INSTANCE, BLOCK, ENTRY = range(4)
_SYMBOL = "mjwrap.plugin.block_table"


def _table_of_the_process() -> Any:
    """Return the table: the largest number of entries used so far, then the entries. It outlives this module."""
    kind = ctypes.c_int64 * (1 + ENTRY * CAPACITY)
    address = llvm.address_of_symbol(_SYMBOL)
    if address is None:
        table = kind()
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(table))
        address = ctypes.addressof(table)
        llvm.add_symbol(_SYMBOL, address)
    return kind.from_address(address)


TABLE = _table_of_the_process()


@intrinsic
def _table(typing_context: Any) -> Any:
    """Return the address of the table by a symbol, so that cached machine code works in every process."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = ir.FunctionType(ir.VoidType(), [])
        symbol = cgutils.get_or_insert_function(builder.module, kind, _SYMBOL)
        return builder.ptrtoint(symbol, ir.IntType(64))

    return types.int64(), generate


@jit
def _entry(place):
    """Return the address of an entry; place: its index, from 1 on."""
    return _table() + 8 + 8 * ENTRY * (place - 1)


@jit
def _owned(place, data, instance):
    """Return whether a place is valid and its entry belongs to this instance of this mjData."""
    if place < 1 or place >= CAPACITY:
        return False
    entry = _entry(place)
    return read_int64(entry + 8 * OWNER) == data and read_int64(entry + 8 * INSTANCE) == instance


@jit
def place_of(data, instance, nplugin, plugin_data):
    """Return the place of an instance's entry, 0 if it has none; corrects plugin_data if that is a copy."""
    if instance >= read_int32(data + nplugin):
        return 0
    slot = read_int64(data + plugin_data) + 8 * instance
    place = read_int64(slot)
    if place == 0 or _owned(place, data, instance):
        return place
    for other in range(1, read_int64(_table()) + 1):
        if _owned(other, data, instance):
            write_int64(slot, other)
            return other
    return 0


@jit
def block_at(place):
    """Return the address of an entry's block, 0 for place 0."""
    return read_int64(_entry(place) + 8 * BLOCK) if place != 0 else 0


@jit
def remove_entry(place):
    """Free an entry."""
    write_int64(_entry(place) + 8 * OWNER, 0)


@jit
def _keeps(place, instance, state):
    """Return whether an entry is of the instance whose numbers in plugin_state start at the address `state`."""
    entry = _entry(place)
    owner, block = read_int64(entry + 8 * OWNER), read_int64(entry + 8 * BLOCK)
    if owner == 0 or read_int64(entry + 8 * INSTANCE) != instance:
        return False
    first = read_int64(owner + read_int64(block + 8 * bk.PLUGIN_STATE))
    return first + 8 * read_int64(block + 8 * bk.STATE_ADDRESS) == state


@jit
def block_of_state(place, instance, state):
    """Return the block of the instance whose numbers start at `state`; place: the number in its plugin_data."""
    if 1 <= place < CAPACITY and _keeps(place, instance, state):
        return block_at(place)
    for other in range(1, read_int64(_table()) + 1):
        if _keeps(other, instance, state):
            return block_at(other)
    return 0
