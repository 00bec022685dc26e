"""Make poses of a model: sweeps of each joint over its range, and random poses, with coupled joints in place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf import name_of
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.mjcf.joint_ranges import joint_range

Array = NDArray[np.float64]
_KINDS = mujoco.mjtJoint
_HINGE, _SLIDE, _BALL = int(_KINDS.mjJNT_HINGE), int(_KINDS.mjJNT_SLIDE), int(_KINDS.mjJNT_BALL)


@dataclass(frozen=True)
class PoseSequence:
    """A sequence of poses to evaluate in order.

    name: a joint's name, or "random poses"; at (T,): the joint's position [m or rad], or the index; qpos (T, nq);
    tangent (T, nv): d(pose)/d(at); qvel (T, nv): random velocities; continuous: whether the poses form a motion;
    base: the number of the pose around which a joint is swept; alone: whether a coupled joint is moved alone, which no
    motion of the model does; turning: whether the swept joint turns.
    """

    name: str
    at: Array
    qpos: Array
    tangent: Array
    qvel: Array
    continuous: bool
    base: int = 0
    alone: bool = False
    turning: bool = True


class PoseMaker:
    """Make poses of a model around a base pose qpos (nq,), with coupled joints in place."""

    def __init__(self, model: mujoco.MjModel, base: Array, seed: int = 0, number: int = 0) -> None:
        self.model = model
        self.base = np.array(base, dtype=np.float64)
        self.number = number
        self.rng = np.random.default_rng(seed)
        self._coupled = CoupledJoints(model)
        self._without = {-1: self._coupled}  # by the joint that is swept although it follows another joint
        self._coupled.place(self.base)

    def joints(self) -> list[int]:
        """Return the joints that can be swept: all except free joints."""
        return [j for j in range(self.model.njnt) if int(self.model.jnt_type[j]) in (_HINGE, _SLIDE, _BALL)]

    def follows(self, joint: int) -> bool:
        """Return whether an equality determines the position of a joint."""
        return joint in self._coupled.leader

    def leader(self, joint: int) -> str | None:
        """Return the name of the joint that a joint follows ("" if it is held by itself), None if it is independent."""
        if not self.follows(joint):
            return None
        head = self._coupled.leader[joint]
        return name_of(self.model, mujoco.mjtObj.mjOBJ_JOINT, head) if head >= 0 else ""

    def axes(self, joint: int) -> range:
        """Return the axes to sweep a joint about: three for a ball."""
        return range(3 if int(self.model.jnt_type[joint]) == _BALL else 1)

    def middle(self) -> Array:
        """Return the pose (nq,) with every hinge and slide in the middle of its range."""
        qpos = self.base.copy()
        for joint in self.joints():
            if int(self.model.jnt_type[joint]) != _BALL:
                qpos[self.model.jnt_qposadr[joint]] = 0.5 * sum(self.span(joint))
        self._coupled.place(qpos)
        return qpos

    def span(self, joint: int) -> tuple[float, float]:
        """Return the range to sweep [m or rad]: the joint's range, else half a turn or half the model's extent."""
        model = self.model
        kind = int(model.jnt_type[joint])
        own = joint_range(model, joint)
        if kind == _BALL:
            reach = 0.5 * np.pi if own is None else own[1]
            return -reach, reach
        if own is not None and own[1] > own[0]:
            return own
        here = float(self.base[model.jnt_qposadr[joint]])
        reach = np.pi if kind == _HINGE else 0.5 * float(model.stat.extent)
        return here - reach, here + reach

    def place(self, joint: int, axis: int, value: float) -> tuple[Array, Array]:
        """Return the base pose (nq,) with one joint at `value`, about `axis` for a ball, and d(pose)/d(value) (nv,)."""
        model = self.model
        qpos, tangent = self.base.copy(), np.zeros(model.nv)
        adr, dof = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
        if int(model.jnt_type[joint]) == _BALL:
            turn = np.zeros(3)
            turn[axis] = value
            mujoco.mju_quatIntegrate(qpos[adr : adr + 4], turn, 1.0)
            tangent[dof + axis] = 1.0
        else:
            qpos[adr] = value
            tangent[dof] = 1.0
        couplings = self._couplings(joint)
        couplings.place(qpos)
        couplings.spread(qpos, tangent)
        return qpos, tangent

    def _couplings(self, swept: int = -1) -> CoupledJoints:
        """Return the coupled joints; the swept joint counts as independent."""
        free = swept if swept in self._coupled.leader else -1
        if free not in self._without:
            self._without[free] = CoupledJoints(self.model, free)
        return self._without[free]

    def _velocities(self, count: int) -> Array:
        return self.rng.uniform(-1.0, 1.0, (count, self.model.nv))

    def sweep(self, joint: int, samples: int, axis: int = 0) -> PoseSequence:
        """Return a sweep of one joint over its range; the others stay, or follow it if they are coupled to it.

        A joint that follows another one is moved alone.
        """
        low, high = self.span(joint)
        at = np.linspace(low, high, samples)
        pairs = [self.place(joint, axis, float(value)) for value in at]
        name = name_of(self.model, mujoco.mjtObj.mjOBJ_JOINT, joint)
        if int(self.model.jnt_type[joint]) == _BALL:
            name = f"{name} ({'xyz'[axis]})"
        qpos, tangent = (np.array(part) for part in zip(*pairs, strict=True))
        velocities, alone = self._velocities(samples), self.follows(joint)
        turning = int(self.model.jnt_type[joint]) != _SLIDE
        return PoseSequence(name, at, qpos, tangent, velocities, True, self.number, alone, turning)

    def maker(self, joint: int, axis: int = 0) -> Callable[[float], tuple[Array, Array]]:
        """Return the function value -> (pose, tangent) of a sweep, for positions between its samples."""
        return lambda value: self.place(joint, axis, value)

    def random(self, count: int) -> PoseSequence:
        """Return poses with every joint drawn independently from its range; free joints stay at the base pose."""
        model = self.model
        qpos = np.tile(self.base, (count, 1))
        for row in qpos:
            for joint in self.joints():
                adr = int(model.jnt_qposadr[joint])
                low, high = self.span(joint)
                if int(model.jnt_type[joint]) == _BALL:
                    direction = self.rng.normal(size=3)
                    turn = direction / np.linalg.norm(direction) * self.rng.uniform(0.0, high)
                    mujoco.mju_quatIntegrate(row[adr : adr + 4], turn, 1.0)
                else:
                    row[adr] = self.rng.uniform(low, high)
            self._coupled.place(row)
        return PoseSequence(
            "random poses",
            np.arange(count, dtype=np.float64),
            qpos,
            np.zeros((count, model.nv)),
            self._velocities(count),
            False,
        )
