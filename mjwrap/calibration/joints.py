"""The joints of a model as independent variables within their ranges; coupled joints follow."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap import validation
from mjwrap.errors import ModelError, StateError
from mjwrap.mjcf import MuscleDeclaration, name_of, names
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.mjcf.joint_ranges import joint_range
from mjwrap.model.kinematic_tree import crossed_dofs

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
_KINDS = mujoco.mjtJoint
_SINGLE = (int(_KINDS.mjJNT_HINGE), int(_KINDS.mjJNT_SLIDE))
_BALL = int(_KINDS.mjJNT_BALL)


class JointSpace:
    """Variables u (k,): 0 to 1 over the range of a hinge or slide; a ball's rotation vector over its largest angle.

    ranges: by joint name, (low, high) [rad or m], for a ball (0, largest angle); they replace the model's own. Joints
    without a range (`held`) stay at their positions in `base` (nq,), joints whose range is a single value stay there,
    and joints coupled by an equality follow their leaders. Raises `ModelError` for an invalid name or range.
    """

    def __init__(
        self, model: mujoco.MjModel, base: ArrayLike, ranges: Mapping[str, tuple[float, float]]
    ) -> None:
        self.model = model
        self.base = validation.numbers(base, "base", ModelError).copy()
        if self.base.shape != (model.nq,) or not np.isfinite(self.base).all():
            raise StateError(
                f"the base pose must be finite and have shape ({model.nq},), not {self.base.shape}"
            )
        self._couplings = CoupledJoints(model)
        leader = self._couplings.leader
        spans = _spans(model, ranges, leader)
        free = [j for j in range(model.njnt) if j not in leader]
        self.held = [j for j in free if j not in spans]
        hinges = [j for j in free if j in spans and int(model.jnt_type[j]) != _BALL]
        self.single = [j for j in hinges if spans[j][0] < spans[j][1]]
        self.balls = [j for j in free if j in spans and int(model.jnt_type[j]) == _BALL]
        self._low = np.array([spans[j][0] for j in self.single])
        self._width = np.array([spans[j][1] for j in self.single]) - self._low
        self._reach = [spans[j][1] for j in self.balls]
        self._qpos_at = np.array(model.jnt_qposadr[self.single], dtype=np.int64)
        self._dof_at = np.array(model.jnt_dofadr[self.single], dtype=np.int64)
        self._fixed = self.base.copy()
        for j in hinges:
            self._fixed[model.jnt_qposadr[j]] = spans[j][0]
        self.k = len(self.single) + 3 * len(self.balls)
        owner = {joint: [v] for v, joint in enumerate(self.single)}
        for b, joint in enumerate(self.balls):
            owner[joint] = [*range(self._ball(b).start, self._ball(b).stop)]
        self._owner = owner

    def _ball(self, b: int) -> slice:
        first = len(self.single) + 3 * b
        return slice(first, first + 3)

    def neutral(self) -> Array:
        """Return the variables (k,) of the base pose, moved into the ranges."""
        u = np.zeros(self.k)
        u[: len(self.single)] = (self.base[self._qpos_at] - self._low) / self._width
        for b, joint in enumerate(self.balls):
            adr = int(self.model.jnt_qposadr[joint])
            turn = np.zeros(3)
            mujoco.mju_quat2Vel(turn, self.base[adr : adr + 4], 1.0)
            u[self._ball(b)] = turn / self._reach[b]
        return self.project(u)

    def project(self, u: Array) -> Array:
        """Return the nearest variables (k,) within all ranges."""
        found = u.copy()
        n = len(self.single)
        np.clip(u[:n], 0.0, 1.0, out=found[:n])
        for b in range(len(self.balls)):
            part = self._ball(b)
            found[part] /= max(1.0, float(np.linalg.norm(found[part])))
        return found

    def draw(self, rng: np.random.Generator, corner: bool) -> Array:
        """Return random variables (k,), or a random corner of the ranges."""
        n = len(self.single)
        u = rng.uniform(0.0, 1.0, self.k)
        if corner:
            u[:n] = np.round(u[:n])
        for b in range(len(self.balls)):
            turn = rng.normal(size=3)
            turn /= np.linalg.norm(turn)
            u[self._ball(b)] = turn if corner else turn * rng.uniform() ** (1.0 / 3.0)
        return u

    def pose(self, u: Array) -> Array:
        """Return the pose qpos (nq,)."""
        qpos = self._fixed.copy()
        qpos[self._qpos_at] = self._low + u[: len(self.single)] * self._width
        for b, joint in enumerate(self.balls):
            adr = int(self.model.jnt_qposadr[joint])
            quat = np.array([1.0, 0.0, 0.0, 0.0])
            mujoco.mju_quatIntegrate(quat, u[self._ball(b)] * self._reach[b], 1.0)
            qpos[adr : adr + 4] = quat
        self._couplings.place(qpos)
        return qpos

    def tangent(self, u: Array, qpos: Array) -> Array:
        """Return d(pose)/du (nv, k) at variables u and their pose."""
        found = np.zeros((self.model.nv, self.k))
        found[self._dof_at, np.arange(len(self.single))] = self._width
        for b, joint in enumerate(self.balls):
            dof, part = int(self.model.jnt_dofadr[joint]), self._ball(b)
            found[dof : dof + 3, part] = _right_jacobian(u[part] * self._reach[b]) * self._reach[b]
        self._couplings.spread(qpos, found)
        return found

    def moves(self, muscles: list[MuscleDeclaration]) -> tuple[Bools, list[tuple[str, ...]]]:
        """Return which variables move which muscle (n, k), and the names of the held joints that would move it."""
        joints = crossed_dofs(self.model, muscles)[:, self.model.jnt_dofadr]
        variables = np.zeros((len(muscles), self.k), dtype=np.bool_)
        held: list[tuple[str, ...]] = []
        for i, row in enumerate(joints):
            led = [head for j in np.flatnonzero(row) for head in self._couplings.heads(int(j))]
            for joint in led:
                variables[i, self._owner.get(joint, [])] = True
            still = [j for j in self.held if j in led]
            held.append(tuple(name_of(self.model, mujoco.mjtObj.mjOBJ_JOINT, j) for j in still))
        return variables, held


def _spans(
    model: mujoco.MjModel, ranges: Mapping[str, tuple[float, float]], followers: Mapping[int, int]
) -> dict[int, tuple[float, float]]:
    """Return the range of every joint with a range, by joint id."""
    known = names(model, mujoco.mjtObj.mjOBJ_JOINT, model.njnt)
    own = {j: joint_range(model, j) for j in range(model.njnt)}
    spans = {j: span for j, span in own.items() if span is not None}
    for name, (low, high) in ranges.items():
        if name not in known:
            raise ModelError(
                f"there is no joint '{name}' for which a range is given; joints: {', '.join(known) or 'none'}"
            )
        joint = known.index(name)
        if int(model.jnt_type[joint]) not in (*_SINGLE, _BALL):
            raise ModelError(f"joint '{name}' is free: it has no range")
        if joint in followers:
            raise ModelError(
                f"joint '{name}' follows an equality constraint: its range is that of its leader"
            )
        spans[joint] = (float(low), float(high))
    for joint, (low, high) in list(spans.items()):
        ball = int(model.jnt_type[joint]) == _BALL
        if joint in followers:
            del spans[joint]
        elif not (np.isfinite([low, high]).all() and low <= high) or (ball and not 0.0 < high <= np.pi):
            wanted = "0 and a largest angle up to π" if ball else "finite and not decreasing"
            raise ModelError(f"range of joint '{known[joint]}' must be {wanted}, not {low:g} to {high:g}")
    return spans


def _right_jacobian(turn: Array) -> Array:
    """Return the angular velocity in the turned frame (3, 3) for each rate of a rotation vector (3,) [rad]."""
    angle = float(np.linalg.norm(turn))
    x, y, z = turn.tolist()
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < 1e-4:  # its series; the remainder is below 1e-13
        return np.eye(3) - 0.5 * cross + cross @ cross / 6.0
    first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.eye(3) - first * cross + second * cross @ cross
