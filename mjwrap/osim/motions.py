"""Motions of an imported model as tables that OpenSim replays."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mjwrap import validation
from mjwrap.errors import StateError
from mjwrap.files.atomic import PartFile
from mjwrap.files.table import Table
from mjwrap.files.writing import RowWriter
from mjwrap.osim.coordinates import coordinates

_HEADER = {"header": "Coordinates", "inDegrees": "no"}


class MotionFile:
    """Write the coordinates of every sample of a run to a .mot or .sto file, as `motion_table` does."""

    def __init__(self, output: PartFile, model: mujoco.MjModel) -> None:
        self._output, self._model = output, model
        self._names = list(coordinates(model, mujoco.MjData(model)))
        with output.writing():
            self._writer = RowWriter(output.open_text(), output.path.suffix, self._names, _HEADER)

    def log(self, data: mujoco.MjData) -> None:
        """Write the present coordinates."""
        values = coordinates(self._model, data)
        with self._output.writing():
            self._writer.add(data.time, [values[name] for name in self._names])

    def close(self) -> None:
        """Complete the file and give it its name."""
        with self._output.writing():
            self._writer.finish()
        self._output.publish()


def motion_table(model: mujoco.MjModel, time: ArrayLike, qpos: ArrayLike) -> Table:
    """Return a motion as a table with a column for every coordinate, named as in OpenSim, angles in rad.

    `mw.write_table("motion.mot", table)` writes it as a motion that OpenSim loads, or as .sto. Coordinates that follow
    others have columns, too; joints that an import added for the axes of a joint are columns that OpenSim does not use.

    Args:
        model: an imported model.
        time: (T,) times [s], ascending.
        qpos: (T, nq) positions.

    Returns:
        The table; its header says inDegrees=no.

    Raises:
        StateError: the arrays do not fit the model, or are not finite.
    """
    validation.of_type(model, "MjModel", "model", StateError)
    times, poses = np.asarray(time, dtype=np.float64), np.asarray(qpos, dtype=np.float64)
    if times.ndim != 1 or poses.shape != (len(times), model.nq):
        raise StateError(f"time must be (T,) and qpos (T, {model.nq}), not {times.shape} and {poses.shape}")
    if not (np.isfinite(times).all() and np.isfinite(poses).all()):
        raise StateError("time and qpos must be finite numbers")
    data = mujoco.MjData(model)
    rows = []
    for pose in poses:
        data.qpos[:] = pose
        rows.append(coordinates(model, data))
    names = list(coordinates(model, data))
    values = np.array([[row[name] for name in names] for row in rows]).reshape(len(times), len(names))
    return Table(times, tuple(names), values, _HEADER)
