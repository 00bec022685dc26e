"""Films of a simulation, drawn offscreen by MuJoCo's renderer."""

from mjwrap.video.film import Video

__all__ = ["Video"]
