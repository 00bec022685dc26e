"""Rows of a recording between two flushes: one of scalars a call, one of poses and paths a displayed frame."""

from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from mjwrap.errors import RecordingError
from mjwrap.recording import columns
from mjwrap.recording.layout import blueprint
from mjwrap.recording.scene import Scene
from mjwrap.recording.stream import Stream

if TYPE_CHECKING:
    from mjwrap.system import MuscleSystem

EARLY = 1e-6  # part of a frame's period by which it may come too early, for times that are not exact


class Buffers:
    """Room for `rows` calls of `add`; `take` turns what is there into record batches and empties it."""

    def __init__(
        self, scene: Scene, muscles: "MuscleSystem", rate: float, rows: int, spacing: float | None
    ) -> None:
        self._scene, self._muscles = scene, muscles
        self._rate = rate
        self._spacing = spacing
        self._poses = getattr(muscles, "poses", lambda data: data)
        n, bodies = len(scene.muscle_names), scene.model.nbody
        self._time = np.empty(rows)
        self._scalars = np.empty((len(columns.QUANTITIES), rows, n))
        self._length, self._velocity, self._tension, self._activation = self._scalars
        self._frame_rows = np.empty(rows, dtype=np.int64)  # the row that each frame belongs to
        self._positions = np.empty((rows, bodies, 3), dtype=np.float32)
        self._quaternions = np.empty((rows, bodies, 4), dtype=np.float32)
        self._paths, self._contacts = columns.Ragged(), columns.Ragged()
        self._scalar_table = columns.scalar_table(
            [path for q in columns.QUANTITIES for path in scene.series[q]]
        )
        self._pose_table = columns.pose_table([scene.bodies[body] for body in scene.moving])
        self._path_table = columns.path_table(scene.paths, scene.contacts)
        self._rows = self._frames = 0
        self._start: float | None = None  # time of the first call
        self._last_time = self._next_frame = -np.inf

    @property
    def full(self) -> bool:
        """Whether the next row has no room."""
        return self._rows == len(self._time)

    def add(self, data: Any) -> None:
        """Copy what belongs to the muscles' last forward."""
        muscles, row = self._muscles, self._rows
        time = muscles.time
        if not time >= self._last_time:
            raise RecordingError(
                f"cannot log at time {time} s after {self._last_time} s: one recording is one run, in which time "
                "goes forward; close this Recorder and make another one after a reset"
            )
        self._time[row] = time
        self._length[row] = muscles.length
        self._velocity[row] = muscles.velocity
        self._tension[row] = muscles.tension
        self._activation[row] = muscles.activation
        if time >= self._next_frame:
            self._add_frame(data, row, time)
        self._last_time = time
        self._rows = row + 1

    def _add_frame(self, data: Any, row: int, time: float) -> None:
        if self._start is None:
            self._start = time
        # frames are due at whole multiples of the period, so that rounding does not add up
        due = np.floor((time - self._start) * self._rate + EARLY) + 1
        self._next_frame = self._start + (due - EARLY) / self._rate
        frame = self._frames
        poses = self._poses(data)
        self._positions[frame] = poses.xpos
        self._quaternions[frame] = poses.xquat
        self._frame_rows[frame] = row
        self._paths.put(frame, *self._muscles.polylines(self._spacing))
        self._contacts.put(frame, *self._muscles.contacts())
        self._frames = frame + 1

    def lay_out(self, stream: Stream) -> None:
        """Log what waits for the first frame: the layout, which looks at the muscles, and the welded bodies."""
        stream.blueprint(blueprint(self._scene, self._paths.first(), self._positions[0, 1:]))
        if self._frames:
            self._scene.log_welded(stream, self._positions[0], self._quaternions[0])

    def take(self) -> list[pa.RecordBatch]:
        """All rows as record batches; the buffers are empty afterwards."""
        batches = []
        if self._rows:
            values = self._scalars[:, : self._rows]
            cells = [column for quantity in values for column in columns.scalar_columns(quantity)]
            batches.append(self._scalar_table.batch(self._time[: self._rows], cells))
        if self._frames:
            rows = self._frame_rows[: self._frames]
            times, moving = self._time[rows], self._scene.moving
            poses = (self._positions[: self._frames, moving], self._quaternions[: self._frames, moving])
            colors = columns.activation_colors(self._scalars[-1][rows])
            if moving:
                batches.append(self._pose_table.batch(times, columns.pose_columns(*poses)))
            cells = columns.path_columns(self._paths, self._contacts, colors)
            batches.append(self._path_table.batch(times, cells))
        self._rows = self._frames = 0
        return batches
