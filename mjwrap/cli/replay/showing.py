"""Show a recording in a viewer or browser, describe it, or make one from a table of states."""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

from mjwrap.cli.common.errors import UserError
from mjwrap.cli.common.output import Report, say
from mjwrap.cli.common.recorded import serve_until_stopped
from mjwrap.cli.replay.settings import ReplaySettings, StatesSettings
from mjwrap.errors import RecordingError
from mjwrap.files.atomic import uninterrupted
from mjwrap.recording import Summary, open_native, read_summary, serve
from mjwrap.text import counted


def replay(settings: ReplaySettings) -> int:
    """Show, record or describe a file; a damaged recording is an error, so that no empty viewer opens."""
    try:
        if settings.states is None:
            return show(settings, settings.file)
        return replay_states(settings, settings.states)
    except RecordingError as error:
        raise UserError(str(error)) from None


def show(settings: ReplaySettings, path: str) -> int:
    """Describe a recording, or show it."""
    summary = read_summary(path)
    if settings.info or settings.json:
        report = Report(settings.json)
        report.say(describe(summary))
        report.finish({name: str(x) if isinstance(x, Path) else x for name, x in vars(summary).items()})
        return 0
    if settings.serve or not has_display():
        with uninterrupted():
            server = serve(path, settings.port)
        return serve_until_stopped(server, lambda: say(served(settings, summary, server.address)))
    return open_native(path)


def served(settings: ReplaySettings, summary: Summary, address: str) -> str:
    """Return what --serve has started, and where; the address is the last word."""
    why = "" if settings.serve else "there is no display for rerun's viewer, so "
    what = f"{summary.model}, {summary.start:g} s to {summary.end:g} s, {counted(summary.states, 'state')}"
    return (
        f"{why}rerun serves its viewer for a browser on this machine at port {settings.port}, and the recording "
        f"({what}) at port {settings.port + 1}\n"
        f"press Ctrl-C to stop it\n"
        f"open {address}"
    )


def replay_states(settings: ReplaySettings, states: StatesSettings) -> int:
    """Compute paths and forces at the states of a table; show the recording, unless only files were asked for."""
    from mjwrap.cli.replay.states import (
        recompute,  # loads the muscles, which showing a recording does not need
    )

    if states.kept or settings.info or settings.json:
        return recompute(settings.file, states, json=settings.json)
    with tempfile.TemporaryDirectory(prefix="mjwrap-") as folder:
        path = os.path.join(folder, f"{Path(settings.file).stem}.rrd")
        return recompute(settings.file, states, recording=path) or show(settings, path)


def describe(summary: Summary) -> str:
    """Return the contents of a recording, one fact per line."""
    lines = [
        f"file      {summary.path} ({summary.path.stat().st_size / 1e6:.1f} MB)",
        f"model     {summary.model}",
        f"time      {summary.start:g} s to {summary.end:g} s, {counted(summary.states, 'state')}",
        f"muscles   {len(summary.muscles)}: {', '.join(summary.muscles)}",
        f"entities  {len(summary.entities)}:",
    ]
    return "\n".join(lines + [f"    {path}" for path in summary.entities])


def has_display() -> bool:
    """Whether a window can be opened."""
    return sys.platform in ("darwin", "win32") or any(
        os.environ.get(v) for v in ("DISPLAY", "WAYLAND_DISPLAY")
    )
