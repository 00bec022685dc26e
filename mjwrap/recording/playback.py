"""Recordings once they are there: what one holds, and the viewer on it."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

import numpy as np

from mjwrap.errors import RecordingError

if TYPE_CHECKING:
    from rerun.chunk import LazyStore, RrdReader, StoreEntry


@dataclass(frozen=True)
class Summary:
    """What a recording holds; times in simulated seconds, nan where no state was logged."""

    path: Path
    model: str
    muscles: tuple[str, ...]
    entities: tuple[str, ...]
    states: int
    start: float
    end: float


def read_summary(path: str | os.PathLike[str]) -> Summary:
    """Read what a recording holds.

    Raises RecordingError where there is no such file, it is cut short or damaged, or `Recorder` did not write it.
    """
    path = Path(path)
    if not path.is_file():
        raise RecordingError(f"there is no recording '{path}'")
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
        # every chunk is decoded, so that damage anywhere shows
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
    """The store of a recording; RecordingError where the table of contents, written last, is missing."""
    try:
        return reader.store(store=entry)
    except RuntimeError as error:
        raise RecordingError(f"'{reader.path}' is cut short: its table of contents is missing") from error


def open_native(path: str | os.PathLike[str]) -> int:
    """Open the native viewer on a recording, wait until it is closed and give its exit code."""
    process = _viewer([str(path)])
    try:
        return process.wait()
    finally:
        process.terminate()


def serve(path: str | os.PathLike[str], port: int = 9090) -> tuple[str, subprocess.Popen[bytes]]:
    """Serve a recording to browsers on this machine; the address to open, and the process that serves it.

    The viewer listens at `port`, the data come from `port + 1`. Raises RecordingError where one is taken.
    """
    data_port = port + 1
    for number in (port, data_port):
        try:
            with socket.socket() as probe:
                probe.bind(("127.0.0.1", number))
        except (OSError, OverflowError) as error:
            raise RecordingError(f"cannot serve at port {number}: {error}; choose another port") from error
    data = quote(f"rerun+http://127.0.0.1:{data_port}/proxy", safe="")
    # the server keeps what it hands out in memory, and drops the oldest beyond its limit
    limits = ["--bind", "127.0.0.1", "--server-memory-limit", "75%"]
    ports = ["--web-viewer-port", str(port), "--port", str(data_port)]
    return f"http://127.0.0.1:{port}?url={data}", _viewer([str(path), "--serve-web", *limits, *ports])


class _Viewer(subprocess.Popen[bytes]):
    """The viewer's launcher, which does not hand signals on to the viewer that it starts: so end both."""

    def terminate(self) -> None:
        """End the launcher and its viewer."""
        if os.name == "posix":
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.pid, signal.SIGTERM)
        else:
            super().terminate()


def _viewer(arguments: list[str]) -> _Viewer:
    quiet = {"RUST_LOG": "warn", **os.environ}
    return _Viewer([sys.executable, "-m", "rerun_cli", *arguments], env=quiet, start_new_session=True)
