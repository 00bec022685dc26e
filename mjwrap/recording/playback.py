"""Recordings once they are there: what one holds, and the viewer on it."""

import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mjwrap.errors import RecordingError

WEB_PORT = 9090


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
    """Read what a recording holds; RecordingError where there is no such file or it is not a whole recording."""
    path = _existing(path)
    from rerun.chunk import RrdReader

    from mjwrap.recording.columns import QUANTITIES, TIMELINE
    from mjwrap.recording.stream import APPLICATION

    try:
        reader = RrdReader(path)
        ours = [entry for entry in reader.recordings() if entry.application_id == APPLICATION]
        if not ours:
            raise RecordingError(f"'{path}' is a rerun file, but not a recording of {APPLICATION}")
        store = reader.store(store=ours[0])
        entities = sorted({column.entity_path for column in store.schema().component_columns()})
        properties = next(
            chunk.to_record_batch().to_pydict()
            for chunk in store.stream().filter(content=f"/__properties/{APPLICATION}")
        )
        times = [
            time.total_seconds() if hasattr(time, "total_seconds") else time
            for chunk in store.stream().filter(content=f"/{QUANTITIES[0]}/**", is_static=False)
            for time in chunk.to_record_batch().column(TIMELINE).to_pylist()
        ]
    except (RuntimeError, ValueError, OSError, StopIteration) as error:
        if isinstance(error, RecordingError):
            raise
        raise RecordingError(f"'{path}' is not a complete recording: {error}") from error
    return Summary(path, properties, entities, times)


def open_native(path: str | os.PathLike[str]) -> int:
    """Open the native viewer on a recording and wait for its end; the viewer's exit code."""
    return _viewer([str(_existing(path))])


def serve(path: str | os.PathLike[str], port: int = WEB_PORT) -> int:
    """Serve a recording to a browser on this machine until Ctrl-C; the server's exit code."""
    return _viewer([str(_existing(path)), "--serve-web", "--web-viewer-port", str(port)])


def _viewer(arguments: Sequence[str]) -> int:
    return subprocess.run([sys.executable, "-m", "rerun", *arguments], check=False).returncode


def _existing(path: str | os.PathLike[str]) -> Path:
    path = Path(path)
    if not path.is_file():
        raise RecordingError(f"there is no recording '{path}'")
    return path
