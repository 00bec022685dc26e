"""The samples of a run that a plot needs."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.system import MuscleSystem

Array = NDArray[np.float64]
MOST = 4000  # largest number of samples in a plot; if there are more, every second one is dropped


class PlotHistory:
    """Samples for a plot, (T, ...) each: time, qpos, activation, length, tension."""

    def __init__(self, muscles: MuscleSystem) -> None:
        self._muscles = muscles
        self._rows: list[tuple[float, Array, Array, Array, Array]] = []
        self._stride, self._skip = 1, 0

    def log(self, data: mujoco.MjData) -> None:
        """Store the present state."""
        self._skip -= 1
        if self._skip >= 0:
            return
        self._skip = self._stride - 1
        m = self._muscles
        self._rows.append(
            (float(data.time), data.qpos.copy(), m.activation.copy(), m.length.copy(), m.tension.copy())
        )
        if len(self._rows) >= MOST:
            self._rows = self._rows[::2]
            self._stride *= 2

    @property
    def time(self) -> Array:
        """Times (T,) [s]."""
        return np.array([row[0] for row in self._rows])

    def column(self, place: int) -> Array:
        """Return qpos (1), activation (2), length (3) or tension (4), (T, n)."""
        return np.array([row[place] for row in self._rows])
