"""Points to fit a surface to: vertices of a mesh geom in a region of space."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from mjwrap import validation
from mjwrap.errors import GeometryError, ModelError

Array = NDArray[np.float64]
Region = Callable[[Array], ArrayLike]
_MESH = 7  # mjtGeom; this package does not import mujoco


def mesh_points(model: Any, geom: str | int, region: Region | None = None, data: Any = None) -> Array:
    """Return the vertices of a mesh geom.

    Args:
        model: a mujoco.MjModel.
        geom: name or id of the geom.
        region: a function that returns which points (m, 3) to keep (m,), such as those of `in_box`, `in_ball` and
            `beyond`; None for all.
        data: a mujoco.MjData with up-to-date kinematics, for points in the world; None for points in the frame of the
            geom's body.

    Returns:
        The points (m, 3) [m].

    Raises:
        ModelError: the geom does not exist or is not a mesh. The message lists the mesh geoms.
    """
    validation.of_type(model, "MjModel", "model", ModelError)
    if data is not None:
        validation.of_type(data, "MjData", "data", ModelError)
    validation.instance(geom, str | int | np.integer, "geom", ModelError, "the name or id of a mesh geom")
    good = region is None or (callable(region) and not isinstance(region, type))
    validation.require(good, "region", "a function of points (m, 3), such as in_box", region, GeometryError)
    index = _mesh_geom(model, geom)
    mesh = int(model.geom_dataid[index])
    first = int(model.mesh_vertadr[mesh])
    vertices = np.asarray(model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])], dtype=np.float64)
    if data is None:
        rotation = Rotation.from_quat(np.roll(model.geom_quat[index], -1)).as_matrix()
        origin = model.geom_pos[index]
    else:
        rotation, origin = data.geom_xmat[index].reshape(3, 3), data.geom_xpos[index]
    points = np.unique(vertices, axis=0) @ rotation.T + origin
    return points if region is None else points[np.asarray(region(points), dtype=bool)]


def in_box(low: ArrayLike, high: ArrayLike) -> Region:
    """Return a region: a box along the axes from corner low (3,) to corner high (3,) [m]."""
    a, b = _vector(low, "low"), _vector(high, "high")
    return lambda points: np.all((points >= a) & (points <= b), axis=1)


def in_ball(centre: ArrayLike, radius: float) -> Region:
    """Return a region: all points within radius [m] of a centre (3,) [m]."""
    middle = _vector(centre, "centre")
    return lambda points: np.linalg.norm(points - middle, axis=1) <= radius


def beyond(point: ArrayLike, direction: ArrayLike) -> Region:
    """Return a region: the half space of all points that lie beyond a point (3,) [m] in a direction (3,)."""
    start, along = _vector(point, "point"), _vector(direction, "direction")
    return lambda points: (points - start) @ along >= 0.0


def _vector(value: ArrayLike, what: str) -> Array:
    vector = np.asarray(value, dtype=np.float64)
    if vector.shape != (3,) or np.isnan(vector).any():
        raise GeometryError(f"region: {what} must be 3 numbers [m], not {value!r}")
    return vector


def _mesh_geom(model: Any, geom: str | int) -> int:
    names = [model.geom(i).name or f"#{i}" for i in range(model.ngeom)]
    meshes = [i for i in range(model.ngeom) if int(model.geom_type[i]) == _MESH]
    index = names.index(geom) if isinstance(geom, str) and geom in names else geom
    if not isinstance(index, str) and int(index) in meshes:
        return int(index)
    there = ", ".join(names[i] for i in meshes) or "none"
    exists = not isinstance(index, str) and 0 <= int(index) < model.ngeom
    fault = "is not a mesh" if exists else "does not exist"
    raise ModelError(f"geom {geom!r} {fault}; mesh geoms: {there}")
