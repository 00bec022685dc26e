"""Store and load generated modules: each is written and compiled once, and found again by its content.

A module's name is a hash of everything from which it is made, and its folder is named by the sources that it imports.
So no module can be outdated. Files are written in one step; processes that write the same file write the same text.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import os
import re
import sys
import tempfile
import threading
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from numba.core import event
from numba.core.errors import NumbaError

from mjwrap.errors import GeometryError
from mjwrap.kernels.compilation import cache_folders, module_caches

PREFIX = "mjwrap_surface_"
_IMPORTED = (
    "mjwrap.surfaces.codegen.lanes"  # every generated module imports it, and through it all else of mjwrap
)
_HERE = Path(__file__).parent
_NOTICE = "mjwrap: compiling the surface {}, once for this machine and version (some seconds) ..."
_LOCK = threading.RLock()


@cache
def generator_hash() -> str:
    """Return a hash of the sources of this package, which generates the modules."""
    digest = hashlib.sha256()
    for file in sorted(_HERE.rglob("*.py")):
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def key_of(*parts: object) -> str:
    """Return 16 hexadecimal digits: a hash of everything from which a module is made."""
    return hashlib.sha256("\0".join([generator_hash(), *map(repr, parts)]).encode()).hexdigest()[:16]


def load(key: str, make: Callable[[], str], label: str) -> ModuleType:
    """Return the compiled module of a key, from this process, from disk, or from `make`; label: for messages."""
    name = PREFIX + key
    with _LOCK:
        if name in sys.modules:
            return sys.modules[name]
        path = folder() / f"{name}.py"
        if path.is_file():
            try:
                return _import(name, path, label)
            except GeometryError:
                raise
            except Exception:
                pass  # a damaged file: make the module again
        _write(path, make())
        return _import(name, path, label)


@cache
def folder() -> Path:
    """Return the folder of the modules that import these sources."""
    return module_caches.new_place(_IMPORTED, "mjwrap.surfaces").folder


def _write(path: Path, text: str) -> None:
    """Write a file in one step."""
    cache_folders.make_version(path.parent)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=path.stem, suffix=".tmp")
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(text)
    try:
        os.replace(name, path)
    except OSError:  # if files in use cannot be replaced, another process has just written the same file
        os.unlink(name)
        if not path.is_file():
            raise


def _import(name: str, path: Path, label: str) -> ModuleType:
    """Run a generated module, which compiles its functions or loads their machine code."""
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # never removed: rows of paths contain addresses of its machine code
    try:
        module_caches.keep(name, path)
        with (
            module_caches.kept_in(path.parent),
            event.install_listener("numba:compile", _Announcer(name, label)),
        ):
            spec.loader.exec_module(module)
            module.TEXT = path.read_text(encoding="utf-8")  # pyright: ignore[reportAttributeAccessIssue]
    except NumbaError as error:
        forget(name, path)
        lines = [line for line in re.sub(r"\x1b\[[0-9;]*m", "", str(error)).splitlines() if line.strip()]
        raise GeometryError(f"it cannot be compiled: {' '.join(lines[:3])}") from error
    except BaseException:
        forget(name, path)
        raise
    return module


def forget(name: str, path: Path) -> None:
    """Remove an unusable module from this process and from disk."""
    sys.modules.pop(name, None)
    with contextlib.suppress(OSError):
        path.unlink()


class _Announcer(event.Listener):
    """Tell the user that a surface is being compiled, not loaded."""

    def __init__(self, module: str, label: str) -> None:
        self.module, self.label, self.silent = module, label, False

    def on_start(self, event: Any) -> None:
        dispatcher = event.data.get("dispatcher") if event.data else None
        function = getattr(dispatcher, "py_func", None)
        if not self.silent and getattr(function, "__module__", None) == self.module:
            self.silent = True
            print(_NOTICE.format(self.label), file=sys.stderr, flush=True)

    def on_end(self, event: Any) -> None:
        pass
