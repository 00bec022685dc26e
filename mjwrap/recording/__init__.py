"""Recordings of a run for the rerun viewer: `Recorder` writes one, `read_summary` describes its contents."""

from mjwrap.recording.playback import Server, Summary, open_native, read_summary, serve
from mjwrap.recording.recorder import Recorder

__all__ = ["Recorder", "Server", "Summary", "open_native", "read_summary", "serve"]
