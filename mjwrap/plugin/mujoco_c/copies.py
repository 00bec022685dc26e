"""Copies a model of which only the address is known, to read its declarations from.

MuJoCo makes a copy by writing the model in its binary form and reading that again, which takes most of a second for
large meshes. So the copy of a model that comes twice is kept, and takes over the arrays of others of the same sizes.
"""

from __future__ import annotations

import ctypes
from collections import OrderedDict

import mujoco

from mjwrap.plugin.mujoco_c.fingerprint import buffer_layout
from mjwrap.plugin.mujoco_c.library import saved_model

_MOST = 2
_kept: OrderedDict[bytes, mujoco.MjModel | None] = OrderedDict()  # by sizes; None: they came once


def _buffer(address: int) -> tuple[int, int]:
    """Return where a model's arrays lie, and how many bytes they are."""
    layout = buffer_layout()
    start = ctypes.c_uint64.from_address(address + layout.buffer).value
    return start, ctypes.c_int64.from_address(address + layout.nbuffer).value


def copy_of(address: int) -> mujoco.MjModel:
    """Return a copy of the model at an address, good until the next call; all but its options, which nobody reads."""
    sizes = ctypes.string_at(address, buffer_layout().sizes)
    kept = _kept.get(sizes)
    if kept is None:
        saved = saved_model(address)
        model = mujoco.MjModel.from_binary_path("model.mjb", {"model.mjb": saved.raw})
        _kept[sizes] = model if sizes in _kept else None
    else:
        model = kept
        (to, size), (origin, given) = _buffer(model._address), _buffer(address)
        assert size == given
        ctypes.memmove(to, origin, size)
    _kept.move_to_end(sizes)
    while len(_kept) > _MOST:
        _kept.popitem(last=False)
    return model
