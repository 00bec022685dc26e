"""Progress bars."""

from __future__ import annotations

import contextlib
import sys
from typing import Any


def progress_bar(total: float, unit: str, label: str) -> Any:
    """Return a bar with `update(n)` and `close()`; it appears after two seconds, only on a terminal."""
    if sys.stderr.isatty():
        with contextlib.suppress(ImportError):
            from tqdm import tqdm

            form = "{desc}: {percentage:3.0f}%|{bar}| {n:.4g}/{total:.4g} {unit} [{elapsed}<{remaining}]"
            return tqdm(total=total, unit=unit, desc=label, delay=2.0, leave=False, bar_format=form)
    return _NoBar()


class Stages:
    """A bar for work in named parts: called before each part with (name, number of parts done, number of parts)."""

    def __init__(self, unit: str, label: str) -> None:
        self._unit, self._label = unit, label
        self._bar: Any = None

    def __call__(self, name: str, done: int, count: int) -> None:
        if self._bar is None:
            self._bar = progress_bar(count, self._unit, self._label)
        self._bar.set_description_str(name, refresh=False)
        self._bar.update(int(done > 0))

    def close(self) -> None:
        """Remove the bar."""
        if self._bar is not None:
            self._bar.close()


class _NoBar:
    def update(self, n: float) -> None:
        """Do nothing."""

    def set_description_str(self, text: str, refresh: bool = True) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""
