"""The points and the touched surfaces of a model's paths at its last evaluation, in the world."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.kernels import layout
from mjwrap.kernels.coupling import muscle_paths
from mjwrap.mjcf import Node
from mjwrap.surfaces import Surface
from mjwrap.system import MuscleSystem

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Point:
    """A point of a path: the name of its site, and its place in the world (3,) [m]."""

    name: str
    pos: Array


@dataclass(frozen=True)
class Touched:
    """A surface that a path touches.

    name: of its geom. pos (3,) [m], turn (3, 3): its frame in the world. contact (2, 3) [m]: where the path meets and
    leaves it, in its frame. half: half its length along its z axis as OpenSim has it [m], infinite but for cylinders.
    """

    name: str
    surface: Surface
    pos: Array
    turn: Array
    contact: Array
    half: float

    @property
    def middle(self) -> Array:
        """The middle of the contact chord in the surface's frame (3,) [m]."""
        return 0.5 * (self.contact[0] + self.contact[1])


@dataclass(frozen=True)
class TouchingRoute:
    """A converged route that touches a surface: its muscle, length [m] and stops, untouched surfaces left out."""

    muscle: str
    length: float
    stops: list[Point | Touched]


class TouchingRoutes:
    """The routes of a model's muscles that touch a surface."""

    def __init__(self, muscles: MuscleSystem) -> None:
        self._muscles = muscles
        self._nodes = [node for m in muscles.declarations for route in m.routes for node in route.nodes]

    def now(self, data: mujoco.MjData) -> list[TouchingRoute]:
        """Return those of the last evaluation, which was that of `data`."""
        muscles = self._muscles
        plan, state = muscles._plan, muscles._evaluation()
        poses = muscles.poses(data)
        found = []
        for c, route in enumerate(plan.routes):
            info = state.paths.info[c]
            if info[layout.I_STATUS] != layout.CONVERGED or not route[muscle_paths.R_SURFACES]:
                continue
            low, high = int(route[muscle_paths.R_LO]), int(route[muscle_paths.R_HI])
            rows = state.paths.node[low:high]
            points = rows[:, layout.KIND] == layout.VIA
            touched = rows[:, layout.S_MODE] == layout.TOUCHED
            if not (touched & ~points).any():
                continue
            first = self._point(poses, int(route[muscle_paths.R_FROM]))
            stops: list[Point | Touched] = [first]
            for row, node, is_point, is_touched in zip(
                rows, self._nodes[low:high], points, touched, strict=True
            ):
                if is_point:
                    stops.append(
                        Point(muscles.model.site(node.site).name, row[layout.POS : layout.POS + 3].copy())
                    )
                elif is_touched:
                    stops.append(self._surface(row, node, first.pos))
            stops.append(self._point(poses, int(route[muscle_paths.R_TO])))
            name = muscles.names[int(route[muscle_paths.R_MUSCLE])]
            found.append(TouchingRoute(name, float(info[layout.I_LENGTH]), stops))
        return found

    def _point(self, poses: mujoco.MjData, site: int) -> Point:
        return Point(self._muscles.model.site(site).name, poses.site_xpos[site].copy())

    def _surface(self, row: Array, node: Node, origin: Array) -> Touched:
        model = self._muscles.model
        pos, turn = (
            row[layout.POS : layout.POS + 3].copy(),
            row[layout.ROT : layout.ROT + 9].reshape(3, 3).copy(),
        )
        ends = np.array([row[w : w + 3] for w in (layout.W_P, layout.W_Q)]) + origin
        cylinder = int(model.geom_type[node.geom]) == int(mujoco.mjtGeom.mjGEOM_CYLINDER)
        half = float(model.geom_size[node.geom, 1]) if cylinder else np.inf
        assert node.surface is not None  # a row of a surface has one
        return Touched(model.geom(node.geom).name, node.surface, pos, turn, (ends - pos) @ turn, half)
