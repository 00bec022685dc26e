"""Motions of a model that satisfy its equalities and move its coordinates least."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf.coordinate_functions import read_axis_joints, read_coordinate_functions
from mjwrap.mjcf.couplings import CoupledJoints

Array = NDArray[np.float64]
RANK = 1e-10  # smallest singular value that counts, as a share of the largest


def least_motion(rows: Array, wanted: Array, rates: Array) -> Array:
    """Return x (n,) with rows (m, n) x = wanted (m,), by least squares if need be, for which |rates x| is least.

    rates (c, n) may have any rank; what moves no coordinate is free.
    """
    u, sizes, vt = np.linalg.svd(rows)
    rank = int(np.count_nonzero(sizes > RANK * sizes[0])) if sizes.size else 0
    particular = vt[:rank].T @ ((u[:, :rank].T @ wanted) / sizes[:rank])
    free = vt[rank:].T
    if not free.shape[1]:
        return particular
    along, *_ = np.linalg.lstsq(rates @ free, -(rates @ particular), rcond=RANK)
    return particular + free @ along


class CoordinateRates:
    """The rates of a model's coordinates as linear functions of qvel.

    Every degree of freedom is a coordinate, except those of joints that are axes only, and of joints that follow
    several others; the coordinates that tuples declare as functions are added.
    """

    def __init__(self, model: mujoco.MjModel, couplings: CoupledJoints) -> None:
        self._model = model
        self.functions = read_coordinate_functions(model)
        several = {joint for joint, each in couplings.couplings.items() if len(each.leaders) > 1}
        left = read_axis_joints(model) | several
        self._dofs = np.array([d for d in range(model.nv) if int(model.dof_jntid[d]) not in left], dtype=int)

    def matrix(self, qpos: Array) -> Array:
        """Return the rates (c, nv) of all coordinates at a pose."""
        model = self._model
        found = np.zeros((len(self._dofs) + len(self.functions), model.nv))
        found[np.arange(len(self._dofs)), self._dofs] = 1.0
        for k, name in enumerate(self.functions):
            found[len(self._dofs) + k] = self.row(name, qpos)
        return found

    def row(self, name: str, qpos: Array) -> Array:
        """Return the rate (nv,) of a coordinate that a tuple declares."""
        function, found = self.functions[name], np.zeros(self._model.nv)
        position = float(qpos[self._model.jnt_qposadr[function.joint]])
        found[self._model.jnt_dofadr[function.joint]] = function.rate(position)
        return found
