"""The one place that decides how kernels are compiled; `_places.py` says where the machine code is kept."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, TypeVar

import numba
from numba.core import event, types

from mjwrap.kernels import _check, _places
from mjwrap.kernels._folders import config

_OURS = "mjwrap.kernels."
F = TypeVar("F", bound=Callable[..., Any])
_NOTICE = "mjwrap: compiling its kernels, once for this machine and version ({}) ..."
_FIRST, _FURTHER = (
    "about half a minute",
    "those that nothing has asked for so far; mjwrap warmup compiles all at once",
)
# What numba.njit has, too. Where `_kernel.py` does not fit numba, that is all there is.
_PLAIN: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}, "cache": True}


class _Announcer(event.Listener):
    """Tells the user, once a process, that kernels are being compiled rather than loaded."""

    def __init__(self) -> None:
        self.silent = False

    def on_start(self, event: Any) -> None:
        dispatcher = event.data.get("dispatcher") if event.data else None
        function = getattr(dispatcher, "py_func", None)
        if not self.silent and (getattr(function, "__module__", None) or "").startswith(_OURS):
            self.silent = True
            how = _FURTHER if _places.is_anything_kept() else _FIRST
            print(_NOTICE.format(how), file=sys.stderr, flush=True)

    def on_end(self, event: Any) -> None:
        pass


event.register("numba:compile", _Announcer())


def jit(function: F, kind: str = "Kernel", *further: Any, **options: bool) -> F:
    """Compile a kernel: no GIL, IEEE semantics but for fused multiply-adds, machine code kept on disk.

    One whose name begins with an underscore cannot be called from Python, which makes it cheaper to compile.
    """
    if config.DISABLE_JIT:
        return function
    if _check.is_plain():
        with _places.kept(function):
            plain: Any = numba.njit(**_PLAIN)(function)
        return plain
    from mjwrap.kernels import _kernel  # of parts that another numba may lack

    if function.__name__.startswith("_"):
        kind, options = "Hidden", options | {"no_cpython_wrapper": True}
    kernel: Any = getattr(_kernel, kind)(function, _kernel.OPTIONS | options, *further)
    with _places.kept(function):
        kernel.enable_caching()
    return kernel


def apart(function: F) -> F:
    """Compile a kernel whose code callers do not take over: a large one, to which a call is nothing."""
    return jit(function, "Apart")


def deferred(*returns: Any) -> Callable[[F], F]:
    """Compile a kernel at its first call: a large one, which many scenes never call.

    returns: numba's types of what it returns.
    """
    kind = returns[0] if len(returns) == 1 else types.Tuple(returns)
    return lambda function: jit(function, "Deferred", kind)


def allocating(function: F) -> F:
    """Compile a kernel that makes arrays of its own."""
    return jit(function, _nrt=True)


def inlined(function: F) -> F:
    """Compile a kernel that every caller takes over: a small one, called with constants."""
    return jit(function, forceinline=True)
