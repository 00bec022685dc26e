"""The exact motion of a coupled model in its independent coordinates, from the splines alone, for tests."""

from __future__ import annotations

import mujoco
import numpy as np
from coupling_models import Knee

Array = np.ndarray


class Reduction:
    """A passive model whose joints are all hinges and slides; y = (positions, velocities) of the independent ones."""

    def __init__(self, made: Knee) -> None:
        self.made, self.model = made, made.model
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
        self.data = mujoco.MjData(self.model)
        self.at = {
            self.model.joint(j).name: j for j in range(self.model.njnt)
        }  # also the place in qpos and qvel
        self.free = [j for name, j in self.at.items() if name not in made.splines]

    def state(self, y: Array) -> tuple[Array, Array, Array, Array]:
        """Return qpos, qvel, N (nv, k), and the accelerations (nv,) that independent velocities alone cause."""
        k, nv = len(self.free), self.model.nv
        qpos, matrix, extra = np.zeros(nv), np.zeros((nv, k)), np.zeros(nv)
        qpos[self.free], matrix[self.free, range(k)] = y[:k], 1.0
        for name, spline in self.made.splines.items():
            leaders = [(self.at[leader], weight) for leader, weight in self.made.leaders[name].items()]
            x, row = sum(w * qpos[j] for j, w in leaders), sum(w * matrix[j] for j, w in leaders)
            turn = sum(w * extra[j] for j, w in leaders)
            here, slope = self.at[name], spline(x, 1)
            qpos[here], matrix[here] = spline(x), slope * row
            extra[here] = spline(x, 2) * float(row @ y[k:]) ** 2 + slope * turn
        return qpos, matrix @ y[k:], matrix, extra

    def rate(self, y: Array) -> Array:
        """Return dy/dt."""
        data, k = self.data, len(self.free)
        data.qpos[:], data.qvel[:], matrix, extra = self.state(y)
        mujoco.mj_fwdPosition(self.model, data)
        mujoco.mj_fwdVelocity(self.model, data)
        inertia = np.zeros((self.model.nv, self.model.nv))
        for i, unit in enumerate(np.eye(self.model.nv)):
            mujoco.mj_mulM(self.model, data, inertia[i], unit)
        force = matrix.T @ (data.qfrc_passive - data.qfrc_bias - inertia @ extra)
        return np.append(y[k:], np.linalg.solve(matrix.T @ inertia @ matrix, force))

    def motion(self, y: Array, seconds: float, timestep: float = 5e-4) -> Array:
        """Return y after a time, by the classical Runge-Kutta method."""
        for _ in range(round(seconds / timestep)):
            a = self.rate(y)
            b = self.rate(y + 0.5 * timestep * a)
            c = self.rate(y + 0.5 * timestep * b)
            d = self.rate(y + timestep * c)
            y = y + timestep / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        return y
