"""Lengths in closed form of paths whose cylinders and spheres lie between points, to judge two paths that differ."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mjwrap.osim.verifying.stops import Point, Touched, TouchingRoute
from mjwrap.surfaces import Cylinder, Sphere

Array = NDArray[np.float64]


def closed_form_length(route: TouchingRoute) -> float | None:
    """Return the length of a route [m] if every surface is a cylinder or sphere with a point on either side, else None.

    Of the route only points, surfaces and the side on which each is passed are used. A string over one cylinder is a
    straight line once the cylinder is unrolled; over one sphere it lies in the plane of its ends and the centre.
    """
    total, stops = 0.0, route.stops
    for k, (before, after) in enumerate(pairwise(stops)):
        if isinstance(before, Point) and isinstance(after, Point):
            total += float(np.linalg.norm(after.pos - before.pos))
        elif isinstance(before, Point) and isinstance(after, Touched):
            beyond = stops[k + 2]
            if not isinstance(beyond, Point):
                return None
            length = _over(after, before.pos, beyond.pos)
            if length is None:
                return None
            total += length
    return total


def _over(touched: Touched, start: Array, end: Array) -> float | None:
    """Return the length from a point over one surface to another point, both in the world."""
    a, b = ((place - touched.pos) @ touched.turn for place in (start, end))
    surface = touched.surface
    if isinstance(surface, Cylinder):
        across = _round(surface.radius, a[:2], b[:2], touched.middle[:2])
        return None if across is None else float(np.hypot(across, b[2] - a[2]))
    if isinstance(surface, Sphere):
        first = a / np.linalg.norm(a)
        second = b - (b @ first) * first
        size = float(np.linalg.norm(second))
        if size <= 1e-9 * float(np.linalg.norm(b)):
            return None  # any plane holds both ends
        plane = np.array([first, second / size])
        return _round(surface.radius, plane @ a, plane @ b, plane @ touched.middle)
    return None


def _round(radius: float, a: Array, b: Array, side: Array) -> float | None:
    """Return the length of a string in the plane from a round a circle about 0 to b, on the side of a third point."""
    far = [float(np.linalg.norm(p)) for p in (a, b)]
    if min(far) <= radius:
        return None
    tangents = [float(np.sqrt(f * f - radius * radius)) for f in far]
    spent = sum(float(np.arccos(radius / f)) for f in far)
    start, stop = (float(np.arctan2(p[1], p[0])) for p in (a, b))
    found = []
    for way in (1.0, -1.0):
        turn = (way * (stop - start)) % (2.0 * np.pi)
        middle = start + way * (float(np.arccos(radius / far[0])) + 0.5 * (turn - spent))
        gap = float(np.hypot(np.cos(middle) * radius - side[0], np.sin(middle) * radius - side[1]))
        if turn >= spent:
            found.append((gap, sum(tangents) + radius * (turn - spent)))
    return min(found)[1] if found else None
