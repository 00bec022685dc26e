"""Cameras of films: a camera of the model, MuJoCo's free camera, or one that looks at the muscles."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
from mjwrap.errors import RecordingError
from mjwrap.model.upright import turned_upright
from mjwrap.text import nearest

MUSCLES = (
    "muscles"  # name of the camera that looks at the muscles, unless the model has a camera of this name
)
ROOM = 1.5  # distance, relative to the size of all muscles, at which a camera of 45 degrees shows them all
ELEVATION = -12.0  # [degrees]


def find_camera(
    model: mujoco.MjModel, camera: str | int | mujoco.MjvCamera | None
) -> mujoco.MjvCamera | None:
    """Return a camera, None for the one that looks at the muscles; RecordingError, which lists all, if unknown."""
    if isinstance(camera, mujoco.MjvCamera):
        return camera
    found = _free(model)
    if camera is None:
        return found
    wanted = "a camera's name or id, a mujoco.MjvCamera, or None"
    validation.instance(camera, str | int | np.integer, "camera", RecordingError, wanted)
    names = [model.camera(i).name for i in range(model.ncam)]
    number = names.index(camera) if isinstance(camera, str) and camera in names else camera
    if number == MUSCLES:
        return None
    if isinstance(number, str) or not 0 <= number < model.ncam:
        raise RecordingError(
            f"no camera {camera!r}{nearest(str(camera), names)}; cameras: {', '.join([*names, MUSCLES])}"
        )
    found.type, found.fixedcamid = int(mujoco.mjtCamera.mjCAMERA_FIXED), int(number)
    return found


def look_at_muscles(model: mujoco.MjModel, data: mujoco.MjData) -> mujoco.MjvCamera:
    """Return a free camera that looks at all sites of tendons and tuples, or, if there are none, at the whole model.

    It looks along the horizontal direction of their smallest extent, from the side with fewer bodies. Its numbers are
    in a frame whose z points up: `turn_upright` takes it to the model's own.
    """
    found, upright = _free(model), turned_upright(model)
    points = muscle_points(model, data) @ upright
    size = extent(points)
    if size == 0.0:
        return found
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    level = points[:, :2] - points[:, :2].mean(axis=0)
    along = np.linalg.eigh(level.T @ level)[1][:, 0]
    bodies = (data.xipos[1:] @ upright)[:, :2]
    if (bodies.mean(axis=0) - middle[:2]) @ along < 0.0:
        along = -along
    found.lookat[:], found.distance = middle, ROOM * size
    found.azimuth, found.elevation = float(np.degrees(np.arctan2(along[1], along[0]))), ELEVATION
    return found


def _free(model: mujoco.MjModel) -> mujoco.MjvCamera:
    """Return MuJoCo's free camera on the whole model, with its point in a frame whose z points up."""
    found = mujoco.MjvCamera()
    mujoco.mjv_defaultFreeCamera(model, found)
    found.lookat[:] = np.asarray(found.lookat) @ turned_upright(model)
    return found


def turn_upright(scene: mujoco.MjvScene, model: mujoco.MjModel) -> None:
    """Turn the cameras and the headlight of a scene, which a free camera of this module has set, from z up to up.

    MuJoCo's free camera itself knows no other up than z.
    """
    upright = turned_upright(model)
    headlights = [light for light in scene.lights[: scene.nlight] if light.headlight]
    turned = [vector for eye in scene.camera for vector in (eye.pos, eye.forward, eye.up)]
    turned += [vector for light in headlights for vector in (light.pos, light.dir)]
    for vector in turned:
        vector[:] = upright @ np.asarray(vector, dtype=np.float64)


def muscle_points(model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.float64]:
    """Return the places (n, 3) of all sites of tendons and tuples [m]."""
    on_tendons = model.wrap_objid[model.wrap_type == int(mujoco.mjtWrap.mjWRAP_SITE)]
    in_tuples = model.tuple_objid[model.tuple_objtype == int(mujoco.mjtObj.mjOBJ_SITE)]
    sites = np.union1d(on_tendons, in_tuples)
    return data.site_xpos[sites]


def extent(points: NDArray[np.float64]) -> float:
    """Return the diagonal of the box around points (n, 3) [m]; 0 if there are none."""
    return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0
