"""Choose coordinates of a model by name, and compute moment arms about them, with couplings and other equalities."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
from mjwrap.errors import GeometryError
from mjwrap.mjcf import MuscleDeclaration, name_of, names
from mjwrap.mjcf.coupling_pieces import equation
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.mjcf.names import listed
from mjwrap.model.kinematic_tree import crossed_dofs
from mjwrap.system.equalities import Equalities
from mjwrap.system.least_motion import CoordinateRates, least_motion
from mjwrap.text import nearest

Array = NDArray[np.float64]
_JOINT = mujoco.mjtObj.mjOBJ_JOINT
_SCALAR = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
POSSIBLE = 1e-7  # largest error of the rates of a motion that satisfies the equalities


class _Target(NamedTuple):
    """What moves: a degree of freedom, or a coordinate (name) that is a function of its joint."""

    name: str
    dof: int
    function: bool


class CoordinateMotions:
    """The motions q̇ (nv,) of a model as a coordinate has the rate 1 and its equalities hold.

    Joints that follow by couplings move along. Where other equalities tie coordinates, the motion is the one whose
    rates of all coordinates have the least sum of squares: P eᵢ / Pᵢᵢ, with the projector P on the motions that satisfy
    the equalities, as in OpenSim's moment arms. A joint that an equality holds at a position moves as if that one did
    not exist.
    """

    def __init__(self, model: mujoco.MjModel, couplings: CoupledJoints) -> None:
        self.model = model
        self.couplings = couplings
        self._equalities = Equalities(model, couplings)
        self._rates = CoordinateRates(model, couplings)
        self._freed: dict[
            int, CoordinateMotions
        ] = {}  # without the coupling of a joint that is held, by joint

    @property
    def independent(self) -> list[str]:
        """Names of all hinges and slides that follow no other joint, in the model's order."""
        model = self.model
        return [
            name_of(model, _JOINT, joint)
            for joint in range(model.njnt)
            if int(model.jnt_type[joint]) in _SCALAR and joint not in self.couplings.leader
        ]

    def columns(self, data: mujoco.MjData, coordinates: Iterable[str] | None) -> Array:
        """Return the motions (nv, k) about coordinates by name; see `MuscleSystem.moment_arms`."""
        given = self.independent if coordinates is None else _listed(coordinates)
        targets = [target for name in given for target in self._targets(name)]
        found = [self._about(data, target) for target in targets]
        return np.stack(found, axis=1) if found else np.zeros((self.model.nv, 0))

    def along(self, data: mujoco.MjData, dof: int) -> Array:
        """Return the motion (nv,) in which a degree of freedom has the rate 1, zeros if it cannot move."""
        try:
            return self._about(data, _Target("", dof, False))
        except GeometryError:
            return np.zeros(self.model.nv)

    def arms(self, data: mujoco.MjData, jacobian: Array, dofs: Iterable[int]) -> Array:
        """Return moment arms (n, nv) [m] about degrees of freedom from J = ∂l/∂q (n, nv), 0 about all others."""
        arms = np.zeros_like(jacobian)
        for dof in dofs:
            arms[:, dof] = -jacobian @ self.along(data, dof)
        return arms

    def moved_muscles(self, muscles: Sequence[MuscleDeclaration]) -> NDArray[np.bool_]:
        """Return which degrees of freedom move each muscle (n, nv), alone or with those that equalities tie to them."""
        model = self.model
        crossed = crossed_dofs(model, muscles)
        moved = crossed.copy()
        for joint in self.couplings.leader:
            for head in self.couplings.heads(joint):
                moved[:, model.jnt_dofadr[head]] |= crossed[:, model.jnt_dofadr[joint]]
        rest = mujoco.MjData(model)
        for dof in np.flatnonzero(~moved.any(axis=0)):
            moved[:, dof] = (crossed & (self.along(rest, int(dof)) != 0.0)).any(axis=1)
        return moved

    def _targets(self, name: str) -> list[_Target]:
        """Return what a name stands for; `GeometryError` if there is no such joint or coordinate."""
        model = self.model
        known = names(model, _JOINT, model.njnt)
        if name in known:
            joint = known.index(name)
            first = int(model.jnt_dofadr[joint])
            counts = {int(mujoco.mjtJoint.mjJNT_FREE): 6, int(mujoco.mjtJoint.mjJNT_BALL): 3}
            count = counts.get(int(model.jnt_type[joint]), 1)
            return [_Target(name, first + k, False) for k in range(count)]
        if name in self._rates.functions:
            joint = self._rates.functions[name].joint
            return [_Target(name, int(model.jnt_dofadr[joint]), True)]
        every = [*known, *self._rates.functions]
        raise GeometryError(
            f"no joint '{name}' for a moment arm{nearest(name, every)}; joints: {listed(every)}"
        )

    def _about(self, data: mujoco.MjData, target: _Target) -> Array:
        joint = int(self.model.dof_jntid[target.dof])
        if joint in self.couplings.couplings and not self.couplings.couplings[joint].leaders:
            if joint not in self._freed:
                self._freed[joint] = CoordinateMotions(self.model, CoupledJoints(self.model, joint))
            return self._freed[joint]._about(data, target)
        qpos, spread = data.qpos, self.couplings.matrix(data.qpos)
        rows = self._equalities.at(data, qpos, self._holds(joint)).jacobian @ spread
        place = np.flatnonzero(self.couplings.independent == target.dof)
        if place.size and not target.function and not rows[:, place[0]].any():
            return spread[:, place[0]]
        wanted = self._rates.row(target.name, qpos) if target.function else np.eye(self.model.nv)[target.dof]
        moved = _least(rows, wanted @ spread, self._rates.matrix(qpos) @ spread)
        if moved is None:
            name = target.name or name_of(self.model, _JOINT, joint)
            raise GeometryError(
                f"coordinate '{name}' cannot move at this pose: equalities of the model hold it, so there is no moment "
                f"arm about it"
            )
        return spread @ moved

    def of_speed(self, data: mujoco.MjData, speeds: Array, index: int) -> Array | None:
        """Return the motion (nv,) in which one of several speeds is 1, and the sum of their squares least.

        speeds (c, nv): linear functions of qvel, instead of the rates of the coordinates. None if it cannot be 1.
        """
        spread = self.couplings.matrix(data.qpos)
        rows = self._equalities.at(data, data.qpos).jacobian @ spread
        moved = _least(rows, speeds[index] @ spread, speeds @ spread)
        return None if moved is None else spread @ moved

    def _holds(self, joint: int) -> list[int]:
        """Return the ids of the equalities that hold a joint at a position."""
        found = (
            (index, equation(self.model, index))
            for index in range(self.model.neq)
            if int(self.model.eq_type[index]) == int(mujoco.mjtEq.mjEQ_JOINT)
        )
        return [i for i, each in found if each is not None and each.joint == joint and not each.leaders]


def _least(rows: Array, wanted: Array, rates: Array) -> Array | None:
    """Return x (k,) with rows x = 0 and wanted · x = 1 for which |rates x| is least; None where there is none."""
    size = float(np.linalg.norm(wanted))
    if size == 0.0:
        return None
    every = np.concatenate([rows, wanted[None] / size])
    right = np.append(np.zeros(len(rows)), 1.0 / size)
    found = least_motion(every, right, rates)
    possible = float(np.abs(every @ found - right).max()) <= POSSIBLE / size
    return found if possible else None


def arms_of_all_dofs(couplings: CoupledJoints, jacobian: Array, qpos: Array) -> Array:
    """Return moment arms (n, nv) [m]: −J N for independent degrees of freedom, −J for those that follow others."""
    arms = -jacobian
    arms[:, couplings.independent] = arms @ couplings.matrix(qpos)
    return arms


def moved_muscles(
    model: mujoco.MjModel, couplings: CoupledJoints, muscles: Sequence[MuscleDeclaration]
) -> NDArray[np.bool_]:
    """Return which degrees of freedom move each muscle (n, nv), alone or with the joints that follow them."""
    crossed = crossed_dofs(model, muscles)
    moved = crossed.copy()
    for joint in couplings.leader:
        for head in couplings.heads(joint):
            moved[:, model.jnt_dofadr[head]] |= crossed[:, model.jnt_dofadr[joint]]
    return moved


def _listed(coordinates: Iterable[str]) -> list[str]:
    good = isinstance(coordinates, Iterable) and not isinstance(coordinates, Mapping | bytes)
    found = [coordinates] if isinstance(coordinates, str) else list(coordinates) if good else []
    good = good and all(isinstance(name, str) for name in found)
    validation.require(good, "coordinates", "a joint's name, or several", coordinates, GeometryError)
    return found
