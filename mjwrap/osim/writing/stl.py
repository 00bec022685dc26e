"""STL files: those of models, binary or text, and binary ones that MuJoCo accepts, which all meshes become."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mjwrap.osim.description.functions import Array
from mjwrap.osim.writing.vtp import MeshError

MOST_FACES = 200_000  # that MuJoCo reads from one file
FARTHEST = 1e9  # [file's unit] MuJoCo reads coordinates up to 2^30
LEAST_AREA = 1e-12  # [m^2] MuJoCo refuses meshes with less than 1e-15
FACE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])


def read_stl(content: bytes) -> tuple[Array, NDArray[np.int64]]:
    """Return vertices (n, 3) and triangles (m, 3) of an STL file."""
    count = int.from_bytes(content[80:84], "little")
    end = 84 + FACE.itemsize * count
    lines = [] if len(content) == end else content.decode("latin-1").splitlines()
    rows = [words[1:4] for words in map(str.split, lines) if words[:1] == ["vertex"]]
    if not rows and 84 < end <= len(content):
        points = np.frombuffer(content[84:end], FACE)["corners"].astype(np.float64).reshape(-1, 3)
    else:
        try:
            points = np.array(rows, dtype=np.float64).reshape(-1, 3)
        except ValueError:
            points = np.zeros((0, 3))
        if not len(points) or len(points) % 3:
            raise MeshError("is neither a binary nor a text STL file; it may be cut off")
    return points, np.arange(len(points)).reshape(-1, 3)


def triangles(vertices: Array, faces: NDArray[np.int64]) -> Array:
    """Return the corners (m, 3, 3) of all triangles that have an area in the 32 bits of an STL file.

    Raises MeshError for indices without a vertex, numbers that are not finite or too large, and too few triangles.
    """
    if faces.size and (faces.min() < 0 or faces.max() >= len(vertices)):
        raise MeshError("has triangles with points that it does not have")
    corners = vertices[faces]
    if not np.isfinite(corners).all():
        raise MeshError("has numbers that are not finite")
    if not np.abs(corners).max(initial=0.0) < FARTHEST:
        raise MeshError(f"has coordinates beyond {FARTHEST:g}")
    corners = corners.astype(np.float32).astype(np.float64)
    corners = corners[np.linalg.norm(area_vectors(corners), axis=1) > 0.0]
    if all(len(np.unique(some.reshape(-1, 3), axis=0)) < 4 for some in (corners[:100], corners)):
        raise MeshError("has no surface")
    if len(corners) > MOST_FACES:
        raise MeshError(f"has {len(corners)} triangles; MuJoCo reads {MOST_FACES}")
    return corners


def area_vectors(corners: Array) -> Array:
    """Return normals (m, 3) of triangles, as long as twice their area."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def binary_stl(corners: Array) -> bytes:
    """Return triangles (m, 3, 3) as a binary STL file."""
    normals = area_vectors(corners)
    records = np.zeros(len(corners), FACE)
    records["normal"] = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    records["corners"] = corners
    return b"mjwrap".ljust(80) + np.uint32(len(records)).tobytes() + records.tobytes()


def check_scaled(corners: Array, scale: tuple[float, ...]) -> None:
    """Raise MeshError if MuJoCo does not accept triangles after scaling: they are too small or too large."""
    x, y, z = scale
    area = 0.5 * float(np.linalg.norm(area_vectors(corners) * (y * z, z * x, x * y), axis=1).sum())
    if area < LEAST_AREA or not float(np.abs(corners * scale).max()) < FARTHEST:
        raise MeshError(
            f"is too small or too large with its scale factors {scale}: its area is {area:.3g} m^2"
        )
