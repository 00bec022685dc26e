"""Draw a model without a window, with MuJoCo's renderer and any OpenGL backend that works."""

from __future__ import annotations

import contextlib
import importlib
import os
import sys
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import RecordingError

MAXGEOM = 20_000  # largest number of geoms in the scene, as in MuJoCo's viewer
_CHOICE = "MUJOCO_GL"


def _backends() -> Iterator[tuple[str, str]]:
    """Yield name and module of the backends to try: the one that MUJOCO_GL names, else those that may work here."""
    chosen = os.environ.get(_CHOICE, "").strip()
    headless = sys.platform == "linux" and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    )
    if not chosen and headless:
        yield "egl", "mujoco.egl"
        yield "osmesa", "mujoco.osmesa"
    else:
        yield f"{_CHOICE}={chosen}" if chosen else "window system", "mujoco.gl_context"


class Offscreen:
    """A canvas of a given size [pixels] for one model; `picture` must be called in the thread that made the canvas.

    shadows: draw them, which on a processor takes several times as long. Raises RecordingError, with the error of each
    backend, if no OpenGL works.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int, *, shadows: bool = True) -> None:
        self._model, self._rect = model, mujoco.MjrRect(0, 0, width, height)
        faults = []
        for name, module in _backends():
            try:
                with warnings.catch_warnings():  # GLFW warns, and then fails
                    warnings.simplefilter("ignore")
                    self._open(importlib.import_module(module), width, height)
                break
            except Exception as error:  # every backend raises errors of its own
                faults.append(f"{name}: {str(error).strip() or type(error).__name__}")
        else:
            raise RecordingError(
                f"cannot draw: no OpenGL works here ({'; '.join(faults)}); where there is no display, set "
                f"{_CHOICE}=egl (a graphics card's driver, or Mesa's libEGL) or {_CHOICE}=osmesa (libOSMesa) before "
                f"mujoco is imported"
            )
        self._dressed = False
        self._scene = mujoco.MjvScene(model, MAXGEOM)
        self._scene.flags[int(mujoco.mjtRndFlag.mjRND_SHADOW)] = shadows

    def _open(self, backend: Any, width: int, height: int) -> None:
        if not hasattr(backend, "GLContext"):
            raise RuntimeError("switched off")
        context = backend.GLContext(width, height)
        try:
            context.make_current()
            renderer = mujoco.MjrContext(self._model, int(mujoco.mjtFontScale.mjFONTSCALE_100))
        except BaseException:
            with contextlib.suppress(Exception):
                context.free()
            raise
        mujoco.mjr_resizeOffscreen(width, height, renderer)
        mujoco.mjr_setBuffer(int(mujoco.mjtFramebuffer.mjFB_OFFSCREEN), renderer)
        self._context: Any = context
        self._renderer = renderer

    def picture(
        self,
        data: mujoco.MjData,
        camera: mujoco.MjvCamera,
        option: mujoco.MjvOption,
        dress: Callable[[mujoco.MjvScene, mujoco.MjrContext], object] | None = None,
    ) -> NDArray[np.uint8]:
        """Return the picture of a state, (height, width, 3), red, green and blue from the upper left on.

        dress: changes the scene, and the context that draws it, after MuJoCo has filled the scene.
        """
        self._context.make_current()
        every = int(mujoco.mjtCatBit.mjCAT_ALL)
        mujoco.mjv_updateScene(self._model, data, option, None, camera, every, self._scene)
        if dress is not None:
            dress(self._scene, self._renderer)
            if not self._dressed:  # MuJoCo draws its first scene with the fog that the context was made with
                self._dressed = True
                mujoco.mjr_render(mujoco.MjrRect(0, 0, 1, 1), self._scene, self._renderer)
        mujoco.mjr_render(self._rect, self._scene, self._renderer)
        pixels = np.empty((self._rect.height, self._rect.width, 3), dtype=np.uint8)
        mujoco.mjr_readPixels(pixels, None, self._rect, self._renderer)
        return np.ascontiguousarray(pixels[::-1])

    def close(self) -> None:
        """Free the canvas's OpenGL resources; a second call does nothing."""
        if self._context is not None:
            self._context.make_current()
            self._renderer.free()
            self._context.free()
            self._context = None
