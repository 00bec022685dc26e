"""Find the offsets of the fields of MuJoCo's visualisation structs, and verify them, as `offsets.py` does.

The Python bindings do not show the addresses of a scene and its geoms. So MuJoCo's own functions fill structs in
memory that is allocated here, and their contents are compared with the same scene in the bindings.
"""

from __future__ import annotations

import ctypes
import functools
import warnings
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import VersionError
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks.drawing import GROUPS, LABEL
from mjwrap.plugin.mujoco_c.library import library
from mjwrap.plugin.mujoco_c.offsets import c_type, check_pointer, field_offsets, structs
from mjwrap.plugin.mujoco_c.refusal import refuse

_ARRAYS = (
    "tendon_width", "tendon_rgba", "tendon_group", "tendon_matid", "actuator_group",
    "mat_rgba", "mat_emission", "mat_specular", "mat_shininess", "mat_reflectance",
)  # fmt: skip
_GEOM_NUMBERS = (
    "type",
    "objtype",
    "objid",
    "category",
    "segid",
    "emission",
    "specular",
    "shininess",
    "reflectance",
)
_GEOM_ARRAYS = ("size", "pos", "mat", "rgba")
_SPARE = 64  # bytes behind a struct that MuJoCo must not touch
_TEXT = b"The scene is full and muscles are missing in it; increase maxgeom."
_XML = """
<mujoco>
  <visual>
    <map alpha="0.375" actuatortendon="1.625"/>
    <rgba actuator="0.1 0.2 0.3 0.4" actuatorpositive="0.5 0.6 0.7 0.8" contactpoint="0.9 0.25 0.35 0.45"
      actuatornegative="0.55 0.65 0.75 0.85"/>
  </visual>
  <asset>
    <material name="dull" rgba="0.2 0.4 0.6 0.8" emission="0.125" specular="0.25" shininess="0.375"
      reflectance="0.625"/>
    <material name="red" rgba="0.9 0.1 0.1 1"/>
  </asset>
  <worldbody>
    <geom size="0.1" material="dull"/>
    <body pos="0 0 1"><freejoint/><geom type="capsule" size="0.1 0.2" euler="10 20 30" rgba="0.1 0.6 0.3 0.9"/></body>
    <site name="a" pos="0 1 0"/><site name="b" pos="0.3 1 0.7"/><site name="c" pos="0.1 1.5 0.2"/>
  </worldbody>
  <tendon>
    <spatial name="first" width="0.02" material="red"><site site="a"/><site site="b"/></spatial>
    <spatial name="second" group="1" rgba="0.3 0.2 0.1 0.5"><site site="b"/><site site="c"/></spatial>
  </tendon>
  <actuator><motor tendon="first"/><motor tendon="second" group="3"/></actuator>
</mujoco>
"""


class Drawing(NamedTuple):
    """The part of a block's head for drawing, as `block.DRAWING` lists them; blank: a geom as MuJoCo initialises it."""

    words: list[int]
    blank: bytes


def _fields(name: str) -> tuple[dict[str, int], int]:
    """Return the offset of every field of a struct, and its size."""
    return field_offsets(structs()[name].fields)


def _visual() -> dict[str, int]:
    """Return the offsets in mjModel of the visual options that `block.DRAWING` names."""
    start, found = _fields("mjModel")[0]["vis"], {}
    sections = {field.name: field for field in structs()["mjVisual"].fields}
    for section, names in (
        ("rgba", ("actuator", "actuatornegative", "actuatorpositive", "contactpoint")),
        ("map", ("alpha", "actuatortendon")),
    ):
        at, inner = _fields("mjVisual")[0][section], field_offsets(sections[section].type.fields)[0]
        found |= {f"model.vis.{section}.{name}": start + at + inner[name] for name in names}
    return found


def _struct(name: str, *, fill: int = 0) -> Any:
    """Return memory for a struct and some bytes behind it, filled with one value."""
    buffer = (ctypes.c_ubyte * (_fields(name)[1] + _SPARE))()
    ctypes.memset(buffer, fill, len(buffer))
    return buffer


def _floats(address: int, number: int) -> NDArray[np.float32]:
    return np.ctypeslib.as_array((ctypes.c_float * number).from_address(address))


def _int(address: int) -> int:
    return ctypes.c_int.from_address(address).value


def _verify_model(model: mujoco.MjModel, visual: dict[str, int]) -> None:
    at = _fields("mjModel")[0]
    for name in _ARRAYS:
        check_pointer(model, name, at[name])
    for name, offset in visual.items():
        _, _, section, field = name.split(".")
        shown = np.atleast_1d(np.asarray(getattr(getattr(model.vis, section), field), dtype=np.float32))
        if not np.array_equal(_floats(model._address + offset, shown.size), shown):
            raise refuse(f"{name} is not where its declaration puts it")


def _verify_option() -> Any:
    """Return memory with MuJoCo's default mjvOption, verified against the bytes that Python shows."""
    at, size = _fields("mjvOption")
    shown, memory = mujoco.MjvOption(), _struct("mjvOption", fill=0xA5)
    library().mjv_defaultOption(memory)
    raw, base = bytes(memory), shown.flags.__array_interface__["data"][0] - at["flags"]
    for name in ("geomgroup", "sitegroup", "tendongroup", "actuatorgroup", "flags"):
        array = np.asarray(getattr(shown, name))
        same = raw[at[name] : at[name] + array.size] == array.tobytes()
        if not same or array.__array_interface__["data"][0] != base + at[name]:
            raise refuse(f"mjvOption.{name} is not where its declaration puts it")
    if _int(ctypes.addressof(memory) + at["label"]) != shown.label or raw[size:] != b"\xa5" * _SPARE:
        raise refuse("mjvOption differs from its declaration")
    if np.asarray(shown.tendongroup).size != GROUPS:
        raise refuse("its number of groups differs")
    return memory


def _verify_scene(model: mujoco.MjModel, option: Any) -> None:
    """Let MuJoCo fill a scene in memory that is allocated here, and verify it against the same scene in Python."""
    lib, data, camera = library(), mujoco.MjData(model), _struct("mjvCamera")
    mujoco.mj_forward(model, data)
    at, size = _fields("mjvScene")
    memory, shown = _struct("mjvScene", fill=0xA5), mujoco.MjvScene(model, 7)
    start = ctypes.addressof(memory)
    lib.mjv_defaultScene(memory)
    if bytes(memory)[size:] != b"\xa5" * _SPARE or any(bytes(memory)[at["status"] : size]):
        raise refuse("the size of mjvScene differs from its declaration")
    lib.mjv_defaultCamera(camera)
    lib.mjv_makeScene(model._address, memory, 7)
    try:
        lib.mjv_updateScene(
            model._address, data._address, option, None, camera, int(mujoco.mjtCatBit.mjCAT_ALL), memory
        )
        mujoco.mjv_updateScene(
            model, data, mujoco.MjvOption(), None, mujoco.MjvCamera(), int(mujoco.mjtCatBit.mjCAT_ALL), shown
        )
        numbers = {"maxgeom": 7, "ngeom": shown.ngeom, "status": 0}
        if any(_int(start + at[name]) != value for name, value in numbers.items()) or shown.ngeom < 4:
            raise refuse("mjvScene differs from its declaration")
        _verify_geoms(ctypes.c_uint64.from_address(start + at["geoms"]).value, shown)
    finally:
        lib.mjv_freeScene(memory)


def _verify_geoms(first: int, shown: mujoco.MjvScene) -> None:
    at, size = _fields("mjvGeom")
    for k in range(shown.ngeom):
        geom, here = shown.geoms[k], first + k * size
        for name in _GEOM_NUMBERS:
            value = getattr(geom, name)
            found = _floats(here + at[name], 1)[0] if isinstance(value, float) else _int(here + at[name])
            if found != value:
                raise refuse(f"mjvGeom.{name} is not where its declaration puts it")
        for name in _GEOM_ARRAYS:
            value = np.asarray(getattr(geom, name)).ravel()
            if not np.array_equal(_floats(here + at[name], value.size), value):
                raise refuse(f"mjvGeom.{name} is not where its declaration puts it")


def _find() -> Drawing:
    """Return the layout for drawing in the installed MuJoCo; `VersionError` if it cannot be verified."""
    try:
        geom, size = _fields("mjvGeom")
        scene, option, model = _fields("mjvScene")[0], _fields("mjvOption")[0], _fields("mjModel")[0]
        visual = _visual()
        probe = mujoco.MjSpec.from_string(
            _XML
        ).compile()  # MjModel.from_xml_string never ends inside MjData()
        _verify_model(probe, visual)
        _verify_scene(probe, _verify_option())
        label = {f.name: f for f in structs()["mjvGeom"].fields}["label"]
        light = [geom[name] - geom["emission"] for name in ("specular", "shininess", "reflectance")]
        if ctypes.sizeof(c_type(label.type)) != LABEL or size % 4 or light != [4, 8, 12]:
            raise refuse("the layout of mjvGeom differs from its declaration")
    except (KeyError, AttributeError) as error:
        raise refuse(f"its visualisation structs differ ({error})") from None
    blank = (ctypes.c_ubyte * size)()
    library().mjv_initGeom(blank, int(mujoco.mjtGeom.mjGEOM_NONE), None, None, None, None)
    flags, bits = option["flags"], mujoco.mjtVisFlag
    words = {f"scene.{name}": at for name, at in scene.items()} | {
        f"geom.{name}": at for name, at in geom.items()
    }
    words |= {f"model.{name}": at for name, at in model.items()} | visual
    words |= {f"option.{name}": option[name] for name in ("label", "tendongroup", "actuatorgroup")}
    words |= {
        "option.tendon": flags + int(bits.mjVIS_TENDON),
        "option.actuator": flags + int(bits.mjVIS_ACTUATOR),
        "option.activation": flags + int(bits.mjVIS_ACTIVATION),
        "option.transparent": flags + int(bits.mjVIS_TRANSPARENT),
        "geom.bytes": size,
        "code.label_tendon": int(mujoco.mjtLabel.mjLABEL_TENDON),
        "code.label_actuator": int(mujoco.mjtLabel.mjLABEL_ACTUATOR),
        "code.capsule": int(mujoco.mjtGeom.mjGEOM_CAPSULE),
        "code.sphere": int(mujoco.mjtGeom.mjGEOM_SPHERE),
        "code.tendon": int(mujoco.mjtObj.mjOBJ_TENDON),
        "code.actuator": int(mujoco.mjtObj.mjOBJ_ACTUATOR),
        "code.unknown": int(mujoco.mjtObj.mjOBJ_UNKNOWN),
        "code.dynamic": int(mujoco.mjtCatBit.mjCAT_DYNAMIC),
        "code.decor": int(mujoco.mjtCatBit.mjCAT_DECOR),
        "warn": ctypes.cast(library().mju_warning, ctypes.c_void_p).value or 0,
        "full": ctypes.addressof(_FULL),
    }  # fmt: skip
    return Drawing([words[name] for name in bk.DRAWING], bytes(blank))


_FULL = ctypes.create_string_buffer(_TEXT)
ctypes.pythonapi.Py_IncRef(ctypes.py_object(_FULL))  # blocks point to it, even after this module is unloaded


@functools.cache
def drawing() -> Drawing | None:
    """Return the layout for drawing in the installed MuJoCo; None, with a warning, if it cannot be verified."""
    try:
        return _find()
    except VersionError as error:
        warnings.warn(f"muscles run but are not drawn: {error}", RuntimeWarning, stacklevel=2)
        return None
