"""Write frames to a file: MP4 with PyAV, GIF with Pillow; each is loaded only when needed."""

from __future__ import annotations

import importlib
from fractions import Fraction
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import RecordingError

Picture = NDArray[np.uint8]
GIF_RATE = 50.0  # largest frame rate at which viewers play a GIF at full speed
_QUALITY = "18"  # x264's constant rate factor: almost no visible loss


class Writer(Protocol):
    """A writer of numbered pictures, in increasing order; a missing number repeats the picture before it."""

    def add(self, picture: Picture, number: int) -> None:
        """Append a picture (height, width, 3)."""
        ...

    def finish(self, end: int) -> None:
        """Complete the file; end: the number that the next picture would have had."""
        ...

    def abandon(self) -> None:
        """Close the file as it is."""
        ...


class Mp4:
    """H.264 in MP4, which browsers and slides can play; written during the run."""

    def __init__(self, part: Path, rate: float, width: int, height: int) -> None:
        if width % 2 or height % 2:
            raise RecordingError(f"width and height of an .mp4 must be even, not {width} and {height}")
        try:
            av: Any = importlib.import_module("av")
        except ImportError as error:
            raise RecordingError(
                f"cannot write .mp4: {error}; install PyAV with: pip install 'mjwrap[video]', or pip install av; or "
                "write a .gif"
            ) from error
        self._av = av
        fraction = Fraction(rate).limit_denominator(1000)
        self._file: Any = av.open(str(part), "w", format="mp4", options={"movflags": "+faststart"})
        stream: Any = self._file.add_stream("libx264", rate=fraction, options={"crf": _QUALITY})
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.time_base = stream.codec_context.time_base = 1 / fraction
        self._stream = stream

    def add(self, picture: Picture, number: int) -> None:
        """Encode a picture."""
        frame = self._av.VideoFrame.from_ndarray(picture, format="rgb24")
        frame.pts, frame.time_base = number, self._stream.codec_context.time_base
        self._file.mux(self._stream.encode(frame))

    def finish(self, end: int) -> None:
        """Encode the remaining pictures and close."""
        self._file.mux(self._stream.encode(None))
        self._file.close()

    def abandon(self) -> None:
        """Close without encoding the remaining pictures."""
        self._file.close()


class Gif:
    """A GIF that repeats, with 256 colours per picture; kept in memory until it is finished."""

    def __init__(self, part: Path, rate: float, width: int, height: int) -> None:
        if rate > GIF_RATE:
            raise RecordingError(
                f"a .gif shows at most {GIF_RATE:g} frames a second, not {rate:g}; write an .mp4"
            )
        try:
            image: Any = importlib.import_module("PIL.Image")
        except ImportError as error:
            raise RecordingError(
                f"cannot write .gif: {error}; install Pillow with: pip install 'mjwrap[video]', or pip install pillow"
            ) from error
        self._image = image
        self._part, self._rate = part, rate
        self._pictures: list[Any] = []
        self._numbers: list[int] = []

    def add(self, picture: Picture, number: int) -> None:
        """Reduce a picture to its 256 colours and keep it."""
        self._pictures.append(self._image.fromarray(picture).quantize(256))
        self._numbers.append(number)

    def finish(self, end: int) -> None:
        """Write all pictures; their times are rounded to hundredths of a second such that the sum is right."""
        ticks = np.rint(100.0 * np.array([*self._numbers, end]) / self._rate).astype(int)
        self._pictures[0].save(
            self._part, format="GIF", save_all=True, append_images=self._pictures[1:], loop=0,
            duration=[int(10 * ticks_shown) for ticks_shown in np.diff(ticks)],
        )  # fmt: skip
        self.abandon()

    def abandon(self) -> None:
        """Discard the pictures."""
        self._pictures.clear()


FORMATS: dict[str, type[Mp4] | type[Gif]] = {".mp4": Mp4, ".gif": Gif}
