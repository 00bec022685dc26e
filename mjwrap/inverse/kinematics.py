"""MuJoCo's kinematics of a motion, a block of frames at a time."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.inverse.motion import CompleteMotion
from mjwrap.kernels.coupling.groups import PathPoints
from mjwrap.kernels.inverse.muscle_frames import place_points

Array = NDArray[np.float64]
BLOCK = 256  # frames, few enough to stay in the processor's cache


class Kinematics:
    """Arrays of mjData, by their names there, for the frames of a block; they are written again for the next one.

    names: of the arrays, such as "site_xpos", of which `array` returns the first `count` frames.
    """

    def __init__(self, model: mujoco.MjModel, names: tuple[str, ...], block: int = BLOCK) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        self._sources = [getattr(self._data, name) for name in names]
        self._held = {
            name: np.zeros((block, *source.shape)) for name, source in zip(names, self._sources, strict=True)
        }
        self._block = block
        self.count = 0

    def array(self, name: str) -> Array:
        """Return an array of the present block, frames first."""
        return self._held[name][: self.count]

    def blocks(self, motion: CompleteMotion) -> Iterator[tuple[int, int]]:
        """Fill block after block; yield the first frame of each, and one behind its last."""
        model, data = self._model, self._data
        qpos, qvel = data.qpos, data.qvel
        kept = list(zip(self._held.values(), self._sources, strict=True))
        for first in range(0, len(motion), self._block):
            end = min(first + self._block, len(motion))
            self.count = end - first
            for k in range(self.count):
                qpos[:] = motion.qpos[first + k]
                qvel[:] = motion.qvel[first + k]
                mujoco.mj_kinematics(model, data)
                mujoco.mj_comPos(model, data)
                mujoco.mj_comVel(model, data)
                for block, source in kept:
                    block[k] = source
            yield first, end

    def place_points(self, points: PathPoints, qpos: Array, slopes: Array, active: NDArray[np.int64]) -> None:
        """Place moving and conditional points of the present block, which needs xpos, xmat and site_xpos.

        points: `PathPoints.group()`. qpos: (count, nq). Written are site_xpos, slopes and, (count, routes), active.
        """
        place_points(
            *points[:5], points.force, qpos, self.array("xpos"), self.array("xmat"), self._model.site_pos,
            self.array("site_xpos"), slopes, active,
        )  # fmt: skip
