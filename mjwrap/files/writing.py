"""Write tables over time, complete or row by row during a run."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np

from mjwrap import validation
from mjwrap.errors import RecordingError, TableError
from mjwrap.files.atomic import PartFile
from mjwrap.files.table import SUFFIXES, Array, Table, check_names

_DIGITS = 12  # space for the number of rows, which is known at the end


def write_table(path: str | os.PathLike[str], table: Table) -> None:
    """Write a table as OpenSim's .sto or .mot (version 3), .csv or .npz, by the suffix; complete or not at all.

    Numbers are written in full precision. CSV has no metadata. Raises `TableError` if the file cannot be written, or if
    a name is not possible in such a file.
    """
    validation.instance(table, Table, "table", TableError, "a Table (mw.Table, mw.read_table)")
    output: PartFile | None = None
    try:
        output = PartFile(path, *SUFFIXES)
        suffix = output.path.suffix.lower()
        with output.writing():
            if suffix == ".npz":
                save_npz(output.part, table)
            else:
                writer = RowWriter(output.open_text(), suffix, table.names, table.metadata)
                for time, row in zip(table.time.tolist(), table.values.tolist(), strict=True):
                    writer.add(time, row)
                writer.finish()
        output.publish()
    except RecordingError as error:
        raise TableError(str(error)) from None
    finally:
        if output is not None:
            output.discard()


def save_npz(path: Path, table: Table) -> None:
    """Write a table as arrays `time`, `columns` and `values`, and its metadata as `metadata.KEY`."""
    metadata: dict[str, Any] = {f"metadata.{key}": np.array(value) for key, value in table.metadata.items()}
    np.savez_compressed(
        path, time=table.time, columns=np.array(table.names, dtype=str), values=table.values, **metadata
    )


class RowWriter:
    """Write the rows of a .sto, .mot or .csv file one by one, to a text file that can be rewound."""

    def __init__(
        self, file: IO[str], suffix: str, names: Sequence[str], metadata: Mapping[str, str] | None = None
    ) -> None:
        self._file, self._rows, self._place = file, 0, -1
        check_names(["time", *names])
        if suffix.lower() == ".csv":
            self._between = ","
            file.write(",".join(map(_quoted, ("time", *names))) + "\n")
            return
        self._between = "\t"
        for name in names:
            if any(c in name for c in "\t\r\n"):
                raise TableError(
                    f"column {name!r}: in OpenSim's files a name must not contain tabs or line ends"
                )
        given = dict(metadata or {})
        file.write(_line(given.pop("header", "mjwrap")) + "\n")
        for key in ("nRows", "nColumns", "datarows", "datacolumns", "range", "version", "DataType"):
            given.pop(key, None)
        file.write("version=3\nDataType=double\nnRows=")
        self._place = file.tell()
        file.write(f"{0:0{_DIGITS}d}\nnColumns={len(names) + 1}\ninDegrees={given.pop('inDegrees', 'no')}\n")
        file.writelines(f"{_line(key)}={_line(value)}\n" for key, value in given.items())
        file.write("endheader\n" + "\t".join(("time", *names)) + "\n")

    def add(self, time: float, row: Iterable[float] | Array) -> None:
        """Write a row: time [s] and a number for each name, with enough digits to read back the same number."""
        numbers = row.tolist() if isinstance(row, np.ndarray) else row
        self._file.write(self._between.join(map(repr, (float(time), *numbers))) + "\n")
        self._rows += 1

    def finish(self) -> None:
        """Write the number of rows into the header."""
        if self._place >= 0:
            end = self._file.tell()
            self._file.seek(self._place)
            self._file.write(f"{self._rows:0{_DIGITS}d}")
            self._file.seek(end)
        self._file.flush()


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"' if any(c in name for c in ',"\r\n') else name


def _line(text: str) -> str:
    return " ".join(str(text).split())
