"""Elements of an .osim file, with typed values and errors that name the place in the file."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import OsimError
from mjwrap.osim.description.model import Note
from mjwrap.osim.report import EXACT

Array = NDArray[np.float64]

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$")
_NOT_FINITE = {"nan": math.nan, "inf": math.inf, "infinity": math.inf}
LARGEST = 1e30  # magnitude of a number; powers of larger ones overflow
_TRUE, _FALSE = {"true", "1"}, {"false", "0"}

# Tags between a component and the one that owns it, which are no part of its path.
_TRANSPARENT = {
    "objects",
    "components",
    "frames",
    "coordinates",
    "attached_geometry",
    "path_elements",
    "Joint",
}


@dataclass(eq=False)
class Document:
    """What the elements of one file share: its name, its version, and what the reader has to say about it."""

    file: str
    version: int = 0
    notes: list[Note] = field(default_factory=list)


@dataclass(eq=False)
class Node:
    """An element of the file. `fallback` is the element of <defaults> that has the values that this one lacks."""

    tag: str
    attributes: dict[str, str]
    line: int
    document: Document
    parent: Node | None = None
    text: str = ""
    children: list[Node] = field(default_factory=list)
    fallback: Node | None = None

    @property
    def name(self) -> str:
        """The name attribute; empty where there is none."""
        return self.attributes.get("name", "").strip()

    @property
    def label(self) -> str:
        """Class and name, as messages say it."""
        if self.name:
            return f"{self.tag} '{self.name}'"
        named = self.parent
        while named is not None and not named.name:
            named = named.parent
        return f"{self.tag} of {named.tag} '{named.name}'" if named is not None else self.tag

    @property
    def path(self) -> str:
        """The path of the component in the model, such as /bodyset/femur_r."""
        parts: list[str] = []
        node: Node | None = self
        while node is not None and node.tag not in ("Model", "OpenSimDocument"):
            if node.tag.endswith("Set"):
                parts.append(node.tag.lower())
            elif node.tag not in _TRANSPARENT:
                parts.append(node.name or node.tag)
            node = node.parent
        return "/" + "/".join(reversed(parts))

    def error(self, text: str) -> OsimError:
        """Return the error that says what is wrong with this element."""
        return OsimError(f"{self.document.file}, line {self.line}: {self.label}: {text}")

    def note(self, text: str, outcome: str = EXACT) -> None:
        """Say something about this element in the report."""
        name = self.label.removeprefix(self.tag).strip().removeprefix("'").removesuffix("'")
        self.document.notes.append(Note(self.tag, name, text, outcome))

    def __iter__(self) -> Iterator[Node]:
        return iter(self.children)

    def walk(self) -> Iterator[Node]:
        """Yield this element and all below it, in the order of the file."""
        yield self
        for child in self.children:
            yield from child.walk()

    def find(self, *tags: str) -> Node | None:
        """Return the first child with one of these tags, the first tag first; else that of <defaults>."""
        for tag in tags:
            for child in self.children:
                if child.tag == tag:
                    return child
        return self.fallback.find(*tags) if self.fallback is not None else None

    def need(self, *tags: str) -> Node:
        """Return the first child with one of these tags, or say that it is missing."""
        found = self.find(*tags)
        if found is None:
            raise self.error(f"<{tags[0]}> is missing; add it, or save the model again with OpenSim")
        return found

    def objects(self, *tags: str) -> list[Node]:
        """Return the members of a set, or of a plain list, with one of these tags; none where it is missing."""
        found = self.find(*tags)
        if found is None:
            return []
        inner = found.find("objects")
        return list(inner.children if inner is not None else [c for c in found.children if c.tag != "groups"])

    def object(self, name: str) -> Node | None:
        """Return the object of a property: inside a tag with its name, or with its name as attribute."""
        for child in self.children:
            if child.tag == name:
                if child.children:
                    return child.children[0]
                if child.name == name:
                    return child
            elif child.name == name:
                return child
        return self.fallback.object(name) if self.fallback is not None else None

    def string(self, *tags: str, default: str | None = None) -> str:
        """Return the text of a child without blanks around it."""
        found = self.need(*tags) if default is None else self.find(*tags)
        return default or "" if found is None else found.text.strip()

    def words(self, *tags: str) -> list[str]:
        """Return the words of a child's text; none where it is missing."""
        found = self.find(*tags)
        return [] if found is None else found.text.split()

    def flag(self, *tags: str, default: bool) -> bool:
        """Return a child's text as true or false."""
        found = self.find(*tags)
        if found is None or not found.text.strip():
            return default
        text = found.text.strip().lower()
        if text not in _TRUE | _FALSE:
            raise found.error(f"must be true or false, not '{_short(text)}'")
        return text in _TRUE

    def numbers(self, *tags: str, finite: bool = True) -> list[float]:
        """Return all numbers of a child's text; none where it is missing."""
        found = self.find(*tags)
        return [] if found is None else found.values(finite)

    def values(self, finite: bool = True) -> list[float]:
        """Return the numbers of this element's text."""
        numbers = []
        for word in re.sub(r"[(),~\[\]]", " ", self.text).split():
            sign, bare = (-1.0, word[1:]) if word[0] == "-" else (1.0, word.lstrip("+"))
            if _NUMBER.match(word):
                value = float(word)
            elif bare.lower() in _NOT_FINITE:
                value = sign * _NOT_FINITE[bare.lower()]
            else:
                raise self.error(f"'{_short(word)}' is not a number")
            if math.isnan(value) or (finite and not math.isfinite(value)):
                raise self.error(f"must be a {'finite ' * finite}number, not {word}")
            if finite and abs(value) > LARGEST:
                raise self.error(f"{_short(word)} is larger than any number of a model")
            numbers.append(value)
        return numbers

    def number(self, *tags: str, default: float | None = None, finite: bool = True) -> float:
        """Return a child's text as one number; the default where it is missing or empty."""
        return self.vector(*tags, size=1, default=None if default is None else (default,), finite=finite)[
            0
        ].item()

    def vector(
        self, *tags: str, size: int, default: Sequence[float] | None = None, finite: bool = True
    ) -> Array:
        """Return a child's text as (size,) numbers; the default where it is missing or empty."""
        found = self.find(*tags) if default is not None else self.need(*tags)
        numbers = [] if found is None else found.values(finite)
        if not numbers and default is not None:
            numbers = list(default)
        if len(numbers) != size:
            wanted = "one number" if size == 1 else f"{size} numbers"
            raise (found or self).error(f"must be {wanted}, not {len(numbers)}")
        return np.array(numbers)


def _short(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "..."
