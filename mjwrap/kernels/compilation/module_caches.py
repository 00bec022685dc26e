"""The folder in which the machine code of each module is kept, named such that outdated code is never found.

numba checks only whether the file of a function has changed, not the files of the functions that it calls. Here the
name of a module's folder contains a hash over all sources that count for the module (`import_closure.py`). The place of
the package does not count: copies of it share machine code.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import os
import sys
import uuid
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numba

from mjwrap.kernels.compilation import cache_folders, import_closure, self_test
from mjwrap.kernels.compilation.cache_folders import config


class Place(NamedTuple):
    """The folder of a module's machine code, and the stamp that its index files carry if they are up to date."""

    folder: Path
    stamp: str


# The place of each module, with the `__spec__` that the module had: it is another one after a reload.
_places: dict[str, tuple[object, Place]] = {}


def circumstances() -> tuple[object, ...]:
    """Return what machine code depends on besides the sources."""
    bounds = os.environ.get("NUMBA_BOUNDSCHECK", "0")
    return numba.__version__, tuple(sys.version_info[:2]), bounds, self_test.is_plain()


def keep(module: str, file: Path) -> None:
    """Keep the machine code of a module of another package beside its file, valid while the file is unchanged."""
    _places[module] = None, Place(file.parent, hashlib.sha256(file.read_bytes()).hexdigest()[:16])


def place(function: Callable[..., Any]) -> Place | None:
    """Return where the machine code of a function is kept; None for a function of another package."""
    module, spec = function.__module__ or "", function.__globals__.get("__spec__")
    before, known = _places.get(module, (None, None))
    if module.startswith(f"{import_closure.PACKAGE}.") and (known is None or before is not spec):
        if known is not None:
            import_closure.forget()
        known = new_place(module)
        _places[module] = spec, known
    return known


def new_place(module: str, name: str = "") -> Place:
    """Return where the machine code of a module that was just loaded is kept, and note that the folder is in use.

    name: begins the folder's name, where that is not the module's.
    """
    name = name or module
    version = import_closure.key(module, *circumstances())
    if version is None:  # edited since this process began: its machine code is for this process alone
        stamp = uuid.uuid4().hex[:16]
        return Place(cache_folders.private() / f"{name}-{stamp}", stamp)
    folder = cache_folders.base() / f"{name}-{version}"
    cache_folders.use(folder)
    return Place(folder, version)


def is_anything_kept() -> bool:
    """Return whether there is machine code of any module loaded so far."""
    return any(place.folder.is_dir() for _, place in _places.values())


@cache
def _is_located() -> bool:
    """Return whether numba uses `cache_locator.py`; a future version may lack the base class that it needs."""
    try:
        importlib.import_module("mjwrap.kernels.compilation.cache_locator")
    except (ImportError, AttributeError):
        return False
    return True


@contextlib.contextmanager
def kept(function: Callable[..., Any]) -> Iterator[None]:
    """Keep the machine code of a function that is decorated inside the block in the folder of its module."""
    found = place(function)
    if found is None:
        yield
    else:
        with kept_in(found.folder):
            yield


@contextlib.contextmanager
def kept_in(folder: Path) -> Iterator[None]:
    """Keep machine code in a folder by numba's own setting, where numba does not use the locator."""
    if _is_located():
        yield
        return
    before = config.CACHE_DIR
    config.CACHE_DIR = str(folder)  # numba reads it when the function is decorated
    try:
        yield
    finally:
        config.CACHE_DIR = before
