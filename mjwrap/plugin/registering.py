"""Register the plugin with MuJoCo, once per process.

MuJoCo calls `nstate` while it compiles a model, and `init` for every new mjData: the only callbacks in Python. They
read everything from the model, because it may have been compiled in another process.
"""

from __future__ import annotations

import ctypes
import functools
import os
import sys
import threading

from mjwrap.errors import VersionError
from mjwrap.mjcf.marks import PLUGIN_NAME
from mjwrap.plugin.blocks.allocation import entries, give_block
from mjwrap.plugin.blocks.instance_muscles import is_reading
from mjwrap.plugin.callbacks.hooks import compile_hooks
from mjwrap.plugin.mujoco_c.offsets import offsets
from mjwrap.plugin.mujoco_c.probe import verify_plugin_fields
from mjwrap.plugin.mujoco_c.registration import register_plugin
from mjwrap.plugin.mujoco_c.visualisation import drawing
from mjwrap.plugin.spec.configuration import ATTRIBUTES, configuration_at

_NSTATE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int)
_INIT = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)
_here = threading.local()  # .error: the reason of the last failure of a callback in this thread


@functools.cache
def register() -> None:
    """Register the plugin with MuJoCo; `VersionError` if the installed MuJoCo cannot be verified."""
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        raise VersionError("the engine plugin needs compiled kernels; NUMBA_DISABLE_JIT is set")
    offsets()
    verify_plugin_fields()
    drawing()  # warns here if drawing is not possible
    entries()
    hooks = compile_hooks(offsets().data)
    python = {"nstate": _NSTATE(_nstate), "init": _INIT(_init)}
    register_plugin(PLUGIN_NAME, python | hooks._asdict(), ATTRIBUTES)


def take_error() -> Exception | None:
    """Return the reason of the last failure of a callback in this thread, and forget it."""
    error = getattr(_here, "error", None)
    _here.error = None
    return error


def _failed(error: Exception) -> int:
    _here.error = error
    print(
        f"mjwrap: {error}", file=sys.stderr, flush=True
    )  # MuJoCo's own message only says that an init failed
    return -1


def _nstate(model: int, instance: int) -> int:
    """Return the number of entries of plugin_state that an instance needs, -1 on failure."""
    try:
        return configuration_at(model, instance).numbers
    except Exception as error:
        return _failed(error)


def _init(model: int, data: int, instance: int) -> int:
    """Allocate the block of a new mjData; its entry of plugin_data is not defined before."""
    slots = ctypes.c_uint64.from_address(data + offsets().data["plugin_data"]).value
    slot = ctypes.c_uint64.from_address(slots + 8 * instance)
    slot.value = 0
    if is_reading():
        return 0
    try:
        slot.value = give_block(model, data, instance)
    except Exception as error:
        return _failed(error)
    return 0
