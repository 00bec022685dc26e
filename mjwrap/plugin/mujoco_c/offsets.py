"""Find the offsets of the fields of MuJoCo's C structs in the installed MuJoCo, and verify them, when first needed.

Offsets change with almost every release. ctypes computes them from the struct declarations in the mujoco package
(`mujoco.introspect`). Then they are checked against models and data in memory, whose addresses and values the Python
bindings show. A MuJoCo that passes is used; any other is refused before anything is written.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Iterator
from typing import Any, NamedTuple

import mujoco
import numpy as np

from mjwrap.plugin.mujoco_c.refusal import refuse

_TYPES: dict[str, Any] = {
    "char": ctypes.c_char, "mjtByte": ctypes.c_ubyte, "mjtBool": ctypes.c_bool, "int": ctypes.c_int,
    "unsigned int": ctypes.c_uint, "float": ctypes.c_float, "mjtNum": ctypes.c_double, "double": ctypes.c_double,
    "mjtSize": ctypes.c_int64, "int64_t": ctypes.c_int64, "uint64_t": ctypes.c_uint64, "size_t": ctypes.c_size_t,
    "uintptr_t": ctypes.c_size_t,
}  # fmt: skip

# pointers that the plugin follows, each verified; data_plugin_state and data_plugin_data: see `probe.py`
MODEL_POINTERS = ("actuator_gear", "site_pos")
MODEL_PLUGIN_POINTERS = ("plugin_stateadr",)
DATA_POINTERS = (
    "qpos", "qvel", "act", "ctrl", "eq_active", "xfrc_applied", "qfrc_passive", "xpos", "xmat", "xipos", "geom_xpos",
    "geom_xmat", "site_xpos", "subtree_com",
    "cdof", "cvel", "act_dot", "actuator_length", "actuator_velocity", "actuator_force", "moment_rownnz",
    "moment_rowadr", "moment_colind", "actuator_moment", "ten_length", "ten_velocity", "ten_J", "sensordata",
)  # fmt: skip
PLUGIN_POINTERS = ("plugin_state", "plugin_data")
OPTIONS = ("timestep", "integrator", "disableflags", "disableactuator")


class Offsets(NamedTuple):
    """Byte offsets: `data` and `model` by field name; the model's options as "opt.timestep" and so on."""

    data: dict[str, int]
    model: dict[str, int]


class ModelBuffer(NamedTuple):
    """The layout of mjModel's arrays: byte offsets of `buffer`, `nbuffer` and of the pointer to each array by name.

    sizes [bytes]: length of the first part of the struct, which contains the model's sizes.
    """

    buffer: int
    nbuffer: int
    sizes: int
    arrays: dict[str, int]


# ------------------------------------------------------------------------------------ layout, left to ctypes


def structs() -> Any:
    """Return the declarations of MuJoCo's structs by name."""
    try:
        from mujoco.introspect import structs
    except ImportError:
        raise refuse("it does not contain the declarations of its structs (mujoco.introspect)") from None
    return structs.STRUCTS


def c_type(kind: Any) -> Any:
    """Return the ctypes type of a type as `mujoco.introspect` describes it."""
    form = type(kind).__name__
    if form == "PointerType":
        return ctypes.c_void_p
    if form == "ArrayType":
        return c_type(kind.inner_type) * int(np.prod(kind.extents))
    if form == "AnonymousStructDecl":
        return structure(kind.fields)
    name = getattr(kind, "name", "")
    if name in _TYPES:
        return _TYPES[name]
    if name in structs():
        return structure(structs()[name].fields)
    raise refuse(f"the type {name or form} in its structs is unknown")


def structure(fields: Any) -> type[ctypes.Structure]:
    """Return the ctypes struct with the fields listed by `mujoco.introspect`; ctypes uses the layout of C."""
    declared = []
    for field in fields:
        if type(field).__name__ != "StructFieldDecl":
            raise refuse(f"its structs contain a {type(field).__name__}")
        declared.append((field.name, c_type(field.type)))
    return type("Declared", (ctypes.Structure,), {"_fields_": declared})


def field_offsets(fields: Any) -> tuple[dict[str, int], int]:
    """Return the offset of every field of a struct, and its size [bytes]."""
    kind = structure(fields)
    return {field.name: getattr(kind, field.name).offset for field in fields}, ctypes.sizeof(kind)


# ------------------------------------------------------------------------------------------- verification


def _probes() -> Iterator[tuple[mujoco.MjModel, mujoco.MjData]]:
    """Yield models of different sizes, none of whose arrays is empty, with distinct values of the options."""
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
            equality = spec.add_equality(name1=f"j{i}", type=mujoco.mjtEq.mjEQ_JOINT)
            equality.objtype = mujoco.mjtObj.mjOBJ_JOINT
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
    """Raise unless the struct contains, at `offset`, the address of the array that Python shows by this name."""
    array = np.asarray(getattr(owner, field))
    found = ctypes.c_uint64.from_address(owner._address + offset).value
    if array.size == 0 or found != array.__array_interface__["data"][0]:
        raise refuse(f"{type(owner).__name__}.{field} is not where its declaration puts it")


def check_value(owner: Any, field: str, kind: Any, offset: int, expected: float) -> None:
    """Raise unless the struct contains, at `offset`, the expected number of a ctypes kind."""
    found = kind.from_address(owner._address + offset).value
    if found != expected:
        raise refuse(f"{type(owner).__name__}.{field} is not where its declaration puts it")


@functools.cache
def offsets() -> Offsets:
    """Return the offsets in the installed MuJoCo; `VersionError` if a field cannot be verified."""
    declared = structs()
    if ctypes.sizeof(ctypes.c_void_p) != 8 or np.dtype(np.uintp).itemsize != 8:
        raise refuse("this is not a 64-bit process")
    try:
        data, model, option = (
            field_offsets(declared[s].fields)[0] for s in ("mjData", "mjModel", "mjOption")
        )
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
        check_value(state, "time", ctypes.c_double, found.data["time"], state.time)
        for name in OPTIONS:
            kind = ctypes.c_double if name == "timestep" else ctypes.c_int
            check_value(living, f"opt.{name}", kind, found.model[f"opt.{name}"], getattr(living.opt, name))
    return found


def model_buffer() -> ModelBuffer:
    """Return the layout of mjModel's arrays; `VersionError` if one of them is elsewhere in a test model."""
    fields = structs()["mjModel"].fields
    at = field_offsets(fields)[0]
    pointers = {
        f.name: at[f.name] for f in fields if type(f.type).__name__ == "PointerType" and f.name != "buffer"
    }
    for model, _ in _probes():
        for name, offset in pointers.items():
            shown = getattr(model, name, None)
            if isinstance(shown, np.ndarray) and shown.size:
                check_pointer(model, name, offset)
        check_value(model, "nbuffer", ctypes.c_int64, at["nbuffer"], model.nbuffer)
    return ModelBuffer(at["buffer"], at["nbuffer"], at["opt"], pointers)
