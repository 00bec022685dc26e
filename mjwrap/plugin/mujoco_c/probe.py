"""Verify the fields that only a model with plugins has, using a plugin that does nothing."""

from __future__ import annotations

import ctypes

import mujoco

from mjwrap.plugin.mujoco_c.library import MjpPlugin
from mjwrap.plugin.mujoco_c.offsets import (
    MODEL_PLUGIN_POINTERS,
    PLUGIN_POINTERS,
    check_pointer,
    check_value,
    offsets,
)
from mjwrap.plugin.mujoco_c.refusal import refuse
from mjwrap.plugin.mujoco_c.registration import register_plugin

_NAME = "mjwrap.probe"
_PLUGIN_BYTES = 152
_NSTATE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int)
_INIT = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)
_NOTHING = ctypes.CFUNCTYPE(None)


def verify_plugin_fields() -> None:
    """Raise `VersionError` if the fields of a model with two instances are not where they are declared."""
    if ctypes.sizeof(MjpPlugin) != _PLUGIN_BYTES:
        raise refuse("the size of mjpPlugin differs from that in C")
    two = _NSTATE(lambda model, instance: 2)
    ready = _INIT(lambda model, data, instance: 0)
    nothing = _NOTHING(lambda: None)
    register_plugin(_NAME, {"nstate": two, "init": ready, "reset": nothing, "compute": nothing})
    spec = mujoco.MjSpec()
    spec.activate_plugin(_NAME)
    for name in "ab":
        spec.add_plugin(name=name, plugin_name=_NAME, active=True)
    model = spec.compile()
    data, found = mujoco.MjData(model), offsets()
    for field in MODEL_PLUGIN_POINTERS:
        check_pointer(model, field, found.model[field])
    for field in PLUGIN_POINTERS:
        check_pointer(data, field, found.data[field])
    check_value(data, "nplugin", ctypes.c_int, found.data["nplugin"], data.nplugin)
