"""Compiles the callbacks, and keeps their machine code beside that of the kernels.

The folder is named by a hash over the sources in this package and the marks that they read: numba does not notice an
edit in the file of a function or constant that a compiled function uses.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba

from mjwrap.kernels._jit import cache_dir, config
from mjwrap.mjcf import marks

F = TypeVar("F", bound=Callable[..., Any])
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}, "cache": True}


def _folder() -> str:
    digest = hashlib.sha256()
    for file in [*sorted(Path(__file__).parent.glob("*.py")), Path(marks.__file__)]:
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return str(cache_dir() / f"plugin-{digest.hexdigest()[:16]}")


_CACHE = _folder()


def _kept(decorate: Callable[[], Any]) -> Any:
    before = config.CACHE_DIR
    config.CACHE_DIR = _CACHE  # read by numba when a function is decorated
    try:
        return decorate()
    finally:
        config.CACHE_DIR = before


def jit(function: F) -> F:
    """Compile a function that callbacks call."""
    return _kept(lambda: numba.njit(function, nogil=True, **_OPTIONS))


def callback(signature: Any, function: Callable[..., Any]) -> Any:
    """Compile a function with a C signature now; its `address` is what MuJoCo calls."""
    return _kept(lambda: numba.cfunc(signature, **_OPTIONS)(function))
