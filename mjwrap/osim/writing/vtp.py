"""Triangles of .vtp files (VTK's XML polygons): ASCII, base64, or appended, in base64 or raw; with zlib or without."""

from __future__ import annotations

import base64
import itertools
import re
import zlib
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from mjwrap.osim.description.functions import Array

TYPES = {"Float32": "f4", "Float64": "f8", "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4",
         "UInt32": "u4", "Int64": "i8", "UInt64": "u8"}  # fmt: skip


class MeshError(ValueError):
    """A mesh file cannot be read; the message says why."""


def read_vtp(content: bytes) -> tuple[Array, NDArray[np.int64]]:
    """Return vertices (n, 3) and triangles (m, 3) of a .vtp file; polygons and strips are cut into triangles."""
    raw = b""
    found = re.search(rb'<AppendedData[^>]*encoding="raw"[^>]*>\s*_', content)
    if found:
        end = content.rfind(b"</AppendedData>")
        raw = content[found.end() : end]
        content = content[: found.end()] + content[end:]
    try:
        root = ElementTree.fromstring(content)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise MeshError(f"is not XML: {error}") from None
    reader = _Arrays(root, raw)
    points: list[Array] = []
    triangles: list[NDArray[np.int64]] = []
    count = 0
    for piece in root.iter("Piece"):
        own = reader.of(piece.find("Points"), "")
        if own.size % 3:
            raise MeshError(f"has {own.size} coordinates of points, which is not a multiple of 3")
        own = own.reshape(-1, 3)
        for tag, cut in (("Polys", _fans), ("Strips", _strips)):
            cells = piece.find(tag)
            if cells is not None and len(cells):
                indices, ends = (_whole(reader.of(cells, name)) for name in ("connectivity", "offsets"))
                triangles.append(cut(indices, ends) + count)
        points.append(own)
        count += len(own)
    if not points or not triangles or not sum(map(len, triangles)):
        raise MeshError("has no polygons")
    vertices, faces = np.concatenate(points), np.concatenate(triangles)
    return vertices, faces


def _whole(numbers: Array) -> NDArray[np.int64]:
    if not (np.abs(numbers) < 2.0**31).all():
        raise MeshError("has indices that are no numbers of points")
    return numbers.astype(np.int64)


def _fans(indices: NDArray[np.int64], ends: NDArray[np.int64]) -> NDArray[np.int64]:
    starts = np.concatenate([[0], ends])[:-1]
    parts = [np.zeros((0, 3), dtype=np.int64)]
    for start, end in zip(starts, ends, strict=True):
        cell = indices[start:end]
        if len(cell) >= 3:
            parts.append(np.stack([np.full(len(cell) - 2, cell[0]), cell[1:-1], cell[2:]], axis=1))
    return np.concatenate(parts)


def _strips(indices: NDArray[np.int64], ends: NDArray[np.int64]) -> NDArray[np.int64]:
    starts = np.concatenate([[0], ends])[:-1]
    rows = []
    for start, end in zip(starts, ends, strict=True):
        cell = indices[start:end]
        for k in range(len(cell) - 2):
            a, b, c = cell[k : k + 3]
            rows.append((a, b, c) if k % 2 == 0 else (b, a, c))
    return np.array(rows, dtype=np.int64).reshape(-1, 3)


class _Arrays:
    """Reads the DataArray elements of a file."""

    def __init__(self, root: ElementTree.Element, raw: bytes) -> None:
        self.order = "<" if root.get("byte_order", "LittleEndian") == "LittleEndian" else ">"
        self.header = np.dtype(self.order + TYPES.get(root.get("header_type", "UInt32"), "u4"))
        self.compressed = bool(root.get("compressor"))
        appended = root.find("AppendedData")
        self.raw = raw
        self.text = "" if appended is None or raw else (appended.text or "").strip().lstrip("_")

    def of(self, parent: ElementTree.Element | None, name: str) -> Array:
        """Return the numbers of an element's array, of the only one without a name."""
        for array in () if parent is None else parent.iter("DataArray"):
            if not name or array.get("Name") == name:
                try:
                    return self._numbers(array).astype(np.float64)
                except (ValueError, IndexError, KeyError, zlib.error) as error:
                    raise MeshError(
                        f"has an array '{name or 'Points'}' that cannot be read: {error}"
                    ) from None
        raise MeshError(f"lacks the array '{name or 'Points'}'")

    def _numbers(self, array: ElementTree.Element) -> NDArray[np.generic]:
        dtype = np.dtype(self.order + TYPES[array.get("type", "Float32")])
        form = array.get("format", "ascii")
        if form == "ascii":
            return np.array((array.text or "").split(), dtype=np.float64)
        if form == "binary":
            return np.frombuffer(self._block(_Base64((array.text or "").strip())), dtype)
        offset = int(array.get("offset", "0"))
        source = _Raw(self.raw[offset:]) if self.raw else _Base64(self.text[offset:])
        return np.frombuffer(self._block(source), dtype)

    def _block(self, source: _Base64 | _Raw) -> bytes:
        if not self.compressed:
            size = int(np.frombuffer(source.take(self.header.itemsize, last=False), self.header)[0])
            return source.after(self.header.itemsize, size)
        head = np.frombuffer(source.take(3 * self.header.itemsize, last=False), self.header)
        blocks = int(head[0])
        length = (3 + blocks) * self.header.itemsize
        sizes = np.frombuffer(source.take(length), self.header)[3:]
        data = source.rest(length, int(sizes.sum()))
        ends = np.concatenate([[0], np.cumsum(sizes)]).astype(int)
        return b"".join(zlib.decompress(data[a:b]) for a, b in itertools.pairwise(ends))


class _Raw:
    """Bytes as they are."""

    def __init__(self, content: bytes) -> None:
        self.content = content

    def take(self, count: int, *, last: bool = True) -> bytes:
        """Return the first bytes."""
        return self.content[:count]

    def after(self, header: int, count: int) -> bytes:
        """Return what follows a header in the same block."""
        return self.content[header : header + count]

    def rest(self, header: int, count: int) -> bytes:
        """Return what follows a header in a block of its own."""
        return self.content[header : header + count]


class _Base64:
    """Bytes in base64: a header with its padding may be followed by a block of its own."""

    def __init__(self, text: str) -> None:
        self.text = "".join(text.split())

    def take(self, count: int, *, last: bool = True) -> bytes:
        """Return the first bytes."""
        return base64.b64decode(self.text[: 4 * -(-count // 3)])[:count]

    def after(self, header: int, count: int) -> bytes:
        """Return what follows a header in the same block."""
        return base64.b64decode(self.text[: 4 * -(-(header + count) // 3)])[header : header + count]

    def rest(self, header: int, count: int) -> bytes:
        """Return what follows a header in a block of its own."""
        start = 4 * -(-header // 3)
        return base64.b64decode(self.text[start : start + 4 * -(-count // 3)])[:count]
