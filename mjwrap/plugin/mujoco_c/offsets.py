"""Where the fields of MuJoCo's C structs lie in the installed MuJoCo, found and verified when first needed.

Offsets move with almost every release. They are computed from the struct declarations that the mujoco package carries
(`mujoco.introspect`) by the rules of C, then checked against living models and data, whose field addresses and values
the Python bindings show. A MuJoCo that passes is used; any other is refused before anything is written.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Iterator
from typing import Any, NamedTuple

import mujoco
import numpy as np

from mjwrap.errors import VersionError

_POINTER = ctypes.sizeof(ctypes.c_void_p)
_SIZES = {
    "char": 1, "mjtByte": 1, "mjtBool": 1, "int": 4, "unsigned int": 4, "float": 4, "mjtNum": 8, "double": 8,
    "mjtSize": 8, "int64_t": 8, "uint64_t": 8, "size_t": _POINTER, "uintptr_t": _POINTER,
}  # fmt: skip

# pointers that the plugin follows, each verified; data_plugin_state and data_plugin_data: see `verify_plugin_fields`
MODEL_POINTERS = ("actuator_gear",)
MODEL_PLUGIN_POINTERS = ("plugin_stateadr",)
DATA_POINTERS = (
    "qpos", "qvel", "act", "ctrl", "xfrc_applied", "xipos", "geom_xpos", "geom_xmat", "site_xpos", "subtree_com",
    "cdof", "cvel", "act_dot", "actuator_length", "actuator_velocity", "moment_rownnz", "moment_rowadr",
    "moment_colind", "actuator_moment", "ten_length", "ten_velocity", "ten_J", "sensordata",
)  # fmt: skip
PLUGIN_POINTERS = ("plugin_state", "plugin_data")
OPTIONS = ("timestep", "integrator", "disableflags", "disableactuator")


class Offsets(NamedTuple):
    """Byte offsets: `data` and `model` by field name; the model's options as "opt.timestep" and so on."""

    data: dict[str, int]
    model: dict[str, int]


class ModelBuffer(NamedTuple):
    """Where mjModel keeps its arrays: byte offsets of `buffer`, `nbuffer` and of the pointer to each array by name.

    sizes [bytes]: how much of the struct, from its start, are the model's sizes.
    """

    buffer: int
    nbuffer: int
    sizes: int
    arrays: dict[str, int]


def refuse(what: str) -> VersionError:
    return VersionError(
        f"the engine plugin cannot run in MuJoCo {mujoco.__version__}: {what}; MuscleSystem works without it"
    )


# --------------------------------------------------------------------------------- layout by the rules of C


def structs() -> Any:
    try:
        from mujoco.introspect import structs
    except ImportError:
        raise refuse("it does not carry the declarations of its structs (mujoco.introspect)") from None
    return structs.STRUCTS


def extent(kind: Any) -> tuple[int, int]:
    """Return size and alignment [bytes] of a type as `mujoco.introspect` describes it."""
    form = type(kind).__name__
    if form == "PointerType":
        return _POINTER, _POINTER
    if form == "ArrayType":
        size, alignment = extent(kind.inner_type)
        return size * int(np.prod(kind.extents)), alignment
    if form == "AnonymousStructDecl":
        return walk(kind.fields)[1:]
    name = getattr(kind, "name", "")
    if name in _SIZES:
        return _SIZES[name], _SIZES[name]
    if name in structs():
        return walk(structs()[name].fields)[1:]
    raise refuse(f"the type {name or form} in its structs is unknown")


def walk(fields: Any) -> tuple[dict[str, int], int, int]:
    """Return the offset of every field, the size and the alignment of a struct [bytes]."""
    offsets: dict[str, int] = {}
    here, widest = 0, 1
    for field in fields:
        if type(field).__name__ != "StructFieldDecl":
            raise refuse(f"its structs contain a {type(field).__name__}")
        size, alignment = extent(field.type)
        here = -(-here // alignment) * alignment
        offsets[field.name] = here
        here, widest = here + size, max(widest, alignment)
    return offsets, -(-here // widest) * widest, widest


# ------------------------------------------------------------------------------------------- verification


def _probes() -> Iterator[tuple[mujoco.MjModel, mujoco.MjData]]:
    """Yield models whose arrays all have room, of different sizes, with options of distinct values."""
    for n in (2, 3, 5):
        spec = mujoco.MjSpec()
        for i in range(n):
            body = spec.worldbody.add_body(name=f"b{i}", pos=[i, 0, 0])
            body.add_joint(name=f"j{i}", axis=[0, 1, 0])
            for _ in range(i + 1):
                body.add_geom(size=[0.1, 0, 0])
            for k in range(2 * n - i):
                body.add_site(name=f"s{i}_{k}", pos=[0.1, 0, 0])
            actuator = spec.add_actuator(name=f"a{i}", target=f"j{i}")
            actuator.trntype = mujoco.mjtTrn.mjTRN_JOINT
            actuator.dyntype = mujoco.mjtDyn.mjDYN_INTEGRATOR
            tendon = spec.add_tendon(name=f"t{i}")
            for k in (0, 1):
                tendon.wrap_site(f"s{i * k}_{k}")
            spec.add_sensor(
                type=mujoco.mjtSensor.mjSENS_TENDONPOS, objtype=mujoco.mjtObj.mjOBJ_TENDON, objname=f"t{i}"
            )
        model = spec.compile()
        model.opt.timestep = 0.001 * (n + 0.25)
        model.opt.integrator = n % 4
        model.opt.disableflags, model.opt.disableactuator = 64 + n, 1000 + n
        data = mujoco.MjData(model)
        data.time = 7.0 + n
        yield model, data


def check_pointer(owner: Any, field: str, offset: int) -> None:
    """Raise unless the struct holds at `offset` the address of the array that Python shows under this name."""
    array = np.asarray(getattr(owner, field))
    found = ctypes.c_uint64.from_address(owner._address + offset).value
    if array.size == 0 or found != array.__array_interface__["data"][0]:
        raise refuse(f"{type(owner).__name__}.{field} is not where its declaration puts it")


def _check_value(owner: Any, field: str, kind: Any, offset: int, expected: float) -> None:
    found = kind.from_address(owner._address + offset).value
    if found != expected:
        raise refuse(f"{type(owner).__name__}.{field} is not where its declaration puts it")


@functools.cache
def offsets() -> Offsets:
    """Return the offsets in the installed MuJoCo; `VersionError` where a field cannot be verified."""
    declared = structs()
    if _POINTER != 8 or np.dtype(np.uintp).itemsize != 8:
        raise refuse("this is not a 64-bit process")
    try:
        data, model, option = (walk(declared[s].fields)[0] for s in ("mjData", "mjModel", "mjOption"))
        found = Offsets(
            {name: data[name] for name in ("time", "nplugin", *DATA_POINTERS, *PLUGIN_POINTERS)},
            {name: model[name] for name in (*MODEL_POINTERS, *MODEL_PLUGIN_POINTERS)}
            | {f"opt.{name}": model["opt"] + option[name] for name in OPTIONS},
        )
    except KeyError as error:
        raise refuse(f"its structs have no {error.args[0]}") from None
    for living, state in _probes():
        for field in DATA_POINTERS:
            check_pointer(state, field, found.data[field])
        for field in MODEL_POINTERS:
            check_pointer(living, field, found.model[field])
        _check_value(state, "time", ctypes.c_double, found.data["time"], state.time)
        for name in OPTIONS:
            kind = ctypes.c_double if name == "timestep" else ctypes.c_int
            _check_value(living, f"opt.{name}", kind, found.model[f"opt.{name}"], getattr(living.opt, name))
    return found


def model_buffer() -> ModelBuffer:
    """Return where mjModel keeps its arrays; `VersionError` where one of them is elsewhere in a model of ours."""
    fields = structs()["mjModel"].fields
    at = walk(fields)[0]
    pointers = {
        f.name: at[f.name] for f in fields if type(f.type).__name__ == "PointerType" and f.name != "buffer"
    }
    for model, _ in _probes():
        for name, offset in pointers.items():
            shown = getattr(model, name, None)
            if isinstance(shown, np.ndarray) and shown.size:
                check_pointer(model, name, offset)
        _check_value(model, "nbuffer", ctypes.c_int64, at["nbuffer"], model.nbuffer)
    return ModelBuffer(at["buffer"], at["nbuffer"], at["opt"], pointers)


def verify_plugin_fields(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Verify the fields that only a model with plugins has: model needs two instances with states of their own."""
    found = offsets()
    for field in MODEL_PLUGIN_POINTERS:
        check_pointer(model, field, found.model[field])
    for field in PLUGIN_POINTERS:
        check_pointer(data, field, found.data[field])
    _check_value(data, "nplugin", ctypes.c_int, found.data["nplugin"], data.nplugin)
