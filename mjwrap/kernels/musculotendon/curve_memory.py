"""Numbers that compiled code reads by their address: the curves of muscles that have their own.

A muscle's own curves stand in arrays that Python keeps (`mjwrap/muscles/curve_sets.py`). Their address takes the place
of the law's code in the functions of `dispatch.py`, so that a muscle without curves of its own pays nothing for them.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic as numba_intrinsic
from numba.np.numpy_support import carray

from mjwrap.kernels.compilation.cache_folders import config
from mjwrap.kernels.compilation.jit import jit

LEAST_ADDRESS = 4096  # no array lies below; codes of laws are smaller
LARGEST_ADDRESS = 2**53  # an address is kept as a float64 among a muscle's parameters, exactly up to here
intrinsic: Any = numba_intrinsic  # Any: the decorated function takes other arguments than it is written with


@intrinsic
def _load(typing_context: Any, address: Any) -> Any:
    """Return the double at an address."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load(builder.inttoptr(arguments[0], ir.DoubleType().as_pointer()))

    return types.float64(types.int64), generate


@intrinsic
def _pointer(typing_context: Any, address: Any) -> Any:
    """Return an address as a void pointer."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], cgutils.voidptr_t)

    return types.voidptr(types.int64), generate


def _read(address, index):
    """Return number `index` of the doubles at an address."""
    return _load(address + 8 * index)


def _rows(address, shape):
    """Return the doubles at an address as an array of two dimensions."""
    return carray(_pointer(address), shape, np.float64)


def _plain_read(address: int, index: int) -> float:
    return ctypes.c_double.from_address(int(address) + 8 * int(index)).value


def _plain_rows(address: int, shape: tuple[int, int]) -> Any:
    count = int(shape[0]) * int(shape[1])
    return np.frombuffer((ctypes.c_double * count).from_address(int(address))).reshape(shape)


read: Any = _plain_read if config.DISABLE_JIT else jit(_read)
rows: Any = _plain_rows if config.DISABLE_JIT else jit(_rows, _nrt=True)
