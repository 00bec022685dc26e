"""Rotation matrices as quaternions in full precision."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def quaternion(rotation: Array) -> Array | None:
    """Return a rotation matrix (3, 3) as w, x, y, z; None for no rotation."""
    if np.array_equal(rotation, np.eye(3)):
        return None
    trace = float(np.trace(rotation))
    square = 0.25 * np.array([1.0 + trace, *(1.0 - trace + 2.0 * np.diag(rotation))])
    largest = int(np.argmax(square))
    found = np.empty(4)
    skew = np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    even = rotation + rotation.T
    if largest == 0:
        found[0], found[1:] = 4.0 * square[0], skew
    else:
        i = largest - 1
        found[0], found[1:] = skew[i], even[i]
        found[largest] = 4.0 * square[largest]
    return found / np.linalg.norm(found)
