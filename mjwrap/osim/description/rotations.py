"""Rotation matrices as .osim files write them: about an axis, and of body-fixed x-y-z angles. Angles in rad."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def about(axis: ArrayLike, angle: float) -> Array:
    """Return the matrix (3, 3) of a turn by an angle about an axis (3,), which need not have length 1."""
    axis = np.asarray(axis, dtype=np.float64)
    x, y, z = axis / np.linalg.norm(axis)
    c, s = np.cos(angle), np.sin(angle)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return c * np.eye(3) + s * cross + (1.0 - c) * np.outer((x, y, z), (x, y, z))


def body_fixed_xyz(angles: ArrayLike) -> Array:
    """Return the matrix (3, 3) of turns about x, the new y and the new z, one after the other."""
    x, y, z = np.asarray(angles, dtype=np.float64)
    cx, cy, cz = np.cos((x, y, z))
    sx, sy, sz = np.sin((x, y, z))
    return np.array(
        [
            [cy * cz, -cy * sz, sy],
            [cx * sz + sx * sy * cz, cx * cz - sx * sy * sz, -sx * cy],
            [sx * sz - cx * sy * cz, sx * cz + cx * sy * sz, cx * cy],
        ]
    )
