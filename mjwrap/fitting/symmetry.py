"""Choose, among the frames in which a surface has the same shape, the one turned least from the points' axes."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np

from mjwrap.fitting import shapes
from mjwrap.fitting.least_squares import SMALLEST, Posed, misshapen
from mjwrap.fitting.shapes import Array

_LONG = (
    shapes.CYLINDER,
    shapes.ELLIPTIC_CYLINDER,
    shapes.CONE,
)  # shapes that are cut off where their points end


def canonical_frame(posed: Posed, x: Array) -> tuple[Posed, float]:
    """Return the same surface in the frame turned least, and its half length, the range of points x (m, 3).

    The origin of cylinders and cones is the middle of the points' range; a cone does not extend beyond its apex.
    Raises `GeometryError` if the points have no range along the axis.
    """
    if posed.shape in (shapes.ELLIPSOID, shapes.ELLIPTIC_CYLINDER):
        posed = _permuted(posed)
    elif posed.shape is shapes.SPHERE:
        posed = posed._replace(rotation=np.eye(3))
    else:
        posed = _upright(posed)
    if posed.shape not in _LONG:
        return posed, 0.0
    z = posed.local(x)[:, 2]
    low, high = float(z.min()), float(z.max())
    if posed.shape is shapes.CONE:
        radius, slope = posed.sizes
        apex = -radius / slope if slope else -np.inf
        low, high = (max(low, apex), high) if slope > 0.0 else (low, min(high, apex))
        posed = posed._replace(sizes=np.array([radius + 0.5 * slope * (low + high), slope]))
    if high - low < SMALLEST:
        raise misshapen(posed.shape)
    middle = posed.rotation @ (0.0, 0.0, 0.5 * (low + high))
    return posed._replace(origin=posed.origin + middle), 0.5 * (high - low)


def _permuted(posed: Posed) -> Posed:
    """Exchange semi-axes, and z of a cylinder for -z."""
    count = posed.shape.sizes
    best, order = posed.rotation, list(range(count))
    for places in permutations(range(count)):
        columns = [*places, *range(count, 3)]
        for signs in product((1.0, -1.0), repeat=3):
            turned = posed.rotation[:, columns] * signs
            if np.linalg.det(turned) > 0.0 and np.trace(turned) > np.trace(best):
                best, order = turned, list(places)
    return posed._replace(rotation=best, sizes=posed.sizes[order])


def _upright(posed: Posed) -> Posed:
    """Turn z onto the axis by the shortest way; the axis points upwards."""
    axis, sizes = posed.rotation[:, 2], posed.sizes
    if axis[2] < 0.0:
        axis = -axis
        if posed.shape is shapes.CONE:
            sizes = sizes * (1.0, -1.0)
    x, y, z = axis
    across = np.array([[0.0, 0.0, x], [0.0, 0.0, y], [-x, -y, 0.0]])
    return posed._replace(rotation=np.eye(3) + across + across @ across / (1.0 + z), sizes=sizes)
