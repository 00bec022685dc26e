"""The independent coordinates of a model, about which moment arms and generalised forces are given."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
from mjwrap.errors import ModelError
from mjwrap.mjcf import dof_names, name_of
from mjwrap.mjcf.couplings import CoupledJoints

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
_LOOPS = (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD))
_FREE, _SLIDE = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_SLIDE)


class IndependentCoordinates:
    """The k degrees of freedom of a model that follow no other by an equality, in the order of qvel.

    A ball joint counts as three (rotations about the axes of its body), a free joint as six (translations in the world,
    then rotations about the axes of its body), as in qvel. The equalities are those that are active at the start.

    Attributes:
        couplings: the joints that follow others.
        dofs: (k,) indices in qvel.
        names: (k,) names, a joint's, with a number if the joint has several: "knee", "root[0]".
        labels: (k,) names of generalised forces as OpenSim's InverseDynamicsTool writes them: "knee_moment" about a
            rotation [N m], "root[0]_force" along a translation [N].
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        validation.of_type(model, "MjModel", "model", ModelError)
        self._model = model
        self.couplings = CoupledJoints(model)
        self.dofs = self.couplings.independent
        known = dof_names(model)
        self.names = tuple(known[dof] for dof in self.dofs)
        self.labels = tuple(
            f"{known[dof]}_{'force' if _translates(model, int(dof)) else 'moment'}" for dof in self.dofs
        )

    def matrices(self, qpos: Array) -> Array:
        """Return N = ∂q/∂q_independent (T, nv, k) at poses qpos (T, nq), see `CoupledJoints.matrix`."""
        return np.ascontiguousarray(np.moveaxis(self.couplings.matrix(qpos.T), 1, 0))

    def followers(self) -> tuple[Ints, Ints, Ints]:
        """Return the other degrees of freedom (f,), and which of the independent ones each follows.

        Number i follows those of the numbers heads[starts[i] : starts[i + 1]] in `dofs`; returned: dofs, starts, heads.
        """
        model, places = self._model, {int(dof): i for i, dof in enumerate(self.dofs)}
        others = np.setdiff1d(np.arange(model.nv), self.dofs)
        heads = [
            [places[int(model.jnt_dofadr[head])] for head in self.couplings.heads(int(model.dof_jntid[dof]))]
            for dof in others
        ]
        starts = np.cumsum([0, *(len(each) for each in heads)]).astype(np.int64)
        return others, starts, np.array([head for each in heads for head in each], dtype=np.int64)


def refuse_loops(model: mujoco.MjModel, why: str) -> None:
    """Raise `ModelError`, which names the equality and says why, if an active connect or weld closes a loop."""
    for e in range(model.neq):
        if model.eq_active0[e] and int(model.eq_type[e]) in _LOOPS:
            name = name_of(model, mujoco.mjtObj.mjOBJ_EQUALITY, e)
            raise ModelError(f"equality '{name}' closes a loop; {why}")


def _translates(model: mujoco.MjModel, dof: int) -> bool:
    joint = int(model.dof_jntid[dof])
    kind = int(model.jnt_type[joint])
    return kind == _SLIDE or (kind == _FREE and dof - int(model.jnt_dofadr[joint]) < 3)


def quaternions(model: mujoco.MjModel) -> list[tuple[str, int, int]]:
    """Return name, first place in qpos and first rotation in qvel of every ball and free joint."""
    found = []
    for joint in range(model.njnt):
        kind = int(model.jnt_type[joint])
        if kind in (_FREE, int(mujoco.mjtJoint.mjJNT_BALL)):
            before = 3 if kind == _FREE else 0
            places = int(model.jnt_qposadr[joint]) + before, int(model.jnt_dofadr[joint]) + before
            found.append((name_of(model, mujoco.mjtObj.mjOBJ_JOINT, joint), *places))
    return found
