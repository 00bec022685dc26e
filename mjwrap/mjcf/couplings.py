"""Set joints that follow others by joint equalities to their positions, and compute their Jacobian N.

A joint equality of MuJoCo (`<equality><joint polycoef>`) requires q = qpos0 + Σ cᵢ xⁱ of its first joint, the follower,
i = 0..4, where x is q − qpos0 of its second joint, the leader, or 0 without a leader. In a simulation it is a soft
constraint; here the follower is set exactly. A follower may be the leader of others.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
_JOINT = int(mujoco.mjtEq.mjEQ_JOINT)


class Coupling(NamedTuple):
    """One active joint equality: ids of the follower and of its leader (-1: none), and c₀ to c₄ (5,)."""

    joint: int
    leader: int
    coefficients: Array


def read_couplings(model: mujoco.MjModel) -> list[Coupling]:
    """Return the joint equalities of a model that are active at its start, in its order."""
    return [
        Coupling(int(model.eq_obj1id[i]), int(model.eq_obj2id[i]), model.eq_data[i, :5].copy())
        for i in range(model.neq)
        if int(model.eq_type[i]) == _JOINT and model.eq_active0[i]
    ]


class CoupledJoints:
    """All joints of a model that follow others, sorted so that leaders come first.

    free: a joint that counts as independent here although it has an equality, or -1. A joint with several equalities
    follows the first; an equality that would close a loop of followers is left out.
    """

    def __init__(self, model: mujoco.MjModel, free: int = -1) -> None:
        couplings = [coupling for coupling in read_couplings(model) if coupling.joint != free]
        chosen = _choose(couplings)
        self.leader = {joint: coupling.leader for joint, coupling in chosen.items()}  # by follower; -1: none
        self._levels = [_Level(model, level) for level in _by_depth(chosen)]
        followers = np.array(model.jnt_dofadr[list(chosen)], dtype=np.int64)
        self.independent: Ints = np.setdiff1d(
            np.arange(model.nv), followers
        )  # (k,) dofs that follow no other
        self._nv = int(model.nv)

    def head(self, joint: int) -> int:
        """Return the independent joint that a joint follows: itself if it is independent, -1 if it is fixed."""
        while joint in self.leader:
            joint = self.leader[joint]
        return joint

    def place(self, qpos: Array) -> None:
        """Set the followers in a pose qpos (nq,) to the positions given by their leaders, in place [m or rad]."""
        for level in self._levels:
            qpos[level.qpos_at] = level.rest + level.value(qpos)

    def spread(self, qpos: Array, tangent: Array) -> None:
        """Set the followers' rows of a derivative d(pose)/dx (nv,) or (nv, m), in place, from their leaders' rows.

        qpos (nq,): the pose of the derivative, with the followers in place.
        """
        for level in self._levels:
            slope = level.slope(qpos)
            tangent[level.dof_at] = (slope if tangent.ndim == 1 else slope[:, None]) * tangent[
                level.leader_dof
            ]

    def matrix(self, qpos: Array) -> Array:
        """Return N = ∂q/∂q_independent (nv, k) at a pose qpos (nq,); columns as in `independent`.

        Forces τ (nv,) act on the independent degrees of freedom as Nᵀτ; velocities are v = N v_independent.
        """
        found = np.zeros((self._nv, len(self.independent)))
        found[self.independent, np.arange(len(self.independent))] = 1.0
        self.spread(qpos, found)
        return found


class _Level:
    """Couplings, as arrays, whose leaders are all set before them."""

    def __init__(self, model: mujoco.MjModel, couplings: list[Coupling]) -> None:
        joints = [coupling.joint for coupling in couplings]
        leaders = [max(coupling.leader, 0) for coupling in couplings]
        self.qpos_at, self.dof_at = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        self.rest = model.qpos0[self.qpos_at]
        self.leader_dof = model.jnt_dofadr[leaders]
        self._leader_at = model.jnt_qposadr[leaders]
        self._leader_rest = model.qpos0[self._leader_at]
        self._led = np.array([float(coupling.leader >= 0) for coupling in couplings])
        self._c = np.array([coupling.coefficients for coupling in couplings]).T  # (5, couplings)

    def _x(self, qpos: Array) -> Array:
        return (qpos[self._leader_at] - self._leader_rest) * self._led

    def value(self, qpos: Array) -> Array:
        """Return Σ cᵢ xⁱ of each coupling."""
        x, c = self._x(qpos), self._c
        return c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * c[4])))

    def slope(self, qpos: Array) -> Array:
        """Return Σ i cᵢ xⁱ⁻¹ of each coupling, 0 without a leader."""
        x, c = self._x(qpos), self._c
        return self._led * (c[1] + x * (2.0 * c[2] + x * (3.0 * c[3] + x * 4.0 * c[4])))


def _choose(couplings: list[Coupling]) -> dict[int, Coupling]:
    """Return the coupling that determines each follower."""
    chosen: dict[int, Coupling] = {}
    for coupling in couplings:
        head = coupling.leader
        while head in chosen:
            head = chosen[head].leader
        if coupling.joint not in chosen and head != coupling.joint:
            chosen[coupling.joint] = coupling
    return chosen


def _by_depth(chosen: dict[int, Coupling]) -> list[list[Coupling]]:
    """Return couplings in lists, each of which depends only on joints of previous lists."""

    def depth(joint: int) -> int:
        return 1 + depth(chosen[joint].leader) if joint in chosen else 0

    by_depth: dict[int, list[Coupling]] = {}
    for joint, coupling in chosen.items():
        by_depth.setdefault(depth(joint), []).append(coupling)
    return [by_depth[d] for d in sorted(by_depth)]
