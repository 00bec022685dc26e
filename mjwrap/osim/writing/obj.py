"""Triangles of .obj files (Wavefront): their vertices and faces, polygons cut into triangles; nothing else is read."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from mjwrap.osim.description.functions import Array
from mjwrap.osim.writing.vtp import MeshError


def read_obj(content: bytes) -> tuple[Array, NDArray[np.int64]]:
    """Return vertices (n, 3) and triangles (m, 3) of an .obj file."""
    vertices: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    text = content.decode("latin-1").replace("\\\r\n", " ").replace("\\\n", " ")
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split()
        try:
            if words[:1] == ["v"]:
                x, y, z = map(float, words[1:4])
                vertices.append([x, y, z])
            elif words[:1] == ["f"]:
                corners = [_index(word, len(vertices)) for word in words[1:]]
                faces += [(corners[0], b, c) for b, c in itertools.pairwise(corners[1:])]
        except ValueError:
            raise MeshError(f"has a line that cannot be read, line {number}") from None
    return np.array(vertices).reshape(-1, 3), np.array(faces, dtype=np.int64).reshape(-1, 3)


def _index(word: str, count: int) -> int:
    """Return the index from 0 of a corner such as 3/1/2; a negative one counts back from the last vertex so far."""
    index = int(word.split("/", 1)[0])
    found = index - 1 if index > 0 else count + index
    if not -1 < found < 2**31:
        raise ValueError
    return found
