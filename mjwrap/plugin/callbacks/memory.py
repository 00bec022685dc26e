"""Read and write memory at addresses in compiled code, and call functions by their addresses."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic as numba_intrinsic
from numba.np.numpy_support import carray

from mjwrap.plugin.callbacks._cache import jit

_WORD = ir.IntType(64)
intrinsic: Any = numba_intrinsic  # Any: the decorated function takes other arguments than it is written with


def _load(kind: Any, numba_type: Any) -> Any:
    def typed(typing_context: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.load(builder.inttoptr(arguments[0], kind.as_pointer()))

        return numba_type(types.int64), generate

    return intrinsic(typed)


read_int64: Any = _load(_WORD, types.int64)  # the 64-bit integer at an address
read_int32: Any = _load(ir.IntType(32), types.int32)  # the 32-bit integer at an address
read_uint8: Any = _load(ir.IntType(8), types.uint8)  # the byte at an address
read_float64: Any = _load(ir.DoubleType(), types.float64)  # the double at an address
read_float32: Any = _load(ir.FloatType(), types.float32)  # the float at an address


@intrinsic
def pointer(typing_context: Any, address: Any) -> Any:
    """Return an address as a void pointer."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], cgutils.voidptr_t)

    return types.voidptr(types.int64), generate


@intrinsic
def write_int64(typing_context: Any, address: Any, value: Any) -> Any:
    """Write a 64-bit integer to an address."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.store(arguments[1], builder.inttoptr(arguments[0], _WORD.as_pointer()))
        return context.get_dummy_value()

    return types.none(types.int64, types.int64), generate


def _calling(number: int) -> Any:
    """Return the signature and code generator of a call, by address, of a function of `number` 64-bit integers."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = ir.FunctionType(ir.VoidType(), [_WORD] * number)
        builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), list(arguments[1:]))
        return context.get_dummy_value()

    return types.none(*[types.int64] * (1 + number)), generate


@intrinsic
def call(typing_context: Any, function: Any, first: Any, second: Any, third: Any) -> Any:
    """Call void f(int64, int64, int64) by its address."""
    return _calling(3)


@intrinsic
def call_with_two(typing_context: Any, function: Any, first: Any, second: Any) -> Any:
    """Call void f(int64, int64) by its address."""
    return _calling(2)


@intrinsic
def call_with_four(
    typing_context: Any, function: Any, first: Any, second: Any, third: Any, fourth: Any
) -> Any:
    """Call void f(int64, int64, int64, int64) by its address."""
    return _calling(4)


@jit
def float64_array(address, shape):
    """Return the doubles at an address as an array of the given shape."""
    return carray(pointer(address), shape, np.float64)


@jit
def int64_array(address, shape):
    """Return the 64-bit integers at an address as an array of the given shape."""
    return carray(pointer(address), shape, np.int64)


@jit
def int32_array(address, shape):
    """Return the 32-bit integers at an address as an array of the given shape."""
    return carray(pointer(address), shape, np.int32)


@jit
def bool_array(address, shape):
    """Return the bytes at an address as an array of booleans of the given shape."""
    return carray(pointer(address), shape, np.bool_)


@jit
def float32_array(address, shape):
    """Return the floats at an address as an array of the given shape."""
    return carray(pointer(address), shape, np.float32)


@jit
def uint8_array(address, shape):
    """Return the bytes at an address as an array of the given shape."""
    return carray(pointer(address), shape, np.uint8)
