"""The static part of a recording: every geom of a MuJoCo model, and every wrapping surface, as a rerun shape."""

from typing import Any

import numpy as np
import rerun as rr

from mjwrap.surfaces import Capsule, Cylinder, Ellipsoid, Sphere, Surface
from mjwrap.surfaces.triangles import surface_grid, triangles

# mjtGeom; this package does not import mujoco
PLANE, HFIELD, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX, MESH, SDF = range(9)

DEFAULT_RGBA = (0.5, 0.5, 0.5, 1.0)
WRAP_ALPHA = 0.35
BODY_ALPHA = 0.5  # at first: bones stay recognisable, and muscles are seen behind and inside them
WIRE_ALPHA = 0.6
SMOOTH = 49  # points on the circles of a surface
FLOOR = 0.2  # brightness of a plane, which would be too bright without its texture


def geom_shape(model: Any, geom: int, *, wraps: bool) -> rr.AsComponents | None:
    """Return the shape of a geom in its own frame, or None for a kind without a shape.

    Infinite wrapping cylinders are drawn with the geom's half length; wrapping surfaces are translucent.
    """
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    rgba = _rgba(model, geom)
    if wraps:
        rgba[3] = min(rgba[3], WRAP_ALPHA)
    look: Any = {"colors": [rgba], "fill_mode": "solid"}
    if kind == SPHERE:
        return rr.Ellipsoids3D(half_sizes=[[size[0]] * 3], **look)
    if kind == ELLIPSOID:
        return rr.Ellipsoids3D(half_sizes=[size], **look)
    if kind == CYLINDER:
        return rr.Cylinders3D(lengths=[2 * size[1]], radii=[size[0]], **look)
    if kind == CAPSULE:
        # rerun's capsule starts at its lower end, MuJoCo's is centred
        return rr.Capsules3D(lengths=[2 * size[1]], radii=[size[0]], translations=[[0, 0, -size[1]]], **look)
    if kind == BOX:
        return rr.Boxes3D(half_sizes=[size], **look)
    if kind == PLANE:
        # size 0 is an infinite plane; a thin slab just below the surface
        rgba[:3] *= FLOOR
        look["colors"] = [rgba]
        sides = [side if side > 0 else float(model.stat.extent) for side in size[:2]]
        thickness = 1e-3 * float(model.stat.extent)
        return rr.Boxes3D(centers=[[0, 0, -thickness]], half_sizes=[[*sides, thickness]], **look)
    if kind == HFIELD:
        return _mesh(*_hfield(model, int(model.geom_dataid[geom])), rgba)
    if kind in (MESH, SDF) and model.geom_dataid[geom] >= 0:
        mesh = int(model.geom_dataid[geom])
        vertex, face = int(model.mesh_vertadr[mesh]), int(model.mesh_faceadr[mesh])
        vertices = model.mesh_vert[vertex : vertex + int(model.mesh_vertnum[mesh])]
        faces = model.mesh_face[face : face + int(model.mesh_facenum[mesh])]
        return _mesh(vertices, faces, rgba)
    return None


def see_through(model: Any, geom: int, *, wraps: bool) -> rr.AsComponents | None:
    """Return how the viewer shows a geom at first, so that it hides no muscle; None if as recorded.

    Bodies are translucent; a wrapping surface is a wireframe with a translucent filling.
    """
    kind = int(model.geom_type[geom])
    rgba = _rgba(model, geom)
    # shown by hand, a surface without opacity would have black lines
    rgba[3] = WIRE_ALPHA if wraps else min(rgba[3], BODY_ALPHA)
    look: Any = {"colors": [rgba]}
    if wraps:
        look["fill_mode"] = "TransparentFillMajorWireframe"
    if kind in (SPHERE, ELLIPSOID):
        return rr.Ellipsoids3D.from_fields(**look)
    if kind == CYLINDER:
        return rr.Cylinders3D.from_fields(**look)
    if kind == CAPSULE:
        return rr.Capsules3D.from_fields(**look)
    if kind == BOX:
        return rr.Boxes3D.from_fields(**look)
    if kind in (MESH, SDF) and model.geom_dataid[geom] >= 0:
        return rr.Mesh3D.from_fields(albedo_factor=rgba)
    return None


def invisible(model: Any, geom: int) -> bool:
    """Return whether the model gives a geom no opacity."""
    return bool(_rgba(model, geom)[3] == 0.0)


def draws(model: Any, geom: int, surface: Surface) -> bool:
    """Return whether a geom has the shape of a surface; the ends of an infinite cylinder do not count."""
    kind, size = int(model.geom_type[geom]), tuple(float(x) for x in model.geom_size[geom])
    if isinstance(surface, Cylinder):
        return kind == CYLINDER and surface.radius == size[0] and surface.half_length in (size[1], np.inf)
    if isinstance(surface, Sphere):
        return kind == SPHERE and surface.radius == size[0]
    if isinstance(surface, Ellipsoid):
        return kind == ELLIPSOID and surface.radii == size
    return isinstance(surface, Capsule) and kind == CAPSULE and surface.dims == size[:2]


def surface_shape(model: Any, geom: int, surface: Surface) -> rr.AsComponents:
    """Return the shape of a surface in the frame of its geom, in the geom's colour and translucent."""
    rgba = _rgba(model, geom)
    rgba[3] = WRAP_ALPHA
    return _mesh(*triangles(surface_grid(surface, SMOOTH, SMOOTH)), rgba)


def pose(position: np.ndarray, quaternion: np.ndarray) -> rr.Transform3D:
    """Return a transform from a position (3,) [m] and a quaternion (4,) w-x-y-z."""
    return rr.Transform3D(translation=position, quaternion=rr.Quaternion(xyzw=quaternion[[1, 2, 3, 0]]))


def _rgba(model: Any, geom: int) -> np.ndarray:
    """Return the colour (4,) in which MuJoCo draws a geom: its own or, if it has none, that of its material."""
    rgba, material = model.geom_rgba[geom], int(model.geom_matid[geom])
    if material >= 0 and np.allclose(rgba, DEFAULT_RGBA):
        rgba = model.mat_rgba[material]
    return np.array(rgba, dtype=np.float32)


def _mesh(vertices: np.ndarray, faces: np.ndarray, rgba: np.ndarray) -> rr.Mesh3D:
    """Return a mesh of one colour, with normals averaged by area over the faces around each vertex."""
    vertices = np.asarray(vertices, dtype=np.float32)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, faces[:, k], np.cross(b - a, c - a))
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
    return rr.Mesh3D(
        vertex_positions=vertices, triangle_indices=faces, vertex_normals=normals, albedo_factor=rgba
    )


def _hfield(model: Any, field: int) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices (rows columns, 3) and faces (m, 3) of a height field's upper side."""
    rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    start = int(model.hfield_adr[field])
    half_x, half_y, height, _ = model.hfield_size[field]
    y, x = np.meshgrid(
        np.linspace(-half_y, half_y, rows), np.linspace(-half_x, half_x, columns), indexing="ij"
    )
    z = height * model.hfield_data[start : start + rows * columns].reshape(rows, columns)
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]).reshape(-1, 3)
    return np.stack([x, y, z], axis=-1).reshape(-1, 3), faces
