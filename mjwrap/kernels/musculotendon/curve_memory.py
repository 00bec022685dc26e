"""Numbers that compiled code reads by their address: the curves of muscles that have their own.

A muscle's own curves stand in arrays that Python keeps (`mjwrap/muscles/curve_sets.py`). Their address takes the place
of the law's code in the functions of `dispatch.py`, so that a muscle without curves of its own pays a comparison.
"""

from __future__ import annotations

import ctypes
from typing import Any

from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic as numba_intrinsic

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


def _read(address, index):
    """Return number `index` of the doubles at an address."""
    return _load(address + 8 * index)


def _plain_read(address: int, index: int) -> float:
    return ctypes.c_double.from_address(int(address) + 8 * int(index)).value


read: Any = _plain_read if config.DISABLE_JIT else jit(_read)
