"""OpenSim's `Scholz2015GeometryPath` over a scene of bench_paths.py, warm and cold.

OpenSim keeps the last solution in the state as the value of an auto-update discrete variable, and that value depends on
the instance stage. Warm: it is left alone, as in a simulation. Cold: before every pose, outside the clock, the state's
instance stage is invalidated and realised again. That drops the last solution, and the path starts from its contact
hint; its lengths are then the same to the last bit as those of a state fresh from `initSystem`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from time import thread_time as clock
from typing import Any

import numpy as np
from path_scenes import Array, Scene
from path_sweep import Sweep

import mjwrap as mw

WHOLE_ROW = 16  # longer rows run over fewer poses: the time of one grows with the cube of the row
Model = tuple[Any, Any, list[Any]]  # model, state, coordinates


class OpenSimScholz:
    """The path as it ships, at new poses of a sweep.

    Every obstacle is a contact geometry on a body with a slider coordinate. At every pose coordinates are set, then
    positions realised and the length read; the same without the path is timed beside it and subtracted.
    """

    other_side = False

    def __init__(self, scene: Scene, warm: bool) -> None:
        try:
            import opensim
        except ImportError as error:
            raise NotImplementedError(f"the opensim wheel is not installed ({error})") from None
        opensim.Logger.setLevelString("off")
        self.name = "OpenSim warm" if warm else "OpenSim cold"
        self.against = "mjwrap warm" if warm else "mjwrap cold"
        self.warm, self.scene, self.osim = warm, scene, opensim
        self.instance = opensim.Stage(opensim.Stage.Instance)
        self.path: Any = None
        self.with_path, self.without = self._model(True), self._model(False)
        count = math.ceil(scene.poses * min(1.0, (WHOLE_ROW / scene.n) ** 3))
        self.at = np.arange(count) if warm else np.linspace(0, scene.poses - 1, count).astype(np.int64)

    def _shape(self, k: int, body: Any) -> Any:
        """The contact geometry of surface k on a body."""
        osim, surface = self.osim, self.scene.surfaces[k]
        origin, tilt = osim.Vec3(0.0), osim.Vec3(*self.scene.tilt[k])
        if isinstance(surface, mw.Cylinder):
            return osim.ContactCylinder(surface.radius, origin, tilt, body)
        if isinstance(surface, mw.Sphere):
            return osim.ContactSphere(surface.radius, origin, body)
        if isinstance(surface, mw.Ellipsoid):
            return osim.ContactEllipsoid(osim.Vec3(*surface.radii), origin, tilt, body)
        if isinstance(surface, mw.Torus):
            return osim.ContactTorus(surface.major_radius, surface.minor_radius, origin, tilt, body)
        raise NotImplementedError(f"OpenSim's path has no {type(surface).__name__}")

    def _model(self, with_path: bool) -> Model:
        osim, scene = self.osim, self.scene
        model = osim.Model()
        ground = model.getGround()
        path = osim.Scholz2015GeometryPath()
        path.setName("path")
        path.appendPathPoint(ground, osim.Vec3(*scene.origin))
        along_y = osim.Vec3(0.0, 0.0, 0.5 * math.pi)  # a slider moves along its x axis
        for k in range(scene.n):
            body = osim.Body(f"body{k}", 1.0, osim.Vec3(0.0), osim.Inertia(1.0, 1.0, 1.0))
            model.addBody(body)
            place = osim.Vec3(*scene.place[k])
            model.addJoint(
                osim.SliderJoint(f"joint{k}", ground, place, along_y, body, osim.Vec3(0.0), along_y)
            )
            shape = self._shape(k, body)
            shape.setName(f"surface{k}")
            model.addContactGeometry(shape)
            path.appendObstacle(shape, osim.Vec3(*scene.hints[k]))
        path.appendPathPoint(ground, osim.Vec3(*scene.insertion))
        if with_path:
            model.addComponent(path)
            self.path = path
        state = model.initSystem()
        coordinates = [model.getCoordinateSet().get(f"joint{k}_coord_0") for k in range(scene.n)]
        return model, state, coordinates

    def _forget(self, loaded: Model) -> None:
        """Drop the last solution, and bring the state back to where setting coordinates would leave it."""
        model, state, _ = loaded
        state.invalidateAllCacheAtOrAbove(self.instance)
        model.realizeTime(state)

    def _pose(self, loaded: Model, heights: list[float], read: Callable[[Any], float]) -> tuple[float, float]:
        model, state, coordinates = loaded
        for coordinate, height in zip(coordinates, heights, strict=True):
            coordinate.setValue(state, height, False)
        if not self.warm:
            self._forget(loaded)
        began = clock()
        model.realizePosition(state)
        length = read(state)
        return 1e6 * (clock() - began), length

    def sweep(self) -> Sweep:
        """Time every pose by itself, the first one cold; a pose fails where OpenSim throws."""
        samples, lengths = np.empty(len(self.at)), np.full(len(self.at), np.nan)
        nothing = self.without[0].getNumCoordinates  # a call across the same border, to be subtracted
        for loaded in (self.with_path, self.without):
            self._forget(loaded)
        rows: Array = self.scene.y[self.at]
        for j, heights in enumerate(rows.tolist()):
            bare, _ = self._pose(self.without, heights, lambda state: nothing())
            try:
                full, lengths[j] = self._pose(self.with_path, heights, self.path.getLength)
            except RuntimeError:
                full = np.nan
            samples[j] = full - bare
        return Sweep(float(np.nanmean(samples)), samples, lengths, np.isnan(lengths), self.at)
