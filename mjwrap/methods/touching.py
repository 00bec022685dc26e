"""The scene of one path, and the state of its outer loop: touched obstacles and contact points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mjwrap.errors import GeometryError
from mjwrap.methods.iteration import Outcome, Solver, iterate
from mjwrap.methods.problem import Array, ChainProblem
from mjwrap.surfaces import Sphere, Surface

DEPTH = 1e-12  # relative to a radius: a shallower dip of a segment changes the length by less than rounding

Start = tuple[Array, Array, Array, Array]


class Scene:
    """The checked arguments of `solve_chain`."""

    def __init__(
        self,
        origin: Array,
        insertion: Array,
        surfaces: Sequence[Surface],
        positions: Array,
        rotations: Array,
        residual: str,
    ) -> None:
        self.n = len(surfaces)
        self.surfaces = list(surfaces)
        self.residual = residual
        self.origin = _checked("origin", origin, (3,))
        self.insertion = _checked("insertion", insertion, (3,))
        self.positions = _checked("positions", positions, (self.n, 3))
        self.rotations = _checked("rotations", rotations, (self.n, 3, 3))
        everything = self.problem(
            np.ones(self.n, dtype=bool)
        )  # raises an error for an unknown surface or residual
        self.radii = everything.radii

    def problem(self, active: Array) -> ChainProblem:
        """Return the coupled system over the touched obstacles."""
        surfaces = [surface for surface, on in zip(self.surfaces, active, strict=True) if on]
        return ChainProblem(
            self.origin,
            self.insertion,
            surfaces,
            self.positions[active],
            self.rotations[active],
            self.residual,
        )

    def nearest(self, k: int, a: Array, b: Array) -> tuple[float, Array, Array]:
        """Return the depth of the segment from a to b below obstacle k [radii], the surface point there, and b − a."""
        radius = float(self.radii[k])
        d = b - a
        across = np.eye(3)
        if not isinstance(self.surfaces[k], Sphere):
            axis = self.rotations[k][:, 2]
            across = across - np.outer(axis, axis)
        from_axis, direction = across @ (a - self.positions[k]), across @ d
        size2 = direction @ direction
        where = float(np.clip(-(from_axis @ direction) / size2, 0.0, 1.0)) if size2 > 0.0 else 0.0
        out = from_axis + where * direction
        distance = float(np.sqrt(out @ out))
        if distance > 1e-12 * radius:
            normal = out / distance
        else:  # exactly through the middle: all directions are equal
            normal = np.cross(direction, across @ np.eye(3)[np.argmin(np.abs(d))])
            size = np.sqrt(normal @ normal)
            normal = normal / size if size > 0.0 else self.rotations[k][:, 0]
        point = a + where * d + (radius - distance) * normal
        return 1.0 - distance / radius, point, d


def _checked(name: str, value: Array, shape: tuple[int, ...]) -> Array:
    array = np.asarray(value, dtype=np.float64)
    if array.shape != shape:
        raise GeometryError(f"{name} must have shape {shape}, not {array.shape}")
    if not np.isfinite(array).all():
        raise GeometryError(f"{name} must be finite, not {array.tolist()}")
    return array


@dataclass
class TouchState:
    """An iterate of the outer loop: contacts of all obstacles, touched or not."""

    P: Array
    t: Array
    s: Array
    active: Array

    @classmethod
    def at(cls, scene: Scene, start: Start | None) -> TouchState:
        if start is None and scene.n == 0:
            return cls(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0, dtype=bool))
        if start is None:
            everything = np.ones(scene.n, dtype=bool)
            problem = scene.problem(everything)
            g = problem.geometry(problem.first_guess())
            return cls(g.P[0], g.t_P[0], g.arc[0], everything)
        P = _checked("start P", start[0], (scene.n, 3)).copy()
        t = _checked("start t", start[1], (scene.n, 3)).copy()
        s = _checked("start s", start[2], (scene.n,)).copy()
        active = np.array(start[3], dtype=bool)
        if active.shape != (scene.n,):
            raise GeometryError(f"start active must have shape ({scene.n},), not {active.shape}")
        return cls(P, t, s, active)

    def copy(self) -> TouchState:
        return TouchState(self.P.copy(), self.t.copy(), self.s.copy(), self.active.copy())

    def solve(self, scene: Scene, solver: Solver[Any], tol: float) -> Outcome:
        """Solve the coupled system over the touched obstacles, and take its solution."""
        problem = scene.problem(self.active)
        x = problem.unknowns(self.P[self.active], self.t[self.active], self.s[self.active])
        outcome = iterate(solver, problem, x, tol)
        g = problem.geometry(problem.normalised(outcome.x))
        self.P[self.active], self.t[self.active], self.s[self.active] = g.P[0], g.t_P[0], g.arc[0]
        return outcome

    def contacts(self, scene: Scene) -> tuple[Array, float]:
        """Return the last contact points Q (n, 3), equal to P for untouched obstacles, and the tangency error."""
        Q = self.P.copy()
        if not self.active.any():
            return Q, 0.0
        problem = scene.problem(self.active)
        x = problem.unknowns(self.P[self.active], self.t[self.active], self.s[self.active])
        Q[self.active] = problem.geometry(x).Q[0]
        return Q, problem.tangency_error(x)

    def segments(self, scene: Scene) -> list[tuple[Array, Array, list[int]]]:
        """Return start and end of every straight segment, with the untouched obstacles that it passes."""
        Q, _ = self.contacts(scene)
        out: list[tuple[Array, Array, list[int]]] = []
        here, passed = scene.origin, []
        for k in range(scene.n):
            if self.active[k]:
                out.append((here, self.P[k], passed))
                here, passed = Q[k], []
            else:
                passed.append(k)
        return [*out, (here, scene.insertion, passed)]

    def touch_down(self, scene: Scene) -> bool:
        """Add every untouched obstacle below whose surface a segment passes; move the others next to the path."""
        found = False
        for a, b, passed in self.segments(scene):
            for k in passed:
                depth, self.P[k], d = scene.nearest(k, a, b)
                size = float(np.sqrt(d @ d))
                self.t[k] = d / size if size > 0.0 else scene.rotations[k][:, 2]
                self.s[k] = 0.0
                if depth > DEPTH:
                    self.active[k] = found = True
        return found
