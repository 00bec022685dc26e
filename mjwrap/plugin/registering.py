"""Complete the registration of the plugin with MuJoCo, once per process, and allocate the blocks of mjData.

`announcing.py` has registered its name, and calls the two functions in Python here.

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
from mjwrap.plugin.announcing import announce
from mjwrap.plugin.blocks.allocation import entries, give_block
from mjwrap.plugin.blocks.instance_muscles import is_reading
from mjwrap.plugin.callbacks.hooks import compile_hooks
from mjwrap.plugin.mujoco_c.offsets import offsets
from mjwrap.plugin.mujoco_c.probe import verify_plugin_fields
from mjwrap.plugin.mujoco_c.registration import PLUGIN_NAME, add_callbacks
from mjwrap.plugin.mujoco_c.visualisation import drawing
from mjwrap.plugin.spec.configuration import configuration_at, is_idle

_LOCK = threading.RLock()
_here = threading.local()  # .error: the reason of the last failure of a callback in this thread


def register() -> None:
    """Make the engine plugin known to MuJoCo, for models that already have it: pickles, MJB files, saved XML.

    `install` and `load` call it. After `import mjwrap` the first mjData of such a model calls it, too; call it earlier
    if that mjData must not wait for the compilation.

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
    drawing()  # warns here if drawing is not possible
    entries()
    add_callbacks(PLUGIN_NAME, compile_hooks(offsets().data)._asdict())


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


def number_of_states(model: int, instance: int) -> int:
    """Return the number of entries of plugin_state that an instance needs, -1 on failure."""
    try:
        return configuration_at(model, instance).numbers
    except Exception as error:
        return _failed(error)


def initialise(model: int, data: int, instance: int) -> int:
    """Allocate the block of a new mjData, whose entry of plugin_data is not defined before; return 0, -1 on failure."""
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
