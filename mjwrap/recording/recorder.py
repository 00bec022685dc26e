"""`Recorder`: what happened in a run, as a file that the rerun viewer replays."""

import math
import os
import warnings
import weakref
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from mjwrap.errors import RecordingError
from mjwrap.output import PartFile, require, uninterrupted

if TYPE_CHECKING:
    from mjwrap.recording.frames import Buffers
    from mjwrap.recording.stream import Stream
    from mjwrap.system import MuscleSystem

SUFFIX = ".rrd"
BUFFERED = 250_000  # states of a muscle that are gathered unless the caller says otherwise; 8 MB


class Recorder:
    """Record a simulation for rerun: the moving model, muscle paths coloured by activation, and time series.

    `model` is a mujoco.MjModel, `muscles` its MuscleSystem, `path` a file name that ends in .rrd. Bodies, paths and
    contact points are taken `path_rate` times per second of simulated time [Hz], length [m], lengthening
    speed [m/s], tension [N] and activation of every muscle at every `log`. `flush_every` calls are gathered before
    they go to the file (None: 4000, fewer where there are many muscles); `spacing` [m] is the distance of points on
    the curved parts of a path (None: as many as their curvature asks for).

    The file has its name only once it is complete: `close` does that, or the end of a `with` block, also where
    Ctrl-C ended it. An error inside the block leaves nothing behind, and an older file of that name as it was.

    Raises RecordingError, before the run where `path` cannot be written, and from `log` or `close` where the
    disk is full.
    """

    def __init__(
        self,
        model: Any,
        muscles: "MuscleSystem",
        path: str | os.PathLike[str],
        *,
        path_rate: float = 60.0,
        flush_every: int | None = None,
        spacing: float | None = None,
    ) -> None:
        require("path_rate", path_rate, 0 < path_rate < math.inf, "a positive number of frames per second")
        require("flush_every", flush_every, flush_every is None or flush_every >= 1, "at least 1")
        require("spacing", spacing, spacing is None or 0 < spacing < math.inf, "a positive length in metres")
        self._ended = ""  # why no more can be logged
        self._target = PartFile(path, SUFFIX)
        try:
            buffers, stream = _open(model, muscles, self._target, path_rate, flush_every, spacing)
        except BaseException:
            self._target.discard()
            raise
        self._buffers, self._stream, self._laid_out = buffers, stream, False
        self._finalizer = weakref.finalize(self, _forgotten, self._target, stream)

    def log(self, data: Any) -> None:
        """Record the state that `muscles` last saw; `data` is the mujoco.MjData that it belongs to.

        Raises RecordingError where the disk is full, where time runs backwards (after a reset: one recording
        is one run), and after `close`.
        """
        if self._ended:
            raise RecordingError(f"cannot log to '{self._target.path}': {self._ended}")
        self._buffers.add(data)
        if self._buffers.full:
            self._guarded(self._flush)

    def close(self) -> None:
        """Write what is left, check that the file is complete and give it its name; a second call does nothing.

        Raises RecordingError, and leaves nothing behind, where the disk is full.
        """
        if not self._ended:
            self._guarded(self._finish)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None and issubclass(kind, Exception):
            self._discard("the run ended with an error and nothing was kept")
        else:
            self.close()  # KeyboardInterrupt and SystemExit too: what was logged so far is a recording

    def _flush(self) -> None:
        if not self._laid_out:
            self._buffers.lay_out(self._stream)
            self._laid_out = True
        self._stream.send(self._buffers.take())

    def _finish(self) -> None:
        self._flush()
        self._stream.finish()
        self._target.publish()
        self._ended = "it is closed"
        self._finalizer.detach()

    def _guarded(self, action: Callable[[], None]) -> None:
        """Act whole or not at all: Ctrl-C waits for the end, an error removes the file."""
        with uninterrupted():
            try:
                action()
            except BaseException as error:
                self._discard(f"it failed before ({error})")
                raise

    def _discard(self, why: str) -> None:
        if self._ended:
            return
        self._ended = why
        self._finalizer.detach()
        self._stream.abandon()
        self._target.discard()


def _open(
    model: Any,
    muscles: "MuscleSystem",
    target: PartFile,
    rate: float,
    rows: int | None,
    spacing: float | None,
) -> tuple["Buffers", "Stream"]:
    """Start the file; rerun loads here and nowhere earlier."""
    try:
        from mjwrap.recording.frames import Buffers
        from mjwrap.recording.scene import Scene, model_name
        from mjwrap.recording.stream import Stream
    except ImportError as error:
        raise RecordingError(f"cannot record: {error}; install rerun with: pip install rerun-sdk") from error
    scene = Scene(model, muscles)
    name = model_name(model)
    stream = Stream(target, name)
    try:
        stream.properties(model=name, muscles=scene.muscle_names, timestep=float(model.opt.timestep))
        scene.log_static(stream)
        stream.wait()
    except BaseException:
        stream.abandon()
        raise
    rows = rows or int(np.clip(BUFFERED // max(1, muscles.n), 250, 4000))
    return Buffers(scene, muscles, rate, rows, spacing), stream


def _forgotten(target: PartFile, stream: "Stream") -> None:
    stream.abandon()
    target.discard()
    warnings.warn(
        f"the Recorder of '{target.path}' was never closed, so nothing was kept; use it in a with statement",
        RuntimeWarning,
        stacklevel=2,
    )
