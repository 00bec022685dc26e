"""The file as a tree of elements: decoded, parsed, with versions and default values sorted out."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from xml.parsers import expat

from mjwrap.errors import OsimError
from mjwrap.osim.reading.nodes import Document, Node

DEEPEST = 60  # elements inside one another; models have about 15
OLDEST = 20000  # the document version of OpenSim 2.0
PACKED = (b"\x1f\x8b", b"PK", b"BZ")  # first bytes of gzip, zip and bzip2
_AMPERSAND = re.compile(r"&(?!(amp|lt|gt|quot|apos|#\d+|#x[0-9a-fA-F]+);)")


def read_document(path: Path) -> Node:
    """Return the root element <OpenSimDocument> of a file."""
    try:
        data = path.read_bytes()
    except OSError as problem:
        raise OsimError(f"{path}: cannot be read: {problem.strerror or problem}") from None
    if not data.strip():
        raise OsimError(f"{path}: is empty")
    if data[:2] in PACKED:
        raise OsimError(f"{path}: is compressed; unpack it first")
    document = Document(str(path))
    root = parse(_decoded(data), document)
    if root.tag != "OpenSimDocument":
        raise OsimError(f"{path}: is not an OpenSim file: its root is <{root.tag}>, not <OpenSimDocument>")
    text = root.attributes.get("Version", "")
    if not text.strip().isdigit():
        raise OsimError(
            f"{path}: <OpenSimDocument> has no version number; open it in OpenSim and save it again"
        )
    document.version = int(text)
    if document.version < OLDEST:
        raise OsimError(
            f"{path}: has document version {document.version}, older than OpenSim 2.0; "
            "open it in OpenSim and save it again"
        )
    for node in list(root.walk()):
        if node.tag.endswith("Set") and node.attributes.get("file", "").strip():
            _include(node, path.parent / node.attributes["file"].strip())
    _apply_defaults(root)
    return root


def _include(node: Node, path: Path) -> None:
    """Fill a set from the file that it names."""
    try:
        data = path.read_bytes()
    except OSError as problem:
        raise node.error(f"its file {path} cannot be read: {problem.strerror or problem}") from None
    document = replace(node.document, file=str(path))  # with the same list of notes
    found = next((inner for inner in parse(_decoded(data), document).walk() if inner.tag == node.tag), None)
    if found is None:
        raise node.error(f"its file {path} has no <{node.tag}>")
    node.children = found.children
    for child in node.children:
        child.parent = node


def parse(text: str, document: Document) -> Node:
    """Return the root of an XML text. Comments go first, as OpenSim's own parser allows "--" in them."""
    text = re.sub(r"<!--.*?-->", _blank, text, flags=re.DOTALL)
    text = re.sub(r"^\s*<\?xml.*?\?>", _blank, text, count=1, flags=re.DOTALL)
    text = _AMPERSAND.sub("&amp;", text)
    builder = _Builder(document)
    try:
        builder.parser.Parse(text.lstrip("\ufeff"), True)
    except expat.ExpatError as problem:
        reason = expat.ErrorString(problem.code) or "is not XML"
        raise OsimError(
            f"{document.file}, line {problem.lineno}, column {problem.offset + 1}: is not well-formed XML: {reason}; "
            "the file may be cut off or damaged"
        ) from None
    assert builder.root is not None
    return builder.root


class _Builder:
    def __init__(self, document: Document) -> None:
        self.document = document
        self.root: Node | None = None
        self.open: list[Node] = []
        self.parser = expat.ParserCreate()  # without name spaces: "::" is then a part of a tag
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.CharacterDataHandler = self.characters
        self.parser.StartDoctypeDeclHandler = self.doctype

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        parent = self.open[-1] if self.open else None
        node = Node(tag, attributes, self.parser.CurrentLineNumber, self.document, parent)
        if len(self.open) >= DEEPEST:
            raise node.error(f"lies inside {DEEPEST} other elements, deeper than any OpenSim model")
        if parent is None:
            self.root = node
        else:
            parent.children.append(node)
        self.open.append(node)

    def end(self, tag: str) -> None:
        self.open.pop()

    def characters(self, text: str) -> None:
        self.open[-1].text += text

    def doctype(self, *_: object) -> None:
        raise OsimError(
            f"{self.document.file}, line {self.parser.CurrentLineNumber}: has a <!DOCTYPE>, which may define entities; "
            "OpenSim files have none: remove it"
        )


def _decoded(data: bytes) -> str:
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _blank(match: re.Match[str]) -> str:
    return "\n" * match[0].count("\n")


def _apply_defaults(root: Node) -> None:
    """Give every element the one of its class in <defaults>, which has the values that it lacks."""
    classes: dict[str, Node] = {}
    inside: set[int] = set()
    for node in root.walk():
        if node.tag == "defaults":
            for child in node.children:
                classes.setdefault(child.tag, child)
            inside.update(id(below) for below in node.walk())
    if not classes:
        return
    for node in root.walk():
        if id(node) not in inside:
            node.fallback = classes.get(node.tag)
