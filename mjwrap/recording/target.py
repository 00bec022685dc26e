"""The file that a recording becomes: written under a temporary name, given its own once it is complete."""

import contextlib
import os
import stat
import uuid
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
            raise RecordingError(
                f"cannot record to '{self.path}': the name must end in {SUFFIX}, which is how the viewer "
                f"knows a recording; for example '{self.path.with_suffix(SUFFIX) if self.path.name else 'run.rrd'}'"
            )
        try:
            self._check_overwritable()
            self.part = self.path.with_name(f".{self.path.name}.{os.getpid()}-{uuid.uuid4().hex[:8]}.part")
            self.part.open("xb").close()
        except OSError as error:
            if isinstance(error, RecordingError):
                raise
            raise RecordingError(f"cannot record to '{self.path}': {_reason(error, self.path)}") from error

    def _check_overwritable(self) -> None:
        try:
            mode = self.path.stat().st_mode
        except FileNotFoundError:
            return
        if stat.S_ISDIR(mode):
            raise RecordingError(f"cannot record to '{self.path}': it is a folder; name a file in it")
        if not stat.S_ISREG(mode):
            raise RecordingError(f"cannot record to '{self.path}': it is a device or a pipe, not a file")
        if not os.access(self.path, os.W_OK):
            raise RecordingError(f"cannot record to '{self.path}': it exists and is write-protected")

    def publish(self) -> None:
        """Put the finished file on the disk and give it its name; OSError where the disk refuses."""
        with self.part.open("rb+") as file:
            os.fsync(file.fileno())
        os.replace(self.part, self.path)

    def discard(self) -> None:
        """Remove the temporary file, if it is still there."""
        with contextlib.suppress(OSError):
            self.part.unlink(missing_ok=True)

    def write_fault(self) -> str:
        """Say why a write to the temporary file failed, by trying another one."""
        try:
            with self.part.open("ab") as file:
                file.write(bytes(1 << 16))
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            return _reason(error, self.path)
        return "the write failed, though there is room again now"


def _reason(error: OSError, path: Path) -> str:
    """Name the cause of an OSError, and the folder that exists where one is missing."""
    reason = (error.strerror or str(error)).lower()
    folder = path.absolute().parent
    if isinstance(error, FileNotFoundError):
        existing = next(parent for parent in folder.parents if parent.exists())
        return f"there is no folder '{folder}' (the path exists as far as '{existing}')"
    if isinstance(error, NotADirectoryError):
        return f"'{folder}' is not a folder"
    return reason
