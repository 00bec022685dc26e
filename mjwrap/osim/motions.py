"""Motions of an imported model as tables that OpenSim replays."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mjwrap import validation
from mjwrap.errors import StateError
from mjwrap.files.table import Table
from mjwrap.osim.coordinates import coordinates


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
    return Table(times, tuple(names), values, {"header": "Coordinates", "inDegrees": "no"})
