"""Load the C library of MuJoCo that the Python bindings use, through ctypes."""

from __future__ import annotations

import ctypes
import functools
from pathlib import Path
from typing import Any

import mujoco

from mjwrap.errors import VersionError

_ADDRESS = ctypes.c_void_p


class MjpPlugin(ctypes.Structure):
    """mjpPlugin of `mjplugin.h`, 152 bytes in MuJoCo 3.3 to 4.0."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("nattribute", ctypes.c_int),
        ("attributes", ctypes.POINTER(ctypes.c_char_p)),
        ("capabilityflags", ctypes.c_int),
        ("needstage", ctypes.c_int),
        ("nstate", _ADDRESS),
        ("nsensordata", _ADDRESS),
        ("init", _ADDRESS),
        ("destroy", _ADDRESS),
        ("copy", _ADDRESS),
        ("reset", _ADDRESS),
        ("compute", _ADDRESS),
        ("advance", _ADDRESS),
        ("visualize", _ADDRESS),
        ("actuator_act_dot", _ADDRESS),
        ("sdf_distance", _ADDRESS),
        ("sdf_gradient", _ADDRESS),
        ("sdf_staticdistance", _ADDRESS),
        ("sdf_attribute", _ADDRESS),
        ("sdf_aabb", _ADDRESS),
    )


@functools.cache
def library() -> Any:
    """Return libmujoco with the argument types of the functions that the plugin calls."""
    folder = Path(mujoco.__file__).parent
    names = [*folder.glob("libmujoco.so*"), *folder.glob("libmujoco*.dylib"), *folder.glob("mujoco.dll")]
    if not names:
        raise VersionError(
            f"no MuJoCo library in {folder}; the engine plugin needs the library of MuJoCo's wheel"
        )
    loaded = ctypes.CDLL(str(names[0]))
    loaded.mjp_registerPlugin.argtypes = [ctypes.POINTER(MjpPlugin)]
    loaded.mjp_getPlugin.argtypes = [ctypes.c_char_p, ctypes.POINTER(ctypes.c_int)]
    loaded.mjp_getPlugin.restype = ctypes.POINTER(MjpPlugin)
    loaded.mj_getPluginConfig.argtypes = [_ADDRESS, ctypes.c_int, ctypes.c_char_p]
    loaded.mj_getPluginConfig.restype = ctypes.c_char_p
    loaded.mj_id2name.argtypes = [_ADDRESS, ctypes.c_int, ctypes.c_int]
    loaded.mj_id2name.restype = ctypes.c_char_p
    loaded.mj_sizeModel.argtypes = [_ADDRESS]
    loaded.mj_sizeModel.restype = ctypes.c_int64
    loaded.mj_saveModel.argtypes = [_ADDRESS, ctypes.c_char_p, _ADDRESS, ctypes.c_int64]
    loaded.mj_saveModel.restype = None
    for name in ("mj_makeConstraint", "mj_island", "mj_projectConstraint"):  # called by their addresses
        getattr(loaded, name).argtypes, getattr(loaded, name).restype = [_ADDRESS, _ADDRESS], None
    for name in ("mjv_defaultOption", "mjv_defaultScene", "mjv_defaultCamera", "mjv_freeScene"):
        getattr(loaded, name).argtypes, getattr(loaded, name).restype = [_ADDRESS], None
    loaded.mjv_makeScene.argtypes, loaded.mjv_makeScene.restype = [_ADDRESS, _ADDRESS, ctypes.c_int], None
    loaded.mjv_updateScene.argtypes = [_ADDRESS] * 5 + [ctypes.c_int, _ADDRESS]
    loaded.mjv_updateScene.restype = None
    loaded.mjv_initGeom.argtypes, loaded.mjv_initGeom.restype = (
        [_ADDRESS, ctypes.c_int] + [_ADDRESS] * 4,
        None,
    )
    return loaded


def saved_model(address: int) -> ctypes.Array[ctypes.c_char]:
    """Return the model at an address in MuJoCo's binary form."""
    size = library().mj_sizeModel(address)
    buffer = (ctypes.c_char * size)()
    library().mj_saveModel(address, None, buffer, size)
    return buffer
