"""Files that are either complete under their name or absent, and the base class of their writers."""

import contextlib
import os
import signal
import stat
import threading
import warnings
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import IO, TYPE_CHECKING, Any, Self

from mjwrap.errors import MjwrapError, RecordingError
from mjwrap.files.leftovers import part_name, remove_leftovers

if TYPE_CHECKING:
    import numpy as np

# signals that ask a process to end: Ctrl-C, kill, and a closed terminal (not on Windows)
STOPPING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))

_new_folders: set[Path] = set()  # made for files that are not complete yet


class PartFile:
    """A temporary file beside `path`, created at once, so that a place that cannot be written is noticed before a run.

    `part` is the file to write; `publish` gives it the name `path` in one step, replacing an older file of that name;
    `discard` removes it. Until then an existing `path` is unchanged. Parts that killed processes have left in the
    folder are removed first. A missing folder is made, and removed again by `discard`. option: the name of the option
    that gave the path, for messages.

    Raises RecordingError if `path` is not the name of a file, has none of the suffixes, is not a regular file, may not
    be overwritten, or lies in a folder that cannot be made or written.
    """

    def __init__(self, path: str | os.PathLike[str], *suffixes: str, option: str = "") -> None:
        self.path = Path(as_path(path))
        self._named = f"{option} '{self.path}'".lstrip()
        self._text: IO[str] | None = None
        if self.path.suffix.lower() not in suffixes:
            first = suffixes[0]
            example = self.path.with_suffix(first) if self.path.name else self.path / f"run{first}"
            raise RecordingError(
                f"cannot write {self._named}: the name must end in {' or '.join(suffixes)}, which tells programs "
                f"its format; for example '{example}'"
            )
        remove_leftovers(self.path.parent)
        self.part = self.path.with_name(part_name(self.path))
        try:
            fault = self._overwrite_fault()
            if not fault:
                _make_folder(self.path.parent)
                self.part.open("xb").close()
        except OSError as error:
            fault = _reason(error, self.path)
            _remove_empty(self.path)
        if fault:
            raise RecordingError(f"cannot write {self._named}: {fault}")

    def _overwrite_fault(self) -> str:
        """Return why an existing `path` may not be replaced, or an empty string."""
        try:
            mode = self.path.stat().st_mode
        except FileNotFoundError:
            return ""
        if stat.S_ISDIR(mode):
            return "it is a folder; name a file in it"
        if not stat.S_ISREG(mode):
            return "it is a device or a pipe, not a file"
        return "" if os.access(self.path, os.W_OK) else "it exists and is write-protected"

    def open_text(self) -> IO[str]:
        """Return the temporary file, open for text; `publish` and `discard` close it."""
        self._text = self.part.open("w", encoding="utf-8", newline="")
        return self._text

    def write_text(self, text: str) -> None:
        """Write the whole file and give it its name."""
        with self.writing():
            self.part.write_text(text, encoding="utf-8")
        self.publish()

    @contextlib.contextmanager
    def writing(self) -> Iterator[None]:
        """Convert an OSError inside a with block to a RecordingError."""
        try:
            yield
        except RecordingError:
            raise
        except OSError as error:
            raise self.failure(error) from error

    def publish(self) -> None:
        """Write the finished file to the disk and give it its name."""
        with self.writing():
            if self._text is not None:
                self._text.close()
            with self.part.open("rb+") as file:
                os.fsync(file.fileno())
            os.replace(self.part, self.path)
        _new_folders.difference_update(self.path.absolute().parents)

    def discard(self) -> None:
        """Remove the temporary file, if it is still there."""
        with contextlib.suppress(OSError):
            if self._text is not None:
                self._text.close()
        with contextlib.suppress(OSError):
            self.part.unlink(missing_ok=True)
        _remove_empty(self.path)

    def failure(self, error: Exception) -> RecordingError:
        """Return the error to raise if `error` ended the writing."""
        reason = _reason(error, self.path) if isinstance(error, OSError) else str(error)
        return RecordingError(f"writing {self._named} failed: {reason}; the incomplete file was removed")


class RunLog:
    """A log of a run: its file is complete once it is closed, and removed if the run ends with an error.

    A subclass calls `_begin` at the end of its `__init__`, writes to the file only inside `_guarded`, and completes it
    in `_finish`. `_ended` is the reason why nothing more can be logged.
    """

    _ended = ""
    _place: str
    _target: PartFile | None

    def _begin(self, place: str, target: PartFile | None, release: Callable[[], object]) -> None:
        """Begin the log; release: a function, without a reference to the log, that frees its resources."""
        self._place, self._target, self._release = place, target, release
        self._finalizer = weakref.finalize(self, _forgotten, type(self).__name__, place, target, release)

    @property
    def _empty(self) -> bool:
        """Whether nothing was logged."""
        raise NotImplementedError

    def _finish(self) -> None:
        """Complete the file and give it its name."""
        raise NotImplementedError

    def close(self) -> None:
        """Write the rest, check that the file is complete, and give it its name; a second call does nothing.

        Raises RecordingError, and leaves no file, if the disk is full.
        """
        if not self._ended:
            self._guarded(self._publish)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None and issubclass(kind, Exception):
            self._discard("the run ended with an error, so no file was written")
        elif kind is not None and self._empty:
            self._discard("the run was stopped before anything was logged")
        else:
            self.close()  # after KeyboardInterrupt and SystemExit, too, the log so far is kept

    def _publish(self) -> None:
        self._finish()
        if self._target:
            self._target.publish()
        self._ended = "it is closed"
        self._finalizer.detach()

    def _guarded(self, action: Callable[[], None]) -> None:
        """Run an action without interruption by Ctrl-C; an error removes the file."""
        with uninterrupted():
            try:
                with self._target.writing() if self._target else contextlib.nullcontext():
                    action()
            except BaseException as error:
                self._discard(f"it failed before ({error})")
                raise

    def _discard(self, why: str) -> None:
        if not self._ended:
            self._ended = why
            self._finalizer.detach()
            _let_go(self._target, self._release)


def _let_go(target: PartFile | None, release: Callable[[], object]) -> None:
    with contextlib.suppress(Exception):  # the file is removed, so further errors do not matter
        release()
    if target:
        target.discard()


def _forgotten(kind: str, place: str, target: PartFile | None, release: Callable[[], object]) -> None:
    _let_go(target, release)
    warnings.warn(
        f"the {kind} of '{place}' was never closed, so no file was written; use it in a with statement",
        RuntimeWarning,
        stacklevel=2,
    )


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Delay Ctrl-C, and other signals with a handler in Python, until the end of the block."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handlers = {number: signal.getsignal(number) for number in STOPPING}
    previous = {number: handler for number, handler in handlers.items() if callable(handler)}
    held: list[Any] = []
    for number in previous:
        signal.signal(number, lambda *received: held.append(received))
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
    for received in held:
        previous[received[0]](*received)


def as_path(path: object, error: type[MjwrapError] = RecordingError) -> str:
    """Return the name of a file as text; `error` if it is neither text nor a path."""
    text = os.fspath(path) if isinstance(path, str | os.PathLike) else None
    if not isinstance(text, str):
        raise error(f"path must be the name of a file, as str or Path, not {path!r}")
    return text


def _make_folder(folder: Path) -> None:
    """Make a folder and those above it that are missing, and remember them until a file in them is complete."""
    folder = folder.absolute()
    for each in reversed([each for each in (folder, *folder.parents) if not each.exists()]):
        with contextlib.suppress(FileExistsError):  # made by another process at this moment
            each.mkdir()
            _new_folders.add(each)


def _remove_empty(path: Path) -> None:
    """Remove the folders that were made for a file and others that never came, where nothing is in them."""
    for folder in path.absolute().parents:
        if folder in _new_folders:
            with contextlib.suppress(OSError):
                folder.rmdir()
                _new_folders.discard(folder)


def require(name: str, value: object, holds: "bool | np.bool_", wanted: str) -> None:
    """Raise RecordingError unless an argument is valid."""
    if not holds:
        raise RecordingError(f"{name} must be {wanted}, not {value!r}")


def _reason(error: OSError, path: Path) -> str:
    """Return the cause of an OSError as text; if a folder is missing, that it could not be made."""
    folder = path.absolute().parent
    reason = (error.strerror or str(error)).lower()
    existing = next(parent for parent in (folder, *folder.parents) if parent.exists())
    if not existing.is_dir():
        return f"'{existing}' is not a folder"
    if existing != folder:
        return f"there is no folder '{folder}', and in '{existing}' none can be made: {reason}"
    return reason
