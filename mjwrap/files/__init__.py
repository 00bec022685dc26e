"""Tables over time and their files: OpenSim's .sto and .mot, CSV and NPZ."""

from mjwrap.files.reading import read_table
from mjwrap.files.table import SUFFIXES, Table
from mjwrap.files.writing import RowWriter, write_table

__all__ = ["SUFFIXES", "RowWriter", "Table", "read_table", "write_table"]
