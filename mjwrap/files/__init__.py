"""Tables over time and their files: OpenSim's .sto and .mot, CSV and NPZ."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mjwrap.files.reading import read_table
    from mjwrap.files.table import SUFFIXES, Table
    from mjwrap.files.writing import RowWriter, write_table

__all__ = ["SUFFIXES", "RowWriter", "Table", "read_table", "write_table"]

_HOMES = {
    "SUFFIXES": "table", "RowWriter": "writing", "Table": "table", "read_table": "reading", "write_table": "writing",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """Load a name when it is first used, so that importing `files.atomic` does not import NumPy."""
    if name not in _HOMES:
        raise AttributeError(f"module 'mjwrap.files' has no attribute {name!r}; it has: {', '.join(__all__)}")
    value = getattr(importlib.import_module(f"mjwrap.files.{_HOMES[name]}"), name)
    globals()[name] = value
    return value
