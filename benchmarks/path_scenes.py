"""Moving rows of cylinders and one sphere for timing paths: 1,501 poses of one smooth sweep.

Cylinders of 3 cm radius stand 0.1 m apart along x between (0, 0, 0) and (0.1 (n + 1), 0, 0.01), passed above and below
in turn, their axes tilted a little, and move up and down by 8 mm, odd and even ones at different rates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import mjwrap as mw

Array = NDArray[np.float64]
POSES = 1501


@dataclass(frozen=True)
class Scene:
    """One path over n obstacles that move by translation along y; their orientations stay.

    name; kind: "cylinder" or "sphere"; radius [m]; origin, insertion (3,) [m]; place (n, 3): rest positions [m];
    tilt (n, 2): rotations about x, then about the turned y [rad]; side (n,): +1 above, -1 below; y (T, n): heights [m].
    """

    name: str
    kind: str
    radius: float
    origin: Array
    insertion: Array
    place: Array
    tilt: Array
    side: Array
    y: Array

    @property
    def n(self) -> int:
        """Number of obstacles."""
        return len(self.place)

    @property
    def poses(self) -> int:
        """Number of poses of the sweep."""
        return len(self.y)

    @property
    def hints(self) -> Array:
        """Points (n, 3) near which the path touches, in the frames of the surfaces [m]."""
        hints = np.zeros((self.n, 3))
        hints[:, 1] = self.side * self.radius
        return hints

    @property
    def quat(self) -> Array:
        """Orientations (n, 4), w x y z."""
        a, b = 0.5 * self.tilt.T
        return np.stack(
            [np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.cos(a) * np.sin(b), np.sin(a) * np.sin(b)], 1
        )

    def obstacles(self) -> list[mw.Obstacle]:
        """mjwrap's obstacles, without their poses."""
        surface = mw.Cylinder(self.radius) if self.kind == "cylinder" else mw.Sphere(self.radius)
        return [mw.Obstacle(surface, hint=tuple(hint)) for hint in self.hints]

    def motion(self) -> tuple[Array, Array]:
        """Positions (T, n, 3) [m] and orientations (T, n, 4) of all surfaces at all poses."""
        pos = np.repeat(self.place[None], self.poses, axis=0)
        pos[:, :, 1] = self.y
        return pos, np.repeat(self.quat[None], self.poses, axis=0)


def cylinders(n: int, poses: int = POSES) -> Scene:
    """A row of n cylinders."""
    angle = np.linspace(0.0, 2.0 * np.pi, poses)
    even = np.arange(n) % 2 == 0
    side = np.where(even, 1.0, -1.0)
    rate = np.where(even, 1.0, 1.3)
    tilt = np.stack([np.where(even, 0.1, -0.08), np.where(np.arange(n) % 3 == 0, 0.12, -0.07)], 1)
    place = np.zeros((n, 3))
    place[:, 0] = 0.1 * np.arange(1, n + 1)
    y = side * (-0.012 + 0.008 * np.sin(angle[:, None] * rate))
    name = f"{n} cylinder{'s' if n > 1 else ''}"
    insertion = np.array([0.1 * (n + 1), 0.0, 0.01])
    return Scene(name, "cylinder", 0.03, np.zeros(3), insertion, place, tilt, side, y)


def sphere(poses: int = POSES) -> Scene:
    """One sphere."""
    angle = np.linspace(0.0, 2.0 * np.pi, poses)
    y = (-0.04 + 0.015 * np.sin(angle))[:, None]
    origin, insertion = np.array([-0.15, -0.01, -0.01]), np.array([0.15, -0.02, 0.02])
    return Scene(
        "1 sphere", "sphere", 0.05, origin, insertion, np.zeros((1, 3)), np.zeros((1, 2)), np.ones(1), y
    )


def all_scenes(poses: int = POSES) -> list[Scene]:
    """Every scene of the benchmark, fewest obstacles first."""
    return [cylinders(1, poses), sphere(poses), *(cylinders(n, poses) for n in (2, 4, 8, 16))]
