"""Compile the functions whose addresses are in mjpPlugin: each finds the block of its instance and works on it.

An mjData without a block is ignored. While a model compiles, MuJoCo steps data that no plugin has initialised; their
plugin_data is not defined, so only mjData.nplugin shows that they have no block.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numba.core import types

from mjwrap.kernels.array_types import compiled_types
from mjwrap.kernels.coupling.evaluation import evaluate, evaluate_with_points
from mjwrap.kernels.coupling.groups import PathPoints, Paths, Poses, Routes, SiteFrames
from mjwrap.kernels.musculotendon.groups import Inputs, Muscles, MuscleStates, StepStart, Timing
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks import drawing
from mjwrap.plugin.callbacks import publishing as pb
from mjwrap.plugin.callbacks import stage as st
from mjwrap.plugin.callbacks._cache import callback, jit
from mjwrap.plugin.callbacks.block_table import block_at, block_of_state, place_of, remove_entry
from mjwrap.plugin.callbacks.memory import call, call_with_four, read_int64, write_int64

_WORD, _INT = types.int64, types.int32
ACTUATOR = 1  # mjPLUGIN_ACTUATOR: what MuJoCo asks for, if not passive forces


class Hooks(NamedTuple):
    """Compiled callbacks, each with an `address`, in the order of mjpPlugin."""

    destroy: Any
    copy: Any
    reset: Any
    compute: Any
    advance: Any
    visualize: Any


class Entries(NamedTuple):
    """Compiled functions that blocks point to, each with an `address`."""

    stage: Any
    finish: Any
    publish: Any
    draw: Any


def _group(kind: Any) -> Any:
    """Return the type of a group."""
    return types.BaseTuple.from_types(
        compiled_types(kind), kind
    )  # a tuple whose fields all have one type is a different numba type


def _evaluation() -> tuple[Any, ...]:
    """Return the types of the arguments with which `stage` calls `evaluate`."""
    return (
        _group(Routes), _group(Muscles), _group(Poses), _group(Inputs), _group(Timing), types.float64,
        _group(Paths), _group(StepStart), _group(MuscleStates), types.float64[:, ::1],
    )  # fmt: skip


def compile_entries() -> Entries:
    """Compile, or load, the functions that are the same for every MuJoCo; only here the kernels are linked.

    Large kernels such as `evaluate` are called by symbols. These must be defined here, because numba loads a C function
    from its cache without them.
    """
    signature = types.void(_WORD, _WORD, _WORD)
    with_points = *_evaluation(), _group(PathPoints), _group(SiteFrames)
    for function, given in ((evaluate, _evaluation()), (evaluate_with_points, with_points)):
        kernel: Any = function
        kernel.compile(given)
        kernel.get_overload(given)
    draw = callback(types.void(_WORD, _WORD, _WORD, _WORD), drawing.draw)
    return Entries(
        callback(signature, st.stage),
        callback(signature, st.finish),
        callback(signature, pb.publish_forces),
        draw,
    )


@jit
def _block(data, instance, nplugin, plugin_data):
    """Return the address of an instance's block, 0 if there is none."""
    return block_at(place_of(data, instance, nplugin, plugin_data))


def compile_hooks(offsets: dict[str, int]) -> Hooks:
    """Compile, or load, the callbacks for an mjData with `nplugin` and `plugin_data` at these offsets."""
    nplugin, plugin_data = offsets["nplugin"], offsets["plugin_data"]

    def destroy(data, instance):
        place = place_of(data, instance, nplugin, plugin_data)
        if place != 0:
            block = block_at(place)
            write_int64(read_int64(data + plugin_data) + 8 * instance, 0)
            remove_entry(place)
            call(read_int64(block + 8 * bk.FREE), block, 0, 0)

    def copy(target, model, origin, instance):
        to, given = (
            _block(target, instance, nplugin, plugin_data),
            _block(origin, instance, nplugin, plugin_data),
        )
        if to != 0 and given != 0 and read_int64(to) == read_int64(given):
            for i in range(read_int64(given) // 8):
                write_int64(to + 8 * i, read_int64(given + 8 * i))

    def reset(model, state, place, instance):
        block = block_of_state(place, instance, state) if place != 0 else 0
        if block != 0:
            st.restart(block, state)

    def compute(model, data, instance, capability):
        block = _block(data, instance, nplugin, plugin_data)
        if block != 0:
            entry = bk.PUBLISH if capability == ACTUATOR else bk.STAGE
            call(read_int64(block + 8 * entry), block, model, data)

    def advance(model, data, instance):
        block = _block(data, instance, nplugin, plugin_data)
        if block != 0:
            call(read_int64(block + 8 * bk.FINISH), block, model, data)

    def visualize(model, data, option, scene, instance):
        block = _block(data, instance, nplugin, plugin_data)
        if block != 0 and read_int64(block + 8 * bk.DRAW) != 0:
            call_with_four(read_int64(block + 8 * bk.DRAW), block, model, option, scene)

    return Hooks(
        callback(types.void(_WORD, _INT), destroy),
        callback(types.void(_WORD, _WORD, _WORD, _INT), copy),
        callback(types.void(_WORD, _WORD, _WORD, _INT), reset),
        callback(types.void(_WORD, _WORD, _INT, _INT), compute),
        callback(types.void(_WORD, _WORD, _INT), advance),
        callback(types.void(_WORD, _WORD, _WORD, _WORD, _INT), visualize),
    )
