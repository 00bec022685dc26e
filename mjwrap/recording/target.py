"""Write a recording to its file, with an error if the disk is full."""

import os
import selectors
import threading
from collections.abc import Callable
from pathlib import Path


class FilePipe:
    """A pipe into which rerun writes, and a thread that copies the data to a file.

    rerun's own file writer reports a full disk only in its log, and can then wait for ever. With the pipe it never
    meets a full disk: after an error, which is kept in `error`, the thread continues to empty the pipe.
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
        """Close this end of the pipe: the writer that has opened `address` has its own."""
        os.close(self._entrance)

    def finish(self) -> None:
        """Wait until all data of a writer that is now closed are on the disk, or `error` says why not.

        A process forked meanwhile may keep the pipe open for ever, so this does not wait for the end of the pipe.
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
            # stop only when the pipe is empty
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
