"""Tells the user that kernels are being compiled rather than loaded, and how many so far."""

from __future__ import annotations

import sys
import time
from typing import Any

from numba.core import event

from mjwrap.kernels.compilation import module_caches

_OURS = ("mjwrap.kernels.", "mjwrap.plugin.")
_FIRST = "mjwrap: compiling its kernels, which are kept for later runs ..."
_FURTHER = (
    "mjwrap: compiling its kernels that were not used before ('mjwrap warmup' compiles all in advance) ..."
)
_SO_FAR = "mjwrap: kernels compiled so far: {}, in {:.0f} s"
_OFTEN, _SELDOM = 0.25, 15.0  # [s] between two counts on a terminal, and in a file or notebook
_CLEARED = "\r\x1b[K"  # the line that the cursor is in


class Progress(event.Listener):
    """Prints a line at the first compilation of a process; then counts, in one line that changes on a terminal."""

    def __init__(self) -> None:
        self.depth, self.count, self.seconds = 0, 0, 0.0
        self._began, self._shown, self._told = 0.0, 0.0, False

    def on_start(self, event: Any) -> None:
        """Note that a compilation begins, perhaps inside that of its caller."""
        if not _is_ours(event):
            return
        if self.depth == 0:
            self._began = time.perf_counter()
            if not self._told:
                self._told, self._shown = True, self._began
                print(_FURTHER if module_caches.is_anything_kept() else _FIRST, file=sys.stderr, flush=True)
        self.depth += 1

    def on_end(self, event: Any) -> None:
        """Count a compilation."""
        if not _is_ours(event) or self.depth == 0:
            return
        self.depth -= 1
        self.count += 1
        self._show(time.perf_counter())

    def _show(self, now: float) -> None:
        """Print the count if the last one is old; on a terminal, remove it when the outermost compilation ends."""
        stream, running = sys.stderr, now - self._began
        terminal = stream is not None and stream.isatty()
        if self.depth == 0:
            self.seconds += running
            running = 0.0
        if stream is not None and now - self._shown >= (_OFTEN if terminal else _SELDOM) and self.depth > 0:
            text = _SO_FAR.format(self.count, self.seconds + running)
            print(
                f"{_CLEARED}{text}" if terminal else text,
                end="" if terminal else "\n",
                file=stream,
                flush=True,
            )
            self._shown = now
        elif terminal and self.depth == 0 and stream is not None:
            print(_CLEARED, end="", file=stream, flush=True)


def _is_ours(event: Any) -> bool:
    """Return whether a function of this package is compiled."""
    dispatcher = event.data.get("dispatcher") if event.data else None
    function = getattr(dispatcher, "py_func", None)
    return (getattr(function, "__module__", None) or "").startswith(_OURS)


def register() -> None:
    """Watch every compilation of this process."""
    event.register("numba:compile", Progress())
