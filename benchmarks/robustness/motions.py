"""Smooth random motions of surfaces and end points, for motion.py."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import mjwrap as mw
from mjwrap.verification.cases import describe, restore
from mjwrap.verification.random_scenes import Maker
from mjwrap.verification.scenes import gap, height
from mjwrap.verification.shapes import Array

WAVES = 3  # harmonics of each coordinate
SWING, TILT = 0.02, 0.3  # largest amplitudes of a surface alone and of its ends [m, rad]
ROW_SWING = 0.008  # of surfaces in a row [m]
CLEARANCE = 1e-3  # between surfaces, and of end points from them [m]
CHECKED = 61  # poses at which a motion is checked for room
SHRINKS = 8  # halvings of a motion until there is room


@dataclass(frozen=True)
class Motion:
    """A closed motion over one period of the time tau, 0 to 2 pi.

    obstacles: where everything is in the middle; shifts (n + 2, 3, WAVES, 2): cosines and sines of origin, surfaces and
    insertion [m]; axes (n, 3), turns (n, WAVES, 2): each surface turns about an axis of the world [rad].
    """

    origin: Array
    insertion: Array
    obstacles: list[mw.Obstacle]
    shifts: Array
    axes: Array
    turns: Array

    def _waves(self, tau: Array) -> tuple[Array, Array]:
        """Return the harmonics (T, WAVES, 2) and their rates."""
        k = np.arange(1.0, WAVES + 1.0)
        angle = tau[:, None] * k
        c, s = np.cos(angle), np.sin(angle)
        return np.stack([c, s], 2), np.stack([-s, c], 2) * k[:, None]

    def poses(self, tau: Array) -> tuple[Array, Array, Array, Array]:
        """Return origin, insertion (T, 3), pos (T, n, 3) and quat (T, n, 4)."""
        waves, _ = self._waves(tau)
        moved = np.einsum("bckp,tkp->tbc", self.shifts, waves)
        pos = np.array([o.pos for o in self.obstacles]) + moved[:, 1:-1]
        half = 0.5 * np.einsum("bkp,tkp->tb", self.turns, waves)
        w, v = np.cos(half), np.sin(half)[..., None] * self.axes
        quat0 = np.array([o.quat for o in self.obstacles])
        a, u = quat0[:, 0], quat0[:, 1:]
        real = w * a - np.einsum("tbi,bi->tb", v, u)
        quat = np.concatenate([real[..., None], w[..., None] * u + a[:, None] * v + np.cross(v, u)], 2)
        return self.origin + moved[:, 0], self.insertion + moved[:, -1], pos, quat

    def velocities(self, tau: float) -> tuple[Array, Array, Array]:
        """Return the velocities of origin and insertion (3,) and the twists (n, 6) per unit of tau."""
        _, rates = self._waves(np.array([tau]))
        moved = np.einsum("bckp,kp->bc", self.shifts, rates[0])
        spin = np.einsum("bkp,kp->b", self.turns, rates[0])[:, None] * self.axes
        return moved[0], moved[-1], np.concatenate([moved[1:-1], spin], 1)

    def scene(self, tau: float) -> tuple[Array, Array, list[mw.Obstacle]]:
        """Return origin, insertion and obstacles at one time."""
        a, b, pos, quat = (value[0] for value in self.poses(np.array([tau])))
        row = [
            replace(o, pos=tuple(p), quat=tuple(q)) for o, p, q in zip(self.obstacles, pos, quat, strict=True)
        ]
        return a, b, row

    def travel(self, steps: Sequence[float]) -> float:
        """Return a bound on how fast the length of a string can change, per unit of tau [m]: bodies' speeds, twice."""
        fastest = 0.0
        for tau in steps:
            start, end, twists = self.velocities(tau)
            spins = (
                np.linalg.norm(twists[:, 3:], axis=1) * 0.15
            )  # contacts lie within 0.15 m of a surface's centre
            speeds = np.linalg.norm(twists[:, :3], axis=1) + spins
            fastest = max(fastest, float(np.linalg.norm(start) + np.linalg.norm(end) + 2.0 * speeds.sum()))
        return 2.0 * fastest

    def plain(self) -> dict[str, Any]:
        """Return the motion as numbers that can be saved."""
        scene = describe(self.origin, self.insertion, self.obstacles)
        return {
            **scene,
            **{name: getattr(self, name).tolist() for name in ("shifts", "axes", "turns")},
        }

    @classmethod
    def restored(cls, saved: dict[str, Any]) -> Motion:
        """Return a saved motion."""
        shape = (len(saved["obstacles"]) + 2, 3, WAVES, 2)
        return cls(
            *restore(saved),
            np.array(saved["shifts"]).reshape(shape),
            np.array(saved["axes"]).reshape(-1, 3),
            np.array(saved["turns"]).reshape(-1, WAVES, 2),
        )


def has_room(motion: Motion) -> bool:
    """Return whether no surface comes near another one or an end point during a motion."""
    tau = np.linspace(0.0, 2.0 * np.pi, CHECKED)
    for now in tau:
        a, b, row = motion.scene(now)
        ends = np.array([a, b])
        if min(float(height(o, ends).min()) for o in row) < CLEARANCE:
            return False
    for now in tau[::6]:
        _, _, row = motion.scene(now)
        for k, o in enumerate(row):
            if any(gap(o, other) < CLEARANCE for other in row[k + 1 : k + 4]):
                return False
    return True


def random_motion(maker: Maker) -> Motion:
    """Return a motion about a scene with good hints; contacts come and go in most of them."""
    rng = maker.rng
    while True:
        scene = maker.scene(True)
        obstacles = scene.hinted("good")
        assert obstacles is not None
        n = len(obstacles)
        swing = SWING if n == 1 else ROW_SWING
        size = rng.normal(size=(n + 2, 3, WAVES, 2)) / np.arange(1, WAVES + 1)[:, None] ** 2
        spins = rng.normal(size=(n, WAVES, 2)) / np.arange(1, WAVES + 1)[:, None] ** 2
        axes = rng.normal(size=(n, 3))
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        for halving in range(SHRINKS):
            scale = 0.5**halving / np.sqrt(2.0)
            tilt = TILT if n == 1 else 0.3 * TILT
            motion = Motion(
                scene.origin, scene.insertion, obstacles, scale * swing * size, axes, scale * tilt * spins
            )
            if has_room(motion):
                return motion
