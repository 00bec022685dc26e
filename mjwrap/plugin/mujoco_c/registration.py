"""Register engine plugins with MuJoCo, which keeps them until the process ends."""

from __future__ import annotations

import ctypes
from typing import Any

from mjwrap.plugin.mujoco_c.library import MjpPlugin, library

PLUGIN_NAME = "mjwrap.muscles"  # of the engine plugin
# names of the texts of its configuration, which the model keeps in this order (`mjcf/marks.py` reads the fourth)
ATTRIBUTES = MUSCLES, NUMBERS, MODE, SIDE_RULE = "muscles", "numbers", "mode", "side_rule"
_ACTUATOR, _PASSIVE, _STAGE_ACC = 1, 4, 3  # mjPLUGIN_ACTUATOR, mjPLUGIN_PASSIVE, mjSTAGE_ACC


def slot_of(name: str) -> int:
    """Return the number under which MuJoCo keeps a plugin, -1 if it is not registered."""
    slot = ctypes.c_int(-1)
    library().mjp_getPlugin(name.encode(), ctypes.byref(slot))
    return slot.value


def register_plugin(name: str, callbacks: dict[str, Any], attributes: tuple[str, ...] = ()) -> None:
    """Register a plugin for passive forces and actuators, unless one with this name is registered.

    callbacks: numba or ctypes functions by their field in mjpPlugin; attributes: names of its configuration values.
    """
    lib = library()
    if slot_of(name) >= 0:
        return
    texts = (ctypes.c_char_p * max(1, len(attributes)))(*(text.encode() for text in attributes))
    plugin = MjpPlugin(name=name.encode(), nattribute=len(attributes), attributes=texts)
    plugin.capabilityflags, plugin.needstage = _PASSIVE | _ACTUATOR, _STAGE_ACC
    for field, function in callbacks.items():
        setattr(plugin, field, address_of(function))
        keep_forever(function)
    keep_forever(plugin)
    lib.mjp_registerPlugin(ctypes.byref(plugin))


def add_callbacks(name: str, callbacks: dict[str, Any]) -> None:
    """Give a registered plugin its other callbacks, unless it has them: MuJoCo reads its record at every call."""
    plugin = library().mjp_getPlugin(name.encode(), None).contents
    if any(getattr(plugin, field) for field in callbacks):
        return
    for field, function in callbacks.items():
        keep_forever(function)
        setattr(plugin, field, address_of(function))


def keep_forever(thing: Any) -> None:
    """Keep an object until the process ends, even if the module that made it is unloaded."""
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))


def address_of(function: Any) -> int:
    """Return the address at which C calls a numba or ctypes function."""
    return int(getattr(function, "address", 0) or ctypes.cast(function, ctypes.c_void_p).value or 0)
