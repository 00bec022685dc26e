"""A table over time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mjwrap import html, validation
from mjwrap.errors import TableError

Array = NDArray[np.float64]
SUFFIXES = (".sto", ".mot", ".csv", ".npz")
SHOWN, FEW = 8, 4  # columns, and rows at either end, that a notebook shows


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of numbers over time; `table["name"]` is a column (T,).

    Args:
        time: (T,) increasing times [s].
        names: n different names of the columns.
        values: (T, n) numbers.
        metadata: entries of the header of a .sto or .mot file.
        source: the file from which the table was read.

    Raises:
        TableError: shapes differ, times do not increase, or names are not unique.
    """

    time: Array
    names: tuple[str, ...]
    values: Array
    metadata: Mapping[str, str] = field(default_factory=dict)
    source: str = ""

    def __post_init__(self) -> None:
        validation.instance(self.source, str, "source", TableError, "the name of a file, as str")
        validation.instance(self.metadata, Mapping, "metadata", TableError, "a dict of texts by key")
        where = f"'{self.source}': " if self.source else ""
        time = validation.numbers(self.time, f"{where}time", TableError)
        values = validation.numbers(self.values, f"{where}values", TableError)
        names = _names(self.names, where)
        if time.ndim != 1 or values.shape != (len(time), len(names)):
            raise TableError(
                f"{where}time, names, values: times of shape {time.shape} and {len(names)} names do not fit "
                f"values of shape {values.shape}"
            )
        check_names(names, where)
        late = np.flatnonzero(~(np.diff(time) > 0.0))
        if not np.isfinite(time).all() or late.size:
            k = int(late[0]) + 1 if late.size else int(np.flatnonzero(~np.isfinite(time))[0])
            raise TableError(
                f"{where}times must be finite and increase; time {time[k]:g} in row {k + 1} does not"
            )
        for name, value in (("time", time), ("names", names), ("values", values)):
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        rows = f"{len(self.time)} row{'s' * (len(self.time) != 1)}"
        span = f" from {self.time[0]:g} to {self.time[-1]:g} s" if len(self.time) else ""
        names = ", ".join(self.names[:6]) + ", ..." * (len(self.names) > 6)
        source = f", {self.source!r}" if self.source else ""
        return f"Table({rows}{span}, {len(self.names)} column{'s' * (len(self.names) != 1)}: {names}{source})"

    def _repr_html_(self) -> str:
        """Return the table as a notebook shows it: its first and last rows and its first columns."""
        names = self.names[:SHOWN]
        some = len(self.time) > 2 * FEW
        picked = (
            [*range(FEW), *range(len(self.time) - FEW, len(self.time))] if some else range(len(self.time))
        )
        rows = [[f"{self.time[k]:g}", *(f"{x:.6g}" for x in self.values[k, : len(names)])] for k in picked]
        if some:
            rows.insert(FEW, ["..."] * (len(names) + 1))
        return html.table(
            ["time [s]", *names, *(["..."] if len(self.names) > SHOWN else [])], rows, repr(self)
        )

    def __getitem__(self, name: str) -> Array:
        if name not in self.names:
            where = f"'{self.source}' has " if self.source else ""
            raise TableError(f"{where}no column '{name}'; columns: {', '.join(self.names) or 'none'}")
        return self.values[:, self.names.index(name)]

    @property
    def in_degrees(self) -> bool:
        """Whether the header says that rotations are in degrees."""
        return self.metadata.get("inDegrees", "no").strip().lower() in ("yes", "true", "1")


def _names(given: object, where: str) -> tuple[str, ...]:
    """Return names of columns as a tuple; `TableError` if they are not a list of texts."""
    names = None if isinstance(given, str | bytes) or not isinstance(given, Iterable) else tuple(given)
    good = names is not None and all(isinstance(name, str) for name in names)
    validation.require(good, f"{where}names", "a tuple of texts, one for each column", given, TableError)
    return names or ()


def check_names(names: Sequence[str], where: str = "") -> None:
    """Raise `TableError` if names of columns are empty or repeated."""
    double = sorted({name for name in names if names.count(name) > 1})
    if double or "" in names:
        which = ", ".join(name for name in double if name) or "the empty names"
        raise TableError(f"{where}every column must have a name that no other has; check {which}")
