"""Whether a folder can hold machine code: loading it runs it, so nobody else may be able to have put it there.

Looked at are the folder, all that contain it, and the links on the way. Root, this user and whoever owns the root
folder are trusted: inside a container that may be a user without a name here. Folders that a group may write to
are refused, but for the private group that many systems give to each user. Where anyone may write, as in /tmp,
the sticky bit has to keep others from replacing what is in there, and the next folder has to be a trusted one's.
"""

from __future__ import annotations

import contextlib
import os
import stat
from pathlib import Path


def objection(folder: Path) -> str | None:
    """Return why a folder, there or still to be made, cannot hold machine code; None where it can.

    Raises `OSError` where the way to it leads through a file, or cannot be looked at.
    """
    if os.name == "nt":  # folders of a profile are its user's there; owners and groups are not numbered
        return None
    ways = _ways(folder)
    if ways is None:
        return f"{folder} leads through too many links"
    me, ends = os.getuid(), {Path(os.path.abspath(folder)), Path(os.path.realpath(folder))}
    for way in ways:
        try:
            found = os.lstat(way)
        except FileNotFoundError:
            continue  # made with mode 0700, in a folder that is looked at here
        if found.st_uid not in trusted():
            return f"{way} belongs to user {found.st_uid}"
        if not stat.S_ISDIR(found.st_mode):
            continue
        if found.st_mode & stat.S_ISVTX and way not in ends:
            continue
        if found.st_mode & stat.S_IWOTH:
            return f"anyone may write to {way}"
        if found.st_mode & stat.S_IWGRP and not (found.st_uid == me and _is_private(found.st_gid)):
            return f"group {found.st_gid} may write to {way}"
    return None


def trusted() -> set[int]:
    """Return the users whose folders can hold machine code that this one runs."""
    return {0, os.getuid(), os.lstat("/").st_uid}


def _ways(folder: Path) -> list[Path] | None:
    """Return a folder and all folders and links through which it is found; None where links go on and on."""
    found: dict[Path, None] = {}
    todo = [Path(os.path.abspath(folder)), Path(os.path.realpath(folder))]
    for path in todo:
        for way in (path, *path.parents):
            if way not in found and os.path.islink(way):
                if len(todo) > 40:
                    return None
                todo.append(Path(os.path.normpath(os.path.realpath(way.parent) / Path(os.readlink(way)))))
            found[way] = None
    return list(found)


def _is_private(group: int) -> bool:
    """Return whether a group is this user's own: its main one, of its name, with no other members."""
    with contextlib.suppress(ImportError, KeyError, OSError):
        import grp
        import pwd

        user, entry = pwd.getpwuid(os.getuid()), grp.getgrgid(group)
        return user.pw_gid == group and entry.gr_name == user.pw_name and not {*entry.gr_mem} - {user.pw_name}
    return False
