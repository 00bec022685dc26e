"""`FilmLook`: background, colours, surfaces and legend of a film, put into each of its frames."""

from __future__ import annotations

import contextlib
from collections.abc import Callable

import mujoco
import numpy as np

from mjwrap import validation
from mjwrap.errors import RecordingError
from mjwrap.video.background import (
    background_color,
    brighten,
    floor_color,
    paint_background,
    scenery,
)
from mjwrap.video.camera import extent, muscle_points
from mjwrap.video.formats import Picture
from mjwrap.video.legend import Legend
from mjwrap.video.muscle_looks import MuscleLooks, check_colors, hide, pale_floors

MOST = 0.25  # of a frame, that a legend may cover which nobody asked for


class FilmLook:
    """The look of a film; see `Video` for the options. width, height: of a frame [pixels]."""

    def __init__(
        self,
        background: str,
        colors: str | None,
        surfaces: bool | None,
        legend: bool | None,
        width: int,
        height: int,
    ) -> None:
        check_colors(colors)
        for name, value in (("surfaces", surfaces), ("legend", legend)):
            good = value is None or (isinstance(value, bool | np.bool_ | int) and value in (0, 1))
            validation.require(good, name, "True, False or None", value, RecordingError)
        self._color = background_color(background)
        self._dark = self._color is not None and float(np.mean(self._color)) < 0.5
        self._options, self._size, self._wants_legend = (colors, surfaces), (width, height), legend
        self._data: mujoco.MjData | None = None
        self._looks: MuscleLooks | None = None
        self._legend: Legend | None = None
        self._left_out: set[int] = set()
        self._legend_made = False

    def dress(self, data: mujoco.MjData) -> Callable[[mujoco.MjvScene, mujoco.MjrContext], None]:
        """Return what changes a filled scene of `data`, and its context, for this look."""
        looks = self._looks
        if looks is None or data is not self._data:
            looks = self._looks = MuscleLooks(data, *self._options, dark=self._dark)
            self._data = data
            self._begin(data, looks)
        return lambda scene, context: self._dress(scene, context, data, looks)

    def finish(self, picture: Picture) -> Picture:
        """Return a picture with the legend."""
        if self._legend is not None:
            self._legend.put(picture)
        return picture

    def _begin(self, data: mujoco.MjData, looks: MuscleLooks) -> None:
        """Find out what the first frame tells: scenery to leave out, and the legend."""
        if self._color is not None:
            points = muscle_points(data.model, data)
            if size := extent(points):
                middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
                self._left_out = scenery(data.model, data, middle, size)
        if self._legend_made:
            return
        self._legend_made = True
        entries = looks.legend()
        if entries and (self._wants_legend or (self._wants_legend is None and looks.few)):
            # a legend that nobody asked for needs no error if Pillow is missing
            with contextlib.nullcontext() if self._wants_legend else contextlib.suppress(RecordingError):
                self._legend = Legend(entries, self._size[1], dark=self._dark)
        most = MOST * self._size[0] * self._size[1]
        if self._legend is not None and not self._wants_legend and self._legend.area > most:
            self._legend = None

    def _dress(
        self, scene: mujoco.MjvScene, context: mujoco.MjrContext, data: mujoco.MjData, looks: MuscleLooks
    ) -> None:
        looks.dress(scene, data)
        if self._color is not None:
            hide(scene, self._left_out)
            if not data.model.nlight:
                brighten(scene)
            pale_floors(scene, floor_color(self._color))
            paint_background(scene, context, self._color)
