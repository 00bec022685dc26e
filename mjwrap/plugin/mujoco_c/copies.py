"""Copy a model of which only the address is known, so that its declarations can be read.

MuJoCo copies a model by writing it in binary form and reading that, which takes most of a second for large meshes. So
the copy of a model that is requested twice is kept, and reused for models of the same sizes by copying their arrays.
"""

from __future__ import annotations

import ctypes
from collections import OrderedDict

import mujoco

from mjwrap.plugin.mujoco_c.fingerprint import buffer_layout
from mjwrap.plugin.mujoco_c.library import saved_model

_MOST = 2
_kept: OrderedDict[bytes, mujoco.MjModel | None] = OrderedDict()  # by sizes; None: requested once so far


def _buffer(address: int) -> tuple[int, int]:
    """Return the address of a model's arrays, and their size in bytes."""
    layout = buffer_layout()
    start = ctypes.c_uint64.from_address(address + layout.buffer).value
    return start, ctypes.c_int64.from_address(address + layout.nbuffer).value


def copy_of(address: int) -> mujoco.MjModel:
    """Return a copy of the model at an address, valid until the next call; its options are not copied."""
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
