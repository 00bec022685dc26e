"""Enter blocks into the table of `callbacks/block_table.py`, and find them there, from Python."""

from __future__ import annotations

import threading

import numpy as np
from numpy.typing import NDArray

from mjwrap.plugin.callbacks import block_table as bt

_LOCK = threading.Lock()


def _entries(count: int) -> NDArray[np.int64]:
    """Return the first entries of the table (count, ENTRY), which share its memory."""
    return np.ctypeslib.as_array(bt.TABLE)[1 : 1 + bt.ENTRY * count].reshape(-1, bt.ENTRY)


def enter_block(data: int, instance: int, block: int) -> int:
    """Enter the block of an instance of the mjData at an address; return its index in the table, from 1 on.

    Raises `MemoryError` if the table is full.
    """
    with _LOCK:
        used = bt.TABLE[0]
        entries = _entries(used + 1)
        entry = int(np.argmin(entries[:, bt.OWNER] != 0))  # the first that is free
        if entry >= bt.CAPACITY - 1:
            raise MemoryError(f"more than {bt.CAPACITY - 1} mjData with muscles at once")
        entries[entry, [bt.INSTANCE, bt.BLOCK]] = instance, block
        entries[entry, bt.OWNER] = data
        bt.TABLE[0] = max(used, entry + 1)
    return entry + 1


def find_block(data: int, instance: int) -> int:
    """Return the address of the block of an instance of the mjData at an address, 0 if it has none."""
    entries = _entries(bt.TABLE[0])
    own = (entries[:, bt.OWNER] == data) & (entries[:, bt.INSTANCE] == instance)
    return int(entries[own, bt.BLOCK][0]) if own.any() else 0
