"""Columns of a recording: NumPy rows gathered during the run, turned into Arrow columns a few hundred at once."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import rerun as rr
from rerun.components import LineStrip3DBatch, Position3DBatch

TIMELINE = "sim_time"
QUANTITIES = ("length", "velocity", "tension", "activation")

_TIME = pa.duration("ns")
_VEC3 = Position3DBatch._ARROW_DATATYPE
_STRIP = LineStrip3DBatch._ARROW_DATATYPE
_QUAT = rr.components.RotationQuatBatch._ARROW_DATATYPE

_BLUE = np.array([40.0, 80.0, 230.0])
_RED = np.array([230.0, 30.0, 30.0])

Array = npt.NDArray[Any]


def activation_colors(activation: npt.ArrayLike) -> npt.NDArray[np.uint32]:
    """Colours 0xRRGGBBAA of activations (n,): blue at 0, red at 1, straight between, clipped outside."""
    share = np.clip(np.asarray(activation, dtype=np.float64), 0.0, 1.0)[..., np.newaxis]
    rgb = np.rint(_BLUE + share * (_RED - _BLUE)).astype(np.uint32)
    return (rgb[..., 0] << 24 | rgb[..., 1] << 16 | rgb[..., 2] << 8 | 0xFF).astype(np.uint32)


class Table:
    """Columns that share one time column: the fixed part of every record batch of one kind.

    Columns are (entity path, component descriptor, Arrow type of one row); rerun splits a batch into one chunk
    per entity.
    """

    def __init__(self, columns: Iterable[tuple[str, rr.ComponentDescriptor, pa.DataType]]) -> None:
        time = pa.field(TIMELINE, _TIME, metadata={"rerun:kind": "index", "rerun:index_name": TIMELINE})
        self._schema = pa.schema([time, *(_field(*column) for column in columns)])

    def batch(self, times: Array, columns: Sequence[pa.Array]) -> pa.RecordBatch:
        """Join times (T,) [s] and one Arrow array of T rows per column."""
        nanoseconds = np.rint(times * 1e9).astype("timedelta64[ns]")
        return pa.RecordBatch.from_arrays([pa.array(nanoseconds, _TIME), *columns], schema=self._schema)


def _field(entity: str, component: rr.ComponentDescriptor, datatype: pa.DataType) -> pa.Field:
    metadata = {
        "rerun:kind": "data",
        "rerun:entity_path": entity,
        "rerun:archetype": component.archetype or "",
        "rerun:component": component.component,
        "rerun:component_type": component.component_type or "",
    }
    return pa.field(f"{entity}:{component.component}", pa.list_(datatype), metadata=metadata)


def scalar_table(entities: Sequence[str]) -> Table:
    """One float64 a row for each entity."""
    return Table((entity, rr.Scalars.descriptor_scalars(), pa.float64()) for entity in entities)


def scalar_columns(values: Array) -> list[pa.Array]:
    """Values (T, m) as m columns of T rows."""
    offsets = _one_each(len(values))
    return [pa.ListArray.from_arrays(offsets, pa.array(column)) for column in np.ascontiguousarray(values.T)]


def pose_table(entities: Sequence[str]) -> Table:
    """A translation and a rotation a row for each entity."""
    rows = []
    for entity in entities:
        rows.append((entity, rr.Transform3D.descriptor_translation(), _VEC3))
        rows.append((entity, rr.Transform3D.descriptor_quaternion(), _QUAT))
    return Table(rows)


def pose_columns(positions: Array, quaternions: Array) -> list[pa.Array]:
    """Positions (T, m, 3) [m] and quaternions (T, m, 4) w-x-y-z as 2 m columns of T rows."""
    offsets = _one_each(len(positions))
    columns = []
    for position, quaternion in zip(positions.swapaxes(0, 1), quaternions.swapaxes(0, 1), strict=True):
        columns.append(pa.ListArray.from_arrays(offsets, _fixed(position, _VEC3)))
        columns.append(pa.ListArray.from_arrays(offsets, _fixed(quaternion[:, [1, 2, 3, 0]], _QUAT)))
    return columns


def path_table(paths: Sequence[str], contacts: Sequence[str]) -> Table:
    """A line strip, its colour and a set of points a row for each muscle."""
    rows = []
    for path, contact in zip(paths, contacts, strict=True):
        rows.append((path, rr.LineStrips3D.descriptor_strips(), _STRIP))
        rows.append((path, rr.LineStrips3D.descriptor_colors(), pa.uint32()))
        rows.append((contact, rr.Points3D.descriptor_positions(), _VEC3))
    return Table(rows)


def path_columns(paths: "Ragged", contacts: "Ragged", colors: npt.NDArray[np.uint32]) -> list[pa.Array]:
    """Polylines and contact points of n muscles over T frames, and colours (T, n), as 3 n columns of T rows.

    A muscle that has no path in a frame, because none was found yet, has an empty row there.
    """
    frames, n = colors.shape
    points, counts = paths.by_muscle(frames)
    drawn = counts > 0
    strips = pa.ListArray.from_arrays(_offsets(counts[drawn]), _fixed(points, _VEC3), type=_STRIP)
    touches, numbers = contacts.by_muscle(frames)
    # each array holds all muscles, one after the other; a column is a slice of it, which costs nothing
    whole = (
        pa.ListArray.from_arrays(_offsets(drawn), strips),
        pa.ListArray.from_arrays(_one_each(n * frames), pa.array(np.ascontiguousarray(colors.T).ravel())),
        pa.ListArray.from_arrays(_offsets(numbers), _fixed(touches, _VEC3)),
    )
    return [array.slice(i * frames, frames) for i in range(n) for array in whole]


class Ragged:
    """For every frame, points of every muscle, each with its own number of them."""

    def __init__(self) -> None:
        self._points: list[Array] = []  # (m, 3) a frame, muscle after muscle
        self._starts: list[Array] = []  # (n + 1,) a frame

    def put(self, frame: int, points: Array, starts: Array) -> None:
        """Set the last frame: muscle i has `points[starts[i]:starts[i + 1]]`. What an interrupt left goes."""
        del self._points[frame:], self._starts[frame:]
        self._points.append(points)
        self._starts.append(starts)

    def first(self) -> Array:
        """The points (m, 3) of the first frame, none where there is no frame."""
        return self._points[0] if self._points else np.empty((0, 3))

    def by_muscle(self, frames: int) -> tuple[Array, Array]:
        """All points (m, 3), those of a muscle in a row, frame after frame, and how many each has (n frames,)."""
        starts = np.stack(self._starts[:frames])  # (T, n + 1)
        counts = np.diff(starts, axis=1).T.ravel()
        before = np.concatenate([[0], np.cumsum(starts[:-1, -1])])  # points of earlier frames
        blocks = (
            starts[:, :-1] + before[:, np.newaxis]
        ).T.ravel()  # where each muscle's points of a frame begin
        ends = np.cumsum(counts)
        order = np.arange(counts.sum()) + np.repeat(blocks - ends + counts, counts)
        points = np.concatenate(self._points[:frames], dtype=np.float32)
        return points.take(order.astype(np.intp), axis=0), counts


def _one_each(rows: int) -> pa.Array:
    return pa.array(np.arange(rows + 1, dtype=np.int32))


def _offsets(counts: Array) -> pa.Array:
    return pa.array(np.concatenate([[0], np.cumsum(counts)]).astype(np.int32))


def _fixed(values: Array, datatype: pa.DataType) -> pa.Array:
    flat = pa.array(np.ascontiguousarray(values, dtype=np.float32).ravel())
    return pa.FixedSizeListArray.from_arrays(flat, type=datatype)
