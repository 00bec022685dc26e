"""Recordings made by commands: their settings, their `Recorder`, and serving them to a browser."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mjwrap.cli.common.output import check_unread, opened
from mjwrap.cli.common.stopping import Stopped
from mjwrap.recording import Recorder, Server

LOCAL = "local"  # the viewer on this machine


@dataclass(frozen=True)
class RecordingSettings:
    """The settings of a recording.

    path: a file, or None. connect: the address of a viewer, LOCAL for the viewer on this machine, or empty. rate [Hz],
    groups (names of muscles by group) and force_scale [m/N] as `Recorder` takes them.
    """

    path: str | None = None
    connect: str = ""
    rate: float | None = None
    groups: Mapping[str, Sequence[str]] | None = None
    force_scale: float | None = None

    @property
    def wanted(self) -> bool:
        """Whether a recording is asked for."""
        return bool(self.path or self.connect)


def open_recorder(
    settings: RecordingSettings, model: Any, muscles: Any, stack: contextlib.ExitStack
) -> Recorder:
    """Return the recorder of the settings; `stack` closes it."""
    if settings.path is not None:
        check_unread(settings.path, "--record")
    recorder = opened(
        lambda: Recorder(
            model,
            muscles,
            settings.path,
            connect=True if settings.connect == LOCAL else settings.connect,
            rate=settings.rate,
            groups=settings.groups,
            force_scale=settings.force_scale,
        )
    )
    return stack.enter_context(recorder)


def end(server: Server) -> None:
    """Stop a server."""
    server.process.terminate()
    server.process.wait()


def serve_until_stopped(server: Server, tell: Callable[[], object]) -> int:
    """Print the address, and serve until Ctrl-C or until the server ends; return the exit code."""
    try:
        tell()
        return server.process.wait()
    except Stopped as stop:
        return 0 if stop.name == "Ctrl-C" else stop.code
    finally:
        end(server)
