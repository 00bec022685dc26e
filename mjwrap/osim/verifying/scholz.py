"""OpenSim's own geodesics, `Scholz2015GeometryPath`, over the points and surfaces of a route."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from mjwrap.osim.verifying.stops import Point, Touched, TouchingRoute
from mjwrap.surfaces import Cylinder, Ellipsoid, Sphere, Torus


def scholz_length(opensim: Any, route: TouchingRoute) -> float | None:
    """Return the length [m] of OpenSim's geodesic path over a route's stops, fixed in the world, or None.

    The hint of each surface is the middle of mjwrap's contact chord: with others OpenSim's path may stay wound.
    None for a surface that OpenSim's path does not have. `RuntimeError` where OpenSim throws.
    """
    model = opensim.Model()
    ground = model.getGround()
    path = opensim.Scholz2015GeometryPath()
    path.setName("path")
    for k, stop in enumerate(route.stops):
        if isinstance(stop, Point):
            path.appendPathPoint(ground, opensim.Vec3(*map(float, stop.pos)))
            continue
        geometry = _shape(opensim, stop, ground)
        if geometry is None:
            return None
        geometry.setName(f"surface{k}")
        model.addContactGeometry(geometry)
        path.appendObstacle(geometry, opensim.Vec3(*map(float, stop.middle)))
    model.addComponent(path)
    state = model.initSystem()
    model.realizePosition(state)
    length = float(path.getLength(state))
    return length if np.isfinite(length) else None


def _shape(opensim: Any, stop: Touched, body: Any) -> Any:
    """Return the contact geometry of a surface, or None."""
    origin = opensim.Vec3(*map(float, stop.pos))
    turn = opensim.Vec3(*map(float, Rotation.from_matrix(stop.turn).as_euler("XYZ")))
    surface = stop.surface
    if isinstance(surface, Cylinder):
        return opensim.ContactCylinder(surface.radius, origin, turn, body)
    if isinstance(surface, Sphere):
        return opensim.ContactSphere(surface.radius, origin, body)
    if isinstance(surface, Ellipsoid):
        return opensim.ContactEllipsoid(opensim.Vec3(*surface.radii), origin, turn, body)
    if isinstance(surface, Torus):
        return opensim.ContactTorus(surface.major_radius, surface.minor_radius, origin, turn, body)
    return None
