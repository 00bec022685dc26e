"""Allocate the block of every new mjData, and rewrite it when the model has changed.

The first contents of a block are computed from a copy of the model, which takes time, so those of recent models are
kept.
"""

from __future__ import annotations

import ctypes
import functools
import sys
import threading
from collections import OrderedDict

from mjwrap.errors import ModelError
from mjwrap.plugin.blocks.image import block_image, renew, state_size
from mjwrap.plugin.blocks.instance_muscles import copy_read
from mjwrap.plugin.blocks.table import enter_block
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks.hooks import Entries, compile_entries
from mjwrap.plugin.mujoco_c.fingerprint import fingerprint
from mjwrap.plugin.mujoco_c.registration import address_of, keep_forever
from mjwrap.plugin.spec.configuration import configuration_at

_KEPT_IMAGES = 16
_REBUILD = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64)
_LOCK = threading.Lock()
_IMAGES: OrderedDict[tuple[bytes | None, int], bytes] = OrderedDict()


@functools.cache
def entries() -> Entries:
    """Return the compiled functions that blocks point to."""
    return compile_entries()


def give_block(model: int, data: int, instance: int) -> int:
    """Make a block for an instance, given the addresses of model and mjData; return its place in the table."""
    image = _image(model, instance)
    block = raw_malloc(len(image))
    ctypes.memmove(block, image, len(image))
    ctypes.c_int64.from_address(block + 8 * bk.MODEL).value = model
    return enter_block(data, instance, block)


def raw_malloc(size: int) -> int:
    """Return the address of new memory [bytes]; it may be freed without the GIL, even after Python has ended."""
    allocate = ctypes.pythonapi.PyMem_RawMalloc
    allocate.restype, allocate.argtypes = ctypes.c_void_p, [ctypes.c_size_t]
    address = allocate(size)
    if not address:
        raise MemoryError(f"cannot allocate {size} bytes for the muscles")
    return int(address)


def free_function() -> int:
    """Return the address of the C function that frees a block."""
    return int(ctypes.cast(ctypes.pythonapi.PyMem_RawFree, ctypes.c_void_p).value or 0)


def _image(address: int, instance: int) -> bytes:
    """Return the first contents of the block for an instance of the model at an address."""
    key = fingerprint(address), instance
    with _LOCK:
        if key in _IMAGES:
            _IMAGES.move_to_end(key)
            return _IMAGES[key]
    configuration = configuration_at(address, instance)
    with copy_read(address, configuration) as (model, plan, muscles, left_out):
        if state_size(plan) != configuration.numbers:
            raise ModelError(
                f"the muscles' paths have changed since mjwrap.install: their state needs "
                f"{state_size(plan)} numbers and has {configuration.numbers}; call install again"
            )
        image = block_image(
            model, instance, plan, muscles, left_out, entries(), free_function(), _rebuild_function()
        )
    if key[0] is None:
        return image
    with _LOCK:
        _IMAGES[key] = image
        while len(_IMAGES) > _KEPT_IMAGES:
            _IMAGES.popitem(last=False)
    return image


def _rebuild(block: int, model: int, instance: int) -> None:
    """Update a block to a changed model; if that is impossible, leave it unchanged and warn."""
    try:
        if not renew(block, _image(model, instance)):
            raise ModelError("its muscles differ from those for which the mjData was made; make a new mjData")
    except Exception as error:
        print(
            f"mjwrap: a change of the model is ignored, its muscles stay as they were: {error}",
            file=sys.stderr, flush=True,
        )  # fmt: skip


@functools.cache
def _rebuild_function() -> int:
    function = _REBUILD(_rebuild)
    keep_forever(function)
    return address_of(function)
