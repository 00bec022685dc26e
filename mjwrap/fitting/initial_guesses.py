"""First guesses of a fit, by linear least squares: frames and sizes from which the nonlinear fit converges.

Points are centred on their mean and scaled to a mean square distance of one. Several guesses are made, because the
points' principal axes do not determine the axis of a surface if the points cover only a part of it. The best fit is
used.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from mjwrap.fitting import shapes
from mjwrap.fitting.shapes import Array, Shape

DIRECTIONS = 13  # number of axes tried in addition to the principal ones, spread over a half sphere
WIDEST = 20.0  # largest size of a guess


class Guess(NamedTuple):
    """A pose and sizes to start from: origin (3,), rotation (3, 3), sizes (k,)."""

    origin: Array
    rotation: Array
    sizes: Array


def guesses(shape: Shape, x: Array) -> Iterator[Guess]:
    """Yield guesses for points x (m, 3)."""
    principal = np.linalg.svd(x, full_matrices=False)[2].T
    principal[:, 2] *= np.sign(np.linalg.det(principal))
    if shape is shapes.SPHERE:
        centre, radius = _ball(x)
        yield Guess(centre, np.eye(3), np.array([radius]))
    elif shape is shapes.ELLIPSOID:
        yield from _ellipsoids(x, principal)
    else:
        for axis in [*principal.T, *_half_sphere(DIRECTIONS)]:
            rotation = _towards(axis)
            yield from (
                Guess(rotation @ origin, rotation @ turn, sizes)
                for origin, turn, sizes in _about_axis(shape, x @ rotation)
            )


def _about_axis(shape: Shape, x: Array) -> Iterator[tuple[Array, Array, Array]]:
    """Yield guesses for a shape whose axis is local z, in that frame."""
    centre, radius = _ball(x[:, :2])
    radius = min(radius, WIDEST)
    origin = np.append(centre, 0.0)
    far = np.linalg.norm(x[:, :2] - centre, axis=1)
    if shape is shapes.CYLINDER:
        yield origin, np.eye(3), np.array([radius])
    elif shape is shapes.CAPSULE:
        half = 0.5 * float(np.ptp(x[:, 2]))
        origin[2] = 0.5 * float(x[:, 2].max() + x[:, 2].min())
        yield origin, np.eye(3), np.array([radius, max(half - radius, 0.1 * half)])
    elif shape is shapes.CONE:
        middle, slope = _polynomial(x[:, 2], far, 1)
        yield origin, np.eye(3), np.array([middle, slope])
    elif shape is shapes.ELLIPTIC_CYLINDER:
        for turn in (0.0, 0.25 * np.pi, 0.5 * np.pi, 0.75 * np.pi):
            yield origin, _about_z(turn), np.array([1.2 * radius, 0.8 * radius])
    else:
        yield from _rings(origin, far, x[:, 2])


def _rings(origin: Array, far: Array, z: Array) -> Iterator[tuple[Array, Array, Array]]:
    """Yield tori: the whole ring, and its inner or outer side if the distance from the axis is curved along z."""
    major, minor = float(far.mean()), float(np.sqrt(np.var(far) + np.var(z)))
    yield origin, np.eye(3), np.array([major, min(minor, 0.9 * major)])
    level, tilt, bend = _polynomial(z, far, 2)
    if abs(bend) > 1e-6:
        minor = min(0.5 / abs(bend), WIDEST)
        major = level + np.sign(bend) * minor
        if major > minor:
            yield origin - np.array([0.0, 0.0, 0.5 * tilt / bend]), np.eye(3), np.array([major, minor])


def _ellipsoids(x: Array, principal: Array) -> Iterator[Guess]:
    """Yield the quadric of least algebraic error, if it is an ellipsoid, then ellipsoids along the principal axes."""
    a, b, c = x.T
    columns = np.column_stack([a * a, b * b, c * c, a * b, a * c, b * c, a, b, c])
    q = np.linalg.lstsq(columns, np.ones(len(x)), rcond=None)[0]
    form = np.array([[q[0], q[3] / 2, q[4] / 2], [q[3] / 2, q[1], q[5] / 2], [q[4] / 2, q[5] / 2, q[2]]])
    values, axes = np.linalg.eigh(form)
    if values[0] > 1e-4 * values[2]:
        centre = np.asarray(-0.5 * np.linalg.solve(form, q[6:]), dtype=np.float64)
        axes[:, 2] *= np.sign(np.linalg.det(axes))
        yield Guess(centre, axes, np.minimum(np.sqrt((1.0 + centre @ form @ centre) / values), WIDEST))
    spread: Array = np.maximum(np.sqrt(3.0) * np.std(x @ principal, axis=0), 0.2)
    yield Guess(np.zeros(3), principal, spread)
    centre, radius = _ball(x)
    for stretch in ((1.3, 1.0, 0.7), (0.7, 1.0, 1.3), (1.0, 1.3, 0.7)):
        yield Guess(centre, principal, min(radius, WIDEST) * np.array(stretch))


def _polynomial(x: Array, y: Array, degree: int) -> Array:
    """Return coefficients (degree + 1,) by least squares, the constant first; the smallest if they are not unique."""
    return np.asarray(
        np.linalg.lstsq(np.vander(x, degree + 1, increasing=True), y, rcond=None)[0], dtype=np.float64
    )


def _ball(x: Array) -> tuple[Array, float]:
    """Return centre (k,) and radius of the circle or sphere through points (m, k), by linear least squares."""
    columns = np.column_stack([2.0 * x, np.ones(len(x))])
    found = np.linalg.lstsq(columns, (x * x).sum(axis=1), rcond=None)[0]
    return found[:-1], float(np.sqrt(max(found[-1] + found[:-1] @ found[:-1], 1e-4)))


def _about_z(turn: float) -> Array:
    cosine, sine = np.cos(turn), np.sin(turn)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def _towards(axis: Array) -> Array:
    """Return a rotation (3, 3) that turns z to an axis."""
    across = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = np.cross(across, axis)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def _half_sphere(count: int) -> Array:
    """Return directions (count, 3), evenly spread over the upper half of a sphere."""
    k = np.arange(count)
    z = (k + 0.5) / count
    turn = np.pi * (3.0 - np.sqrt(5.0)) * k
    flat = np.sqrt(1.0 - z * z)
    return np.column_stack([flat * np.cos(turn), flat * np.sin(turn), z])
