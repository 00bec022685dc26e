"""Seeded random scenes at muscle scale for robustness.py and motion.py, each with a hint of every kind.

Half of them are constructed backwards: on every surface a geodesic on which a string can lie is drawn first, and the
ends are put on its tangents. So one taut path is known, its middle is a good hint, and its length is an upper bound of
the shortest length. The other half are placed at random (`scenes.py`) and have no good hint.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import mjwrap as mw
from mjwrap.surfaces import Surface
from mjwrap.verification.arcs import arcs_of
from mjwrap.verification.certificate import ENTERING, Case, deepest, findings, rotation
from mjwrap.verification.scenes import (
    _clear,
    height,
    local,
    nearest,
    outward,
    point_towards,
    random_scene,
    random_surface,
)
from mjwrap.verification.shapes import SHAPES, Array, half_length, sizes, unit

CLASSES = {
    "cylinder": "c",
    "sphere": "s",
    "ellipsoid": "e",
    "torus": "t",
    "cone": "k",
    "elliptic cylinder": "l",
    "capsule": "p",
    "3 mixed": "???",
    "5 mixed": "?????",
    "16 in a row": "+" * 16,
    "16 of all kinds": "?" * 16,
    "64 in a row": "+" * 64,
    "64 of all kinds": "?" * 64,
    "long elliptic cylinder": "L",
    "capsule lengthwise": "p",
    "ends near a surface": ".",
}
WILD = {"?": "cselktp", "+": "cse", ".": "cselkp"}  # letters from which each obstacle of each scene is drawn
POOL = 150  # number of geodesics of each kind that are drawn together
TRIES = 40  # number of positions tried for one surface of a chain
BACKTRACKS = 3  # number of links tried per surface of a chain
LEAST_ARC, MOST_TURN = 2e-3, 2.6  # limits of a drawn geodesic [m, rad]
ROW_TURN = 1.2  # the same within a row, so that the row can continue
STEADY = 0.1  # smallest stiffness after a geodesic of a chain, relative to that of a straight string


@dataclass(frozen=True)
class Scene:
    """One scene: obstacles without hints, and hints and a path that are known.

    good, random: a hint for each obstacle, in its frame [m] (good ones None if no path is known); known: the path
    that the scene was made for, or None.
    """

    origin: Array
    insertion: Array
    obstacles: list[mw.Obstacle]
    good: list[Any] | None
    random: list[Any]
    known: Case | None

    def hinted(self, kind: str) -> list[mw.Obstacle] | None:
        """Return the obstacles with good hints, random hints or none; None if the scene has no such hints."""
        if kind == "none":
            return self.obstacles
        hints = self.good if kind == "good" else self.random
        if hints is None:
            return None
        return [replace(o, hint=tuple(h)) for o, h in zip(self.obstacles, hints, strict=True)]


@dataclass
class Drawn:
    """One geodesic on one surface, in the surface's frame, that a string can lie on."""

    surface: Surface
    P: Array
    t: Array
    n: Array
    s: float
    Q: Array
    t_Q: Array
    n_Q: Array
    jacobi: Array
    middle: Array


@dataclass
class Link:
    """One surface of a chain, in the world: the string's contact, its direction after it, and its stability."""

    drawn: Drawn
    obstacle: mw.Obstacle
    P: Array
    Q: Array
    heading: Array
    b_Q: Array
    behind: float


def draw_geodesics(rng: np.random.Generator, letter: str, count: int, turn: float = MOST_TURN) -> list[Drawn]:
    """Return geodesics over which a string can be pulled: bent towards the surface, in range, no conjugate point."""
    found: list[Drawn] = []
    while len(found) < count:
        surfaces = [random_surface(rng, letter) for _ in range(count)]
        shape = SHAPES[type(surfaces[0])]
        d = np.array([sizes(surface) for surface in surfaces])
        start = rng.normal(size=(count, 3)) * rng.uniform(0.02, 0.06, (count, 1))
        P = shape.nearest(d, shape.nearest(d, start))
        n = shape.normal(d, P)
        t = unit(np.cross(n, rng.normal(size=(count, 3))))
        bending = shape.bending(d, P, t)
        s = rng.uniform(0.02, turn, count) / np.maximum(bending, 3.0)
        s = np.minimum(s, 0.15)
        arcs = arcs_of(shape, d, P, t, s)
        reach = np.array([half_length(surface) for surface in surfaces])
        steady = (arcs.bending > 0.0) & (arcs.spread > 0.0) & (arcs.reach < reach) & (s > LEAST_ARC)
        middle = arcs.points[np.arange(count), np.abs(arcs.x - 0.5 * s[:, None]).argmin(1)]
        n_Q = shape.normal(d, arcs.Q)
        found += [
            Drawn(
                surfaces[i],
                P[i],
                t[i],
                n[i],
                float(s[i]),
                arcs.Q[i],
                arcs.t[i],
                n_Q[i],
                arcs.jacobi[i],
                middle[i],
            )
            for i in np.flatnonzero(steady)
        ]
    return found[:count]


def _enters(a: Array, b: Array, obstacle: mw.Obstacle) -> bool:
    """Return whether the straight segment between two points of the world enters a torus."""
    if not isinstance(obstacle.surface, mw.Torus):
        return False
    ends = local(obstacle, np.array([a, b]))
    return bool(deepest(SHAPES[mw.Torus], sizes(obstacle.surface)[None], ends[:1], ends[1:])[0] < -ENTERING)


def _frame(t: Array, n: Array) -> Array:
    return np.stack([t, n, np.cross(t, n)], 1)


def _quaternion(R: Array) -> tuple[float, ...]:
    """Return w, x, y, z of a rotation matrix, by the largest of the four."""
    K = np.array(
        [
            [R[0, 0] + R[1, 1] + R[2, 2], 0, 0, 0],
            [R[2, 1] - R[1, 2], R[0, 0] - R[1, 1] - R[2, 2], 0, 0],
            [R[0, 2] - R[2, 0], R[1, 0] + R[0, 1], R[1, 1] - R[0, 0] - R[2, 2], 0],
            [R[1, 0] - R[0, 1], R[2, 0] + R[0, 2], R[2, 1] + R[1, 2], R[2, 2] - R[0, 0] - R[1, 1]],
        ]
    )
    return tuple(float(x) for x in np.linalg.eigh(K)[1][:, -1][[0, 1, 2, 3]])


def _lengthwise(rng: np.random.Generator, letters: str) -> tuple[Array, Array, list[mw.Obstacle]]:
    """Return ends beyond the caps of a capsule, within three radii of its axis."""
    surface = random_surface(rng, letters)
    assert isinstance(surface, mw.Capsule)
    row = [mw.Obstacle(surface, tuple(0.05 * rng.normal(size=3)), tuple(rng.normal(size=4)))]
    spread, ends = rng.uniform(0.0, 3.0), []
    for way in (1.0, -1.0):
        angle, far = rng.uniform(0.0, 2.0 * np.pi), surface.radius * spread * np.sqrt(rng.random())
        beyond = surface.half_length + surface.radius + rng.uniform(0.01, 0.1)
        ends.append([far * np.cos(angle), far * np.sin(angle), way * beyond])
    world = np.array(ends) @ rotation(row[0].quat).T + row[0].pos
    return world[0], world[1], row


def _ends_near(rng: np.random.Generator, letters: str) -> tuple[Array, Array, list[mw.Obstacle]]:
    """Return ends at heights of 1e-14 to 1e-3 sizes over a surface."""
    surface = random_surface(rng, letters)
    row = [mw.Obstacle(surface, tuple(0.05 * rng.normal(size=3)), tuple(rng.normal(size=4)))]
    ends = 0.04 * rng.normal(size=(2, 3))
    if isinstance(surface, mw.Cone):
        ends[:, 2] = rng.uniform(-0.8, 0.8, 2) * surface.half_length
    ends = nearest(row[0], nearest(row[0], ends @ rotation(row[0].quat).T + row[0].pos))
    high = surface.size * 10.0 ** rng.uniform(-14.0, -3.0, (2, 1))
    ends = ends + high * outward(row[0], ends)
    return ends[0], ends[1], row


class Maker:
    """Scenes of one class from one seed: geodesics from a pool are combined to scenes.

    name: of one of `CLASSES`, or the letters of a row.
    """

    def __init__(self, name: str, seed: int, chunk: int) -> None:
        self.kinds = CLASSES.get(name, name)
        self.place = {"capsule lengthwise": _lengthwise, "ends near a surface": _ends_near}.get(name)
        number = list(CLASSES).index(name) if name in CLASSES else int.from_bytes(name.encode(), "big")
        self.rng = np.random.default_rng([seed, number, chunk])
        letters = sorted({letter for k in self.kinds for letter in WILD.get(k, k)})
        turn = MOST_TURN if len(self.kinds) == 1 else ROW_TURN
        self.pool = {letter: draw_geodesics(self.rng, letter, POOL, turn) for letter in letters}

    def letters(self) -> str:
        """Return the letters of one scene."""
        return "".join(k if k not in WILD else WILD[k][self.rng.integers(len(WILD[k]))] for k in self.kinds)

    def scene(self, backwards: bool) -> Scene:
        """Return the next scene."""
        if not backwards:
            return self._placed()
        while True:
            scene = self._chained(self.letters())
            if scene is not None and scene.known is not None and not findings([scene.known])[0]:
                return scene

    def _random_hints(self, obstacles: list[mw.Obstacle]) -> list[Any]:
        return [point_towards(o.surface, unit(self.rng.normal(size=3))) for o in obstacles]

    def _placed(self) -> Scene:
        """Return a scene with randomly placed obstacles; a single obstacle has a random orientation."""
        letters = self.letters()
        if self.place is not None:
            origin, insertion, row = self.place(self.rng, letters)
            return Scene(origin, insertion, row, None, self._random_hints(row), None)
        while True:
            origin, insertion, row = random_scene(self.rng, letters, hints=False)
            if len(row) > 1:
                break
            row = [replace(row[0], quat=tuple(self.rng.normal(size=4)))]
            stretch = self.rng.uniform(0.8, 1.6)
            origin, insertion = (row[0].pos + stretch * (x - row[0].pos) for x in (origin, insertion))
            apart = float(np.linalg.norm(insertion - origin))
            if 0.1 <= apart <= 0.3 and height(row[0], np.array([origin, insertion])).min() > 1e-3:
                break
        return Scene(origin, insertion, row, None, self._random_hints(row), None)

    def _chained(self, letters: str) -> Scene | None:
        """Return a scene made along a string: from end to end, each surface is put where the string should touch it."""
        rng, count = self.rng, len(letters)
        spacing = rng.uniform(0.06, 0.12)
        origin = np.array([0.0, *rng.uniform(-0.03, 0.03, 2)])
        heading = unit(np.array([1.0, *rng.uniform(-0.3, 0.3, 2)]))
        links: list[Link] = []
        for _ in range(BACKTRACKS * count):
            if len(links) == count:
                break
            link = self._next(letters[len(links)], links, origin, heading, spacing, count)
            if link is not None:
                links.append(link)
            else:
                del links[-2:]
        if len(links) < count:
            return None
        last = links[-1]
        room = rng.uniform(0.03, 0.12) if count == 1 else rng.uniform(0.3, 0.6) * spacing
        insertion = last.Q + last.heading * room
        row = [link.obstacle for link in links]
        if 1.0 / room + last.behind <= STEADY / room or _enters(last.Q, insertion, row[-1]):
            return None
        if min(height(o, insertion[None])[0] for o in row[-4:]) < 1e-3:
            return None
        if count == 1 and not 0.1 <= np.linalg.norm(insertion - origin) <= 0.3:
            return None
        parts = [origin, *(x for link in links for x in (link.P, link.Q)), insertion]
        chords = np.linalg.norm(np.diff(np.array(parts), axis=0), axis=1)[::2]
        length = float(chords.sum() + sum(link.drawn.s for link in links))
        known = Case(origin, insertion, row, [[(link.P, link.Q, link.drawn.s)] for link in links], length)
        hints = []
        for drawn in (link.drawn for link in links):
            spread = 0.1 * np.linalg.norm(drawn.middle - drawn.P)
            hints.append(drawn.middle + spread * rng.normal(size=3))
        return Scene(origin, insertion, row, hints, self._random_hints(row), known)

    def _next(
        self, letter: str, links: list[Link], origin: Array, heading: Array, spacing: float, count: int
    ) -> Link | None:
        """Return one more link of a chain, or None if none is found that is free of others and stable."""
        rng = self.rng
        point, c, b_before = origin, np.inf, np.zeros(3)
        if links:
            point, heading, c, b_before = links[-1].Q, links[-1].heading, links[-1].behind, links[-1].b_Q
        for _ in range(TRIES):
            drawn = self.pool[letter][rng.integers(POOL)]
            room = rng.uniform(0.03, 0.12)
            if count > 1:
                ahead = (len(links) + rng.uniform(0.8, 1.2)) * spacing - point[0] - 0.5 * drawn.s
                room = max(ahead / heading[0], 0.15 * spacing)
            placed = self._put(drawn, point + room * heading, heading, count > 1)
            if placed is None:
                continue
            obstacle, P, Q, t_Q, b_P, b_Q = placed
            # Riccati: the stiffness with which the previous links hold the string against a sideways shift
            over = 1.0 / room
            if over + c <= STEADY * over:
                continue
            stiff = over if np.isinf(c) else over - (b_before @ b_P * over) ** 2 / (over + c)
            a, da, r, dr = drawn.jacobi
            held = a + stiff * r
            if held <= STEADY * (1.0 + r * over) or da + stiff * dr < -held / spacing:
                continue
            if height(obstacle, origin[None])[0] < 1e-3:
                continue
            if any(_enters(point, P, o) for o in (obstacle, *(link.obstacle for link in links[-1:]))):
                continue
            if all(_clear(obstacle, link.obstacle) for link in reversed(links)):
                return Link(drawn, obstacle, P, Q, t_Q, b_Q, (da + stiff * dr) / held)
        return None

    def _put(self, drawn: Drawn, P: Array, heading: Array, along_row: bool) -> tuple | None:
        """Return a surface put so that the string meets it at P; in a row the string must continue along the row."""
        rng, long = self.rng, drawn.surface.__class__ in (mw.Cylinder, mw.Cone, mw.EllipticCylinder)
        for _ in range(8 if along_row else 1):
            n = unit(np.cross(heading, rng.normal(size=3)))
            R = _frame(heading, n) @ _frame(drawn.t, drawn.n).T
            pos = P - R @ drawn.P
            t_Q = R @ drawn.t_Q
            Q = R @ drawn.Q + pos
            wanted = -Q[1:] / 0.15  # back towards the line of the row, in proportion to the distance
            if along_row and (
                t_Q[0] < 0.5 or np.linalg.norm(t_Q[1:] - wanted) > 0.6 or (long and abs(R[0, 2]) > 0.4)
            ):
                continue
            quat = _quaternion(R)
            R = rotation(quat)  # equal except for rounding
            P, Q = R @ drawn.P + pos, R @ drawn.Q + pos
            b_P, b_Q = np.cross(R @ drawn.t, R @ drawn.n), np.cross(R @ drawn.t_Q, R @ drawn.n_Q)
            return mw.Obstacle(drawn.surface, tuple(pos), quat), P, Q, R @ drawn.t_Q, b_P, b_Q
        return None
