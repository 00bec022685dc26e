"""Columns of a recording: NumPy rows are collected during the run and converted to Arrow columns in batches."""

from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import rerun as rr
from rerun.components import LineStrip3DBatch, Position3DBatch

TIMELINE = "sim_time"

_TIME = pa.duration("ns")
_VEC3 = Position3DBatch._ARROW_DATATYPE
_VECTOR = rr.components.Vector3DBatch._ARROW_DATATYPE
_STRIP = LineStrip3DBatch._ARROW_DATATYPE
_QUAT = rr.components.RotationQuatBatch._ARROW_DATATYPE

_BLUE = np.array([40.0, 80.0, 230.0])
_RED = np.array([230.0, 30.0, 30.0])
_SHADES = 4096  # steps of the colour scale, many more than a channel of eight bits can show

Array = npt.NDArray[Any]


def activation_colors(activation: npt.ArrayLike) -> npt.NDArray[np.uint32]:
    """Return colours 0xRRGGBBAA of activations (n,): from blue at 0 to red at 1, linear between, clipped outside."""
    share = np.clip(np.asarray(activation, dtype=np.float64), 0.0, 1.0)
    return _palette()[np.rint(share * _SHADES).astype(np.intp)]


@cache
def _palette() -> npt.NDArray[np.uint32]:
    share = np.linspace(0.0, 1.0, _SHADES + 1)[:, np.newaxis]
    red, green, blue = np.rint(_BLUE + share * (_RED - _BLUE)).astype(np.uint32).T
    return red << 24 | green << 16 | blue << 8 | 0xFF


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
    """Return a table with one or more float64 per row for each entity."""
    return Table((entity, rr.Scalars.descriptor_scalars(), pa.float64()) for entity in entities)


def scalar_columns(values: Array, memory: Array) -> list[pa.Array]:
    """Convert values (T, m) to m columns of T rows; memory (m, T): for the result."""
    rows, columns = values.shape
    memory[:] = values.T
    # one array contains all columns, one after the other; a column is a slice of it, which costs almost nothing
    whole = pa.ListArray.from_arrays(_one_each(rows * columns), pa.array(memory.ravel()))
    return [whole.slice(i * rows, rows) for i in range(columns)]


def vector_columns(values: Array, widths: Sequence[int], memory: Array) -> list[pa.Array]:
    """Convert values (T, K) to a column of T rows for each width (values per row); memory (T K,): for the result."""
    rows, columns, start = len(values), [], 0
    for width in widths:
        part = memory[rows * start : rows * (start + width)]
        part.reshape(rows, width)[:] = values[:, start : start + width]
        columns.append(pa.ListArray.from_arrays(_one_each(rows, width), pa.array(part)))
        start += width
    return columns


def text_table(entity: str) -> Table:
    """Return a table with a line of text and its level per row."""
    text, level = rr.TextLog.descriptor_text(), rr.TextLog.descriptor_level()
    return Table([(entity, text, pa.string()), (entity, level, pa.string())])


def text_columns(lines: Sequence[str], levels: Sequence[str]) -> list[pa.Array]:
    """Convert lines of text and their levels to two columns."""
    offsets = _one_each(len(lines))
    return [pa.ListArray.from_arrays(offsets, pa.array(each, pa.string())) for each in (lines, levels)]


def pose_table(entities: Sequence[str]) -> Table:
    """Return a table with a translation and a rotation per row for each entity."""
    rows = []
    for entity in entities:
        rows.append((entity, rr.Transform3D.descriptor_translation(), _VEC3))
        rows.append((entity, rr.Transform3D.descriptor_quaternion(), _QUAT))
    return Table(rows)


def pose_columns(positions: Array, quaternions: Array) -> list[pa.Array]:
    """Convert positions (T, m, 3) [m] and quaternions (T, m, 4) w-x-y-z to 2 m columns of T rows."""
    rows, bodies = positions.shape[:2]
    offsets = _one_each(rows * bodies)
    turned = quaternions[..., [1, 2, 3, 0]].swapaxes(0, 1)
    whole = (
        pa.ListArray.from_arrays(offsets, _fixed(positions.swapaxes(0, 1), _VEC3)),
        pa.ListArray.from_arrays(offsets, _fixed(turned, _QUAT)),
    )
    return [array.slice(i * rows, rows) for i in range(bodies) for array in whole]


def path_table(paths: Sequence[str], contacts: Sequence[str], forces: Sequence[str]) -> Table:
    """Return a table with a line strip, its colour, a set of points and a set of arrows per row for each muscle."""
    rows = []
    for path, contact, force in zip(paths, contacts, forces, strict=True):
        rows.append((path, rr.LineStrips3D.descriptor_strips(), _STRIP))
        rows.append((path, rr.LineStrips3D.descriptor_colors(), pa.uint32()))
        rows.append((contact, rr.Points3D.descriptor_positions(), _VEC3))
        rows.append((force, rr.Arrows3D.descriptor_origins(), _VEC3))
        rows.append((force, rr.Arrows3D.descriptor_vectors(), _VECTOR))
    return Table(rows)


def path_columns(
    paths: tuple[Array, Array, Array],
    contacts: tuple[Array, Array],
    arrows: tuple[Array, Array, Array],
    colors: Array,
) -> list[pa.Array]:
    """Convert polylines, contact points and arrows of n muscles over T frames, as from `History`; colours (T, n).

    Returns 5 n columns of T rows. If no path of a muscle was found yet in a frame, its row is empty.
    """
    frames, n = colors.shape
    (points, sizes, strips), (touches, numbers), (tails, vectors, shafts) = paths, contacts, arrows
    force = _offsets(shafts.ravel())
    lines = pa.ListArray.from_arrays(_offsets(sizes), _fixed(points, _VEC3), type=_STRIP)
    whole = (
        pa.ListArray.from_arrays(_offsets(strips.ravel()), lines),
        pa.ListArray.from_arrays(_one_each(n * frames), pa.array(np.ascontiguousarray(colors.T).ravel())),
        pa.ListArray.from_arrays(_offsets(numbers.ravel()), _fixed(touches, _VEC3)),
        pa.ListArray.from_arrays(force, _fixed(tails, _VEC3)),
        pa.ListArray.from_arrays(force, _fixed(vectors, _VECTOR)),
    )
    return [array.slice(i * frames, frames) for i in range(n) for array in whole]


def _one_each(rows: int, width: int = 1) -> pa.Array:
    return pa.array(np.arange(0, width * rows + 1, width, dtype=np.int32))


def _offsets(counts: Array) -> pa.Array:
    return pa.array(np.concatenate([[0], np.cumsum(counts)]).astype(np.int32))


def _fixed(values: Array, datatype: pa.DataType) -> pa.Array:
    flat = pa.array(np.ascontiguousarray(values, dtype=np.float32).ravel())
    return pa.FixedSizeListArray.from_arrays(flat, type=datatype)
