"""Smooth wrapping surfaces fitted to points, such as the vertices of a bone's mesh (docs/surfaces.md).

A path needs a smooth surface, which a mesh is not. So a surface of a simple shape is fitted to the part of the bone
over which muscles run, by least squares on the points' distances. The result includes these distances.
"""

from mjwrap.fitting.fit import (
    Fit,
    fit_capsule,
    fit_cone,
    fit_cylinder,
    fit_ellipsoid,
    fit_elliptic_cylinder,
    fit_sphere,
    fit_torus,
)
from mjwrap.fitting.points import beyond, in_ball, in_box, mesh_points

__all__ = [
    "Fit",
    "beyond",
    "fit_capsule",
    "fit_cone",
    "fit_cylinder",
    "fit_ellipsoid",
    "fit_elliptic_cylinder",
    "fit_sphere",
    "fit_torus",
    "in_ball",
    "in_box",
    "mesh_points",
]
