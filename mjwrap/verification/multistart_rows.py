"""Find taut paths over a row of surfaces: strings laid round them in many ways, pulled tight together, then polished.

A string is a polyline with NODES nodes from one obstacle to the next. It is laid through one waypoint beside each
obstacle (either side of long ones, several directions round others, the hole of a torus, or none). Then it is
repeatedly smoothed by an implicit step of its tension and pushed out of the surfaces. The nodes that touch at the end
give a rough path for `polish`.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

import mjwrap as mw
from mjwrap.surfaces import Surface
from mjwrap.verification.certificate import ENTERING, Case, deepest, rotation
from mjwrap.verification.polish import Touch, polish
from mjwrap.verification.shapes import (
    SHAPES,
    Array,
    Ellipsoid,
    Ints,
    Shape,
    Torus,
    dot,
    orthogonal_unit,
    sizes,
    unit,
)

NODES = 10  # nodes from one obstacle to the next
PULLS = (
    (40.0, 30),
    (10.0, 40),
    (3.0, 40),
    (1.0, 40),
    (0.2, 40),
)  # (strength of the implicit step in nodes squared, number of steps)
WINDOW = 25  # number of nodes on either side of an obstacle that it may push
STRINGS = 96  # number of strings pulled together
POLISHED = 5  # number of the shortest different strings that are polished
REPAIRS = 3  # rounds of adding surfaces that a polished path enters
SAME = 1e-3  # relative: strings with a smaller difference of length and the same touches count as equal


def ways_round(surface: Surface, quat: Sequence[float], along: Array) -> list[Array]:
    """Return waypoints beside a surface, relative to its centre, for a string that runs along a unit vector."""
    turn, d = rotation(quat), sizes(surface)
    match surface:
        case mw.Cylinder() | mw.Cone() | mw.EllipticCylinder():
            side = np.cross(turn[:, 2], along)
            reach = 1.2 * max(d[:2]) if isinstance(surface, mw.EllipticCylinder) else 1.2 * d[0]
            return [sign * reach * unit(side) for sign in (1.0, -1.0)]
        case mw.Torus():
            reach, count, others = d[0] + 1.2 * d[1], 4, [np.zeros(3)]
        case mw.Capsule():
            reach, count, others = d[0] + d[1], 4, []
        case _:
            reach, count, others = 1.2 * max(d), 4, []
    first = orthogonal_unit(along)
    second = np.cross(along, first)
    angles = 2.0 * np.pi * (np.arange(count) + 0.25) / count
    return [*others, *(reach * (np.cos(x) * first + np.sin(x) * second) for x in angles)]


def strings_of(
    origin: Array, insertion: Array, obstacles: Sequence[mw.Obstacle], rng: np.random.Generator, most: int
) -> Array:
    """Return strings (m, N, 3): all combinations of ways round, or a random choice if there are too many."""
    along = unit(insertion - origin)
    ways = [[None, *ways_round(o.surface, o.quat, along)] for o in obstacles]
    total = float(np.prod([float(len(w)) for w in ways]))
    if total <= most:
        chosen = list(itertools.product(*ways))
    else:
        chosen = [tuple(w[rng.integers(len(w))] for w in ways) for _ in range(most - 1)]
        chosen.append((None,) * len(ways))
    places = np.arange(NODES * (len(obstacles) + 1) + 1)
    strings = []
    for choice in chosen:
        index, points = [0], [origin]
        for k, (way, obstacle) in enumerate(zip(choice, obstacles, strict=True)):
            if way is not None:
                index.append(NODES * (k + 1))
                points.append(np.asarray(obstacle.pos) + way)
        index.append(int(places[-1]))
        points.append(insertion)
        strings.append(np.stack([np.interp(places, index, x) for x in np.array(points).T], 1))
    return np.array(strings)


class _Pushers:
    """The surfaces of a row by kind, and the nodes that each may push."""

    def __init__(self, obstacles: Sequence[mw.Obstacle], nodes: int) -> None:
        self.groups: list[tuple[Shape, list[int], Array, Array, Array, Ints]] = []
        kinds = [type(o.surface) for o in obstacles]
        for kind in dict.fromkeys(kinds):
            rows = [k for k, other in enumerate(kinds) if other is kind]
            d = np.array([sizes(obstacles[k].surface) for k in rows])
            turn = np.array([rotation(obstacles[k].quat) for k in rows])
            pos = np.array([obstacles[k].pos for k in rows])
            width = min(2 * WINDOW + 1, nodes - 2)
            first = np.clip(NODES * (np.array(rows) + 1) - WINDOW, 1, nodes - 1 - width)
            self.groups.append((SHAPES[kind], rows, d, turn, pos, first[:, None] + np.arange(width)))

    def push(self, strings: Array) -> None:
        """Move nodes that are inside a surface out along its normal."""
        for shape, _, d, turn, pos, window in self.groups:
            local = np.einsum("kji,mknj->mkni", turn, strings[:, window] - pos[:, None])
            inside = shape.level(d[:, None], local) < 0.0
            if not inside.any():
                continue
            m, k, n = np.nonzero(inside)
            strings[m, window[k, n]] = (
                np.einsum("hij,hj->hi", turn[k], _pushed(shape, d[k], local[m, k, n])) + pos[k]
            )

    def touching(self, string: Array) -> list[tuple[int, Ints]]:
        """Return for each touched obstacle its nodes, in order of the obstacles."""
        found = []
        for shape, rows, d, turn, pos, window in self.groups:
            local = np.einsum("kji,knj->kni", turn, string[window] - pos[:, None])
            on = shape.level(d[:, None], local) < 1e-7
            found += [(row, window[i][on[i]]) for i, row in enumerate(rows) if on[i].any()]
        return sorted(found, key=lambda item: item[0])


def _pushed(shape: Shape, d: Array, x: Array) -> Array:
    """Return points inside a surface moved out: along the normal, deep inside an ellipsoid along the radius."""
    if not isinstance(shape, Ellipsoid):
        # for a point on an axis every direction is equal
        nudged = x + 1e-9 * np.array([0.7, 0.5, 0.3])
        if isinstance(shape, Torus):
            return nudged - shape.height(d, nudged)[..., None] * shape.normal(d, nudged)
        return shape.nearest(d, nudged)
    inverse = shape.inverse(d)
    scaled = np.sqrt((x * x * inverse).sum(-1)) + 1e-12
    for _ in range(3):
        g = x * inverse
        step = x - (0.5 * ((x * x * inverse).sum(-1) - 1.0) / dot(g, g).clip(1e-300))[..., None] * g
        x = np.where((scaled > 0.6)[..., None], step, x)
    radial = np.sqrt((x * x * inverse).sum(-1)).clip(1e-12)
    flat = inverse[..., 2:] == 0.0
    return x / np.where(flat & (np.arange(3) == 2), 1.0, radial[..., None])


def pulled_tight(strings: Array, pushers: _Pushers) -> Array:
    """Return strings (m, N, 3) pulled tight over the surfaces."""
    nodes = strings.shape[1]
    laplace = 2.0 * np.eye(nodes) - np.eye(nodes, k=1) - np.eye(nodes, k=-1)
    laplace[[0, -1]] = 0.0
    strings = strings.copy()
    pushers.push(strings)
    for strength, times in PULLS:
        smooth = np.linalg.inv(np.eye(nodes) + strength * laplace)
        for _ in range(times):
            strings = np.tensordot(strings, smooth, (1, 1)).swapaxes(1, 2)  # (m, 3, N), then (m, N, 3)
            pushers.push(strings)
    return strings


def rough_path(string: Array, obstacles: Sequence[mw.Obstacle], pushers: _Pushers) -> list[Touch]:
    """Return the touches of a string that is pulled tight: one for each surface, two if it bridges a hollow."""
    touches = []
    gaps = np.linalg.norm(np.diff(string, axis=0), axis=1)
    for k, nodes in pushers.touching(string):
        runs = np.split(nodes, np.flatnonzero(np.diff(nodes) > 1) + 1)
        most = 2 if isinstance(obstacles[k].surface, mw.Torus) else 1
        for run in sorted(sorted(runs, key=len)[-most:], key=lambda run: run[0]):
            first, last = int(run[0]), int(run[-1])
            heading = string[first] - string[max(first - 1, 0)]
            s = float(gaps[first:last].sum())
            touches.append(
                Touch(k, string[first], unit(heading), s if last > first else 0.3 * float(gaps[first]))
            )
    return touches


def repaired(
    origin: Array, insertion: Array, obstacles: Sequence[mw.Obstacle], case: Case
) -> list[Touch] | None:
    """Return the touches of a path, with new ones for surfaces that it enters, or None if it enters none."""
    stops = [(k, *touch) for k, contacts in enumerate(case.contacts) for touch in contacts]
    ends = [(0, origin, origin, 0.0), *stops, (len(obstacles) - 1, insertion, insertion, 0.0)]
    touches: list[Touch] = []
    entered = False
    for place, ((i, _, point, _), (k, far, _, s)) in enumerate(pairwise(ends)):
        for j in range(i, k + 1):
            if len(case.contacts[j]) > (1 if isinstance(obstacles[j].surface, mw.Torus) else 0):
                continue
            turn, pos = rotation(obstacles[j].quat), np.array(obstacles[j].pos)
            shape, d = SHAPES[type(obstacles[j].surface)], sizes(obstacles[j].surface)
            a, b = turn.T @ (point - pos), turn.T @ (far - pos)
            if deepest(shape, d[None], a[None], b[None])[0] < -ENTERING:
                samples = a + np.linspace(0.0, 1.0, 65)[:, None] * (b - a)
                low = samples[shape.level(d, samples).argmin()]
                P = turn @ shape.nearest(d, low + 1e-12) + pos
                touches.append(Touch(j, P, unit(far - point), 1e-2 / float(shape.bend(d))))
                entered = True
        if place < len(stops):
            heading = far - (touches[-1].P if entered and touches else point)
            touches.append(Touch(k, far, unit(heading), s))
    return touches if entered else None


def paths_over_row(
    origin: Array,
    insertion: Array,
    obstacles: Sequence[mw.Obstacle],
    rng: np.random.Generator,
    most: int = STRINGS,
) -> list[Case]:
    """Return tangent paths over a row of surfaces, from the shortest strings first; they are not judged yet."""
    strings = strings_of(origin, insertion, obstacles, rng, most)
    pushers = _Pushers(obstacles, strings.shape[1])
    strings = pulled_tight(strings, pushers)
    lengths = np.linalg.norm(np.diff(strings, axis=1), axis=2).sum(1)
    rough: list[list[Touch]] = []
    seen: list[tuple[float, list[int]]] = []
    for i in np.argsort(lengths):
        path = rough_path(strings[i], obstacles, pushers)
        touched = [touch.k for touch in path]
        if any(ks == touched and abs(lengths[i] / x - 1.0) < SAME for x, ks in seen):
            continue
        seen.append((float(lengths[i]), touched))
        rough.append(path)
        if len(rough) == POLISHED:
            break
    return finished(origin, insertion, obstacles, rough)


def finished(
    origin: Array, insertion: Array, obstacles: Sequence[mw.Obstacle], rough: Sequence[list[Touch]]
) -> list[Case]:
    """Return the polished rough paths, with surfaces added that they enter."""
    done: list[Case] = []
    for _ in range(REPAIRS):
        straight = [
            Case(
                origin,
                insertion,
                obstacles,
                [[] for _ in obstacles],
                float(np.linalg.norm(insertion - origin)),
            )
            for path in rough
            if not path
        ]
        cases = [*straight, *(c for c in polish(origin, insertion, obstacles, rough) if c is not None)]
        rough = []
        for case in cases:
            more = repaired(origin, insertion, obstacles, case)
            if more is None:
                done.append(case)
            else:
                rough.append(more)
        if not rough:
            break
    return done
