"""The decorators of kernels, which decide how each is compiled; `module_caches.py` says where machine code is kept."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

import numba
from numba.core import types

from mjwrap.kernels.compilation import module_caches, progress, self_test
from mjwrap.kernels.compilation.cache_folders import config

F = TypeVar("F", bound=Callable[..., Any])
# The options of `linking.py` that numba.njit has too, for a numba with which `linking.py` does not work.
_PLAIN: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}, "cache": True}


progress.register()


def jit(function: F, kind: str = "Kernel", *further: Any, **options: bool) -> F:
    """Compile a kernel: without the GIL, IEEE arithmetic with fused multiply-adds, machine code kept on disk.

    kind: the class in `linking.py`. Only `from_python` makes what Python calls quickly and without further compilation.
    """
    if config.DISABLE_JIT:
        return function
    if self_test.is_plain():
        with module_caches.kept(function):
            plain: Any = numba.njit(**_PLAIN)(function)
        return plain
    from mjwrap.kernels.compilation import linking  # uses inner parts of numba that another version may lack

    kernel: Any = getattr(linking, kind)(function, linking.OPTIONS | options, *further)
    kernel.kept = partial(module_caches.kept, function)
    with kernel.kept():
        kernel.enable_caching()
    return kernel


def from_python(function: F) -> F:
    """Compile a kernel that the package calls from Python."""
    return jit(function, "FromPython")


def no_inline(function: F) -> F:
    """Compile a kernel whose code is not copied into its callers: for large kernels, where a call costs little."""
    return jit(function, "NotInlined")


def deferred(*returns: Any) -> Callable[[F], F]:
    """Compile a kernel only when it is first called: for large kernels that many scenes never call.

    returns: the numba types of its results.
    """
    kind = returns[0] if len(returns) == 1 else types.Tuple(returns)
    return lambda function: jit(function, "Deferred", kind)


def allocating(function: F) -> F:
    """Compile a kernel that allocates arrays, which the package calls from Python."""
    return jit(function, "FromPython", _nrt=True)


def inlined(function: F) -> F:
    """Compile a kernel whose code is copied into every caller: for small kernels, called with constants."""
    return jit(function, forceinline=True)
