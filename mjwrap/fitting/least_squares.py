"""Least squares on the points' distances: the surface of a shape that is nearest to given points."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from mjwrap.errors import GeometryError
from mjwrap.fitting.initial_guesses import guesses
from mjwrap.fitting.shapes import Array, Nearest, Shape
from mjwrap.surfaces.triangles import surface_grid

TRIED = 300  # number of points with which all guesses are tried
FEW = 8  # number of evaluations for each guess then
KEPT = 3  # number of guesses that are iterated to convergence
MANY = 500  # number of evaluations for each of these
LARGEST, SMALLEST = 10.0, 1e-3  # limits of a surface's sizes, relative to the points' spread
LOST = 1e4  # growth from which a surface counts as undetermined


class Posed(NamedTuple):
    """A shape with origin (3,), rotation (3, 3) and sizes (k,)."""

    shape: Shape
    origin: Array
    rotation: Array
    sizes: Array

    @property
    def relative(self) -> NDArray[np.bool_]:
        """Return which sizes (k,) are positive, and therefore change by factors."""
        return ~np.isin(np.arange(self.shape.sizes), self.shape.free_sign)

    def local(self, x: Array) -> Array:
        """Return points (m, 3) in the shape's frame."""
        return (x - self.origin) @ self.rotation

    def nearest(self, x: Array) -> Nearest:
        """Return distances and nearest points of points (m, 3), the latter in the shape's frame."""
        return self.shape.nearest(self.local(x), self.sizes)

    def moved(self, step: Array) -> Posed:
        """Return the shape after turns [rad], shifts, and changes of its sizes, in this order in step (unknowns,)."""
        turn, shift, change = self._parts(step)
        sizes = np.where(self.relative, self.sizes * np.exp(np.clip(change, -30, 30)), self.sizes + change)
        rotation = self.rotation @ Rotation.from_rotvec(turn).as_matrix()
        return Posed(self.shape, self.origin + self.rotation @ shift, rotation, sizes)

    def derivative(self, step: Array, x: Array) -> Array:
        """Return the derivatives (m, unknowns) by `step` of the distances of points (m, 3) from `moved(step)`."""
        turn, _, _ = self._parts(step)
        there = self.moved(step)
        return there.columns(there.nearest(x), _right_jacobian(turn), Rotation.from_rotvec(turn).as_matrix())

    def columns(self, found: Nearest, turned: Array, rotation: Array) -> Array:
        """Return derivatives of distances; turned, rotation (3, 3): of the frame by the step's turns, and before."""
        around = np.cross(found.point, found.normal) @ turned
        along = found.normal @ rotation.T
        wider = found.slide * np.where(self.relative, self.sizes, 1.0)
        return -np.hstack([around[:, list(self.shape.turns)], along[:, list(self.shape.shifts)], wider])

    def _parts(self, step: Array) -> tuple[Array, Array, Array]:
        turn, shift = np.zeros(3), np.zeros(3)
        turns, shifts = len(self.shape.turns), len(self.shape.shifts)
        turn[list(self.shape.turns)] = step[:turns]
        shift[list(self.shape.shifts)] = step[turns : turns + shifts]
        return turn, shift, step[turns + shifts :]


def solve(shape: Shape, x: Array, scale: float | None) -> Posed:
    """Return the shape nearest to points x (m, 3), centred and scaled to a mean square distance of one.

    scale: distance from which points get less weight, or None. Raises `GeometryError` if the points do not determine
    the shape.
    """
    some = x[np.linspace(0, len(x) - 1, min(len(x), TRIED)).astype(int)]
    tried = [_descend(Posed(shape, *guess), some, scale, FEW) for guess in guesses(shape, x)]
    tried.sort(key=lambda pair: pair[0])
    best = min((_descend(posed, x, scale, MANY) for _, posed in tried[:KEPT]), key=lambda pair: pair[0])[1]
    best = _descend(best, x, scale, MANY)[1]  # once more, starting with a turn of zero
    lengths = np.delete(best.sizes, shape.ratios)
    if lengths.max() > LARGEST or (best.sizes[best.relative] < SMALLEST).any():
        raise misshapen(shape)
    return best


def misshapen(shape: Shape) -> GeometryError:
    """Return the error for points whose nearest surface is much larger or thinner than their spread."""
    return GeometryError(
        f"fit of {shape.name}: the nearest one is much larger or thinner than the points' spread: they lie nearly in a "
        f"plane or on a line, or cover too little of the surface; take points from more of it, or a shape with fewer "
        f"sizes"
    )


def growth(posed: Posed, x: Array, half_length: float) -> float:
    """Return the factor by which a small error of points x (m, 3) can grow on the surface; about 1 if they cover it.

    It is the largest ratio, over all small changes of the surface, of its rms movement everywhere to that at the
    points; infinite if a change does not move the surface at the points.
    """
    surface = posed.shape.build(posed.sizes, half_length)
    everywhere = posed.nearest(posed.origin + surface_grid(surface).reshape(-1, 3) @ posed.rotation.T)
    here = posed.nearest(x)
    still = np.eye(3)
    all_over, seen = (posed.columns(f, still, still) / np.sqrt(len(f.distance)) for f in (everywhere, here))
    _, size, axes = np.linalg.svd(all_over, full_matrices=False)
    real = size > 1e-8 * size[0]  # the other turns do not change the surface
    smallest = np.linalg.svd(seen @ (axes[real].T / size[real]), compute_uv=False)[-1]
    return float(1.0 / smallest) if smallest > 1e-12 else np.inf


def _descend(posed: Posed, x: Array, scale: float | None, evaluations: int) -> tuple[float, Posed]:
    """Return cost and shape after least squares from a start."""

    def derivative(step: Array) -> Array:
        return posed.derivative(step, x)

    jacobian: Any = derivative  # scipy's types allow only names of methods
    found = least_squares(
        lambda step: posed.moved(step).nearest(x).distance,
        np.zeros(posed.shape.unknowns),
        jac=jacobian,
        loss="linear" if scale is None else "cauchy",
        f_scale=1.0 if scale is None else scale,
        ftol=1e-15,
        xtol=1e-15,
        gtol=1e-15,
        max_nfev=evaluations,
    )
    return float(found.cost), posed.moved(found.x)


def _right_jacobian(turn: Array) -> Array:
    """Return the derivative (3, 3) of a rotation by its rotation vector, as a turn in the rotated frame."""
    angle = float(np.linalg.norm(turn))
    if angle < 1e-6:
        first, second = 0.5, 1.0 / 6.0
    else:
        first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    x, y, z = turn
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) - first * cross + second * cross @ cross
