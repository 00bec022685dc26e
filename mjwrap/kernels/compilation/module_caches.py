"""Where the machine code of each module is kept, and when it is out of date.

numba asks whether the file of a function has changed, which tells nothing of those that it calls. The folder of a
module is named by all sources that count for it instead. Where the package lies does not count: copies share machine
code.
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
    """Where the machine code of a module is kept, and what its index files have to carry to be up to date."""

    folder: Path
    stamp: str


# Of modules, with the `__spec__` that each had: a new one when it is loaded again.
_places: dict[str, tuple[object, Place]] = {}


def circumstances() -> tuple[object, ...]:
    """Return what machine code depends on, but for sources."""
    bounds = os.environ.get("NUMBA_BOUNDSCHECK", "0")
    return numba.__version__, tuple(sys.version_info[:2]), bounds, self_test.is_plain()


def keep(module: str, file: Path) -> None:
    """Have the machine code of a module outside this package kept beside its file, for as long as that is the same."""
    _places[module] = None, Place(file.parent, hashlib.sha256(file.read_bytes()).hexdigest()[:16])


def place(function: Callable[..., Any]) -> Place | None:
    """Return where the machine code of a function is kept, None where it is not this package's."""
    module, spec = function.__module__ or "", function.__globals__.get("__spec__")
    before, known = _places.get(module, (None, None))
    if module.startswith(f"{import_closure.PACKAGE}.") and (known is None or before is not spec):
        if known is not None:
            import_closure.forget()
        known = new_place(module)
        _places[module] = spec, known
    return known


def new_place(module: str, name: str = "") -> Place:
    """Return where the machine code of a module is kept that has just been loaded, and note that this is in use.

    name: of what is kept there, where that is not the module itself.
    """
    name = name or module
    version = import_closure.key(module, *circumstances())
    if version is None:  # edited since this process began: its code is for this process alone
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
    """Return whether numba asks `cache_locator.py`, whose base class a version to come may lack."""
    try:
        importlib.import_module("mjwrap.kernels.compilation.cache_locator")
    except (ImportError, AttributeError):
        return False
    return True


@contextlib.contextmanager
def kept(function: Callable[..., Any]) -> Iterator[None]:
    """Have the machine code of a function, decorated inside the block, kept in its place."""
    found = place(function)
    if found is None:
        yield
    else:
        with kept_in(found.folder):
            yield


@contextlib.contextmanager
def kept_in(folder: Path) -> Iterator[None]:
    """Have machine code kept in a folder by numba's own setting, where it cannot be told by a locator."""
    if _is_located():
        yield
        return
    before = config.CACHE_DIR
    config.CACHE_DIR = str(folder)  # read when the function is decorated
    try:
        yield
    finally:
        config.CACHE_DIR = before
