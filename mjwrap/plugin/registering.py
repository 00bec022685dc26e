"""Gives the plugin that `announcing.py` has registered its compiled functions, once a process, and mjData their blocks.

MuJoCo calls `nstate` while it compiles a model and `init` for every new mjData: the only callbacks in Python. Whatever
they need they read from the model, whoever compiled it, in this process or another.
"""

from __future__ import annotations

import ctypes
import functools
import os
import sys
import threading

from mjwrap.errors import VersionError
from mjwrap.plugin.announcing import announce
from mjwrap.plugin.blocks.allocation import entries, give_block
from mjwrap.plugin.blocks.reading import is_reading
from mjwrap.plugin.callbacks.hooks import compile_hooks
from mjwrap.plugin.mujoco_c.offsets import offsets
from mjwrap.plugin.mujoco_c.probe import verify_plugin_fields
from mjwrap.plugin.mujoco_c.registration import PLUGIN_NAME, add_callbacks
from mjwrap.plugin.mujoco_c.visualisation import drawing
from mjwrap.plugin.spec.configuration import configuration_at, is_idle

_LOCK = threading.RLock()
_here = threading.local()  # .error: why a callback of this thread failed last


def register() -> None:
    """Make the engine plugin known to MuJoCo, for models that have it: pickled ones, MJB files, saved XML.

    `install` and `load` do it by themselves, and so does `import mjwrap` once the first mjData of such a model is
    made; a process that calls this before pays for it at a time of its own choice.

    Raises:
        VersionError: the installed MuJoCo cannot be verified, or kernels are not compiled (NUMBA_DISABLE_JIT).
    """
    announce()
    with _LOCK:
        _register()


@functools.cache
def _register() -> None:
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        raise VersionError("the engine plugin needs compiled kernels; NUMBA_DISABLE_JIT is set")
    offsets()
    verify_plugin_fields()
    drawing()  # warns here where it cannot
    entries()
    add_callbacks(PLUGIN_NAME, compile_hooks(offsets().data)._asdict())


def take_error() -> Exception | None:
    """Return why a callback of this thread failed last, and forget it."""
    error = getattr(_here, "error", None)
    _here.error = None
    return error


def _failed(error: Exception) -> int:
    _here.error = error
    print(f"mjwrap: {error}", file=sys.stderr, flush=True)  # MuJoCo only says that an init failed
    return -1


def number_of_states(model: int, instance: int) -> int:
    """Return how many numbers of plugin_state an instance needs, -1 where that cannot be told."""
    try:
        return configuration_at(model, instance).numbers
    except Exception as error:
        return _failed(error)


def initialise(model: int, data: int, instance: int) -> int:
    """Give a new mjData its block; what stood in its slot of plugin_data before is not defined."""
    try:
        register()
    except Exception as error:
        return _failed(error)
    slots = ctypes.c_uint64.from_address(data + offsets().data["plugin_data"]).value
    slot = ctypes.c_uint64.from_address(slots + 8 * instance)
    slot.value = 0
    if is_reading() or is_idle(model, instance):
        return 0
    try:
        slot.value = give_block(model, data, instance)
    except Exception as error:
        return _failed(error)
    return 0
