"""Tables whose first column need not be time: columns of numbers by name, with the units that their heads state."""

from __future__ import annotations

import csv
import io
import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import TableError
from mjwrap.files.reading import header_entries, read_table, read_text
from mjwrap.files.table import check_names

Array = NDArray[np.float64]
# factors to SI units; an empty unit is a plain number
UNITS = {
    "deg": math.pi / 180.0, "degree": math.pi / 180.0, "degrees": math.pi / 180.0, "°": math.pi / 180.0,
    "rad": 1.0, "m": 1.0, "cm": 1e-2, "mm": 1e-3, "m/rad": 1.0, "mm/rad": 1e-3, "cm/rad": 1e-2, "N": 1.0, "kN": 1e3,
    "N m": 1.0, "Nm": 1.0, "-": 1.0, "1": 1.0,
}  # fmt: skip
ANGLES = ("deg", "degree", "degrees", "°", "rad")
_UNIT = re.compile(r"^(?P<name>.*?)\s*[\[(]\s*(?P<unit>[^\[\]()]*?)\s*[\])]$")


@dataclass(frozen=True, eq=False)
class Columns:
    """Columns of numbers; `columns["name"]` is a column (T,), NaN for empty cells.

    names: of the columns, without units; units: by name, where the head states one, as NAME [UNIT] or NAME (UNIT);
    values (T, n); metadata: of the header of a .sto or .mot file; source: the file.
    """

    names: tuple[str, ...]
    units: Mapping[str, str]
    values: Array
    metadata: Mapping[str, str]
    source: str

    def __getitem__(self, name: str) -> Array:
        if name not in self.names:
            raise TableError(f"'{self.source}' has no column '{name}'; columns: {', '.join(self.names)}")
        return self.values[:, self.names.index(name)]

    def stated_angle(self) -> str:
        """Return the unit of rotations that a .sto or .mot file's header states: "deg", "rad" or ""."""
        said = self.metadata.get("inDegrees", "").strip().lower()
        return {"yes": "deg", "true": "deg", "1": "deg", "no": "rad", "false": "rad", "0": "rad"}.get(
            said, ""
        )


def read_columns(path: str | os.PathLike[str]) -> Columns:
    """Read columns of numbers from .csv, .sto, .mot or .npz; no column of time is needed.

    Lines of a .csv file that begin with # are remarks; KEY=VALUE in them, such as inDegrees=no, is metadata. Empty
    cells, "nan" and cells missing at the end of a line of a .csv file are NaN. Raises `TableError`, which names
    file, line and column of the first error.
    """
    name = os.fspath(path)
    suffix = Path(name).suffix.lower()
    if suffix == ".npz":
        table = read_table(name, finite=False)
        values = np.column_stack([table.time, table.values])
        return _columns(name, ["time", *table.names], values, dict(table.metadata))
    text = read_text(name)
    metadata: dict[str, str] = {}
    if suffix in (".sto", ".mot"):
        lines = text.splitlines()
        end = next((i for i, line in enumerate(lines) if line.strip().lower() == "endheader"), None)
        if end is None:
            raise TableError(
                f"'{name}' has no line 'endheader', which must end the header of OpenSim's files"
            )
        metadata = header_entries(lines[:end])
        whole = [
            (i, [cell.strip() for cell in (line.rstrip().split("\t") if "\t" in line else line.split())])
            for i, line in enumerate(lines[end + 1 :], end + 2)
            if line.strip()
        ]
    else:
        try:
            numbered = enumerate(csv.reader(io.StringIO(text, newline="")), 1)
            whole = [(i, [c.strip() for c in row]) for i, row in numbered if any(c.strip() for c in row)]
        except csv.Error:
            raise TableError(f"'{name}' is not a text file with comma-separated values") from None
        remarks = [",".join(row).lstrip("#") for _, row in whole if row[0].startswith("#")]
        metadata = header_entries(remarks)
        whole = [(i, row) for i, row in whole if not row[0].startswith("#")]
    if len(whole) < 2:
        raise TableError(f"'{name}' must have a line of names and rows of numbers")
    header = whole[0][1]
    rows = [_row(name, line, header, cells) for line, cells in whole[1:]]
    return _columns(name, header, np.array(rows), metadata)


def _columns(name: str, header: list[str], values: Array, metadata: Mapping[str, str]) -> Columns:
    names, units = [], {}
    for cell in header:
        found = _UNIT.match(cell)
        bare = found["name"] if found and found["name"] and found["unit"] in UNITS else cell
        names.append(bare)
        if found and bare != cell:
            units[bare] = found["unit"]
    check_names(names, f"'{name}': ")
    return Columns(tuple(names), units, values, metadata, name)


def _row(name: str, line: int, header: list[str], cells: list[str]) -> list[float]:
    if len(cells) > len(header):
        raise TableError(f"'{name}' line {line}: {len(cells)} cells where the header has {len(header)}")
    found = []
    for column, cell in zip(header, cells + [""] * (len(header) - len(cells)), strict=True):
        try:
            found.append(float(cell) if cell else math.nan)
        except ValueError:
            raise TableError(f"'{name}' line {line}, column '{column}': {cell!r} is not a number") from None
    return found
