"""The file that a recording becomes: written under a temporary name, given its own once it is complete."""

import contextlib
import os
import selectors
import stat
import threading
import uuid
from collections.abc import Callable
from pathlib import Path

from mjwrap.errors import RecordingError

SUFFIX = ".rrd"


class PartFile:
    """A temporary file beside `path`, created empty at once, so that an unwritable place shows before a run.

    `publish` gives it the name `path` in one step, which replaces an older recording of that name;
    `discard` removes it. Until then an existing `path` stays as it is.

    Raises RecordingError where `path` does not end in .rrd, names something other than a regular file, may
    not be overwritten, or lies in a folder that is missing or cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        if self.path.suffix != SUFFIX:
            example = self.path.with_suffix(SUFFIX) if self.path.name else self.path / f"run{SUFFIX}"
            raise RecordingError(
                f"cannot record to '{self.path}': the name must end in {SUFFIX}, which is how the viewer knows a "
                f"recording; for example '{example}'"
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


class FilePipe:
    """A pipe that rerun writes into, and a thread that carries what arrives there into a file.

    rerun's own file writer says only in its log that the disk is full, and can then wait for itself for ever. Here
    it never meets a full disk: after an error the thread goes on emptying the pipe, and `error` tells.
    """

    AVAILABLE = Path("/dev/fd").is_dir()

    def __init__(self, path: Path) -> None:
        self.error: OSError | None = None
        self._finished = False
        self._file = path.open("wb")
        self._exit, self._entrance = os.pipe()
        self._stop_seen, self._stop = os.pipe()
        self.address = f"/dev/fd/{self._entrance}"
        self._carrier = threading.Thread(target=self._carry, name="recording", daemon=True)
        self._carrier.start()

    def connected(self) -> None:
        """Leave the entrance to the writer that has opened `address`."""
        os.close(self._entrance)

    def finish(self) -> None:
        """Return once all that a writer, now closed, has written is on the disk, or `error` says why not.

        A process forked meanwhile may hold the entrance open for ever, so its closing is not waited for.
        """
        if not self._finished:
            self._finished = True
            os.write(self._stop, b".")
            self._carrier.join()
            for end in (self._exit, self._stop_seen, self._stop):
                os.close(end)

    def _carry(self) -> None:
        with selectors.DefaultSelector() as either:
            for end in (self._exit, self._stop_seen):
                either.register(end, selectors.EVENT_READ)
            # the stop counts only where nothing is left in the pipe
            while self._exit in (key.fd for key, _ in either.select()):
                if not (data := os.read(self._exit, 1 << 20)):
                    break
                if self.error is None:
                    self._attempt(lambda data=data: self._file.write(data))
        self._attempt(self._file.flush)
        self._attempt(lambda: os.fsync(self._file.fileno()))
        self._attempt(self._file.close)

    def _attempt(self, action: Callable[[], object]) -> None:
        try:
            action()
        except OSError as error:
            self.error = self.error or error


def _reason(error: OSError, path: Path) -> str:
    """Name the cause of an OSError, and the folder that exists where one is missing."""
    folder = path.absolute().parent
    if isinstance(error, FileNotFoundError):
        existing = next(parent for parent in folder.parents if parent.exists())
        return f"there is no folder '{folder}' (the path exists as far as '{existing}')"
    if isinstance(error, NotADirectoryError):
        return f"'{folder}' is not a folder"
    return (error.strerror or str(error)).lower()
