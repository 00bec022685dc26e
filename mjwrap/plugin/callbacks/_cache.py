"""Compile the callbacks; their machine code is cached like that of the kernels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

from mjwrap.kernels.compilation.module_caches import kept

F = TypeVar("F", bound=Callable[..., Any])
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}, "cache": True}


def jit(function: F) -> F:
    """Compile a function that callbacks call."""
    with kept(function):
        compiled: Any = numba.njit(function, nogil=True, **_OPTIONS)
        return compiled


def callback(signature: Any, function: Callable[..., Any]) -> Any:
    """Compile a function with a C signature now; MuJoCo calls it by its `address`."""
    with kept(function):
        return numba.cfunc(signature, **_OPTIONS)(function)
