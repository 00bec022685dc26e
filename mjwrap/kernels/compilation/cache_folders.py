"""Where machine code is kept: one folder of the user, with one folder in it for each version of each module."""

from __future__ import annotations

import atexit
import contextlib
import os
import re
import shutil
import sys
import tempfile
import time
import uuid
from functools import cache
from pathlib import Path
from typing import Any

from numba.core import config as numba_config

from mjwrap.kernels.compilation import folder_owners

config: Any = numba_config  # its variables, set from the environment, are not known to type checkers

_DAY = 86_400.0  # [s]
_UNUSED = 30 * _DAY  # versions that were not used for longer are removed
_KEPT = 3  # newest versions of a module, kept however old
# The second form is that of mjwrap 0.1 and before.
_VERSION = re.compile(r"(.+)-[0-9a-f]{16}|[0-9a-f]{16}|.+\.gone-[0-9a-f]{8}")
_REFUSED = "mjwrap: no machine code is kept in {}: {}; it is kept in {} instead"


@cache
def base() -> Path:
    """Return the folder of all machine code; it stays the same as long as this process lives."""
    return find_base()


def find_base() -> Path:
    """Return the best folder for machine code, created and writable; print which folders cannot be trusted."""
    refused: list[tuple[Path, str]] = []
    found = next((folder for folder in _candidates() if _is_fit(folder, refused)), None) or private()
    for folder, reason in refused:
        print(_REFUSED.format(folder, reason, found), file=sys.stderr, flush=True)
    return found


def _candidates() -> list[Path]:
    """Return the folders in which machine code may be kept, best first."""
    found = []
    if config.CACHE_DIR:  # NUMBA_CACHE_DIR
        found.append(Path(config.CACHE_DIR) / "mjwrap")
    if os.environ.get("XDG_CACHE_HOME"):  # on any system
        found.append(Path(os.environ["XDG_CACHE_HOME"]) / "mjwrap")
    else:
        import platformdirs  # takes some milliseconds

        # a user without a home: newer versions raise, older ones return a relative path
        with contextlib.suppress(RuntimeError):
            usual = platformdirs.user_cache_path("mjwrap", appauthor=False)
            if usual.is_absolute():
                found.append(usual)
    user = os.environ.get("USER", os.environ.get("USERNAME", "user"))
    found.append(Path(tempfile.gettempdir()) / f"mjwrap-{user}")
    return found


def _is_fit(folder: Path, refused: list[tuple[Path, str]]) -> bool:
    """Return whether machine code can be kept in a folder, made where missing; add to `refused` why it must not."""
    try:
        reason = folder_owners.objection(folder)  # before anything is written to a folder of somebody else
        if reason is None:
            make(folder)
            with tempfile.TemporaryFile(dir=folder):
                reason = folder_owners.objection(folder)  # somebody else may have made it meanwhile
    except OSError:
        return False
    if reason is not None:
        refused.append((folder, reason))
    return reason is None


@cache
def private() -> Path:
    """Return a folder for this process alone, which is removed when the process ends."""
    folder = tempfile.mkdtemp(prefix="mjwrap-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def make(folder: Path) -> None:
    """Make a folder and its missing parents, readable by this user only."""
    missing = [way for way in (folder, *folder.parents) if not way.exists()]
    for way in reversed(missing):
        way.mkdir(mode=0o700, exist_ok=True)
    if not folder.is_dir():
        raise NotADirectoryError(folder)


def make_version(folder: Path) -> None:
    """Make the folder of one version of a module, and remove old ones of it."""
    if not folder.is_dir():
        make(folder)
        prune(folder)


def use(folder: Path) -> None:
    """Note, once a day, that a version is in use."""
    with contextlib.suppress(OSError):
        if time.time() - folder.stat().st_mtime > _DAY:
            os.utime(folder)


def prune(new: Path) -> None:
    """Remove versions of a module that were not used for long, except the newest, and leftovers of older mjwraps."""
    module = _module_of(new.name)
    versions: list[tuple[float, Path]] = []
    with contextlib.suppress(OSError):
        for folder in new.parent.iterdir():
            if folder != new and _module_of(folder.name) in (module, ""):
                with contextlib.suppress(OSError):
                    versions.append((_last_use(folder), folder))
    versions.sort(reverse=True)
    newest = [folder for _, folder in versions if _module_of(folder.name)][: _KEPT - 1]
    for _, folder in versions:
        if folder not in newest:
            _remove_unused(folder)


def _module_of(folder: str) -> str | None:
    """Return the module whose version a folder holds: "" for leftovers, None for anything else."""
    found = _VERSION.fullmatch(folder)
    return (found.group(1) or "") if found else None


def _last_use(folder: Path) -> float:
    """Return when a version was last used or added to."""
    dates = [folder.stat().st_mtime]
    # older mjwraps wrote to folders in it, which leaves its own date unchanged
    if not _module_of(folder.name):
        dates += [below.stat().st_mtime for below in folder.iterdir()]
    return max(dates)


def _remove_unused(folder: Path) -> None:
    """Remove a version unless it was used lately; it is renamed first, so that no other process sees half of it."""
    with contextlib.suppress(OSError):
        # checked at the last moment: another process may just have begun to use it
        if time.time() - _last_use(folder) > _UNUSED:
            gone = folder.with_name(f"{folder.name}.gone-{uuid.uuid4().hex[:8]}")
            folder.rename(gone)
            shutil.rmtree(gone, ignore_errors=True)
