"""Rotation matrices as .osim files write them: about an axis, and of body-fixed x-y-z angles. Angles in rad."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def about(axis: ArrayLike, angle: float) -> Array:
    """Return the matrix (3, 3) of a turn by an angle about an axis (3,), which need not have length 1."""
    x, y, z = (float(component) for component in np.asarray(axis, dtype=np.float64))
    length = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / length, y / length, z / length
    c, s = math.cos(angle), math.sin(angle)
    d = 1.0 - c
    # entry by entry: an import evaluates it some ten thousand times
    return np.array(
        [
            [c + d * x * x, d * x * y - s * z, d * x * z + s * y],
            [d * x * y + s * z, c + d * y * y, d * y * z - s * x],
            [d * x * z - s * y, d * y * z + s * x, c + d * z * z],
        ]
    )


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
