"""Registering the plugin with MuJoCo, once a process, and giving every new mjData its block.

MuJoCo calls `nstate` while it compiles a model and `init` for every new mjData: the only callbacks in Python. What an
instance of the plugin is to do stands in its configuration, so in the model itself: the muscles it drives, without the
prefixes that `attach` adds, and the size of its state. Everything else `init` reads from the finished model, whoever
compiled it, in this process or another.
"""

from __future__ import annotations

import ctypes
import functools
import os
import sys
import threading
from collections import OrderedDict
from collections.abc import Mapping
from typing import Any, NamedTuple
from urllib.parse import quote, unquote

import mujoco
import numpy as np

from mjwrap.errors import ModelError, VersionError
from mjwrap.mjcf import MuscleDeclaration, read_declarations
from mjwrap.mjcf.names import PLUGIN_INSTANCE as INSTANCE
from mjwrap.model.arrays import Plan, build_plan
from mjwrap.model.takeover import Takeover
from mjwrap.plugin.blocks.image import block_image, renew, state_size
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks import owners
from mjwrap.plugin.callbacks.hooks import Entries, compile_entries, compile_hooks
from mjwrap.plugin.mujoco_c.copies import copy_of
from mjwrap.plugin.mujoco_c.fingerprint import fingerprint
from mjwrap.plugin.mujoco_c.library import MjpPlugin, library
from mjwrap.plugin.mujoco_c.offsets import offsets, verify_plugin_fields
from mjwrap.plugin.mujoco_c.visualisation import drawing
from mjwrap.plugin.spec.placeholders import restore_placeholders

NAME = "mjwrap.muscles.laws"
MUSCLES, NUMBERS, MODE = "muscles", "numbers", "mode"  # its configuration
WRENCH, TRANSMISSION = "wrench", "transmission"  # modes
_PROBE = "mjwrap.probe"
_PASSIVE, _STAGE_ACC = 4, 3  # mjPLUGIN_PASSIVE, mjSTAGE_ACC
_KEPT_IMAGES = 16
# force range [N] of an actuator that pulls no more: the compiler accepts no 0 to 0, to_xml writes nothing smaller, and
# a muscle's force is never positive, so it is clamped to zero
HUSHED = (0.0, 1e-12)

_WORD, _INT = ctypes.c_void_p, ctypes.c_int
_NSTATE = ctypes.CFUNCTYPE(_INT, _WORD, _INT)
_INIT = ctypes.CFUNCTYPE(_INT, _WORD, _WORD, _INT)
_REBUILD = ctypes.CFUNCTYPE(None, _WORD, _WORD, ctypes.c_int64)
_NOTHING = ctypes.CFUNCTYPE(None)

_LOCK = threading.Lock()
_COPY = threading.Lock()  # held while the copy of a model is read
_IMAGES: OrderedDict[tuple[bytes | None, int], bytes] = OrderedDict()
_here = threading.local()  # .reading: init is reading a copy of the model; .error: why init failed last


class Claim(NamedTuple):
    """What an instance is to drive: names of its muscles, the numbers of plugin_state that it has, and the mode."""

    muscles: list[str]
    numbers: int
    mode: str


def configuration(muscles: list[str], numbers: int, mode: str) -> dict[str, str]:
    """Return the configuration of an instance; names are quoted as in URLs, so that spaces part them."""
    names = " ".join(quote(name, safe="/") for name in muscles)
    return {MUSCLES: names, NUMBERS: str(numbers), MODE: mode}


def read_claim(name: str, config: Mapping[str, str]) -> Claim:
    """Return the claim of an instance from its name and configuration."""
    prefix = name.removesuffix(INSTANCE)
    muscles, numbers, mode = (config.get(key, "") for key in (MUSCLES, NUMBERS, MODE))
    if not name.endswith(INSTANCE) or not numbers.isdigit() or mode not in (WRENCH, TRANSMISSION):
        raise ModelError(
            f"plugin instance '{name}' was not made by mjwrap.install; leave it out and call install on the MjSpec"
        )
    return Claim([prefix + unquote(part) for part in muscles.split()], int(numbers), mode)


def claim_of(model: int, instance: int) -> Claim:
    """Return the claim of an instance of the model at an address."""
    lib = library()
    name = lib.mj_id2name(model, int(mujoco.mjtObj.mjOBJ_PLUGIN), instance) or b""
    texts = {
        key: lib.mj_getPluginConfig(model, instance, key.encode()) or b"" for key in (MUSCLES, NUMBERS, MODE)
    }
    return read_claim(name.decode(), {key: text.decode() for key, text in texts.items()})


def hush_to_silence(model: mujoco.MjModel) -> None:
    """Make the force range of actuators that an MjSpec of `install` has hushed what `Takeover` knows as silent."""
    hushed = (model.actuator_forcerange == HUSHED).all(axis=1)
    model.actuator_forcerange[hushed] = 0.0


def read_plan(model: mujoco.MjModel, names: list[str], mode: str) -> tuple[Plan, list[MuscleDeclaration]]:
    """Return the named muscles of a model and their arrays; `ModelError` where one is missing."""
    hush_to_silence(model)
    restore_placeholders(model)
    with Takeover(model).suspended():
        found = read_declarations(model, transmission=mode == TRANSMISSION).muscles
    declared = {muscle.name: muscle for muscle in found}
    missing = [name for name in names if name not in declared]
    if missing:
        raise ModelError(
            f"the model has no muscle '{missing[0]}' any more, which install gave to the engine plugin; muscles: "
            f"{', '.join(declared) or 'none'}; call install again"
        )
    muscles = [declared[name] for name in names]
    return build_plan(model, muscles), muscles


def _read_copy(address: int, claim: Claim) -> tuple[mujoco.MjModel, Plan, list[MuscleDeclaration]]:
    """Return a copy of the model at an address, the muscles of a claim and their arrays; `_COPY` is held."""
    _here.reading = True
    try:
        model = copy_of(address)
        return model, *read_plan(model, claim.muscles, claim.mode)
    finally:
        _here.reading = False


def read_instances(address: int, instances: list[int]) -> tuple[Plan, list[MuscleDeclaration]]:
    """Return the muscles of instances of the model at an address, in their order, and the arrays of all of them."""
    with _COPY:
        read = [_read_copy(address, claim_of(address, instance)) for instance in instances]
        muscles = [muscle for _, _, found in read for muscle in found]
        return build_plan(read[-1][0], muscles), muscles


def _image(address: int, instance: int) -> bytes:
    """Return the block for an instance of the model at an address; those of the last models are kept."""
    key = fingerprint(address), instance
    with _LOCK:
        if key in _IMAGES:
            _IMAGES.move_to_end(key)
            return _IMAGES[key]
    claim = claim_of(address, instance)
    with _COPY:
        model, plan, muscles = _read_copy(address, claim)
        if state_size(plan) != claim.numbers:
            raise ModelError(
                f"the paths of the engine plugin's muscles have changed since mjwrap.install: their state needs "
                f"{state_size(plan)} numbers and has {claim.numbers}; call install again"
            )
        image = block_image(model, instance, plan, muscles, _entries(), _free(), _rebuilder())
    if key[0] is None:
        return image
    with _LOCK:
        _IMAGES[key] = image
        while len(_IMAGES) > _KEPT_IMAGES:
            _IMAGES.popitem(last=False)
    return image


@functools.cache
def _entries() -> Entries:
    return compile_entries()


def _raw_malloc(size: int) -> int:
    allocate = (
        ctypes.pythonapi.PyMem_RawMalloc
    )  # may be given back without the GIL, and when Python has ended
    allocate.restype, allocate.argtypes = ctypes.c_void_p, [ctypes.c_size_t]
    address = allocate(size)
    if not address:
        raise MemoryError(f"no {size} bytes for the muscles' memory")
    return int(address)


def _free() -> int:
    return int(ctypes.cast(ctypes.pythonapi.PyMem_RawFree, ctypes.c_void_p).value or 0)


def _failed(error: Exception) -> int:
    _here.error = error
    print(f"mjwrap: {error}", file=sys.stderr, flush=True)  # MuJoCo only says that an init failed
    return -1


def take_error() -> Exception | None:
    """Return why a callback of this thread failed last, and forget it."""
    error = getattr(_here, "error", None)
    _here.error = None
    return error


def _nstate(model: int, instance: int) -> int:
    try:
        return claim_of(model, instance).numbers
    except Exception as error:
        return _failed(error)


def _init(model: int, data: int, instance: int) -> int:
    """Give a new mjData its block; what stood in plugin_data before is not defined."""
    slots = ctypes.c_uint64.from_address(data + offsets().data["plugin_data"]).value
    slot = ctypes.c_uint64.from_address(slots + 8 * instance)
    slot.value = 0
    if getattr(_here, "reading", False):
        return 0
    try:
        image = _image(model, instance)
        block = _raw_malloc(len(image))
        ctypes.memmove(block, image, len(image))
        ctypes.c_int64.from_address(block + 8 * bk.MODEL).value = model
        slot.value = _enter(data, instance, block)
    except Exception as error:
        return _failed(error)
    return 0


def _enter(data: int, instance: int, block: int) -> int:
    """Enter a block into the table of `callbacks/owners.py`; return its place there."""
    table = owners.TABLE
    with _LOCK:
        used = table[0]
        entries = np.ctypeslib.as_array(table)[1 : 1 + owners.ENTRY * (used + 1)].reshape(-1, owners.ENTRY)
        entry = int(np.argmin(entries[:, owners.OWNER] != 0))  # the first that is free
        if entry >= owners.CAPACITY - 1:
            raise MemoryError(f"more than {owners.CAPACITY - 1} mjData with muscles at once")
        entries[entry, [owners.INSTANCE, owners.BLOCK]] = instance, block
        entries[entry, owners.OWNER] = data
        table[0] = max(used, entry + 1)
    return entry + 1


def block_address(data: int, instance: int) -> int:
    """Return the address of the block of an instance of the mjData at an address, 0 where it has none."""
    table = owners.TABLE
    entries = np.ctypeslib.as_array(table)[1 : 1 + owners.ENTRY * table[0]].reshape(-1, owners.ENTRY)
    mine = (entries[:, owners.OWNER] == data) & (entries[:, owners.INSTANCE] == instance)
    return int(entries[mine, owners.BLOCK][0]) if mine.any() else 0


def _rebuild(block: int, model: int, instance: int) -> None:
    """Make a block's numbers those of a changed model, or leave them as they are and say why."""
    try:
        if not renew(block, _image(model, instance)):
            raise ModelError(
                "its muscles are others than those that the mjData was made for; make a new mjData"
            )
    except Exception as error:
        print(
            f"mjwrap: changes in the model are not followed, its muscles stay as they were: {error}",
            file=sys.stderr, flush=True,
        )  # fmt: skip


@functools.cache
def _rebuilder() -> int:
    function = _REBUILD(_rebuild)
    _for_ever(function)
    return _address(function)


def _for_ever(thing: Any) -> None:
    """Keep an object until the process ends, whatever happens to this module."""
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))


def _address(function: Any) -> int:
    """Return the address that C calls: of a numba or ctypes callback."""
    return int(getattr(function, "address", 0) or ctypes.cast(function, ctypes.c_void_p).value or 0)


def _register(name: str, callbacks: dict[str, Any], attributes: tuple[str, ...] = ()) -> None:
    """Register a plugin unless one of this name is there already."""
    lib, slot = library(), ctypes.c_int(-1)
    if lib.mjp_getPlugin(name.encode(), ctypes.byref(slot)):
        return
    texts = (ctypes.c_char_p * max(1, len(attributes)))(*(text.encode() for text in attributes))
    plugin = MjpPlugin(name=name.encode(), nattribute=len(attributes), attributes=texts)
    plugin.capabilityflags, plugin.needstage = _PASSIVE, _STAGE_ACC
    for field, function in callbacks.items():
        setattr(plugin, field, _address(function))
        _for_ever(function)
    _for_ever(plugin)
    lib.mjp_registerPlugin(ctypes.byref(plugin))


def _verify() -> None:
    """Verify what only a model with plugins shows, with one that does nothing."""
    if ctypes.sizeof(MjpPlugin) != 152:
        raise VersionError("mjpPlugin has another size here than in C")
    two = _NSTATE(lambda model, instance: 2)
    ready = _INIT(lambda model, data, instance: 0)
    nothing = _NOTHING(lambda: None)
    _register(_PROBE, {"nstate": two, "init": ready, "reset": nothing, "compute": nothing})
    spec = mujoco.MjSpec()
    spec.activate_plugin(_PROBE)
    for name in "ab":
        spec.add_plugin(name=name, plugin_name=_PROBE, active=True)
    model = spec.compile()
    verify_plugin_fields(model, mujoco.MjData(model))


@functools.cache
def register() -> None:
    """Make the plugin known to MuJoCo; `VersionError` where the installed MuJoCo cannot be verified."""
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        raise VersionError("the engine plugin needs compiled kernels; NUMBA_DISABLE_JIT is set")
    offsets()
    _verify()
    drawing()  # warns here where it cannot
    _entries()
    hooks = compile_hooks(offsets().data)
    python = {"nstate": _NSTATE(_nstate), "init": _INIT(_init)}
    _register(NAME, python | hooks._asdict(), (MUSCLES, NUMBERS, MODE))
