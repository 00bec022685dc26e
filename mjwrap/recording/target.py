"""Writing a recording into its file, with errors when the disk is full."""

import os
import selectors
import threading
from collections.abc import Callable
from pathlib import Path


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
