"""Moving rows of surfaces for timing paths: 1,501 poses of one smooth sweep, every surface touched throughout.

The scenes of the exact reference paths, and longer rows of the same kind. Every surface moves along y by a sine of its
own rate and keeps its orientation; the end points stand still. Neighbours in a row are passed above and below in turn.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import mjwrap as mw
from mjwrap.surfaces import Surface

Array = NDArray[np.float64]
Row = tuple[float, ...]
POSES = 1501
ROWS = (2, 4, 8, 16, 32, 64)  # cylinders in a row
UPRIGHT = (0.0, 0.5 * np.pi, 0.0)  # turns a ring so that the path runs through its hole
BROAD = mw.Ellipsoid((0.05, 0.04, 0.08))
RING = mw.Torus(0.08, 0.02)


@dataclass(frozen=True)
class Scene:
    """One path over n surfaces that move by translation along y; their orientations stay.

    name; surfaces (n); origin, insertion (3,) [m]; place (n, 3): rest positions [m]; tilt (n, 3): rotations about x,
    then about the turned y, then about the turned z [rad]; hints (n, 3): points near which the path touches, in the
    frames of the surfaces [m]; y (T, n): heights [m].
    """

    name: str
    surfaces: tuple[Surface, ...]
    origin: Array
    insertion: Array
    place: Array
    tilt: Array
    hints: Array
    y: Array

    @property
    def n(self) -> int:
        """Number of surfaces."""
        return len(self.surfaces)

    @property
    def poses(self) -> int:
        """Number of poses of the sweep."""
        return len(self.y)

    @property
    def quat(self) -> Array:
        """Orientations (n, 4), w x y z."""
        (a, b, c), (u, v, w) = np.cos(0.5 * self.tilt.T), np.sin(0.5 * self.tilt.T)
        return np.stack(
            [
                a * b * c - u * v * w,
                u * b * c + a * v * w,
                a * v * c - u * b * w,
                a * b * w + u * v * c,
            ],
            axis=1,
        )

    def obstacles(self, hinted: bool = True) -> list[mw.Obstacle]:
        """mjwrap's obstacles, without their poses."""
        return [
            mw.Obstacle(surface, hint=tuple(hint) if hinted else None)
            for surface, hint in zip(self.surfaces, self.hints, strict=True)
        ]

    def motion(self) -> tuple[Array, Array]:
        """Positions (T, n, 3) [m] and orientations (T, n, 4) of all surfaces at all poses."""
        pos = np.repeat(self.place[None], self.poses, axis=0)
        pos[:, :, 1] = self.y
        return pos, np.repeat(self.quat[None], self.poses, axis=0)


def _angle(poses: int) -> Array:
    return np.linspace(0.0, 2.0 * np.pi, poses)[:, None]


def cylinders(n: int, poses: int = POSES) -> Scene:
    """A row of n cylinders of 3 cm radius, 0.1 m apart along x, their axes tilted a little."""
    even = np.arange(n) % 2 == 0
    side = np.where(even, 1.0, -1.0)
    rate = np.where(even, 1.0, 1.3)
    tilt = np.zeros((n, 3))
    tilt[:, 0] = np.where(even, 0.1, -0.08)
    tilt[:, 1] = np.where(np.arange(n) % 3 == 0, 0.12, -0.07)
    place, hints = np.zeros((n, 3)), np.zeros((n, 3))
    place[:, 0] = 0.1 * np.arange(1, n + 1)
    hints[:, 1] = 0.03 * side
    y = side * (-0.012 + 0.008 * np.sin(_angle(poses) * rate))
    name = f"{n} cylinder{'s' if n > 1 else ''}"
    insertion = np.array([0.1 * (n + 1), 0.0, 0.01])
    return Scene(name, (mw.Cylinder(0.03),) * n, np.zeros(3), insertion, place, tilt, hints, y)


def _single(name: str, surface: Surface, ends: tuple[Row, Row], tilt: Row, hint: float, y: Array) -> Scene:
    """One surface at x = 0; the hint stands on local y."""
    return Scene(
        name,
        (surface,),
        np.array(ends[0]),
        np.array(ends[1]),
        np.zeros((1, 3)),
        np.array([tilt]),
        np.array([[0.0, hint, 0.0]]),
        y,
    )


def sphere(poses: int = POSES) -> Scene:
    """One sphere, passed above."""
    ends = (-0.15, -0.01, -0.01), (0.15, -0.02, 0.02)
    y = -0.04 + 0.015 * np.sin(_angle(poses))
    return _single("1 sphere", mw.Sphere(0.05), ends, (0.0, 0.0, 0.0), 0.05, y)


def ellipsoid(poses: int = POSES) -> Scene:
    """One ellipsoid of three different axes, turned about all three, passed above."""
    ends = (-0.15, -0.01, -0.01), (0.15, -0.02, 0.02)
    y = -0.03 + 0.01 * np.sin(_angle(poses))
    return _single("1 ellipsoid", BROAD, ends, (0.3, 0.4, 0.2), 0.04, y)


def torus(poses: int = POSES) -> Scene:
    """One ring, the path through its hole and round the inside of the tube, where the surface is saddle-shaped."""
    ends = (-0.15, 0.05, 0.01), (0.15, 0.05, -0.01)
    y = -0.04 + 0.025 * np.sin(_angle(poses))
    return _single("1 torus", RING, ends, UPRIGHT, 0.06, y)


def _mixed(name: str, row: list[tuple[Surface, Row, float, float, float, float]], poses: int) -> Scene:
    """A row 0.15 m apart; each surface with its tilt, hint on local y, mean height, amplitude and rate."""
    surfaces, tilt, hint, mean, amplitude, rate = zip(*row, strict=True)
    n = len(row)
    place, hints = np.zeros((n, 3)), np.zeros((n, 3))
    place[:, 0] = 0.15 * np.arange(n)
    hints[:, 1] = hint
    y = np.array(mean) + np.array(amplitude) * np.sin(_angle(poses) * np.array(rate))
    origin, insertion = np.array([-0.15, 0.0, -0.01]), np.array([0.15 * n, 0.0, 0.02])
    return Scene(name, surfaces, origin, insertion, place, np.array(tilt), hints, y)


_THREE = [
    (mw.Cylinder(0.04), (0.15, -0.1, 0.0), 0.04, -0.015, 0.012, 1.0),
    (BROAD, (0.2, 0.3, 0.1), -0.04, 0.015, -0.012, 1.3),
    (RING, UPRIGHT, 0.06, -0.1, 0.01, 0.7),
]
_FIVE = [
    *_THREE,
    (mw.Sphere(0.05), (0.0, 0.0, 0.0), 0.05, -0.075, 0.006, 1.0),
    (mw.Cylinder(0.04), (-0.12, 0.08, 0.0), -0.04, 0.0, -0.006, 1.3),
]


def three_mixed(poses: int = POSES) -> Scene:
    """A cylinder passed above, an ellipsoid passed below and a ring passed through."""
    return _mixed("3 mixed", _THREE, poses)


def five_mixed(poses: int = POSES) -> Scene:
    """The three, then a sphere passed above and a cylinder passed below."""
    return _mixed("5 mixed", _FIVE, poses)


SCENES: dict[str, Callable[[int], Scene]] = {
    "1 cylinder": lambda poses: cylinders(1, poses),
    "1 sphere": sphere,
    "1 ellipsoid": ellipsoid,
    "1 torus": torus,
    "3 mixed": three_mixed,
    "5 mixed": five_mixed,
    **{f"{n} cylinders": lambda poses, n=n: cylinders(n, poses) for n in ROWS},
}
