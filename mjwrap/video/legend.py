"""The legend of a film: the muscles' colours, or the scale of activations, drawn once with Pillow."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import RecordingError

Picture = NDArray[np.uint8]
Entry = tuple[str, Any, bool]  # text, colour (3,) from 0 to 1, whether it is a dot instead of a line
SIZE = 0.034  # height of the letters, as part of a frame's height
LEAST = 9  # [pixels]
OPACITY = 0.8  # of the box behind the text


class Legend:
    """A box of names beside their colours in a corner of frames."""

    def __init__(self, entries: Sequence[Entry], height: int, *, dark: bool) -> None:
        try:
            image, draw, font = (importlib.import_module(f"PIL.{name}") for name in ("Image", "ImageDraw", "ImageFont"))  # type: ignore[misc]  # fmt: skip
        except ImportError as error:
            raise RecordingError(f"no legend: {error}; install Pillow with: pip install pillow") from error
        letters = max(LEAST, round(SIZE * height))
        try:
            face: Any = font.load_default(size=letters)
        except TypeError:  # before Pillow 10.1, in one size only
            face = font.load_default()
        row, gap = round(1.35 * letters), round(0.4 * letters)
        wide = max(int(face.getlength(text)) for text, _, _ in entries)
        box = image.new(
            "RGB", (wide + row + 3 * gap, row * len(entries) + gap), (20, 20, 22) if dark else (255, 255, 255)
        )
        pen: Any = draw.Draw(box)
        for k, (text, color, dot) in enumerate(entries):
            middle = gap // 2 + row * k + row // 2
            rgb = tuple(round(255 * float(x)) for x in color)
            thick = max(2, letters // 3)
            if dot:
                place, radius = gap + row // 2, max(2, letters // 4)
                pen.ellipse((place - radius, middle - radius, place + radius, middle + radius), fill=rgb)
            else:
                pen.rectangle(
                    (gap, middle - thick // 2, gap + row - 1, middle + (thick + 1) // 2 - 1), fill=rgb
                )
            pen.text(
                (row + 2 * gap, middle),
                text,
                fill=(235, 235, 235) if dark else (25, 25, 28),
                font=face,
                anchor="lm",
            )
        self._corner: int | None = None
        self._box = np.asarray(box, dtype=np.uint8)

    @property
    def area(self) -> int:
        """Number of pixels that it covers."""
        return int(self._box.shape[0] * self._box.shape[1])

    def put(self, picture: Picture) -> None:
        """Draw the legend into a picture (height, width, 3), as much of it as fits.

        It stands in the corner that hides least of the first picture, and stays there.
        """
        rows, columns = min(len(self._box), len(picture)), min(self._box.shape[1], picture.shape[1])
        corners = [
            (slice(y, y + rows), slice(x, x + columns))
            for x in (0, picture.shape[1] - columns)
            for y in (0, len(picture) - rows)
        ]
        if self._corner is None:
            self._corner = min(range(4), key=lambda k: _contents(picture[corners[k]]))
        part, box = picture[corners[self._corner]], self._box[:rows, :columns]
        part[:] = np.rint((1.0 - OPACITY) * part + OPACITY * box).astype(np.uint8)


def _contents(part: Picture) -> int:
    """Return the number of pixels that differ from the most frequent colour."""
    colors = part[..., 0].astype(np.int64) << 16 | part[..., 1].astype(np.int64) << 8 | part[..., 2]
    return int(colors.size - np.unique(colors, return_counts=True)[1].max())
