"""Wrapping surfaces of a model: the shape of a geom, or a shape that a numeric declares.

A numeric whose name contains one of `SIZES` gives the geom before it this shape, with these sizes; of the geom itself
only the frame is used then, not the type and size.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import mujoco
import numpy as np

from mjwrap.errors import GeometryError, ModelError
from mjwrap.mjcf.names import listed, name_of
from mjwrap.surfaces import Capsule, Cylinder, Ellipsoid, Sphere, Surface
from mjwrap.surfaces.primitives import SURFACES
from mjwrap.text import counted

GEOM, NUMERIC = mujoco.mjtObj.mjOBJ_GEOM, mujoco.mjtObj.mjOBJ_NUMERIC
_CYLINDER = int(mujoco.mjtGeom.mjGEOM_CYLINDER)
_MESHES = int(mujoco.mjtGeom.mjGEOM_MESH), int(mujoco.mjtGeom.mjGEOM_SDF)
STILL = 1e-9  # [m, 1] a mesh frame that is moved by less than this counts as not moved

# For each type of geom: the surface of its sizes (3,) [m].
GEOMS: dict[int, Callable[[list[float]], Surface]] = {
    _CYLINDER: lambda size: Cylinder(size[0]),  # infinite, as in MuJoCo's wrapping
    int(mujoco.mjtGeom.mjGEOM_SPHERE): lambda size: Sphere(size[0]),
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): lambda size: Ellipsoid((size[0], size[1], size[2])),
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): lambda size: Capsule(size[0], size[1]),
}


class _Sizes(NamedTuple):
    meaning: str
    least: int  # smallest number of values
    build: Callable[..., Surface]

    @property
    def most(self) -> int:
        return len(self.meaning.split())


# By the word in a numeric's name: its values [m], in the order of the surface's class.
SIZES: dict[str, _Sizes] = {
    surface.numeric: _Sizes(surface.numeric_sizes, surface.numeric_least, surface.from_numeric)
    for surface in SURFACES
    if surface.numeric
}


def size_keys(name: str) -> list[str]:
    """Return which of `SIZES` a numeric's name contains, without those that are part of another one in the name."""
    found = [key for key in SIZES if key in name]
    return [key for key in found if not any(key in other for other in found if other != key)]


def wrapping_geoms(model: mujoco.MjModel) -> str:
    """Return the names of all geoms whose type is that of a wrapping surface, for a message."""
    return listed(name_of(model, GEOM, i) for i in range(model.ngeom) if int(model.geom_type[i]) in GEOMS)


def read_surface(model: mujoco.MjModel, geom: int, numeric: int = -1, finite: bool = False) -> Surface:
    """Return the surface of a geom, or the surface that a numeric declares in its frame.

    finite: a cylinder geom's own half length is its range of validity. Raises `ModelError`, which names geom and
    numeric, for invalid sizes and for frames that MuJoCo has moved.
    """
    name, kind = name_of(model, GEOM, geom), int(model.geom_type[geom])
    if finite and (numeric >= 0 or kind != _CYLINDER):
        raise ModelError(
            f"geom '{name}' has prm=1, which makes a cylinder geom as long as it is drawn; this one is "
            + ("declared by a numeric, which can give a half length" if numeric >= 0 else _shape(kind))
        )
    try:
        if numeric >= 0:
            return _declared(model, name, geom, numeric)
        if kind not in GEOMS:
            raise ModelError(f"geom '{name}' is of type {_shape(kind)}; {_advice(model, name, kind)}")
        size = [float(x) for x in model.geom_size[geom]]
        return Cylinder(size[0], size[1]) if finite else GEOMS[kind](size)
    except GeometryError as error:
        raise ModelError(f"geom '{name}': {error}") from None


def _declared(model: mujoco.MjModel, name: str, geom: int, numeric: int) -> Surface:
    kind, label = int(model.geom_type[geom]), name_of(model, NUMERIC, numeric)
    if kind in _MESHES and _moved(model, int(model.geom_dataid[geom])):
        raise ModelError(
            f"geom '{name}' is a mesh whose frame MuJoCo has moved to its centre of mass and principal axes, so the "
            f"surface of numeric '{label}' would not be where the file says; give it a geom of its own, such as a "
            f"small sphere, at the pose of the surface"
        )
    (key,) = size_keys(label)
    sizes, first = SIZES[key], int(model.numeric_adr[numeric])
    values = [float(x) for x in model.numeric_data[first : first + int(model.numeric_size[numeric])]]
    if not sizes.least <= len(values) <= sizes.most:
        least = f"{sizes.least} to " * (sizes.least < sizes.most)
        raise ModelError(
            f"numeric '{label}' must have {least}{counted(sizes.most, 'value')} [m], {sizes.meaning}, not "
            f"{len(values)}"
        )
    try:
        return sizes.build(*values)
    except GeometryError as error:
        raise ModelError(f"geom '{name}', numeric '{label}': {error}") from None


def _moved(model: mujoco.MjModel, mesh: int) -> bool:
    """Return whether the compiler has moved the frame of a mesh from that of its file."""
    if mesh < 0:
        return False
    turned = np.abs(model.mesh_quat[mesh]) - (1.0, 0.0, 0.0, 0.0)
    return max(np.abs(model.mesh_pos[mesh]).max(), np.abs(turned).max()) > STILL


def _shape(kind: int) -> str:
    return mujoco.mjtGeom(kind).name.removeprefix("mjGEOM_").lower()


def _advice(model: mujoco.MjModel, name: str, kind: int) -> str:
    if kind in _MESHES:
        return (
            f"fit a smooth surface to its points and declare that: mjwrap.fit_ellipsoid(mjwrap.mesh_points(model, "
            f"'{name}')) and others, see docs/surfaces.md; geoms to wrap: {wrapping_geoms(model)}"
        )
    return (
        f"a wrapping surface is a cylinder, sphere, ellipsoid or capsule: {wrapping_geoms(model)}; or any geom that a "
        f"numeric directly after it gives a shape, by one of these in its name: {listed(SIZES)}"
    )
