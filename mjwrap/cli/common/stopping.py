"""Stop a command by Ctrl-C, kill or a closed terminal, with the exit codes of these."""

from __future__ import annotations

import contextlib
import os
import signal
import stat
import sys
from collections.abc import Iterator
from typing import Any, NoReturn

from mjwrap.files.atomic import STOPPING


class Stopped(KeyboardInterrupt):
    """A command was asked to end by a signal; name: "Ctrl-C", or the signal's name; code: the exit code."""

    def __init__(self, number: int = signal.SIGINT) -> None:
        super().__init__()
        self.name = "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name
        self.code = 128 + number  # the exit code that shells use


@contextlib.contextmanager
def stoppable() -> Iterator[None]:
    """Raise `Stopped` if a signal arrives inside a with block; ignored signals stay ignored (nohup)."""
    with _handled(_stop):
        yield


class Interrupt:
    """Let a loop end after a signal: the loop tests `asked`, a `Stopped` or None. A second signal stops at once."""

    def __init__(self) -> None:
        self.asked: Stopped | None = None
        self._held = contextlib.ExitStack()

    def __enter__(self) -> Interrupt:
        self._held.enter_context(_handled(self._handle))
        return self

    def __exit__(self, *_: object) -> None:
        self._held.close()

    def _handle(self, number: int, frame: object) -> None:
        if self.asked:
            _stop(number, frame)
        _terminal_is_gone(number)
        self.asked = Stopped(number)


@contextlib.contextmanager
def _handled(handler: Any) -> Iterator[None]:
    before = {number: signal.getsignal(number) for number in STOPPING}
    taken = [number for number, was in before.items() if was is not signal.SIG_IGN]
    try:
        for number in taken:
            signal.signal(number, handler)
        yield
    finally:
        for number in taken:
            signal.signal(number, before[number])


def _stop(number: int, _: object) -> NoReturn:
    _terminal_is_gone(number)
    raise Stopped(number)


def _terminal_is_gone(number: int) -> None:
    """If the signal is SIGHUP, discard further output: writing to a closed terminal is an error."""
    if signal.Signals(number).name != "SIGHUP":
        return
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):  # not a file, or closed
            if stat.S_ISCHR(os.fstat(stream.fileno()).st_mode):
                silence(stream.fileno())


def silence(number: int) -> None:
    """Discard everything that is written to a file descriptor."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, number)
    os.close(nowhere)
