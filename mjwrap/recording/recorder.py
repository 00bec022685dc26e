"""`Recorder`: records a run into a file for the rerun viewer, or streams it to a viewer."""

import math
import numbers
import os
import time
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mjwrap import html, validation
from mjwrap.errors import RecordingError
from mjwrap.files.atomic import PartFile, RunLog, require
from mjwrap.validation import is_positive

if TYPE_CHECKING:
    from mjwrap.recording.blueprint import First
    from mjwrap.recording.frames import Buffers
    from mjwrap.recording.stream import Stream
    from mjwrap.system.results import Results

SUFFIX = ".rrd"
BUFFERED = 80_000  # default number of states to collect times the number of muscles; about 50 MB
LIVE = 0.2  # wall-clock seconds between two batches to a running viewer


class Recorder(RunLog):
    """Record a simulation for rerun: the moving model, muscle paths coloured by activation, forces, and curves.

    The curves are length [m], lengthening speed [m/s], tension [N], activation, power [W], fibre length [m], solver
    status and iterations of every muscle. The file gets its name only when it is complete: at `close`, or at the end
    of a `with` block, also after Ctrl-C. After an error inside the block no file is left, and an existing file of that
    name is unchanged.

    Args:
        model: a mujoco.MjModel.
        muscles: its MuscleSystem or, for a model with the engine plugin, the `mjwrap.plugin.Muscles` of its data.
        path: a file name that ends in .rrd; None with `connect`.
        connect: stream to a running viewer, in addition to the file or without one: True for this machine, or an
            address (rerun+http://HOST:PORT/proxy).
        rate: states per second of simulated time in the curves [Hz], in addition to those of frames; None: one at every
            `log`.
        path_rate: frames of bodies, paths, contact points, forces and moment arms per second of simulated time [Hz].
        groups: muscles whose curves are shown together, {name: patterns of names}; None to group muscles by the body
            that they move.
        force_scale: length of an arrow [m/N]; None: the strongest muscle's is 0.3 times the size of all paths.
        flush_every: number of states collected before they are written; None for 4000, fewer with many muscles.
        spacing: largest distance of points on the curved parts of a path [m]; None: chosen by the curvature.

    Raises:
        RecordingError: before the run, if the file cannot be written or no viewer listens; from `log` or `close`, if
            the disk is full, or the viewer is gone and there is no file.
    """

    def __init__(
        self,
        model: Any,
        muscles: "Results",
        path: str | os.PathLike[str] | None = None,
        *,
        connect: bool | str = False,
        rate: float | None = None,
        path_rate: float = 60.0,
        groups: Mapping[str, str | Iterable[str]] | None = None,
        force_scale: float | None = None,
        flush_every: int | None = None,
        spacing: float | None = None,
    ) -> None:
        if not hasattr(model, "nbody") or hasattr(model, "worldbody"):
            validation.of_type(model, "MjModel", "model", RecordingError)
        if not all(hasattr(muscles, name) for name in ("n", "names", "declarations")):
            validation.of_type(muscles, "MuscleSystem", "muscles", RecordingError)
        where = "True, False or the address of a viewer"
        require("connect", connect, isinstance(connect, bool | str), where)
        require("rate", rate, rate is None or is_positive(rate), "a positive number of states per second")
        require("path_rate", path_rate, is_positive(path_rate), "a positive number of frames per second")
        scaled = force_scale is None or is_positive(force_scale)
        require("force_scale", force_scale, scaled, "a positive length per force in metres per newton")
        whole = flush_every is None or (isinstance(flush_every, numbers.Integral) and flush_every >= 1)
        require("flush_every", flush_every, whole, "a whole number, at least 1")
        require("spacing", spacing, spacing is None or is_positive(spacing), "a positive length in metres")
        if path is None and not connect:
            raise RecordingError("a recording needs a file name, or connect=True, or both")
        target = None if path is None else PartFile(path, SUFFIX)
        self._live, self._batch_due = bool(connect), -math.inf
        try:
            rows = flush_every or int(np.clip(BUFFERED // max(1, muscles.n), 250, 4000))
            how = rate, path_rate, spacing, force_scale
            self._buffers, self._stream = _open(model, muscles, target, connect, groups, rows, how)
        except BaseException:
            if target:
                target.discard()
            raise
        self._laid_out = False
        self._first: First | None = None
        self._names, self._logged = list(muscles.names), 0
        self._begin(str(connect if target is None else target.path), target, self._stream.abandon)

    def log(self, data: Any) -> None:
        """Record the state of the muscles' last evaluation, if a row is due; data: its mujoco.MjData.

        Raises RecordingError if the disk is full, if time goes backwards (a recording has one run; make another one
        after a reset), and after `close`.
        """
        if self._ended:
            raise RecordingError(f"cannot log to '{self._place}': {self._ended}")
        added = self._buffers.add(data)
        self._logged += added
        if added and not self._laid_out:
            self._guarded(self._lay_out)
        if (added and self._buffers.full) or (self._live and time.perf_counter() >= self._batch_due):
            self._guarded(self._flush)

    def __repr__(self) -> str:
        state = f"ended: {self._ended}" if self._ended else "open"
        rows = f"{self._logged} state{'s' * (self._logged != 1)}"
        return f"Recorder({self._place!r}, {len(self._names)} muscles, {rows}, {state})"

    def _repr_html_(self) -> str:
        facts = [("goes to", self._place), ("muscles", ", ".join(self._names)), ("states", self._logged)]
        return html.facts([*facts, ("now", self._ended or "open")], "Recorder")

    @property
    def _empty(self) -> bool:
        return not self._laid_out

    def _lay_out(self) -> None:
        if not self._laid_out:
            self._first = self._buffers.begin(self._stream)
            if self._live:  # a viewer needs the layout at once; that of a file knows the ranges of all curves
                self._stream.blueprint(self._buffers.layout(self._first))
            self._laid_out = True

    def _flush(self) -> None:
        self._stream.send(self._buffers.take(done=self._stream.wait()))
        self._batch_due = time.perf_counter() + LIVE

    def _finish(self) -> None:
        self._lay_out()
        self._flush()
        if not self._live and self._first is not None:
            self._stream.blueprint(self._buffers.layout(self._first))
        self._stream.finish()


def _open(
    model: Any,
    muscles: "Results",
    target: PartFile | None,
    connect: bool | str,
    groups: Mapping[str, str | Iterable[str]] | None,
    rows: int,
    how: tuple[float | None, float, float | None, float | None],
) -> tuple["Buffers", "Stream"]:
    """Allocate the buffers and open the file or the connection; rerun is loaded here, not earlier.

    how: the fields of `frames.Options`.
    """
    try:
        from mjwrap.recording.frames import Buffers, Options
        from mjwrap.recording.scene import Scene, model_name
        from mjwrap.recording.stream import VIEWER, Stream
    except ImportError as error:
        raise RecordingError(f"cannot record: {error}; install rerun with: pip install rerun-sdk") from error
    scene = Scene(model, muscles, groups)
    buffers = Buffers(scene, muscles, rows, Options(*how))
    name = model_name(model)
    stream = Stream(target, VIEWER if connect is True else connect or None, name)
    try:
        stream.properties(model=name, muscles=scene.muscle_names, timestep=float(model.opt.timestep))
        scene.log_static(stream)
        stream.wait()
    except BaseException:
        stream.abandon()
        raise
    return buffers, stream
