"""The paper's unknowns and residuals for a row of cylinders and spheres, with a counter of evaluations.

Unknowns (19) of one obstacle are (u, v, u', v', l): chart coordinates of the first contact point P, the direction of
the geodesic there, and its arc length. v and l are in radii, so that all obstacles look like the paper's cylinder:

    cylinder   r(u, v) = R (cos u, sin u, v)
    sphere     r(u, v) = R (cos v cos u, cos v sin u, sin v)

Unit speed (III-C): (u', v') is scaled by the first fundamental form inside the residual, t = r_u u' + r_v v' over its
norm. Only its direction has an effect, l is the arc length, and the Jacobian has one null direction per obstacle (the
length of (u', v')), along which no method makes a step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjwrap.errors import GeometryError
from mjwrap.surfaces import Cylinder, Sphere, Surface

Array = NDArray[Any]

UNKNOWNS = 5
FIRST_GUESS = (0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5), np.finfo(np.float64).eps)
RESIDUALS = ("tangency", "normals_binormals")
RELATIVE_STEP = 1e-6


def _dot(a: Array, b: Array) -> Array:
    return (a * b).sum(axis=-1)


def _unit(a: Array) -> Array:
    # without abs, hypot or norm the residual is analytic, so that a complex step differentiates it exactly
    return a / np.sqrt(_dot(a, a))[..., None]


@dataclass(frozen=True)
class Geometry:
    """Contact points and Darboux frames of m evaluations, world frame, each (m, n, 3); `arc` (m, n) [m]."""

    P: Array
    t_P: Array
    n_P: Array
    Q: Array
    t_Q: Array
    n_Q: Array
    arc: Array


class ChainProblem:
    """A row of touched obstacles between two fixed points: residuals, their Jacobian, and the length.

    Args:
        origin: (3,) world [m].
        insertion: (3,) world [m].
        surfaces: n of `Cylinder`, `Sphere`.
        positions: (n, 3) of their frames, world [m].
        rotations: (n, 3, 3) surface to world.
        residual: "tangency" is f (18), six numbers per obstacle; "normals_binormals" is h (31), four numbers, which are
            also zero for folded paths.

    Attributes:
        evaluations: residuals of the whole row so far, including those of finite differences.
        radii: (n,) [m].
    """

    def __init__(
        self,
        origin: Array,
        insertion: Array,
        surfaces: Sequence[Surface],
        positions: Array,
        rotations: Array,
        residual: str = "tangency",
    ) -> None:
        if residual not in RESIDUALS:
            raise GeometryError(f"residual must be one of {', '.join(RESIDUALS)}, not {residual!r}")
        self.n = len(surfaces)
        self.residual = residual
        self.evaluations = 0
        self._origin = np.asarray(origin, dtype=np.float64)
        self._insertion = np.asarray(insertion, dtype=np.float64)
        self._position = np.asarray(positions, dtype=np.float64).reshape(self.n, 3)
        self._rotation = np.array(rotations, dtype=np.float64).reshape(self.n, 3, 3)
        self.radii = np.array([_radius(surface) for surface in surfaces], dtype=np.float64)
        self._sphere = np.array([isinstance(surface, Sphere) for surface in surfaces], dtype=bool)
        self._any_sphere, self._any_cylinder = bool(self._sphere.any()), not bool(self._sphere.all())

    def first_guess(self) -> Array:
        """Return the paper's first guess on every obstacle, (5n,): u = v = 0, (u', v') = (1, 1)/√2, l = epsilon."""
        return np.tile(FIRST_GUESS, self.n)

    def unknowns(self, P: Array, t: Array, s: Array) -> Array:
        """Return the unknowns of given geodesics.

        P and t need not lie exactly on the surface and its tangent plane. A sphere's chart is turned so that P is
        far from its poles, where (u', v') is not defined.

        Args:
            P: (n, 3) first contact points, world [m].
            t: (n, 3) tangents there, world.
            s: (n,) arc lengths [m].

        Returns:
            The unknowns (5n,).
        """
        x = np.zeros((self.n, UNKNOWNS))
        for k in range(self.n):
            p = self._rotation[k].T @ (P[k] - self._position[k])
            d = self._rotation[k].T @ t[k]
            if self._sphere[k]:
                x[k, 2] = 1.0
                self._rotation[k] = self._rotation[k] @ _frame(p, d)
            else:
                x[k, 0] = np.arctan2(p[1], p[0])
                x[k, 1] = p[2] / self.radii[k]
                x[k, 2:4] = d[1] * np.cos(x[k, 0]) - d[0] * np.sin(x[k, 0]), d[2]
                size = np.hypot(x[k, 2], x[k, 3])
                x[k, 2:4] = x[k, 2:4] / size if size > 0.0 else FIRST_GUESS[2:4]
            x[k, 4] = s[k] / self.radii[k]
        return x.ravel()

    def normalised(self, x: Array) -> Array:
        """Return x with unit (u', v') in the metric of the chart, and a sphere's l within half a turn of zero."""
        y = np.array(x, dtype=np.float64).reshape(self.n, UNKNOWNS)
        across = np.where(self._sphere, np.cos(y[:, 1]), 1.0)
        y[:, 2:4] /= np.sqrt((across * y[:, 2]) ** 2 + y[:, 3] ** 2)[:, None]
        y[:, 4] = np.where(self._sphere, np.pi - np.mod(np.pi - y[:, 4], 2.0 * np.pi), y[:, 4])
        return y.ravel()

    def geometry(self, x: Array) -> Geometry:
        """Return contact points and frames for unknowns (5n,) or (m, 5n)."""
        y = x.reshape(-1, self.n, UNKNOWNS)
        frames = _cylinder(y) if self._any_cylinder else _sphere(y)
        if self._any_sphere and self._any_cylinder:
            frames = np.where(self._sphere[:, None], _sphere(y), frames)
        frames = np.einsum("kij,fmkj->fmki", self._rotation, frames)
        radius = self.radii[:, None]
        return Geometry(
            P=self._position + radius * frames[0],
            t_P=frames[1],
            n_P=frames[2],
            Q=self._position + radius * frames[3],
            t_Q=frames[4],
            n_Q=frames[5],
            arc=self.radii * y[..., 4],
        )

    def straights(self, g: Geometry) -> Array:
        """Return the n + 1 straight segments as vectors, (m, n + 1, 3): origin to P₁, Q₁ to P₂, …, Qₙ to insertion."""
        m = len(g.P)
        ends = (m, 1, 3)
        near = np.concatenate([np.broadcast_to(self._origin, ends), g.Q], axis=1)
        far = np.concatenate([g.P, np.broadcast_to(self._insertion, ends)], axis=1)
        return far - near

    def residuals(self, x: Array) -> Array:
        """Return m residuals (m, 6n), or (m, 4n) for "normals_binormals", of unknowns (m, 5n); counts m evaluations."""
        self.evaluations += len(x)
        with np.errstate(all="ignore"):
            return self._residuals(x)

    def _residuals(self, x: Array) -> Array:
        g = self.geometry(x)
        e = _unit(self.straights(g))
        arriving, leaving = e[:, :-1], e[:, 1:]
        if self.residual == "tangency":
            f = np.concatenate([arriving - g.t_P, leaving - g.t_Q], axis=2)  # (18)
        else:
            b_P, b_Q = np.cross(g.t_P, g.n_P), np.cross(g.t_Q, g.n_Q)
            f = np.stack(  # (31)
                [_dot(arriving, g.n_P), _dot(arriving, b_P), _dot(leaving, g.n_Q), _dot(leaving, b_Q)], axis=2
            )
        return f.reshape(len(x), -1)

    def __call__(self, x: Array) -> Array:
        """Return the residual (6n,) or (4n,) of the unknowns (5n,); counts one evaluation."""
        return self.residuals(x[None])[0]

    def jacobian(self, x: Array, relative_step: float = RELATIVE_STEP) -> Array:
        """Return ∂f/∂x by central differences with step relative_step · max(1, √‖x‖); counts 10n evaluations."""
        h = relative_step * max(1.0, float(np.sqrt(np.sqrt(x @ x))))
        shift = h * np.eye(len(x))
        f = self.residuals(np.concatenate([x + shift, x - shift]))
        return (f[: len(x)] - f[len(x) :]).T / (2.0 * h)

    def tangency_error(self, x: Array) -> float:
        """Return ‖f‖ (30), also if the residual is h; infinite if it has no value. Not counted as an evaluation."""
        with np.errstate(all="ignore"):
            g = self.geometry(x)
            e = _unit(self.straights(g))
        f = np.concatenate([e[:, :-1] - g.t_P, e[:, 1:] - g.t_Q], axis=2).ravel()
        error = float(np.sqrt(f @ f))
        return error if np.isfinite(error) else float("inf")

    def length(self, x: Array) -> float:
        """Return the length (1) [m]: straight segments and arcs; the arc of a lifted obstacle is negative."""
        g = self.geometry(x)
        d = self.straights(g)
        return float(np.sqrt(_dot(d, d)).sum() + g.arc.sum())


def _radius(surface: Surface) -> float:
    if not isinstance(surface, (Cylinder, Sphere)):
        raise GeometryError(
            f"the paper's methods support only Cylinder and Sphere, not {type(surface).__name__}"
        )
    return float(surface.radius)


def _frame(p: Array, d: Array) -> Array:
    """Return a rotation whose first axis is along p and whose second is as near to d as possible."""
    n = p / np.sqrt(p @ p)
    a = d - (d @ n) * n
    if not a @ a > 1e-24:
        a = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    a = a / np.sqrt(a @ a)
    return np.column_stack([n, a, np.cross(n, a)])


def _cylinder(y: Array) -> Array:
    """Return P, t_P, n_P, Q, t_Q, n_Q on the unit cylinder, (6, m, n, 3): a helix in closed form."""
    u, v, du, dv, s = np.moveaxis(y, -1, 0)
    speed = np.sqrt(du * du + dv * dv)
    turn, rise = du / speed, dv / speed
    out = np.empty((6, *u.shape, 3), dtype=y.dtype)
    for first, angle, height in ((0, u, v), (3, u + turn * s, v + rise * s)):
        c, i = np.cos(angle), np.sin(angle)
        out[first] = np.stack([c, i, height], axis=-1)
        out[first + 1] = np.stack([-turn * i, turn * c, rise], axis=-1)
        out[first + 2] = np.stack([c, i, np.zeros_like(c)], axis=-1)
    return out


def _sphere(y: Array) -> Array:
    """Return P, t_P, n_P, Q, t_Q, n_Q on the unit sphere, (6, m, n, 3): a great circle."""
    u, v, du, dv, s = np.moveaxis(y, -1, 0)
    cu, su, cv, sv = np.cos(u), np.sin(u), np.cos(v), np.sin(v)
    P = np.stack([cv * cu, cv * su, sv], axis=-1)
    east = np.stack([-su, cu, np.zeros_like(u)], axis=-1)
    north = np.stack([-sv * cu, -sv * su, cv], axis=-1)
    t = _unit((cv * du)[..., None] * east + dv[..., None] * north)
    c, i = np.cos(s)[..., None], np.sin(s)[..., None]
    Q, t_Q = c * P + i * t, c * t - i * P
    return np.stack([P, t, P, Q, t_Q, Q])
