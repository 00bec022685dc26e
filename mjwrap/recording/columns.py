"""Columns of a recording: NumPy rows gathered during the run, turned into Arrow columns a few hundred at once."""

from collections.abc import Iterable, Iterator, Sequence
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
    frames, columns = len(colors), []
    for (points, counts), (touch, touches), color in zip(
        paths.by_muscle(frames), contacts.by_muscle(frames), np.ascontiguousarray(colors.T), strict=True
    ):
        strips = pa.ListArray.from_arrays(_offsets(counts[counts > 0]), _fixed(points, _VEC3), type=_STRIP)
        columns.append(pa.ListArray.from_arrays(_offsets(counts > 0), strips))
        columns.append(pa.ListArray.from_arrays(_one_each(len(color)), pa.array(color)))
        columns.append(pa.ListArray.from_arrays(_offsets(touches), _fixed(touch, _VEC3)))
    return columns


class Ragged:
    """For every frame, points of every muscle, each with its own number of them."""

    def __init__(self) -> None:
        self._points: list[Array] = []  # (m, 3) a frame, muscle after muscle
        self._starts: list[Array] = []  # (n + 1,) a frame

    def put(self, frame: int, points: Array, starts: Array) -> None:
        """Set the last frame: muscle i has `points[starts[i]:starts[i + 1]]`. What an interrupt left goes."""
        del self._points[frame:], self._starts[frame:]
        self._points.append(np.array(points, dtype=np.float32))
        self._starts.append(np.array(starts, dtype=np.int64))

    def first(self) -> Array:
        """The points (m, 3) of the first frame, none where there is no frame."""
        return self._points[0] if self._points else np.empty((0, 3), dtype=np.float32)

    def by_muscle(self, frames: int) -> Iterator[tuple[Array, Array]]:
        """For every muscle its points of all frames in a row (m, 3), and how many there are a frame (T,)."""
        counts = np.diff(np.stack(self._starts[:frames]), axis=1)  # (T, n)
        points = np.concatenate(self._points[:frames])
        owner = np.repeat(np.tile(np.arange(counts.shape[1]), len(counts)), counts.ravel())
        points = points[np.argsort(owner, kind="stable")]
        ends = np.cumsum(counts.sum(axis=0))
        for i, end in enumerate(ends):
            yield points[end - counts[:, i].sum() : end], counts[:, i]


def _one_each(rows: int) -> pa.Array:
    return pa.array(np.arange(rows + 1, dtype=np.int32))


def _offsets(counts: Array) -> pa.Array:
    return pa.array(np.concatenate([[0], np.cumsum(counts)]).astype(np.int32))


def _fixed(values: Array, datatype: pa.DataType) -> pa.Array:
    flat = pa.array(np.ascontiguousarray(values, dtype=np.float32).ravel())
    return pa.FixedSizeListArray.from_arrays(flat, type=datatype)
