"""`Video`: films a simulation, at a constant ratio of film time to simulated time."""

from __future__ import annotations

import contextlib
import math
import os

import mujoco
import numpy as np

from mjwrap import validation
from mjwrap.errors import RecordingError
from mjwrap.files.atomic import PartFile, RunLog, require
from mjwrap.validation import is_positive
from mjwrap.video.camera import find_camera, look_at_muscles, turn_upright
from mjwrap.video.formats import FORMATS, Picture, Writer
from mjwrap.video.look import FilmLook
from mjwrap.video.offscreen import Offscreen

EARLY = 1e-6  # share of a frame's period by which it may be early, because times are rounded


class Video(RunLog):
    """Film a simulation as MuJoCo's renderer shows it, into an .mp4 or .gif file.

    It shows the muscles of a model that `install` or `load` returned. The file gets its name only when it is complete:
    at `close`, or at the end of a `with` block, also after Ctrl-C. After an error inside the block no file is left, and
    an existing file of that name is unchanged.

    Args:
        model: a mujoco.MjModel.
        path: a file name that ends in .mp4 or .gif.
        fps: frames per second of the film.
        speed: simulated seconds per second of the film.
        width: of a frame [pixels].
        height: of a frame [pixels].
        camera: name or id of a camera of the model, "muscles" for a camera that looks at all muscles when the film
            begins, a mujoco.MjvCamera, or None for MuJoCo's free camera on the whole model. Up is
            against gravity for "muscles" and None.
        option: a mujoco.MjvOption, which selects what is shown.
        background: "light", "dark", a colour "#RRGGBB", or "model" for the model's own sky and scenery. With a colour,
            planes lose their texture, and meshes of the world around the muscles or apart from them are left out.
        colors: of the muscles: "muscle" for one each, "activation" from blue at 0 to red at 1, "model" for MuJoCo's
            rules; None for "muscle" if the model gives several muscles all the same look, else "model".
        surfaces: True shows every wrapping surface, translucent; False none; None those that the model shows.
        legend: names beside their colours; None for a legend if colours tell at most 12 muscles apart.
        shadows: draw shadows, which without a graphics card takes several times as long.

    Raises:
        RecordingError: before the run, if no OpenGL works, the file cannot be written, or the package that writes it
            is not installed; from `log` or `close`, if the disk is full.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        path: str | os.PathLike[str],
        *,
        fps: float = 30.0,
        speed: float = 1.0,
        width: int = 640,
        height: int = 480,
        camera: str | int | mujoco.MjvCamera | None = None,
        option: mujoco.MjvOption | None = None,
        background: str = "light",
        colors: str | None = None,
        surfaces: bool | None = None,
        legend: bool | None = None,
        shadows: bool = False,
    ) -> None:
        validation.of_type(model, "MjModel", "model", RecordingError)
        validation.optional(option, mujoco.MjvOption, "option", RecordingError, "a mujoco.MjvOption")
        require("fps", fps, is_positive(fps), "a positive number of frames per second")
        require("speed", speed, is_positive(speed), "a positive number of simulated seconds per second")
        for name, pixels in (("width", width), ("height", height)):
            good = isinstance(pixels, int | float | np.integer) and pixels == pixels // 1
            require(name, pixels, good and 1 <= pixels <= 16384, "a number of pixels, 1 to 16384")
        validation.flag(shadows, "shadows", RecordingError)
        self._model, self._camera = model, find_camera(model, camera)
        self._free = camera is None or self._camera is None  # and so has to be turned to where up is
        self._option = option or mujoco.MjvOption()
        self._look = FilmLook(background, colors, surfaces, legend, int(width), int(height))
        self._signature = model.signature
        self._rate = fps / speed  # frames per simulated second
        self._start: float | None = None  # time of the first frame
        self._number, self._last_time = -1, -math.inf  # times of the last frame and of the last call
        target = PartFile(path, *FORMATS)
        size = int(width), int(height)
        with contextlib.ExitStack() as undo:
            undo.callback(target.discard)
            self._writer: Writer = FORMATS[target.path.suffix.lower()](target.part, fps, *size)
            undo.callback(self._writer.abandon)
            self._canvas = Offscreen(model, *size, shadows=shadows)
            undo.pop_all()
        release = contextlib.ExitStack()
        release.callback(self._canvas.close)
        release.callback(self._writer.abandon)
        self._begin(str(target.path), target, release.close)

    def log(self, data: mujoco.MjData) -> None:
        """Add the state of `data` to the film if a frame is due.

        The frame shows the last computed poses and paths, which after `mj_step` are those at the start of the step.
        Raises RecordingError if the disk is full, if time goes backwards (a film has one run), and after `close`.
        """
        if self._ended:
            raise RecordingError(f"cannot log to '{self._place}': {self._ended}")
        if data.signature != self._signature:
            raise RecordingError(f"cannot log to '{self._place}': this mjData belongs to another model")
        time = float(data.time)
        if not time >= self._last_time:
            raise RecordingError(
                f"cannot log at time {time} s after {self._last_time} s: one film is one run, in which time goes "
                "forward; close this Video and make another one after a reset"
            )
        self._last_time = time
        if self._start is None:
            self._start = time
        number = math.floor((time - self._start) * self._rate + EARLY)
        if number > self._number:
            self._number = number
            camera = self._camera = self._camera or look_at_muscles(self._model, data)
            self._guarded(lambda: self._writer.add(self._picture(data, camera), number))

    def _picture(self, data: mujoco.MjData, camera: mujoco.MjvCamera) -> Picture:
        dress = self._look.dress(data)

        def arrange(scene: mujoco.MjvScene, context: mujoco.MjrContext) -> None:
            if self._free:
                turn_upright(scene, self._model)
            dress(scene, context)

        return self._look.finish(self._canvas.picture(data, camera, self._option, arrange))

    @property
    def _empty(self) -> bool:
        return self._number < 0

    def _finish(self) -> None:
        if self._empty:
            raise RecordingError(f"nothing was logged to '{self._place}', so there is no film")
        self._writer.finish(self._number + 1)
        self._canvas.close()
