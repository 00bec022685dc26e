"""Read tables over time, with errors that name the place in the file."""

from __future__ import annotations

import csv
import io
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
from mjwrap.errors import TableError
from mjwrap.files.atomic import as_path
from mjwrap.files.table import SUFFIXES, Table, check_names

Row = tuple[int, list[str]]  # line number, cells


def read_table(path: str | os.PathLike[str], *, finite: bool = True) -> Table:
    """Read a table over time: OpenSim's .sto or .mot, .npz, else comma-separated values.

    finite: refuse numbers that are not finite. A CSV file has a header with `time` [s] and names, before which lines
    such as `# inDegrees=yes` may stand; an NPZ file has
    `time` (T,), and either `columns` and `values`, as from `write_table`, or an array (T,) for each column, or (T, k)
    for columns called name[0] to name[k − 1]. Numbers are returned as in the file: `Table.in_degrees` tells whether
    rotations are in degrees. Raises `TableError`, which names file, line and column of the first error.
    """
    name = as_path(path, TableError)
    validation.flag(finite, "finite", TableError)
    if name.lower().endswith(".osim"):
        raise TableError(
            f"'{name}' is a model of OpenSim, not a table: mjwrap import reads it; tables end in {', '.join(SUFFIXES)}"
        )
    suffix = Path(name).suffix.lower()
    if suffix == ".npz":
        table = _read_npz(name)
        if finite and not np.isfinite(table.values).all():
            k, column = (int(x[0]) for x in np.nonzero(~np.isfinite(table.values)))
            raise TableError(f"'{name}' row {k + 1}, column '{table.names[column]}': not finite")
        return table
    text = read_text(name)
    return _read_opensim(name, text, finite) if suffix in (".sto", ".mot") else _read_csv(name, text, finite)


def read_text(name: str) -> str:
    try:
        return Path(name).read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise TableError(f"cannot read '{name}': {(error.strerror or str(error)).lower()}") from None
    except UnicodeDecodeError:
        raise TableError(f"'{name}' is not a text file; tables end in {', '.join(SUFFIXES)}") from None


def _read_csv(name: str, text: str, finite: bool) -> Table:
    try:
        numbered = enumerate(csv.reader(io.StringIO(text, newline="")), 1)
        rows = [row for row in numbered if any(cell.strip() for cell in row[1])]
    except csv.Error:
        raise TableError(f"'{name}' is not a text file with comma-separated values") from None
    first = next((i for i, (_, cells) in enumerate(rows) if not cells[0].lstrip().startswith("#")), len(rows))
    metadata = header_entries([",".join(cells).strip().lstrip("#") for _, cells in rows[:first]])
    rows = rows[first:]
    if not rows:
        raise TableError(f"'{name}' is empty; wanted: a header with 'time' and names, then rows of numbers")
    return _table(name, [cell.strip() for cell in rows[0][1]], rows[1:], metadata, finite)


def _read_opensim(name: str, text: str, finite: bool) -> Table:
    """Read a .sto or .mot file: a header up to `endheader`, a line of names, rows; version 1, 3, or SIMM's."""
    lines = text.splitlines()
    end = next((i for i, line in enumerate(lines) if line.strip().lower() == "endheader"), None)
    if end is None:
        raise TableError(f"'{name}' has no line 'endheader', which must end the header of OpenSim's files")
    metadata = header_entries(lines[:end])
    kind = metadata.get("DataType", "double")
    if kind.lower() != "double":
        raise TableError(f"'{name}' has {kind} in its cells; only DataType=double can be read")
    rest = [(i, line) for i, line in enumerate(lines[end + 1 :], end + 2) if line.strip()]
    if not rest:
        raise TableError(f"'{name}' has no line of names after 'endheader'")
    first = rest[0][1]
    header = [cell.strip() for cell in (first.rstrip("\t").split("\t") if "\t" in first else first.split())]
    table = _table(name, header, [(i, line.split()) for i, line in rest[1:]], metadata, finite)
    for keys, found in ((("nRows", "datarows"), len(table.time)), (("nColumns", "datacolumns"), len(header))):
        said = next((metadata[key] for key in keys if key in metadata), str(found))
        if not said.isdecimal() or int(said) != found:
            raise TableError(
                f"'{name}': its header says {keys[0]}={said}, but there are {found}: is it cut short?"
            )
    return table


def header_entries(lines: list[str]) -> dict[str, str]:
    """Return the entries of a header: "key=value", SIMM's "key value", and the first line as the name."""
    found: dict[str, str] = {}
    for line in lines:
        key, equals, value = (part.strip() for part in line.partition("="))
        if equals:
            found[key] = value
        elif line.split()[:1] and line.split()[0] in ("datacolumns", "datarows", "range"):
            key, _, value = line.strip().partition(" ")
            found[key] = value.strip()
        elif key and not found:
            found["header"] = key
    return found


def _table(name: str, header: list[str], rows: list[Row], metadata: dict[str, str], finite: bool) -> Table:
    places = [i for i, cell in enumerate(header) if cell.lower() == "time"]
    if not places:
        raise TableError(f"'{name}' has no column 'time' [s]; its columns: {', '.join(header)}")
    check_names(header, f"'{name}': ")
    if not rows:
        raise TableError(f"'{name}' has a header but no rows")
    numbers = np.array([_numbers(name, line, header, cells, finite) for line, cells in rows])
    time = numbers[:, places[0]]
    for k in np.flatnonzero(~(np.diff(time) > 0.0)):
        line = rows[int(k) + 1][0]
        raise TableError(f"'{name}' line {line}: time {time[k + 1]:g} does not come after {time[k]:g}")
    names = tuple(cell for i, cell in enumerate(header) if i != places[0])
    return Table(time.copy(), names, np.delete(numbers, places[0], axis=1), metadata, name)


def _numbers(name: str, line: int, header: list[str], row: list[str], finite: bool) -> list[float]:
    if len(row) != len(header):
        raise TableError(f"'{name}' line {line}: {len(row)} cells where the header has {len(header)}")
    values = []
    for column, cell in zip(header, row, strict=True):
        try:
            value = float(cell)
        except ValueError:
            raise TableError(
                f"'{name}' line {line}, column '{column}': {cell.strip()!r} is not a number"
            ) from None
        if not math.isfinite(value) and (finite or column.lower() == "time"):
            raise TableError(f"'{name}' line {line}, column '{column}': {cell.strip()} is not finite")
        values.append(value)
    return values


def _read_npz(name: str) -> Table:
    try:
        whole = io.BytesIO(Path(name).read_bytes())  # NumPy leaves a damaged file open
        with np.load(whole, allow_pickle=False) as file:
            arrays = {key: file[key] for key in file.files}
    except OSError as error:
        raise TableError(f"cannot read '{name}': {(error.strerror or str(error)).lower()}") from None
    except Exception as error:  # zipfile, zlib and numpy raise some dozen kinds for a damaged file
        why = str(error) or type(error).__name__
        raise TableError(f"'{name}' is damaged, or not an NPZ file of plain arrays: {why}") from None
    if "time" not in arrays:
        raise TableError(f"'{name}' has no array 'time' [s]; its arrays: {', '.join(arrays) or 'none'}")
    time = _numeric(name, "time", arrays.pop("time"), (None,))
    if not time.size:
        raise TableError(f"'{name}': array 'time' is empty")
    metadata = {key[9:]: str(arrays.pop(key)) for key in list(arrays) if key.startswith("metadata.")}
    if {"columns", "values"} <= arrays.keys():
        names = [str(cell) for cell in arrays["columns"].ravel()]
        values = _numeric(name, "values", arrays["values"], (len(time), len(names)))
    else:
        names, columns = [], []
        for key, array in arrays.items():
            numbers = _numeric(name, key, array, (len(time), None)[: max(array.ndim, 1)])
            names += [key] if array.ndim == 1 else [f"{key}[{i}]" for i in range(array.shape[1])]
            columns.append(numbers.reshape(len(time), -1))
        values = np.hstack(columns) if columns else np.empty((time.shape[0], 0))
    return Table(time, tuple(names), values, metadata, name)


def _numeric(name: str, key: str, array: NDArray[Any], shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    """Return an array of a file as numbers, if it has a shape, in which None is any length."""
    fits = len(array.shape) == len(shape) and all(
        wanted in (None, n) for n, wanted in zip(array.shape, shape, strict=True)
    )
    if not fits or array.dtype.kind not in "fiub":
        wanted = " x ".join("any" if n is None else str(n) for n in shape)
        raise TableError(
            f"'{name}': array '{key}' is {array.dtype} of shape {array.shape}; wanted: numbers, {wanted}"
        )
    return array.astype(np.float64)
