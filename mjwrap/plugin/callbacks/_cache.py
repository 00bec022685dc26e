"""Compile the callbacks; their machine code is cached like that of the kernels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

from mjwrap.kernels.compilation import jit as kernels
from mjwrap.kernels.compilation import self_test
from mjwrap.kernels.compilation.module_caches import kept

F = TypeVar("F", bound=Callable[..., Any])
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}, "cache": True}


def jit(function: F) -> F:
    """Compile a function that callbacks call."""
    return kernels.jit(function, _nrt=True)  # it may return an array made from an address


def callback(signature: Any, function: Callable[..., Any]) -> Any:
    """Compile a function with a C signature now; MuJoCo calls it by its `address`."""
    options = dict(_OPTIONS)
    if not self_test.is_plain():
        from mjwrap.kernels.compilation.pipeline import KernelCompiler

        options["pipeline_class"] = KernelCompiler
    with kept(function):
        return numba.cfunc(signature, **options)(function)
