"""One recording stream of rerun into a file, with errors that are raised."""

import warnings
from typing import TYPE_CHECKING

import pyarrow as pa
import rerun as rr
from rerun.chunk import RrdReader

from mjwrap.errors import RecordingError
from mjwrap.output import PartFile
from mjwrap.recording.target import FilePipe

if TYPE_CHECKING:
    import rerun.blueprint as rrb

APPLICATION = "mjwrap"


class Stream:
    """A recording stream into a `PartFile`; `send`, `wait` and `finish` raise RecordingError where it cannot grow."""

    def __init__(self, target: PartFile, name: str) -> None:
        self._target = target
        self._recording = rr.RecordingStream(APPLICATION)
        if not self._recording.is_enabled():
            raise RecordingError(
                f"cannot record to '{target.path}': rerun is switched off by the environment variable RERUN; "
                "unset it or set RERUN=on"
            )
        self._pipe = FilePipe(target.part) if FilePipe.AVAILABLE else None
        self._recording.save(self._pipe.address if self._pipe else target.part)
        if self._pipe:
            self._pipe.connected()
        rr.send_recording_name(name, recording=self._recording)

    def static(self, entity: str, *archetypes: rr.AsComponents) -> None:
        """Log what holds for the whole recording."""
        self._recording.log(entity, *archetypes, static=True, strict=True)

    def properties(self, **values: str | float | list[str]) -> None:
        """Log properties of the recording as a whole."""
        rr.send_property(APPLICATION, rr.AnyValues(True, **values), recording=self._recording)

    def blueprint(self, blueprint: "rrb.Blueprint") -> None:
        """Send the layout that the viewer opens with."""
        self._recording.send_blueprint(blueprint)

    def send(self, batches: list[pa.RecordBatch]) -> None:
        """Hand columns to the writer, which works while the simulation runs on.

        Waits first for the columns handed over before, so that a full disk shows after at most one batch
        and memory holds at most two.
        """
        self.wait()
        for batch in batches:
            if batch.num_columns > 1:  # a model without muscles, or without bodies, has times alone
                rr.send_record_batch(batch, recording=self._recording)

    def wait(self) -> None:
        """Return once everything sent is on its way to the file."""
        try:
            self._recording.flush()
        except (RuntimeError, ValueError, OSError) as error:
            raise self._target.failure(error) from error
        self._check()

    def finish(self) -> None:
        """Write the table of contents, close the file and read that table back."""
        self.wait()
        self._disconnect()
        self._check()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # rerun warns of a missing table, and store() raises for it
                RrdReader(self._target.part).store()
        except (RuntimeError, ValueError, OSError) as error:
            raise self._target.failure(error) from error

    def abandon(self) -> None:
        """Close the file, complete or not."""
        self._disconnect()

    def _disconnect(self) -> None:
        self._recording.disconnect()
        if self._pipe:
            self._pipe.finish()

    def _check(self) -> None:
        if self._pipe and self._pipe.error:
            raise self._target.failure(self._pipe.error) from self._pipe.error
