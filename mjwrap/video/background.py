"""A background of one colour for films, and scenery of the world that would stand in front of it."""

from __future__ import annotations

import re
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import RecordingError
from mjwrap.validation import described

MODEL = "model"  # the model's own background: its sky and its scenery
NAMED = {"light": (0.90, 0.915, 0.935), "dark": (0.09, 0.10, 0.11)}
_HEX = re.compile(r"#[0-9a-fA-F]{6}")
FLOOR = 0.06  # difference in brightness of a floor from the background
SCENERY = 2.0  # a mesh of the world so many times larger than all muscles is a room around them
_NEAR, _FAR = 0.94, 0.98  # of the far clipping distance: where the fog begins, and where the backdrop stands
AMBIENT, DIFFUSE, SPECULAR = 0.4, 0.5, 0.2  # of the headlight of a model without lights
_FLAGS = ("mjRND_SKYBOX", "mjRND_HAZE", "mjRND_REFLECTION")


def background_color(background: str) -> NDArray[np.float64] | None:
    """Return red, green, blue from 0 to 1 of a name or "#RRGGBB"; None for the model's own background."""
    if isinstance(background, str) and background == MODEL:
        return None
    if isinstance(background, str) and background in NAMED:
        return np.array(NAMED[background])
    if isinstance(background, str) and _HEX.fullmatch(background):
        return np.array([int(background[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    names = ", ".join([*NAMED, MODEL])
    raise RecordingError(
        f"background must be one of {names}, or a colour '#RRGGBB', not {described(background)}"
    )


def paint_background(scene: mujoco.MjvScene, context: mujoco.MjrContext, color: NDArray[np.float64]) -> None:
    """Put a backdrop of one colour behind a scene whose geoms and camera are set.

    Without a sky MuJoCo clears to black. A far box in fog has exactly the fog's colour, whatever the lights are, and
    edges in front of it are smooth.
    """
    eye = scene.camera[0]
    if hasattr(mujoco, "mjv_averageCamera"):
        eye = mujoco.mjv_averageCamera(scene.camera[0], scene.camera[1])
    far, near = float(eye.frustum_far), float(eye.frustum_near)
    context.fogStart, context.fogEnd = _NEAR * far, 0.5 * (_NEAR + _FAR) * far
    context.fogRGBA[:] = [*color, 1.0]
    for name in _FLAGS:
        scene.flags[int(getattr(mujoco.mjtRndFlag, name))] = 0
    scene.flags[int(mujoco.mjtRndFlag.mjRND_FOG)] = 1
    if scene.ngeom >= scene.maxgeom:
        return
    forward, up = np.array(eye.forward, dtype=float), np.array(eye.up, dtype=float)
    turn = np.column_stack([np.cross(up, -forward), up, -forward])
    wide = 1.0 if eye.orthographic else _FAR * far / near
    half = 4.0 * wide * max(float(eye.frustum_top), abs(float(eye.frustum_bottom)), float(eye.frustum_width))
    backdrop = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(
        backdrop,
        int(mujoco.mjtGeom.mjGEOM_BOX),
        np.array([half, half, 1e-4 * far]),
        np.array(eye.pos, dtype=float) + _FAR * far * forward,
        turn.ravel(),
        np.array([*color, 1.0], dtype=np.float32),
    )
    backdrop.category = int(mujoco.mjtCatBit.mjCAT_DECOR)
    scene.ngeom += 1


def brighten(scene: mujoco.MjvScene) -> None:
    """Let the headlight be enough for a model without lights, which MuJoCo's default one leaves dark."""
    for light in scene.lights[: scene.nlight]:
        if light.headlight:
            light.ambient[:] = np.maximum(light.ambient, AMBIENT)
            light.diffuse[:] = np.maximum(light.diffuse, DIFFUSE)
            light.specular[:] = np.minimum(light.specular, SPECULAR)


def scenery(model: mujoco.MjModel, data: mujoco.MjData, middle: Any, size: float) -> set[int]:
    """Return the meshes of the world that surround the muscles (around a point, of a size [m]) or stand apart."""
    found = set()
    for i in np.flatnonzero((model.geom_bodyid == 0) & (model.geom_type == int(mujoco.mjtGeom.mjGEOM_MESH))):
        reach = float(model.geom_rbound[i])
        if reach > SCENERY * size > 0 or np.linalg.norm(data.geom_xpos[i] - middle) > reach + size > 0:
            found.add(int(i))
    return found


def floor_color(color: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a colour that differs a little from the background's."""
    return color - FLOOR if color.mean() > 0.5 else color + FLOOR
