"""Summarise a recording, and show it in the viewer."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from urllib.parse import quote

import numpy as np

from mjwrap.errors import RecordingError

if TYPE_CHECKING:
    from rerun.chunk import LazyStore, RrdReader, StoreEntry


_HERE = "127.0.0.1"
_PATIENCE = 60.0  # seconds within which a server must listen


@dataclass(frozen=True)
class Summary:
    """The contents of a recording; times in simulated seconds, nan if no state was logged."""

    path: Path
    model: str
    muscles: tuple[str, ...]
    entities: tuple[str, ...]
    states: int
    start: float
    end: float


def read_summary(path: str | os.PathLike[str]) -> Summary:
    """Read the contents of a recording.

    Raises RecordingError if the file does not exist, is incomplete or damaged, or was not written by `Recorder`.
    """
    path = Path(path)
    if not path.is_file():
        raise RecordingError(f"there is no recording '{path}'")
    if not os.access(path, os.R_OK):
        raise RecordingError(f"cannot read '{path}': permission denied")
    from rerun.chunk import RrdReader

    from mjwrap.recording.columns import TIMELINE
    from mjwrap.recording.scene import MEASURED, entity
    from mjwrap.recording.stream import APPLICATION

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # rerun warns of a missing footer, and store() raises for it
            reader = RrdReader(path)
            ours = [entry for entry in reader.recordings() if entry.application_id == APPLICATION]
            if not ours:
                raise RecordingError(f"'{path}' is a rerun file, but not a recording of {APPLICATION}")
            store = _indexed(reader, ours[0])
        # every chunk is decoded, so that any damage is found
        properties, times = {}, {}
        for chunk in store.stream():
            columns = chunk.to_record_batch()
            if chunk.entity_path == f"/__properties/{APPLICATION}":
                properties = columns.to_pydict()
            elif TIMELINE in chunk.timeline_names:
                times.setdefault(chunk.entity_path, []).append(
                    columns.column(TIMELINE).cast("int64").to_numpy()
                )
        entities = tuple(sorted(store.schema().entity_paths()))
    except (RuntimeError, ValueError) as error:
        raise RecordingError(f"'{path}' is not a complete recording: {error}") from error
    muscles = tuple(properties.get("muscles", [()])[0])
    every = times.get("/" + entity(MEASURED[0], muscles[0]), []) if muscles else []
    seconds = 1e-9 * np.concatenate([*every, np.empty(0)])
    start, end = (float(seconds.min()), float(seconds.max())) if len(seconds) else (np.nan, np.nan)
    return Summary(path, properties["model"][0][0], muscles, entities, len(seconds), start, end)


def _indexed(reader: "RrdReader", entry: "StoreEntry") -> "LazyStore":
    """Return the store of a recording; RecordingError if the table of contents, which is written last, is missing."""
    try:
        return reader.store(store=entry)
    except RuntimeError as error:
        raise RecordingError(f"'{reader.path}' is incomplete: its table of contents is missing") from error


def open_native(path: str | os.PathLike[str]) -> int:
    """Open the native viewer on a recording, wait until it is closed, and return its exit code."""
    process = _viewer([str(path)])
    try:
        return process.wait()
    finally:
        process.terminate()


class Server(NamedTuple):
    """A viewer for browsers: the address to open, the address to which a `Recorder` connects, and the process."""

    address: str
    connect: str
    process: subprocess.Popen[bytes]


def serve(path: str | os.PathLike[str] | None = None, port: int = 9090) -> Server:
    """Serve a recording, or the data of a connected `Recorder`, to browsers on this machine; returns once it listens.

    The viewer listens at `port`, the data come from `port + 1`. Raises RecordingError if one of the ports is in use, or
    the server does not start.
    """
    for number in (port, port + 1):
        try:
            with socket.socket() as probe:
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, os.name == "posix")
                probe.bind((_HERE, number))
        except (OSError, OverflowError) as error:
            raise RecordingError(f"cannot serve at port {number}: {error}; choose another port") from error
    connect = f"rerun+http://{_HERE}:{port + 1}/proxy"
    # the server keeps the data in memory, and drops the oldest beyond its limit
    limits = ["--bind", _HERE, "--server-memory-limit", "75%"]
    ports = ["--web-viewer-port", str(port), "--port", str(port + 1)]
    process = _viewer([*([] if path is None else [str(path)]), "--serve-web", *limits, *ports])
    try:
        for number in (port, port + 1):
            _wait_for(process, number)
    except BaseException:
        process.terminate()
        process.wait()
        raise
    return Server(f"http://{_HERE}:{port}?url={quote(connect, safe='')}", connect, process)


def _wait_for(process: subprocess.Popen[bytes], port: int) -> None:
    """Return once a server listens."""
    deadline = time.monotonic() + _PATIENCE
    while True:
        try:
            socket.create_connection((_HERE, port), timeout=1.0).close()
            return
        except OSError as error:
            if process.poll() is not None or time.monotonic() > deadline:
                raise RecordingError(f"the server at port {port} does not start: {error}") from error
            time.sleep(0.02)


class _Viewer(subprocess.Popen[bytes]):
    """The viewer's launcher; it does not pass signals to the viewer that it starts, so both must be ended."""

    def terminate(self) -> None:
        """End the launcher and the viewer."""
        if os.name == "posix":
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.pid, signal.SIGTERM)
        else:
            super().terminate()


def _viewer(arguments: list[str]) -> _Viewer:
    quiet = {"RUST_LOG": "warn", **os.environ}
    return _Viewer([sys.executable, "-m", "rerun_cli", *arguments], env=quiet, start_new_session=True)
