"""A recording stream of rerun, to a file or to a running viewer, whose errors are raised."""

import socket
import warnings
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import pyarrow as pa
import rerun as rr
from rerun.chunk import RrdReader

from mjwrap.errors import RecordingError
from mjwrap.files.atomic import PartFile
from mjwrap.recording.target import FilePipe

if TYPE_CHECKING:
    import rerun.blueprint as rrb

APPLICATION = "mjwrap"
VIEWER = "rerun+http://127.0.0.1:9876/proxy"  # default address of a viewer


class Stream:
    """A recording stream into a `PartFile`, to the viewer at an address, or both.

    `send`, `wait` and `finish` raise RecordingError if the file cannot grow, or if the viewer is gone and there is no
    file. If there is a file, they warn of a viewer that is gone.
    """

    def __init__(self, target: PartFile | None, url: str | None, name: str) -> None:
        self._target, self._url = target, url
        self._recording = rr.RecordingStream(APPLICATION)
        if not self._recording.is_enabled():
            raise RecordingError(
                f"cannot record to '{target.path if target else url}': rerun is switched off by the environment "
                "variable RERUN; unset it or set RERUN=on"
            )
        self._pipe = FilePipe(target.part) if target and FilePipe.AVAILABLE else None
        self._lost = False  # the viewer is gone
        sinks: list[rr.FileSink | rr.GrpcSink] = []
        if target:
            sinks.append(rr.FileSink(self._pipe.address if self._pipe else target.part))
        if url:
            _require_viewer(url)
            sinks.append(rr.GrpcSink(url))
        self._recording.set_sinks(*sinks)
        if self._pipe:
            self._pipe.connected()
        rr.send_recording_name(name, recording=self._recording)

    def static(self, entity: str, *archetypes: rr.AsComponents) -> None:
        """Log data that hold for the whole recording."""
        self._recording.log(entity, *archetypes, static=True, strict=True)

    def properties(self, **values: str | float | list[str]) -> None:
        """Log properties of the recording as a whole."""
        rr.send_property(APPLICATION, rr.AnyValues(True, **values), recording=self._recording)

    def blueprint(self, blueprint: "rrb.Blueprint") -> None:
        """Send the initial layout of the viewer."""
        self._recording.send_blueprint(blueprint)

    def send(self, batches: list[pa.RecordBatch]) -> None:
        """Pass columns to the writer, which works while the simulation continues; call `wait` before."""
        for batch in batches:
            if batch.num_columns > 1:  # a model without muscles, or without bodies, has only times
                rr.send_record_batch(batch, recording=self._recording)

    def wait(self) -> bool:
        """Wait until all that was sent is on its way to the file or with the viewer; return whether that is certain.

        So a full disk is noticed after at most one batch. It is not certain if there is a file and the viewer is gone.
        """
        try:
            self._recording.flush()
        except (RuntimeError, ValueError, OSError) as error:
            if self._url is None or "gRPC" not in str(error):
                raise self._failure(error) from error
            self._viewer_gone(error)
            self._check()
            return False
        self._check()
        return True

    def finish(self) -> None:
        """Write the table of contents of a file, close the file, and read the table back."""
        self.wait()
        self._disconnect()
        self._check()
        if self._target is None:
            return
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # rerun warns of a missing table, and store() raises for it
                RrdReader(self._target.part).store()
        except (RuntimeError, ValueError, OSError) as error:
            raise self._failure(error) from error

    def abandon(self) -> None:
        """Close the file, even if it is incomplete."""
        self._disconnect()

    def _disconnect(self) -> None:
        self._recording.disconnect()
        if self._pipe:
            self._pipe.finish()

    def _check(self) -> None:
        if self._pipe and self._pipe.error:
            raise self._failure(self._pipe.error) from self._pipe.error

    def _failure(self, error: Exception) -> RecordingError:
        if self._target is None:
            return RecordingError(f"recording to '{self._url}' failed: {error}")
        return self._target.failure(error)

    def _viewer_gone(self, error: Exception) -> None:
        if self._target is None:
            raise RecordingError(f"the viewer at {self._url} is gone: {error}") from error
        if not self._lost:
            self._lost = True
            warnings.warn(
                f"the viewer at {self._url} is gone; the recording to '{self._target.path}' continues",
                RuntimeWarning,
                stacklevel=2,
            )


def _require_viewer(url: str) -> None:
    """Raise RecordingError if no viewer listens at an address: rerun itself would wait for one."""
    try:
        parts = urlsplit(url)
        if not (parts.scheme in ("rerun+http", "rerun+https") and parts.hostname and parts.path == "/proxy"):
            raise ValueError(f"an address looks like {VIEWER}")
        socket.create_connection((parts.hostname, parts.port or 9876), timeout=5.0).close()
    except (OSError, ValueError) as error:
        raise RecordingError(
            f"cannot connect to a viewer at '{url}': {error}; start one first: python -m rerun_cli"
        ) from error
