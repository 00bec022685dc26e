"""rerun's file writer, with errors that are raised: it reports a failed write late, or only in its own log."""

import warnings
from typing import TYPE_CHECKING

import pyarrow as pa
import rerun as rr
from rerun.chunk import RrdReader

from mjwrap.errors import RecordingError
from mjwrap.recording.target import PartFile

if TYPE_CHECKING:
    import rerun.blueprint as rrb

APPLICATION = "mjwrap"


class Stream:
    """One recording stream into a `PartFile`; every method raises RecordingError once a write has failed."""

    def __init__(self, target: PartFile, name: str) -> None:
        self._target = target
        self._recording = rr.RecordingStream(APPLICATION)
        if not self._recording.is_enabled():
            raise RecordingError(
                f"cannot record to '{target.path}': rerun is switched off by the environment variable RERUN; "
                "unset it or set RERUN=on"
            )
        try:
            self._recording.save(target.part)
            rr.send_recording_name(name, recording=self._recording)
        except (RuntimeError, ValueError, OSError) as error:
            raise self._failed() from error

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
            rr.send_record_batch(batch, recording=self._recording)

    def wait(self) -> None:
        """Return once everything sent is in the file."""
        try:
            self._recording.flush()
        except (RuntimeError, ValueError, OSError) as error:
            raise self._failed() from error

    def finish(self) -> None:
        """Write the footer, close the file and read its table of contents back."""
        self.wait()
        self._recording.disconnect()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # rerun warns of a missing footer, and store() raises for it
                RrdReader(self._target.part).store()
        except (RuntimeError, ValueError, OSError) as error:
            raise self._failed() from error

    def abandon(self) -> None:
        """Close the file, complete or not."""
        self._recording.disconnect()

    def _failed(self) -> RecordingError:
        target = self._target
        return RecordingError(
            f"recording to '{target.path}' failed: {target.write_fault()}; nothing was kept"
        )
