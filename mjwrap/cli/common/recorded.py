"""Recordings of commands: their settings, the `Recorder` that these ask for, and serving it to a browser."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mjwrap.cli.common.output import check_unread, opened
from mjwrap.cli.common.stopping import Stopped
from mjwrap.recording import Recorder, Server

LOCAL = "local"  # stands for the viewer on this machine


@dataclass(frozen=True)
class RecordingSettings:
    """Where a recording goes, and how it is made.

    path: a file, or None. connect: the address of a viewer, LOCAL for the one on this machine, or empty. rate [Hz],
    groups (names of muscles by group) and force_scale [m/N] as `Recorder` takes them.
    """

    path: str | None = None
    connect: str = ""
    rate: float | None = None
    groups: Mapping[str, Sequence[str]] | None = None
    force_scale: float | None = None

    @property
    def wanted(self) -> bool:
        """Whether anything is to be recorded."""
        return bool(self.path or self.connect)


def open_recorder(
    settings: RecordingSettings, model: Any, muscles: Any, stack: contextlib.ExitStack
) -> Recorder:
    """Return the recorder that the settings ask for, to be closed by `stack`."""
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
    """End a server."""
    server.process.terminate()
    server.process.wait()


def serve_until_stopped(server: Server, tell: Callable[[], object]) -> int:
    """Tell where, and serve until Ctrl-C or the end of the server; return the exit code."""
    try:
        tell()
        return server.process.wait()
    except Stopped as stop:
        return 0 if stop.name == "Ctrl-C" else stop.code
    finally:
        end(server)
