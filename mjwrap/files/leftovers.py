"""Temporary files that a killed process has left: how they are named, and finding those whose process is gone."""

from __future__ import annotations

import contextlib
import os
import platform
import re
import uuid
from pathlib import Path

_PART = re.compile(r"\..+\.(?P<host>[^.]*)-(?P<process>\d+)-[0-9a-f]{8}\.part(\.\w+)?")


def part_name(path: Path) -> str:
    """Return a new name for the temporary file of `path`, hidden beside it, that says whose it is."""
    return f".{path.stem}.{_host()}-{os.getpid()}-{uuid.uuid4().hex[:8]}.part{path.suffix}"


def remove_leftovers(folder: Path) -> list[Path]:
    """Remove temporary files in a folder whose process, of this machine, has ended; return them.

    On Windows, where a process cannot be asked for without ending it, the system refuses to remove what is in use.
    """
    removed = []
    with contextlib.suppress(OSError):
        for path in folder.glob(".*.part*"):
            named = _PART.fullmatch(path.name)
            if named and named["host"] == _host() and not _is_alive(int(named["process"])):
                with contextlib.suppress(OSError):
                    path.unlink()
                    removed.append(path)
    return removed


def _host() -> str:
    return re.sub(r"[^\w-]", "_", platform.node())[:40]


def _is_alive(process: int) -> bool:
    if process == os.getpid():
        return True
    if os.name == "nt":
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True  # another user's
    return True
