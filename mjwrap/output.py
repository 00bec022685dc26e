"""Files that appear whole under their name or not at all, and what else those who write them share."""

import contextlib
import os
import signal
import stat
import threading
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from mjwrap.errors import RecordingError


class PartFile:
    """A temporary file beside `path`, created empty at once, so that an unwritable place shows before a run.

    `publish` gives it the name `path` in one step, which replaces an older recording of that name;
    `discard` removes it. Until then an existing `path` stays as it is.

    Raises RecordingError where `path` ends in none of the suffixes, names something other than a regular file, may
    not be overwritten, or lies in a folder that is missing or cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str], *suffixes: str) -> None:
        self.path = Path(path)
        if self.path.suffix not in suffixes:
            first = suffixes[0]
            example = self.path.with_suffix(first) if self.path.name else self.path / f"run{first}"
            raise RecordingError(
                f"cannot record to '{self.path}': the name must end in {' or '.join(suffixes)}, by which viewers "
                f"know what it is; for example '{example}'"
            )
        self.part = self.path.with_name(f".{self.path.name}.{os.getpid()}-{uuid.uuid4().hex[:8]}.part")
        try:
            fault = self._overwrite_fault()
            if not fault:
                self.part.open("xb").close()
        except OSError as error:
            fault = _reason(error, self.path)
        if fault:
            raise RecordingError(f"cannot record to '{self.path}': {fault}")

    def _overwrite_fault(self) -> str:
        """Say why `path`, where it exists, may not be replaced."""
        try:
            mode = self.path.stat().st_mode
        except FileNotFoundError:
            return ""
        if stat.S_ISDIR(mode):
            return "it is a folder; name a file in it"
        if not stat.S_ISREG(mode):
            return "it is a device or a pipe, not a file"
        return "" if os.access(self.path, os.W_OK) else "it exists and is write-protected"

    def publish(self) -> None:
        """Give the finished file its name."""
        try:
            os.replace(self.part, self.path)
        except OSError as error:
            raise self.failure(error) from error

    def discard(self) -> None:
        """Remove the temporary file, if it is still there."""
        with contextlib.suppress(OSError):
            self.part.unlink(missing_ok=True)

    def failure(self, error: Exception) -> RecordingError:
        """The error to raise where `error` ended the recording."""
        reason = _reason(error, self.path) if isinstance(error, OSError) else str(error)
        return RecordingError(f"recording to '{self.path}' failed: {reason}; nothing was kept")


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold Ctrl-C back until the block is done."""
    previous = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(previous):
        yield
        return
    held: list[Any] = []
    signal.signal(signal.SIGINT, lambda *received: held.append(received))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)
    if held:
        previous(*held[-1])


def require(name: str, value: object, holds: bool | np.bool_, wanted: str) -> None:
    """Raise RecordingError unless an argument holds."""
    if not holds:
        raise RecordingError(f"{name} must be {wanted}, not {value!r}")


def _reason(error: OSError, path: Path) -> str:
    """Name the cause of an OSError, and the folder that exists where one is missing."""
    folder = path.absolute().parent
    if isinstance(error, FileNotFoundError):
        existing = next(parent for parent in folder.parents if parent.exists())
        return f"there is no folder '{folder}' (the path exists as far as '{existing}')"
    if isinstance(error, NotADirectoryError):
        return f"'{folder}' is not a folder"
    return (error.strerror or str(error)).lower()
