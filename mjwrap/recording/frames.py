"""Rows of a recording between two flushes: scalars of each state; poses, paths and forces of each displayed frame."""

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pyarrow as pa

from mjwrap.errors import RecordingError
from mjwrap.paths import Status
from mjwrap.recording import columns
from mjwrap.recording.axes import widen
from mjwrap.recording.blueprint import First, blueprint
from mjwrap.recording.scene import Scene
from mjwrap.recording.stream import Stream
from mjwrap.system.history import BufferPool

if TYPE_CHECKING:
    import rerun.blueprint as rrb

    from mjwrap.system.results import Results

EARLY = 1e-6  # share of a period by which a row may be early, because times are rounded
LOG = "solver"  # entity of the lines that name muscles without a path, with the reason
ARROW = 0.3  # length of the strongest muscle's arrow, relative to the size of all paths


class Options(NamedTuple):
    """The options of a `Recorder`; see there."""

    rate: float | None
    path_rate: float
    spacing: float | None
    force_scale: float | None


class SampleTimer:
    """A timer that is due at the first time after each multiple of a period, counted from its first time."""

    def __init__(self, rate: float | None) -> None:
        self._rate = rate
        self._start: float | None = None
        self._next = -math.inf
        self._count = 0  # the next multiple

    @property
    def next(self) -> float:
        """Return the time [s] from which a row is due."""
        return self._next

    def due(self, time: float) -> bool:
        """Return whether a row is due at a time [s]; always true without a rate."""
        return time >= self._next

    def take(self, time: float) -> None:
        """Note a row at a time [s]; if it was due, the next one is due a period later."""
        if self._rate is None or time < self._next:
            return
        if self._start is None:
            self._start = time
        # whole multiples, so that rounding errors do not accumulate
        self._count += 1
        self._next = self._start + (self._count - EARLY) / self._rate
        if time >= self._next:  # several periods passed without a call
            self._count = math.floor((time - self._start) * self._rate + EARLY) + 1
            self._next = self._start + (self._count - EARLY) / self._rate


class Buffers:
    """Buffers for `rows` states; `take` converts them to record batches and empties them."""

    def __init__(self, scene: Scene, muscles: "Results", rows: int, options: Options) -> None:
        self._scene, self._muscles, self._options = scene, muscles, options
        self._states, self._displays = SampleTimer(options.rate), SampleTimer(options.path_rate)
        self._time = np.empty(rows)
        self._frame_rows = np.empty(rows, dtype=np.int64)  # the row of each frame
        self._qpos = np.zeros((rows, scene.model.nq))
        self._qpos_time = np.zeros(rows)
        self._joints = [scene.coordinates[k].qpos for k in scene.joints]
        self._widths = [len(coordinate.muscles) for coordinate in scene.coordinates]
        self._history = muscles.history(
            rows,
            np.array([i for coordinate in scene.coordinates for i in coordinate.muscles], dtype=np.int64),
            np.repeat([coordinate.dof for coordinate in scene.coordinates], self._widths).astype(np.int64),
        )
        self._force_scale = options.force_scale
        self._tables = _tables(scene)
        self._pool = BufferPool()
        self._bounds: dict[str, np.ndarray] = {}  # of the columns of each table
        self._before = np.zeros(len(scene.muscle_names))  # status in the last row that was taken
        self._rows = self._frames = 0
        self._last_time = self._next_time = -math.inf

    @property
    def full(self) -> bool:
        """Whether the buffers are full."""
        return self._rows == len(self._time)

    def add(self, data: Any) -> bool:
        """Copy the results of the muscles' last evaluation, if a row is due; return whether it was."""
        time = self._muscles.time
        if self._last_time <= time < self._next_time:  # the most frequent case
            self._last_time = time
            return False
        if not time >= self._last_time:
            raise RecordingError(
                f"cannot log at time {time} s after {self._last_time} s: one recording is one run, in which time "
                "goes forward; close this Recorder and make another one after a reset"
            )
        self._last_time = time
        display = self._displays.due(time)
        row = self._rows
        self._time[row] = time
        self._history.put_state(row)
        self._states.take(time)
        if display:
            self._add_frame(data, row)
            self._displays.take(time)
        self._rows = row + 1
        self._next_time = min(self._displays.next, self._states.next)
        return True

    def _add_frame(self, data: Any, row: int) -> None:
        frame = self._frames
        self._frame_rows[frame] = row
        self._history.put_frame(frame, self._muscles.poses(data), self._options.spacing)
        self._qpos[frame] = data.qpos
        self._qpos_time[frame] = (
            data.time
        )  # after a step the data have the next state, the results belong to this one
        self._frames = frame + 1

    def begin(self, stream: Stream) -> First:
        """Log what needs the first frame, the welded bodies, and return that frame for the viewer's layout."""
        if not self._frames:
            return First(np.empty((0, 3)), np.empty((0, 3)), [])
        arms = np.abs(self._history.moment_arms(1)[0])
        parts = np.split(arms, np.cumsum(self._widths)[:-1]) if self._widths else []
        positions, quaternions = (array[0] for array in self._history.bodies(1))
        first = First(self._history.polylines(1)[0], positions, parts)
        if self._force_scale is None:
            self._force_scale = ARROW * first.size / self._scene.strength
        self._scene.log_welded(stream, positions, quaternions)
        return first

    def layout(self, first: First) -> "rrb.Blueprint":
        """Return the viewer's layout, with axes for the values that were taken until now."""
        scene, bounds = self._scene, {}
        for name, paths in (scene.series | {f"groups {q}": p for q, p in scene.group_series.items()}).items():
            if name in self._bounds:
                bounds |= {path: self._bounds[name][:, [i]] for i, path in enumerate(paths)}
        if "joints" in self._bounds:
            bounds |= {path: self._bounds["joints"][:, [i]] for i, path in enumerate(scene.joints.values())}
        if "moment_arms" in self._bounds:
            parts = np.split(self._bounds["moment_arms"], np.cumsum(self._widths)[:-1], axis=1)
            bounds |= dict(zip(scene.moment_arms, parts, strict=True))
        return blueprint(scene, first, bounds)

    def take(self, done: bool) -> list[pa.RecordBatch]:
        """Return all rows as record batches; the buffers are empty afterwards.

        done: whether the batches taken before are written, so that their memory may be reused.
        """
        if not done:
            self._pool = BufferPool()
        batches = self._take_states() if self._rows else []
        if self._frames:
            batches += self._take_frames()
        self._rows = self._frames = 0
        return batches

    def _take_states(self) -> list[pa.RecordBatch]:
        times = self._time[: self._rows]
        found = self._history.states(self._rows)
        values = {name: found[name] for name in self._scene.measured}
        values["power"] = -values["tension"] * values["velocity"]
        lost = (values["status"] != Status.CONVERGED).astype(np.float64)
        groups = {
            "activation": self._summed(values["activation"]) / self._scene.group_sizes,
            "tension": self._summed(values["tension"]),
            "power": self._summed(values["power"]),
            "without_path": self._summed(lost),
        }
        series = values | {f"groups {name}": groups[name] for name in self._scene.group_series}
        for name, each in series.items():
            widen(self._bounds, name, each)
        cells = [column for name, each in series.items() for column in self._scalars(name, each)]
        batches = [self._tables["scalars"].batch(times, cells)]
        before = np.vstack([self._before, values["status"][:-1]])
        rows, muscles = np.nonzero(values["status"] != before)
        if len(rows):
            codes = [Status(int(code)) for code in values["status"][rows, muscles]]
            lines = [
                f"{self._scene.muscle_names[i]}: {code.message}"
                for i, code in zip(muscles, codes, strict=True)
            ]
            levels = ["INFO" if code == Status.CONVERGED else "WARN" for code in codes]
            batches.append(self._tables["log"].batch(times[rows], columns.text_columns(lines, levels)))
        self._before = values["status"][-1].copy()
        return batches

    def _scalars(self, name: str, values: np.ndarray) -> list[pa.Array]:
        """Return columns of values (T, m), in the pool's memory of this name."""
        return columns.scalar_columns(values, self._pool.array(name, values.shape[::-1]))

    def _summed(self, values: np.ndarray) -> np.ndarray:
        """Return the sums of values (T, n) over each group, (T, groups)."""
        order, starts = self._scene.by_group
        return np.add.reduceat(values[:, order], starts, axis=1) if len(starts) else values

    def _take_frames(self) -> list[pa.RecordBatch]:
        rows, moving = self._frame_rows[: self._frames], self._scene.moving
        times = self._time[rows]
        batches = []
        if moving:
            poses = (array[:, moving] for array in self._history.bodies(self._frames))
            batches.append(self._tables["poses"].batch(times, columns.pose_columns(*poses)))
        if self._joints:
            positions = self._qpos[: self._frames, self._joints]
            widen(self._bounds, "joints", positions)
            cells = self._scalars("joint", positions)
            batches.append(self._tables["joints"].batch(self._qpos_time[: self._frames], cells))
        if self._widths:
            arms = self._history.moment_arms(self._frames)
            widen(self._bounds, "moment_arms", arms)
            memory = self._pool.array("moment_arm", (arms.size,))
            batches.append(
                self._tables["moment_arms"].batch(times, columns.vector_columns(arms, self._widths, memory))
            )
        colors = columns.activation_colors(self._history.states(self._rows)["activation"][rows])
        history, frames = self._history, self._frames
        drawn = (
            history.polylines(frames, self._pool),
            history.contacts(frames, self._pool),
            history.arrows(frames, self._force_scale or 1.0, self._pool),
        )
        cells = columns.path_columns(*drawn, colors)
        batches.append(self._tables["paths"].batch(times, cells))
        return batches


def _tables(scene: Scene) -> dict[str, columns.Table]:
    scalars = [path for paths in [*scene.series.values(), *scene.group_series.values()] for path in paths]
    return {
        "scalars": columns.scalar_table(scalars),
        "log": columns.text_table(LOG),
        "poses": columns.pose_table([scene.bodies[body] for body in scene.moving]),
        "joints": columns.scalar_table(list(scene.joints.values())),
        "moment_arms": columns.scalar_table(scene.moment_arms),
        "paths": columns.path_table(scene.paths, scene.contacts, scene.forces),
    }
