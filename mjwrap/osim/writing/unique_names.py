"""Names of MJCF elements that MuJoCo and mjwrap accept and that no other element of the same kind has."""

from __future__ import annotations

import re

from mjwrap.osim.writing.document import Document


class UniqueNames:
    """The names that a document's elements of one kind have; `new` gives names that are still free."""

    def __init__(self, document: Document, *tags: str, section: str | None = None) -> None:
        root = document.section(section) if section else None
        found = [root] if root is not None else [document.bodies["ground"]]
        self._taken = {
            element.get("name", "") for part in found for tag in tags for element in part.iter(tag)
        }

    def new(self, wanted: str) -> str:
        """Return the wanted name without spaces and slashes, with a number behind it if it is taken."""
        name = plain = plain_name(wanted)
        count = 1
        while name in self._taken:
            count += 1
            name = f"{plain}_{count}"
        self._taken.add(name)
        return name


def plain_name(name: str) -> str:
    """Return a name as an element of a tuple can refer to it: spaces become underscores."""
    return re.sub(r"\s+", "_", name.strip())


def body_name(name: str) -> str:
    """Return the name of a body as written: MuJoCo calls ground "world"."""
    return name if name != "world" else "world_"
