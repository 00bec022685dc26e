"""OpenSim's own paths at a pose: where they wrap, how they leave surfaces, and how their lengths change."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
STEP = 1e-4  # [rad or m] by which a coordinate moves for the slope of a length


def path_of(force: Any) -> Any:
    """Return the path of a muscle, ligament, path spring or path actuator."""
    return force.getGeometryPath() if hasattr(force, "getGeometryPath") else force.get_GeometryPath()


def contacts(opensim: Any, path: Any, state: Any) -> dict[str, list[float]]:
    """Return arc [m], chord [m] and kink of the contacts of a path, by wrap object.

    kink: the larger sine of the angle at which the path's straight lines meet the surface, 0 for a taut string, NaN for
    an object of unknown shape.
    """
    if not hasattr(path, "getCurrentPath"):
        return {}
    points = path.getCurrentPath(state)
    places, objects = [], []
    for i in range(points.getSize()):
        places.append(_array(points.get(i).getLocationInGround(state)))
        wrapped = opensim.PathWrapPoint.safeDownCast(points.get(i))
        objects.append(wrapped if wrapped is not None and wrapped.getWrapObject() is not None else None)
    found: dict[str, list[float]] = {}
    i = 0
    while i + 1 < len(places):
        if objects[i] is None or objects[i + 1] is None:
            i += 1
            continue
        shape = objects[i].getWrapObject()
        chord = float(np.linalg.norm(places[i + 1] - places[i]))
        kinks = [
            _kink(opensim, shape, state, places[at], places[beside])
            for at, beside in ((i, i - 1), (i + 1, i + 2))
            if 0 <= beside < len(places)
        ]
        found[shape.getName()] = [float(objects[i + 1].getWrapLength(state)), chord, max(kinks, default=0.0)]
        i += 2
    return found


def segments(opensim: Any, path: Any, state: Any) -> dict[str, list[str]]:
    """Return the names of the path points before and after each contact of a path, by wrap object."""
    if not hasattr(path, "getCurrentPath"):
        return {}
    points = path.getCurrentPath(state)
    wraps = []
    for i in range(points.getSize()):
        wrapped = opensim.PathWrapPoint.safeDownCast(points.get(i))
        shape = None if wrapped is None else wrapped.getWrapObject()
        wraps.append(None if shape is None else shape.getName())
    places = [i for i, wrap in enumerate(wraps) if wrap is None]
    found: dict[str, list[str]] = {}
    for i, wrap in enumerate(wraps):
        if wrap is not None:
            around = max(p for p in places if p < i), min(p for p in places if p > i)
            found[wrap] = [points.get(p).getName() for p in around]
    return found


def _array(vector: Any) -> Array:
    return np.array([vector.get(k) for k in range(3)])


def _kink(opensim: Any, shape: Any, state: Any, at: Array, beside: Array) -> float:
    """Return the sine of the angle between a surface at a point and the line from there to another point."""
    across = shape.getFrame().getTransformInGround(state)
    places = [across.shiftBaseStationToFrame(opensim.Vec3(*map(float, place))) for place in (at, beside)]
    local = [_array(shape.getTransform().shiftBaseStationToFrame(place)) for place in places]
    line = local[1] - local[0]
    normal = _normal(opensim, shape, local[0])
    if normal is None:
        return float("nan")
    size = float(np.linalg.norm(line) * np.linalg.norm(normal))
    return abs(float(line @ normal)) / size if size > 0.0 else 0.0


def _normal(opensim: Any, shape: Any, point: Array) -> Array | None:
    """Return a normal of a wrap object at a point of its surface, both in its frame; None for a shape without one."""
    if opensim.WrapCylinder.safeDownCast(shape) is not None:
        return np.array([point[0], point[1], 0.0])
    if opensim.WrapSphere.safeDownCast(shape) is not None:
        return point
    ellipsoid = opensim.WrapEllipsoid.safeDownCast(shape)
    if ellipsoid is not None:
        return np.asarray(point / _array(ellipsoid.getRadii()) ** 2, dtype=np.float64)
    return None


def length_slopes(
    model: Any, state: Any, paths: dict[str, Any], coordinates: dict[str, Any]
) -> dict[str, dict[str, list[float]]]:
    """Return (l(q) − l(q − s))/s and (l(q + s) − l(q))/s of paths, by path and coordinate, s = `STEP`.

    coordinates: those that move; where others have to move along to satisfy constraints there is no entry.
    """
    start = {name: float(c.getValue(state)) for name, c in coordinates.items()}
    here = {name: float(path.getLength(state)) for name, path in paths.items()}
    found: dict[str, dict[str, list[float]]] = {name: {} for name in paths}

    def put(values: dict[str, float]) -> bool:
        for name, value in values.items():
            coordinates[name].setValue(state, value, False)
        model.assemble(state)
        model.realizePosition(state)
        return all(abs(float(coordinates[n].getValue(state)) - v) < 1e-9 for n, v in values.items())

    for moved in coordinates if paths else ():
        sides = [
            {n: (float(p.getLength(state)) - here[n]) / change for n, p in paths.items()}
            for change in (-STEP, STEP)
            if put(start | {moved: start[moved] + change})
        ]
        if len(sides) == 2:
            for name in paths:
                found[name][moved] = [side[name] for side in sides]
    put(start)
    return found
