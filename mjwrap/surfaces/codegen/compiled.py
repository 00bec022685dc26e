"""Compile the functions of a generated module, with the same arithmetic as the kernels, callable from C.

With NUMBA_DISABLE_JIT=1 they stay Python functions, but still get a C address.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from typing import Any

import numba
from numba.core import types

from mjwrap.kernels.compilation.jit import config

_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}}
_REAL, _POINTER = types.float64, types.CPointer(types.float64)
_C_REAL, _C_POINTER = ctypes.c_double, ctypes.POINTER(ctypes.c_double)


class _Uncompiled:
    """A Python function with a C address; an exception becomes NaN, as in compiled code."""

    cache_hits = 0

    def __init__(self, function: Callable[..., Any], returns: Any, arguments: list[Any], size: int) -> None:
        def call(*given: Any) -> Any:
            try:
                return function(*given)
            except (ArithmeticError, ValueError):
                for i in range(size):
                    given[-1][i] = math.nan
                return None if size else math.nan

        self._keep = ctypes.CFUNCTYPE(returns, *arguments)(call)
        self.address = ctypes.cast(self._keep, ctypes.c_void_p).value


def _entry(returns: Any, arguments: list[Any], c_returns: Any, c_arguments: list[Any], size: int) -> Any:
    """Return a decorator that gives a function a C address; size: size of the array that it fills."""
    if config.DISABLE_JIT:
        return lambda function: _Uncompiled(function, c_returns, c_arguments, size)
    return numba.cfunc(returns(*arguments), cache=True, **_OPTIONS)


inner: Any = (lambda function: function) if config.DISABLE_JIT else numba.njit(**_OPTIONS)
geodesic_entry = _entry(types.void, [_POINTER] * 2, None, [_C_POINTER] * 2, 31)
project_entry = _entry(types.void, [_REAL] * 3 + [_POINTER], None, [_C_REAL] * 3 + [_C_POINTER], 6)
height_entry = _entry(_REAL, [_REAL] * 3, _C_REAL, [_C_REAL] * 3, 0)
