"""Whether a folder is safe for machine code: loading the code runs it, so that nobody else may be able to write it.

The folder, all folders that contain it, and the links on the way are checked. Trusted owners are root, this user and
the owner of the root folder, who inside a container may be a user without a name. Folders to which a group may write
are refused, except for the private group that many systems give to each user. Where anyone may write, as in /tmp, the
sticky bit has to keep others from replacing files, and the next folder has to belong to a trusted owner.
"""

from __future__ import annotations

import contextlib
import os
import stat
from pathlib import Path


def objection(folder: Path) -> str | None:
    """Return why a folder, which need not exist yet, is not safe for machine code; None where it is safe.

    Raises `OSError` where its path leads through a file, or cannot be read.
    """
    # there the folders of a profile belong to its user; owners and groups have no numbers
    if os.name == "nt":
        return None
    ways = _ways(folder)
    if ways is None:
        return f"{folder} leads through too many links"
    me, ends = os.getuid(), {Path(os.path.abspath(folder)), Path(os.path.realpath(folder))}
    for way in ways:
        try:
            found = os.lstat(way)
        except FileNotFoundError:
            continue  # it will be made with mode 0700, in a folder that is checked here
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
    """Return a folder and all folders and links on its path; None where there are too many links."""
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
    """Return whether a group is private to this user: the main group, of the user's name, without other members."""
    with contextlib.suppress(ImportError, KeyError, OSError):
        import grp
        import pwd

        user, entry = pwd.getpwuid(os.getuid()), grp.getgrgid(group)
        return user.pw_gid == group and entry.gr_name == user.pw_name and not {*entry.gr_mem} - {user.pw_name}
    return False
