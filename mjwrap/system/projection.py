"""Poses that satisfy all equalities of a model, by Gauss–Newton's method."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import StateError
from mjwrap.mjcf.couplings import CoupledJoints
from mjwrap.system.equalities import Equalities, Errors
from mjwrap.system.least_motion import CoordinateRates, least_motion

Array = NDArray[np.float64]
HELD = 1e-11  # [m or rad] largest error of an equality at a pose that satisfies it
ROUNDED = 1e-14  # [m or rad] an error that no step makes smaller
NEARLY = 1e-6  # [m or rad] error up to which given positions are moved a little to satisfy the equalities
STRIDE = 0.2  # [rad or m] largest change of a given position from one pose to the next
LONGEST = 0.5  # [rad or m] step
STEPS = 60
HEAVY = 1e3  # how much more a given position counts than others, on the way


class Projection:
    """Sets joints of a model and moves others so that couplings and all other active equalities hold."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.couplings = CoupledJoints(model)
        self.equalities = Equalities(model, self.couplings)
        self._rates = CoordinateRates(model, self.couplings)

    def place(self, data: mujoco.MjData, given: Mapping[int, float], nearly: float = NEARLY) -> Array:
        """Return the pose (nq,) after joints have been moved to given positions [rad or m] from that of the data.

        given: positions by joint id, of hinges and slides that follow no other. Joints that follow are set by their
        couplings; others that equalities tie move as little as possible, step by step, in the sum of squares of all
        coordinates. Where given positions that equalities tie to each other leave errors up to `nearly` [m or rad],
        they are moved, too. Nothing is written to the data. Raises `StateError` if the equalities cannot be satisfied.
        """
        model = self.model
        at = model.jnt_qposadr[list(given)]
        wanted = np.array(list(given.values()))
        qpos = data.qpos.copy()
        self.couplings.place(qpos)
        start = qpos[at].copy()
        dofs = model.jnt_dofadr[list(given)]
        count = 1
        if self.equalities.active(data):
            tied = self.tied(data, qpos)[dofs]
            qpos[at[~tied]] = wanted[~tied]
            count = max(1, int(np.ceil(np.abs(wanted - start)[tied].max(initial=0.0) / STRIDE)))
        for k in range(1, count):
            qpos[at] = start + (wanted - start) * (k / count)
            qpos, _ = self._settled(data, qpos, dofs, hold=False)
        qpos[at] = wanted
        self.couplings.place(qpos)
        found = self.equalities.at(data, qpos)
        if found.largest > ROUNDED:
            qpos, found = self._settled(data, qpos, dofs, hold=True)
        if HELD < found.largest <= nearly:
            qpos, found = self._settled(data, qpos, dofs, hold=False)
        if found.largest > HELD:
            raise StateError(
                f"no pose with these values was found that satisfies the equalities of the model: "
                f"{self.equalities.worst(found)}"
            )
        return qpos

    def tied(self, data: mujoco.MjData, qpos: Array) -> NDArray[np.bool_]:
        """Return which degrees of freedom (nv,) equalities tie, with those that follow them."""
        rows = self.equalities.at(data, qpos).jacobian
        tied = np.zeros(self.model.nv, dtype=np.bool_)
        tied[self.couplings.independent] = (rows @ self.couplings.matrix(qpos) != 0.0).any(axis=0)
        return tied

    def _settled(
        self, data: mujoco.MjData, qpos: Array, dofs: NDArray[np.int32], hold: bool
    ) -> tuple[Array, Errors]:
        """Return the pose near qpos that satisfies the equalities, or the best one found, and their errors.

        dofs: of given positions, which stay if `hold`, or else move less than others.
        """
        couplings = self.couplings
        free = np.isin(couplings.independent, dofs, invert=True) if hold else slice(None)
        couplings.place(qpos)
        found = self.equalities.at(data, qpos)
        best, least = qpos, found
        size, patience = np.inf, 0
        for _ in range(STEPS):
            if found.largest < least.largest:
                best, least = qpos, found
            patience = 0 if found.largest < 0.5 * size else patience + 1
            size = min(size, found.largest)
            if found.largest <= ROUNDED or (least.largest <= HELD and patience > 0) or patience > 20:
                break
            spread = couplings.matrix(qpos)[:, free]
            if not spread.shape[1]:
                break
            rates = self._rates.matrix(qpos)
            if not hold:
                rates = np.concatenate([rates, HEAVY * np.eye(self.model.nv)[dofs]])
            step = spread @ least_motion(found.jacobian @ spread, -found.errors, rates @ spread)
            step *= min(1.0, LONGEST / max(float(np.abs(step).max()), 1e-300))
            qpos = qpos.copy()
            mujoco.mj_integratePos(self.model, qpos, step, 1.0)
            couplings.place(qpos)
            found = self.equalities.at(data, qpos)
        return (qpos, found) if found.largest < least.largest else (best, least)
