"""Tells numba where the machine code of this package is kept; importing this module registers it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.core import caching

from mjwrap.kernels.compilation import cache_folders, module_caches
from mjwrap.kernels.compilation.cache_folders import config


class Locator(caching._CacheLocator):
    """Finds the folder of functions of this package; leaves all others to numba."""

    def __init__(self, function: Callable[..., Any], file: str, where: module_caches.Place) -> None:
        self._py_file, self._lineno = file, function.__code__.co_firstlineno  # numba reads them too
        self._place = where

    def get_cache_path(self) -> str:
        """Return the folder."""
        return str(self._place.folder)

    def ensure_cache_path(self) -> None:
        """Make the folder; called only before something is written to it."""
        cache_folders.make_version(self._place.folder)

    def get_source_stamp(self) -> str:
        """Return the stamp that an index file carries if it is up to date."""
        return self._place.stamp

    def get_disambiguator(self) -> str:
        """Return a text that distinguishes functions of the same name."""
        return str(self._lineno)

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> Locator | None:
        """Return the locator of a function; None for a function of another package."""
        where = module_caches.place(py_func)
        return None if where is None else cls(py_func, py_file, where)


def _register() -> None:
    """Register the locator as the first that numba asks."""
    caching.CacheImpl._locator_classes.insert(0, Locator)
    if getattr(config, "CACHE_LOCATOR_CLASSES", ""):  # NUMBA_CACHE_LOCATOR_CLASSES: only those are asked
        config.CACHE_LOCATOR_CLASSES = f"{__name__}.Locator,{config.CACHE_LOCATOR_CLASSES}"


_register()
