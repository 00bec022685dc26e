"""The scene of a path: obstacles with world poses, via points, and their rows for the kernels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap import validation
from mjwrap.errors import GeometryError
from mjwrap.kernels import layout
from mjwrap.kernels.spans import chain
from mjwrap.surfaces import Surface
from mjwrap.surfaces.rows import side_fault, surface_rows

Array = NDArray[np.float64]
Point = tuple[float, float, float]


def vector(value: ArrayLike, size: int, what: str) -> tuple[float, ...]:
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise GeometryError(f"{what} must be {size} numbers, not {value!r}") from None
    if array.shape != (size,):
        raise GeometryError(f"{what} must have shape ({size},), not {array.shape}")
    if not np.isfinite(array).all():
        raise GeometryError(f"{what} must be finite, not {array.tolist()}")
    return tuple(array.tolist())


def point(value: ArrayLike, what: str) -> Point:
    x, y, z = vector(value, 3, what)
    return x, y, z


@dataclass(frozen=True)
class Obstacle:
    """A wrapping surface at a pose in the world.

    Args:
        surface: a `Surface`.
        pos: (3,) origin of its frame, world [m].
        quat: (4,) orientation of its frame, w, x, y, z, of any length except zero.
        hint: (3,) a point in the surface's frame [m] near which the path should touch at a cold start; None for no
            hint.
        inside: the path must meet the solid and is not kept out of it: it is the shortest path that meets the solid,
            with a corner at one point if the straight line does not meet it. Only for a sphere or a cylinder of any
            length, between end points and via points.
        side: (3,) a point in the surface's frame [m] on the half on which the path passes the surface at every pose,
            warm or cold; None for no side. Only its direction from the origin counts, and from the axis where there
            is one. An obstacle has a hint or a side, not both.

    Raises:
        GeometryError: a value is not possible.
    """

    surface: Surface
    pos: tuple[float, ...] = (0.0, 0.0, 0.0)
    quat: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)
    hint: tuple[float, ...] | None = None
    inside: bool = False
    side: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.surface, Surface):
            raise GeometryError(f"Obstacle: surface must be a Surface such as Cylinder, not {self.surface!r}")
        object.__setattr__(self, "pos", vector(self.pos, 3, "Obstacle: pos"))
        object.__setattr__(self, "quat", vector(self.quat, 4, "Obstacle: quat"))
        if not any(self.quat):
            raise GeometryError("Obstacle: quat must not be zero")
        largest = max(abs(x) for x in self.quat)
        if not 1e-100 < largest < 1e100:  # its square would not be a number
            object.__setattr__(self, "quat", tuple(x / largest for x in self.quat))
        if self.hint is not None:
            object.__setattr__(self, "hint", vector(self.hint, 3, "Obstacle: hint"))
        validation.flag(self.inside, "Obstacle: inside", GeometryError)
        if self.inside and not (self.surface.held_about and math.isinf(self.surface.z_limit)):
            raise GeometryError(
                f"Obstacle: only a Sphere or an infinite Cylinder can have inside=True, not {self.surface!r}"
            )
        if self.side is not None:
            self._check_side(self.side)

    def _check_side(self, side: ArrayLike) -> None:
        object.__setattr__(self, "side", vector(side, 3, "Obstacle: side"))
        if self.hint is not None or self.inside:
            other = "a hint" if self.hint is not None else "inside=True"
            raise GeometryError(f"Obstacle: give a side or {other}, not both")
        fault = side_fault(self.surface, side)
        if fault:
            raise GeometryError(
                f"Obstacle: side {self.side} lies {fault} of {self.surface!r}, so that it says no side"
            )


@dataclass(frozen=True)
class ViaPoint:
    """A point through which the path runs; it may be anywhere among the obstacles.

    pos (3,): world coordinates [m], finite, else `GeometryError`.
    """

    pos: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "pos", vector(self.pos, 3, "ViaPoint: pos"))


def owners(obstacles: Sequence[Obstacle | ViaPoint]) -> NDArray[np.int64]:
    """Return the obstacle of every row of the kernels; a surface with hollows has several rows."""
    found: list[int] = []
    for k, obstacle in enumerate(obstacles):
        found += [k] * (obstacle.surface.touches if isinstance(obstacle, Obstacle) else 1)
    return np.array(found, dtype=np.int64)


def pack(obstacles: Sequence[Obstacle | ViaPoint]) -> Array:
    """Return the kernels' rows for a list of obstacles, for a cold start; several for a surface with hollows."""
    if not isinstance(obstacles, list | tuple):
        wanted = "a list of Obstacle and ViaPoint, such as [mw.Obstacle(mw.Sphere(0.03))]"
        validation.sequence(obstacles, "obstacles", GeometryError, wanted)
        validation.require(hasattr(obstacles, "__getitem__"), "obstacles", wanted, obstacles, GeometryError)
    for k, obstacle in enumerate(obstacles):
        if not isinstance(obstacle, Obstacle | ViaPoint):
            raise GeometryError(f"obstacles[{k}] must be an Obstacle or a ViaPoint, not {obstacle!r}")
        after = obstacles[k + 1] if k + 1 < len(obstacles) else None
        if (
            isinstance(obstacle, Obstacle)
            and isinstance(after, Obstacle)
            and (obstacle.inside or after.inside)
        ):
            raise GeometryError(
                f"obstacles[{k}] and obstacles[{k + 1}]: the neighbours of an obstacle with inside=True must be end "
                f"points or via points"
            )
    node = np.zeros((len(owners(obstacles)), layout.ROW))
    first = 0
    for obstacle in obstacles:
        if isinstance(obstacle, ViaPoint):
            node[first, layout.KIND], node[first, layout.S_MODE] = layout.VIA, layout.COLD
            node[first, layout.POS : layout.POS + 3] = obstacle.pos
            first += 1
            continue
        rows = surface_rows(obstacle.surface, obstacle.inside, obstacle.side is not None)
        rows[:, layout.POS : layout.POS + 3] = obstacle.pos
        towards = obstacle.hint if obstacle.side is None else obstacle.side
        if towards is not None:
            rows[0, layout.HINT] = 1.0
            rows[0, layout.HINT + 1 : layout.HINT + 4] = towards
        for row in range(len(rows)):
            chain.set_rotation(rows, row, *obstacle.quat)
        node[first : first + len(rows)] = rows
        first += len(rows)
    return node


SAVED = slice(layout.S_MODE, layout.S_MODE + layout.STATE)
