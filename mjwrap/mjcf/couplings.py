"""Set joints that follow others by equalities to their positions, and compute their Jacobian N.

A joint equality of MuJoCo (`<equality><joint polycoef>`) requires q = qpos0 + Σ cᵢ xⁱ of its first joint, the follower,
i = 0..4, where x is q − qpos0 of its second joint, the leader, or 0 without a leader. An equality of two fixed tendons
(`<equality><tendon>`), the first with one joint, does the same with a weighted sum of joints as the leader. Several
equalities may be the pieces of one coupling (`coupling_pieces.py`), of which the leader's position picks one. In a
simulation these are soft constraints; here the follower is set exactly. A follower may be the leader of others.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf.coupling_pieces import Coupling, equation, read_pieces

__all__ = ["CoupledJoints", "Coupling", "read_couplings"]
Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def read_couplings(model: mujoco.MjModel) -> list[Coupling]:
    """Return the couplings of a model that are active at its start, in the order of their first equalities.

    Raises `ModelError` for a wrong tuple of pieces.
    """
    joined = read_pieces(model)
    taken = {equality for coupling in joined for equality in coupling.equalities}
    single = [equation(model, i) for i in range(model.neq) if i not in taken]
    found = [*joined, *(coupling for coupling in single if coupling is not None)]
    active = [each for each in found if any(model.eq_active0[i] for i in each.equalities)]
    return sorted(active, key=lambda coupling: min(coupling.equalities))


class CoupledJoints:
    """All joints of a model that follow others, sorted so that leaders come first.

    free: a joint that counts as independent here although it has an equality, or -1. A joint with several couplings
    follows the first; a coupling that would close a loop of followers is left out.
    """

    def __init__(self, model: mujoco.MjModel, free: int = -1) -> None:
        couplings = [coupling for coupling in read_couplings(model) if coupling.joint != free]
        chosen = _choose(couplings)
        self.couplings = chosen  # by follower
        self.leader = {
            joint: coupling.leader for joint, coupling in chosen.items()
        }  # the first one, by follower; -1: none
        self._levels = [_Level(model, level) for level in _by_depth(chosen)]
        followers = np.array(model.jnt_dofadr[list(chosen)], dtype=np.int64)
        self.independent: Ints = np.setdiff1d(
            np.arange(model.nv), followers
        )  # (k,) dofs that follow no other
        self._nv = int(model.nv)

    def head(self, joint: int) -> int:
        """Return the independent joint that a joint follows: itself if it is independent, -1 if it is fixed.

        Of a joint that follows several, the first.
        """
        while joint in self.leader:
            joint = self.leader[joint]
        return joint

    def heads(self, joint: int) -> list[int]:
        """Return all independent joints that a joint follows: itself if it is independent, none if it is fixed."""
        if joint not in self.couplings:
            return [joint]
        found = (head for leader in self.couplings[joint].leaders for head in self.heads(leader))
        return list(dict.fromkeys(found))

    def place(self, qpos: Array) -> None:
        """Set the followers to the positions given by their leaders, in place [m or rad].

        qpos: a pose (nq,), or a column for each of several (nq, T).
        """
        for level in self._levels:
            qpos[level.qpos_at] = level.resting(qpos) + level.value(qpos)

    def residuals(self, qpos: Array) -> dict[int, float]:
        """Return how far each follower in a pose qpos (nq,) is from where its leaders put it, by joint [m or rad]."""
        found: dict[int, float] = {}
        for level in self._levels:
            errors = qpos[level.qpos_at] - (level.rest + level.value(qpos))
            found.update(zip(level.joints, errors.tolist(), strict=True))
        return found

    def spread(self, qpos: Array, tangent: Array) -> None:
        """Set the followers' rows of a derivative d(pose)/dx, in place, from their leaders' rows.

        qpos: the pose (nq,), with the followers in place, and tangent (nv,) or (nv, m); or a column for each of several
        poses (nq, T), and tangent (nv, T) or (nv, T, m).
        """
        for level in self._levels:
            tangent[level.dof_at] = _aligned(level.slope(qpos), tangent) * level.led(tangent)

    def accelerate(self, qpos: Array, qvel: Array, qacc: Array) -> None:
        """Set the followers' accelerations [m/s², rad/s²], in place, from their leaders' motion.

        q̈ = f″(x) ẋ² + f′(x) ẍ, with the leaders' x. Columns as of `spread`: qpos (nq, T), qvel and qacc (nv, T); the
        followers' positions and velocities are in place.
        """
        for level in self._levels:
            bent = level.curvature(qpos) * level.led(qvel) ** 2
            qacc[level.dof_at] = bent + level.slope(qpos) * level.led(qacc)

    def matrix(self, qpos: Array) -> Array:
        """Return N = ∂q/∂q_independent (nv, k) at a pose qpos (nq,); columns as in `independent`.

        Forces τ (nv,) act on the independent degrees of freedom as Nᵀτ; velocities are v = N v_independent. Of several
        poses, a column for each (nq, T), the matrices are (nv, T, k).
        """
        count = len(self.independent)
        found = np.zeros((self._nv, *qpos.shape[1:], count))
        found[self.independent, ..., np.arange(count)] = 1.0
        self.spread(qpos, found)
        return found


class _Level:
    """Couplings, as arrays, whose leaders are all set before them."""

    def __init__(self, model: mujoco.MjModel, couplings: list[Coupling]) -> None:
        self.joints = [coupling.joint for coupling in couplings]
        self.qpos_at, self.dof_at = model.jnt_qposadr[self.joints], model.jnt_dofadr[self.joints]
        self.rest = model.qpos0[self.qpos_at]
        most = max(max(len(coupling.leaders) for coupling in couplings), 1)
        leaders = np.zeros((most, len(couplings)), dtype=np.int64)
        self._weight = np.zeros(leaders.shape)  # 0: no leader
        pieces = max(len(coupling.equalities) for coupling in couplings)
        self._knots = np.full((pieces - 1, len(couplings)), np.inf)
        self._c = np.zeros((5, pieces, len(couplings)))
        for k, coupling in enumerate(couplings):
            leaders[: len(coupling.leaders), k] = coupling.leaders
            self._weight[: len(coupling.leaders), k] = coupling.weights
            self._knots[: len(coupling.knots), k] = coupling.knots
            self._c[:, : len(coupling.equalities), k] = coupling.coefficients.T
        self._leader_dof = model.jnt_dofadr[leaders]
        self._leader_at = model.jnt_qposadr[leaders]
        self._leader_rest = model.qpos0[self._leader_at]
        self._every = np.arange(len(couplings))

    def resting(self, qpos: Array) -> Array:
        """Return the followers' positions at rest, with the axes of qpos."""
        return _aligned(self.rest, qpos)

    def _x(self, qpos: Array) -> tuple[Array, Array]:
        """Return x − x₀ of each coupling, and the coefficients (5, couplings) of its piece; qpos as of `place`."""
        at = qpos[self._leader_at]
        weight = _aligned(self._weight, at)
        x = _summed((at - _aligned(self._leader_rest, at)) * weight)
        if not len(self._knots):
            return x, _aligned(self._c[:, 0], x[None])
        piece = np.count_nonzero(_aligned(self._knots, at) <= _summed(at * weight), axis=0)
        return x, self._c[:, piece, _aligned(self._every, piece)]

    def value(self, qpos: Array) -> Array:
        """Return Σ cᵢ xⁱ of each coupling."""
        x, c = self._x(qpos)
        return c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * c[4])))

    def slope(self, qpos: Array) -> Array:
        """Return Σ i cᵢ xⁱ⁻¹ of each coupling."""
        x, c = self._x(qpos)
        return c[1] + x * (2.0 * c[2] + x * (3.0 * c[3] + x * 4.0 * c[4]))

    def curvature(self, qpos: Array) -> Array:
        """Return Σ i (i − 1) cᵢ xⁱ⁻² of each coupling."""
        x, c = self._x(qpos)
        return 2.0 * c[2] + x * (6.0 * c[3] + x * 12.0 * c[4])

    def led(self, tangent: Array) -> Array:
        """Return the weighted sum of the leaders' rows of a derivative, 0 without a leader."""
        rows = tangent[self._leader_dof]
        return _summed(_aligned(self._weight, rows) * rows)


def _aligned(values: NDArray[Any], other: NDArray[Any]) -> NDArray[Any]:
    """Return values with axes of length 1 behind their own, so that they have as many axes as another array."""
    return values.reshape(values.shape + (1,) * (other.ndim - values.ndim))


def _summed(terms: Array) -> Array:
    """Return the sum over the first axis, term by term."""
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total


def _choose(couplings: list[Coupling]) -> dict[int, Coupling]:
    """Return the coupling that determines each follower."""
    chosen: dict[int, Coupling] = {}

    def depends(joint: int, other: int) -> bool:
        return joint == other or (
            joint in chosen and any(depends(leader, other) for leader in chosen[joint].leaders)
        )

    for coupling in couplings:
        loop = any(depends(leader, coupling.joint) for leader in coupling.leaders)
        if coupling.joint not in chosen and not loop:
            chosen[coupling.joint] = coupling
    return chosen


def _by_depth(chosen: dict[int, Coupling]) -> list[list[Coupling]]:
    """Return couplings in lists, each of which depends only on joints of previous lists."""

    def depth(joint: int) -> int:
        if joint not in chosen:
            return 0
        return 1 + max((depth(leader) for leader in chosen[joint].leaders), default=0)

    by_depth: dict[int, list[Coupling]] = {}
    for joint, coupling in chosen.items():
        by_depth.setdefault(depth(joint), []).append(coupling)
    return [by_depth[d] for d in sorted(by_depth)]
