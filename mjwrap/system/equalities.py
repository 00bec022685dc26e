"""Errors and Jacobian of a model's equalities that are no couplings of joints, at any pose."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.mjcf.names import name_of
from mjwrap.system.pieces import PieceSwitch

Array = NDArray[np.float64]
_EQUALITY = int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)


class Errors(NamedTuple):
    """Rows of equalities: errors (m,) [m or rad], their Jacobian (m, nv), and the ids (m,) of the equalities."""

    errors: Array
    jacobian: Array
    ids: NDArray[np.int64]

    @property
    def largest(self) -> float:
        """The largest error, 0 without any."""
        return float(np.abs(self.errors).max(initial=0.0))


class Equalities:
    """The equalities of a model, but for those by which joints follow others; computed on data of its own."""

    def __init__(self, model: mujoco.MjModel, couplings: CoupledJoints) -> None:
        self.model = model
        joined = [each for coupling in couplings.couplings.values() for each in coupling.equalities]
        self._others = np.setdiff1d(np.arange(model.neq), joined)
        self._pieces = PieceSwitch(model)
        self._data: mujoco.MjData | None = None

    def active(self, data: mujoco.MjData) -> bool:
        """Return whether any is active in the data."""
        return bool(data.eq_active[self._others].any())

    def at(self, data: mujoco.MjData, qpos: Array, without: Collection[int] = ()) -> Errors:
        """Return the rows of the equalities that are active in `data`, at another pose qpos (nq,).

        without: ids of equalities to leave out. Of the data, eq_active and the poses of mocap bodies are read.
        """
        model = self.model
        if not self.active(data):
            return Errors(np.zeros(0), np.zeros((0, model.nv)), np.zeros(0, dtype=np.int64))
        if self._data is None:
            self._data = mujoco.MjData(model)
        own = self._data
        own.qpos[:], own.eq_active[:] = qpos, data.eq_active
        own.mocap_pos[:], own.mocap_quat[:] = data.mocap_pos, data.mocap_quat
        self._pieces.set(own)
        mujoco.mj_kinematics(model, own)
        mujoco.mj_comPos(model, own)
        mujoco.mj_flex(model, own)
        mujoco.mj_tendon(model, own)
        mujoco.mj_makeConstraint(model, own)
        kept = np.flatnonzero(own.efc_type == _EQUALITY)
        kept = kept[np.isin(own.efc_id[kept], np.setdiff1d(self._others, list(without)))]
        return Errors(
            own.efc_pos[kept].copy(), _jacobian(model, own)[kept], own.efc_id[kept].astype(np.int64)
        )

    def worst(self, found: Errors) -> str:
        """Return in words which equality has the largest error, and how large it is."""
        k = int(np.argmax(np.abs(found.errors)))
        index = int(found.ids[k])
        kind = mujoco.mjtEq(int(self.model.eq_type[index])).name.removeprefix("mjEQ_").lower()
        name = name_of(self.model, mujoco.mjtObj.mjOBJ_EQUALITY, index)
        return f"equality '{name}' ({kind}) is off by {abs(found.errors[k]):.3g} m or rad"


def _jacobian(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the Jacobian (nefc, nv) of all constraints."""
    dense = np.zeros((data.nefc, model.nv))
    if not data.nefc:
        return dense
    if mujoco.mj_isSparse(model):
        mujoco.mju_sparse2dense(
            dense, data.efc_J.ravel(), data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind
        )
    else:
        dense[:] = data.efc_J.reshape(data.nefc, model.nv)
    return dense
