"""Read OpenSim's ExternalLoads: an .xml file that names a table, and columns in it."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
from mjwrap.errors import OsimError, SignalError, TableError
from mjwrap.files import Table, read_table
from mjwrap.files.atomic import as_path
from mjwrap.inverse.external_force import INTERPOLATIONS, ExternalForce
from mjwrap.osim.reading.document import read_document
from mjwrap.osim.reading.nodes import Node

_UNASSIGNED = ("", "Unassigned")


def read_external_loads(
    path: str | os.PathLike[str], table: Table | None, interpolation: str
) -> list[ExternalForce]:
    """Return the external forces of a file that are not switched off; see `ExternalLoads.from_osim`."""
    file = Path(as_path(path, OsimError))
    validation.optional(table, Table, "table", TableError, "a Table, as from mw.read_table")
    validation.choice(interpolation, INTERPOLATIONS, "interpolation", SignalError)
    root = read_document(file)
    loads = next((node for node in root.walk() if node.tag == "ExternalLoads"), None)
    if loads is None:
        raise OsimError(f"{file}: has no <ExternalLoads>")
    if table is None:
        named = loads.string("datafile", default="")
        if named in _UNASSIGNED:
            raise loads.error("<datafile> is missing or empty; add it, or give the data as a table")
        table = read_table(file.parent / named)
    forces = [node for node in loads.objects("objects") if node.tag == "ExternalForce"]
    return [_force(node, table, interpolation) for node in forces if _acts(node)]


def _acts(node: Node) -> bool:
    return node.flag("appliesForce", default=True) and not node.flag("isDisabled", default=False)


def _force(node: Node, table: Table, interpolation: str) -> ExternalForce:
    body = _assigned(node, "applied_to_body")
    if not body:
        raise node.error("<applied_to_body> is missing or empty")
    force, point, torque = (
        _vector(node, tag, table) for tag in ("force_identifier", "point_identifier", "torque_identifier")
    )
    if force is None and torque is None:
        raise node.error("names neither a <force_identifier> nor a <torque_identifier>")
    return ExternalForce(
        body=_last(body),
        time=table.time,
        force=force,
        point=point,
        torque=torque,
        force_frame=_last(_assigned(node, "force_expressed_in_body") or "ground"),
        point_frame=_last(_assigned(node, "point_expressed_in_body") or "ground"),
        name=node.name,
        interpolation=interpolation,
    )


def _assigned(node: Node, tag: str) -> str:
    text = node.string(tag, default="")
    return "" if text in _UNASSIGNED else text


def _last(path: str) -> str:
    return path.rpartition("/")[2]


def _vector(node: Node, tag: str, table: Table) -> NDArray[np.float64] | None:
    """Return the three columns (S, 3) whose names begin with an identifier, None where there is none."""
    identifier = _assigned(node, tag)
    if not identifier:
        return None
    columns = [name for name in table.names if name.startswith(identifier)]
    if len(columns) != 3:
        found = f"{', '.join(columns)} do" if columns else "no column does"
        raise TableError(
            f"'{table.source}': <{tag}> '{identifier}' of external force '{node.name}' must be the beginning of the "
            f"names of three columns; {found}; columns: {', '.join(table.names)}"
        )
    return np.column_stack([table[name] for name in columns])
