"""The muscles' generalised forces on joints that move path points, in qfrc_applied beside the forces of others."""

from __future__ import annotations

import mujoco
import numpy as np

from mjwrap.kernels.coupling import path_points
from mjwrap.kernels.coupling.groups import PathPoints


class JointForces:
    """What was last added to the qfrc_applied of one mjData."""

    def __init__(self, points: PathPoints) -> None:
        nv = len(points.force)
        self._force = points.force
        self._kept = (np.zeros(nv), np.zeros(nv), np.zeros(nv), np.zeros(nv, dtype=np.bool_))

    def add(self, data: mujoco.MjData) -> None:
        """Remove the last contribution, and add the forces of the last evaluation."""
        path_points.add_to_qfrc(data.qfrc_applied, *self._kept, self._force)

    def remove(self, data: mujoco.MjData) -> None:
        """Remove the last contribution, so that only the forces of others remain."""
        path_points.remove_from_qfrc(data.qfrc_applied, *self._kept)

    def forget(self) -> None:
        """Forget the last contribution without removing it."""
        self._kept[-1][:] = False
