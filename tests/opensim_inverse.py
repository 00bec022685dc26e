"""What benchmarks/inverse/freeze_inverse.py stored of OpenSim's inverse dynamics, as motions, loads and tables."""

from __future__ import annotations

import functools
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from osim_models import compiled

import mjwrap as mw

DATA = Path(__file__).parent / "data" / "inverse"
Array = np.ndarray


@dataclass(frozen=True)
class Frozen:
    """A model along a motion; `record`: the content of the file."""

    model: mujoco.MjModel
    record: dict[str, Any]

    @property
    def table(self) -> mw.Table:
        """The motion as a table of all coordinates."""
        record = self.record
        return mw.Table(np.array(record["time"]), tuple(record["coordinates"]), np.array(record["values"]))

    @property
    def motion(self) -> mw.Motion:
        """The motion, with the splines of OpenSim's tool."""
        return mw.Motion.from_table(self.model, self.table, ends="natural")

    def loads(self, folder: Path) -> mw.ExternalLoads:
        """Write the file of the loads and its table to a folder; return what is read from them."""
        columns, values = self.record["loads"]["columns"], np.array(self.record["loads"]["values"])
        (folder / "loads.xml").write_text(self.record["loads"]["xml"])
        mw.write_table(folder / "loads.mot", mw.Table(values[:, 0], tuple(columns), values[:, 1:]))
        return mw.ExternalLoads.from_osim(folder / "loads.xml")

    def forces(self, which: str) -> dict[str, Array]:
        """Return OpenSim's generalised forces about free coordinates: a follower's times its slope are its leader's."""
        columns = {name: np.array(column) for name, column in self.record[which].items() if name != "time"}
        coordinates, values = self.record["coordinates"], np.array(self.record["values"])
        free = self.record["free"]
        for follower in (name for name in coordinates if name not in free):
            leader = next(
                name for name in free if name.startswith("knee_angle")
            )  # both models have one coupler: the patella's
            x, y = (values[:, coordinates.index(name)] for name in (leader, follower))
            slope, start = np.polyfit(x, y, 1)
            assert np.abs(slope * x + start - y).max() < 1e-12
            mine = next(name for name in columns if name.startswith(f"{follower}_"))
            columns[f"{leader}_moment"] = columns[f"{leader}_moment"] + slope * columns.pop(mine)
        return columns


@functools.cache
def frozen(name: str) -> Frozen:
    """Return what is stored of a model of the shared folder; the test is skipped where the model is absent."""
    return Frozen(compiled(name), json.loads((DATA / f"{name}.json").read_text()))
