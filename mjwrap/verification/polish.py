"""Newton's method on the tangency conditions of rough paths, for the independent search, without the solver's code.

A rough path is a list of touches (obstacle, P, t, s). Derivatives are differences of the geodesics of `arcs`, so that
the solver's analytic Jacobian is not used. All touches of all rough paths of a scene are moved together.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import mjwrap as mw
from mjwrap.surfaces import Surface
from mjwrap.verification.arcs import arcs_of
from mjwrap.verification.certificate import Case, Contacts, rotation
from mjwrap.verification.shapes import SHAPES, Array, sizes, unit

STEP = 1e-6  # step of the differences, in radii and in radians
TANGENT = 1e-11  # largest component of the tangency error of a finished path
ITERATIONS = 40
LARGEST = 0.3  # largest turn, or motion relative to a radius, of a touch in one step
VANISHED = 1e-7  # a touch whose arc is shorter than this share of the radius is removed


class Touch(NamedTuple):
    """A rough geodesic on obstacle k: from P along t over s; world frame [m]. One obstacle may have two in a row."""

    k: int
    P: Array
    t: Array
    s: float


def _size(surface: Surface) -> float:
    return 1.0 / float(SHAPES[type(surface)].bend(sizes(surface)))


class _Touches:
    """All touches of all paths by kind of surface, and the neighbours of each touch."""

    def __init__(self, obstacles: Sequence[mw.Obstacle], paths: Sequence[Sequence[Touch]]) -> None:
        flat = [touch for path in paths for touch in path]
        self.count = len(flat)
        self.turn = np.array([rotation(obstacles[touch.k].quat) for touch in flat])
        self.pos = np.array([obstacles[touch.k].pos for touch in flat])
        self.size = np.array([_size(obstacles[touch.k].surface) for touch in flat])
        kinds = [type(obstacles[touch.k].surface) for touch in flat]
        self.groups = []
        for kind in dict.fromkeys(kinds):
            rows = np.array([i for i, other in enumerate(kinds) if other is kind])
            d = np.array([sizes(obstacles[flat[i].k].surface) for i in rows])
            self.groups.append((SHAPES[kind], rows, d))
        self.P = np.einsum("kji,kj->ki", self.turn, np.array([touch.P for touch in flat]) - self.pos)
        self.t = np.einsum("kji,kj->ki", self.turn, np.array([touch.t for touch in flat]))
        self.s = np.array([touch.s for touch in flat])
        self.P, self.t, self.s = (value[:, 0] for value in self.moved(np.zeros((self.count, 1, 4))))

    def moved(self, by: Array) -> tuple[Array, Array, Array]:
        """Return P, t, s (m, v, ...) after natural variations by (m, v, 4), in the surfaces' frames."""
        P, t = np.empty((*by.shape[:2], 3)), np.empty((*by.shape[:2], 3))
        for shape, rows, d in self.groups:
            n = shape.normal(d, self.P[rows])
            b = np.cross(self.t[rows], n)
            tangent, sideways, move = self.t[rows][:, None], b[:, None], by[rows]
            here = self.P[rows][:, None] + move[..., :1] * tangent + move[..., 1:2] * sideways
            P[rows] = shape.nearest(d[:, None], here)
            n = shape.normal(d[:, None], P[rows])
            heading = tangent + move[..., 2:3] * sideways
            t[rows] = unit(heading - np.einsum("...i,...i->...", heading, n)[..., None] * n)
        return P, t, self.s[:, None] + by[..., 3]

    def world(self, own: slice) -> tuple[Array, Array]:
        """Return P and t of some touches in the world frame."""
        P, t = (np.einsum("kij,kj->ki", self.turn[own], value[own]) for value in (self.P, self.t))
        return P + self.pos[own], t

    def frames(self, by: Array) -> tuple[Array, ...]:
        """Return P, n, b at the start and Q, t, n, b at the end, (m, v, 3), world frame."""
        P, t, s = self.moved(by)
        out = [np.empty_like(P) for _ in range(7)]
        variants = by.shape[1]
        for shape, rows, d in self.groups:
            many = np.repeat(d, variants, axis=0)
            flat = P[rows].reshape(-1, 3), t[rows].reshape(-1, 3), np.maximum(s[rows].ravel(), 0.0)
            arcs = arcs_of(shape, many, *flat)
            n, far = shape.normal(many, flat[0]), shape.normal(many, arcs.Q)
            parts = (flat[0], n, np.cross(flat[1], n), arcs.Q, arcs.t, far, np.cross(arcs.t, far))
            for whole, part in zip(out, parts, strict=True):
                turned = np.einsum("kij,kvj->kvi", self.turn[rows], part.reshape(len(rows), variants, 3))
                whole[rows] = turned
        out[0] += self.pos[:, None]
        out[3] += self.pos[:, None]
        return tuple(out)


def _rows(a: Array, b: Array, n: Array, side: Array) -> Array:
    """Return the two components of the direction from a to b that are zero for a tangent."""
    e = unit(b - a)
    return np.stack([np.einsum("...i,...i->...", e, n), np.einsum("...i,...i->...", e, side)], -1)


def polish(
    origin: Array, insertion: Array, obstacles: Sequence[mw.Obstacle], paths: Sequence[Sequence[Touch]]
) -> list[Case | None]:
    """Return each rough path made tangent, or None if Newton's method does not converge.

    A touch whose arc vanishes is removed, and the method is started again without it.
    """
    paths = [list(path) for path in paths]
    result: list[Case | None] = [None] * len(paths)
    alive = [i for i, path in enumerate(paths) if path]
    if not alive:
        return result
    touches = _Touches(obstacles, [paths[i] for i in alive])
    bounds = np.cumsum([0, *(len(paths[i]) for i in alive)])
    before = np.arange(touches.count) - 1
    after = np.arange(touches.count) + 1
    before[bounds[:-1]], after[bounds[1:] - 1] = -1, -1
    inner_before, inner_after = before >= 0, after >= 0
    scale = np.stack([touches.size, touches.size, np.ones(touches.count), touches.size], 1)
    by = np.zeros((touches.count, 5, 4))
    by[:, 1:] = STEP * np.eye(4) * scale[:, None]
    going = dict.fromkeys(range(len(alive)))
    shorter: dict[int, list[Touch]] = {}
    for _ in range(ITERATIONS):
        P, nP, bP, Q, _, nQ, bQ = touches.frames(by)
        left = np.where(inner_before[:, None], Q[before, 0], origin)
        right = np.where(inner_after[:, None], P[after, 0], insertion)
        arrive, leave = _rows(left[:, None], P, nP, bP), _rows(Q, right[:, None], nQ, bQ)
        error = np.concatenate([arrive[:, 0], leave[:, 0]], 1)
        diagonal = np.concatenate([arrive[:, 1:] - arrive[:, :1], leave[:, 1:] - leave[:, :1]], 2) / STEP
        lower = (_rows(Q[before, 1:], P[:, :1], nP[:, :1], bP[:, :1]) - arrive[:, :1]) / STEP
        upper = (_rows(Q[:, :1], P[after, 1:], nQ[:, :1], bQ[:, :1]) - leave[:, :1]) / STEP
        change = np.zeros((touches.count, 4))
        for path in list(going):
            first, last = bounds[path], bounds[path + 1]
            own = slice(first, last)
            if np.abs(error[own]).max() < TANGENT:
                result[alive[path]] = _case(
                    origin, insertion, obstacles, paths[alive[path]], touches, P, Q, own
                )
                del going[path]
                continue
            n = last - first
            J = np.zeros((4 * n, 4 * n))
            for i in range(n):
                rows = slice(4 * i, 4 * i + 4)
                J[rows, rows] = diagonal[first + i].T
                if i:
                    J[4 * i : 4 * i + 2, 4 * i - 4 : 4 * i] = lower[first + i].T
                if i < n - 1:
                    J[4 * i + 2 : 4 * i + 4, 4 * i + 4 : 4 * i + 8] = upper[first + i].T
            try:
                step = -np.linalg.solve(J, error[own].ravel()).reshape(n, 4)
            except np.linalg.LinAlgError:
                del going[path]
                continue
            step *= min(1.0, LARGEST / max(np.abs(step).max(), 1e-300))
            shrink = -step[:, 3] * touches.size[own] / np.maximum(touches.s[own], 1e-300)
            step *= min(1.0, 0.9 / max(shrink.max(), 1e-300))
            change[own] = step
            vanished = touches.s[own] < VANISHED * touches.size[own]
            if vanished.any():
                del going[path]
                P_now, t_now = touches.world(own)
                shorter[alive[path]] = [
                    Touch(old.k, P_now[i], t_now[i], float(touches.s[first + i]))
                    for i, old in enumerate(paths[alive[path]])
                    if not vanished[i]
                ]
        if not going:
            break
        touches.P, touches.t, touches.s = (value[:, 0] for value in touches.moved((change * scale)[:, None]))
    again = [i for i, path in shorter.items() if path]
    for i, case in zip(again, polish(origin, insertion, obstacles, [shorter[i] for i in again]), strict=True):
        result[i] = case
    return result


def _case(
    origin: Array,
    insertion: Array,
    obstacles: Sequence[mw.Obstacle],
    path: Sequence[Touch],
    touches: _Touches,
    P: Array,
    Q: Array,
    own: slice,
) -> Case:
    """Return the finished path as a case for the judge."""
    contacts: list[Contacts] = [[] for _ in obstacles]
    points = [origin]
    for touch, a, b, s in zip(path, P[own, 0], Q[own, 0], touches.s[own], strict=True):
        contacts[touch.k].append((a, b, float(s)))
        points += [a, b]
    points.append(insertion)
    chords = np.diff(np.array(points), axis=0)[::2]
    length = float(np.linalg.norm(chords, axis=1).sum() + touches.s[own].sum())
    return Case(origin, insertion, obstacles, contacts, length)
