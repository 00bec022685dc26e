"""An independent judge of paths: it tests a solution from its contact points and arc lengths alone.

The path of a taut string touches each of its surfaces along a geodesic that bends towards the surface everywhere. It
meets and leaves the surface tangentially, does not pass below a surface, and is a local minimum of length. `findings`
tests a thousand paths at once, with the geometry of `shapes` and the geodesics of `arcs`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

import mjwrap as mw
from mjwrap.verification.arcs import Arcs, arcs_of
from mjwrap.verification.shapes import SHAPES, Array, Ints, Shape, half_length, orthogonal_unit, sizes, unit

ON_SURFACE = 1e-12  # distance of contact points from their surface, a hundred roundings of 0.1 m [m]
DIRECTION = 1e-8  # sine of the angle between a segment and its geodesic; the solver asks for 1e-10
LANDING = 1e-9  # distance between Q and the end of the geodesic from P; 1e-10 rad over the arcs here makes 1e-11 [m]
SUM = 1e-13  # relative: total length against the sum of its parts
ENTERING = 1e-12  # depth of a straight segment below a surface [m]
LIFTING = 1e-9  # negative normal curvature, relative to the largest
SLIPPING = 1e-9  # negative stiffness against sideways shifts, relative to the largest
SHORT = 1e-6  # the direction of a shorter segment is too inaccurate for the arc after it [m]
BOTH_SHORT = 1e-6  # segments before and after an arc that are shorter leave its direction to its ends [m]
NO_AIM = 1e-10  # shorter ones have no direction to start the search for it [m]
AIMS = 8  # Newton steps of this search
DIRECTIONS = 24  # directions from which it is begun if there is none
ROUNDING = 1e-15  # rounding error of a point [m]: a shorter segment has no direction
SEGMENT_SAMPLES = 257  # points along a straight segment beside a surface that is not convex
NARROWING = 60  # golden-section steps between two samples


Contacts = list[tuple[Array, Array, float]]


@dataclass
class Case:
    """A scene and the path claimed for it: the touches (P, Q, s) of each obstacle, and the length [m].

    An obstacle has no touch, one touch, or two if the string bridges a hollow of it.
    """

    origin: Array
    insertion: Array
    obstacles: Sequence[Any]
    contacts: list[Contacts]
    length: float

    @classmethod
    def of(cls, origin: Any, insertion: Any, obstacles: Sequence[Any], sol: mw.PathSolution) -> Case:
        """Return the case of a solution of `mw.solve_path`."""
        contacts: list[Contacts] = []
        for contact in sol.contacts:
            contacts.append([])
            for touch in contact.touches:
                assert touch.P is not None
                assert touch.Q is not None
                contacts[-1].append((touch.P, touch.Q, touch.arc_length))
        return cls(np.asarray(origin, float), np.asarray(insertion, float), obstacles, contacts, sol.length)


@dataclass
class Touch:
    """One touched surface of one case, in the world: contact points, arc length, and the segments beside it."""

    case: int
    index: int
    P: Array
    Q: Array
    s: float
    arriving: Array
    leaving: Array
    before: float
    after: float
    normals: Array = field(default_factory=lambda: np.zeros((2, 3)))
    tangents: Array = field(default_factory=lambda: np.zeros((2, 3)))
    jacobi: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 1.0]))


@dataclass
class Group:
    """All touches of one kind of surface, with their geodesics in the frames of the surfaces."""

    shape: Shape
    touches: list[Touch]
    d: Array
    turn: Array
    P: Array
    Q: Array
    t: Array
    s: Array
    arcs: Arcs


def rotation(quat: Any) -> Array:
    """Return the matrix of a quaternion w, x, y, z of any length."""
    w, x, y, z = np.asarray(quat) / np.linalg.norm(quat)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class Verdict:
    """The first fault found in each case, or an empty string."""

    def __init__(self, count: int) -> None:
        self.reasons = [""] * count

    def refute(self, case: int, reason: str) -> None:
        """Note a fault, unless the case already has one."""
        if not self.reasons[case]:
            self.reasons[case] = reason


def findings(cases: Sequence[Case]) -> list[str]:
    """Return the fault of each case: '' or a word (folded, penetrating, ...) with its measure."""
    verdict = Verdict(len(cases))
    touches, segments = [], []
    for number, case in enumerate(cases):
        values = [
            case.length,
            *(x for c in case.contacts for touch in c for part in touch for x in np.atleast_1d(part)),
        ]
        if not np.isfinite(values).all():
            verdict.refute(number, "not finite")
            continue
        found, chords, total = laid_out(number, case)
        if any(touch.s < 0.0 for touch in found):
            verdict.refute(number, "negative arc length")
            continue
        if abs(case.length - total) > SUM * total:
            verdict.refute(number, f"length: {case.length!r} m is not the sum of its parts, {total!r} m")
        touches += found
        segments += chords
    for group in grouped(cases, touches):
        _judge_contacts(cases, group, verdict)
    _judge_segments(cases, segments, verdict)
    _judge_stiffness(len(cases), touches, verdict)
    return verdict.reasons


# ---------------------------------------------------------------------------------- laying a path out


def laid_out(number: int, case: Case) -> tuple[list[Touch], list[tuple[int, int, Array, Array]], float]:
    """Return the touches of a case, its pairs (case, obstacle, from, to) of segments and surfaces, and its length."""
    stops: list[tuple[int, Array, Array, float]] = [(-1, case.origin, case.origin, 0.0)]
    for k, contacts in enumerate(case.contacts):
        stops += [(k, np.asarray(P), np.asarray(Q), float(s)) for P, Q, s in contacts]
    stops.append((len(case.obstacles), case.insertion, case.insertion, 0.0))
    total, beside, chords = 0.0, [], []
    for (i, _, a, _), (j, b, _, s) in pairwise(stops):
        size = float(np.linalg.norm(b - a))
        total += size + s
        beside.append(((b - a) / size if size > 0.0 else np.zeros(3), size))
        turns = range(max(i, 0), min(j + 1, len(case.obstacles)))
        chords += [(number, k, a, b) for k in turns if isinstance(case.obstacles[k], mw.Obstacle)]
    touches = [
        Touch(number, k, P, Q, s, beside[i][0], beside[i + 1][0], beside[i][1], beside[i + 1][1])
        for i, (k, P, Q, s) in enumerate(stops[1:-1])
    ]
    return touches, chords, total


def _tangent(n: Array, e: Array) -> Array:
    """Return unit tangents (m, 3) along directions; any tangent if a direction is near the normal (m, 3)."""
    t = e - (e * n).sum(1)[:, None] * n
    size = np.linalg.norm(t, axis=1)
    return np.where((size > 0.5)[:, None], t / np.maximum(size, 1e-300)[:, None], orthogonal_unit(n))


def _aimed(shape: Shape, d: Array, P: Array, t: Array, s: Array, Q: Array) -> Array:
    """Return tangents (m, 3) turned so that the geodesics of length s pass Q without a sideways miss."""
    n = shape.normal(d, P)
    for _ in range(AIMS):
        arcs = arcs_of(shape, d, P, t, s)
        aside = np.cross(arcs.t, shape.normal(d, arcs.Q))
        r = arcs.jacobi[:, 2]
        miss = ((Q - arcs.Q) * aside).sum(1)
        turn = np.clip(miss / np.where(np.abs(r) > 1e-3 * s, r, np.inf), -0.3, 0.3)
        t = unit(t + turn[:, None] * np.cross(t, n))
    return t


def _found(shape: Shape, d: Array, P: Array, s: Array, Q: Array) -> Array:
    """Return tangents (m, 3) of geodesics of length s from P that end nearest to Q, of many directions."""
    n = shape.normal(d, P)
    u = orthogonal_unit(n)
    v = np.cross(n, u)
    tangents, misses = [], []
    for angle in np.linspace(0.0, 2.0 * np.pi, DIRECTIONS, endpoint=False):
        t = _aimed(shape, d, P, np.cos(angle) * u + np.sin(angle) * v, s, Q)
        tangents.append(t)
        misses.append(np.linalg.norm(arcs_of(shape, d, P, t, s).Q - Q, axis=1))
    best = np.array(misses).argmin(0)
    return np.array(tangents)[best, np.arange(len(s))]


def grouped(cases: Sequence[Case], touches: list[Touch]) -> list[Group]:
    """Return the touches by kind of surface, with the geodesics that continue the arriving segments."""
    kinds: dict[type, list[Touch]] = {}
    for touch in touches:
        obstacle = cases[touch.case].obstacles[touch.index]
        if isinstance(obstacle, mw.Obstacle):
            kinds.setdefault(type(obstacle.surface), []).append(touch)
    groups = []
    for kind, found in kinds.items():
        shape = SHAPES[kind]
        obstacles = [cases[touch.case].obstacles[touch.index] for touch in found]
        d = np.array([sizes(o.surface) for o in obstacles])
        turn = np.array([rotation(o.quat) for o in obstacles])
        pos = np.array([o.pos for o in obstacles])

        def local(name: str, base: Array | float, found: list[Touch] = found, turn: Array = turn) -> Array:
            return np.einsum("kji,kj->ki", turn, np.array([getattr(x, name) for x in found]) - base)

        P, Q, e, e2 = local("P", pos), local("Q", pos), local("arriving", 0.0), local("leaving", 0.0)
        s = np.array([touch.s for touch in found])
        n = shape.normal(d, P)
        # if a segment is too short to have a direction and the arc too short to turn, the next segment's is used
        blunt = np.array([touch.before < 1e3 * ROUNDING for touch in found])
        e = np.where(blunt[:, None], e2, e)
        t = _tangent(n, e)
        # a short segment's direction is inaccurate by rounding: a longer segment after it gives the arc's direction
        short = np.array([touch.before < min(SHORT, touch.after) for touch in found]) & (~blunt | (s > SHORT))
        if short.any():
            start = -_tangent(shape.normal(d[short], Q[short]), e2[short])
            t[short] = _tangent(n[short], -arcs_of(shape, d[short], Q[short], start, s[short]).t)
        # two short segments: the direction in which a geodesic reaches Q
        short = np.array([max(touch.before, touch.after) < BOTH_SHORT for touch in found]) & (s > SHORT)
        if short.any():
            t[short] = _aimed(shape, d[short], P[short], t[short], s[short], Q[short])
            blind = np.array([max(touch.before, touch.after) < NO_AIM for touch in found]) & (s > SHORT)
            if blind.any():
                t[blind] = _found(shape, d[blind], P[blind], s[blind], Q[blind])
        arcs = arcs_of(shape, d, P, t, s)
        ends = shape.normal(d, arcs.Q)
        for k, touch in enumerate(found):
            touch.normals = np.array([turn[k] @ n[k], turn[k] @ ends[k]])
            touch.tangents = np.array([turn[k] @ t[k], turn[k] @ arcs.t[k]])
            touch.jacobi = arcs.jacobi[k]
        groups.append(Group(shape, found, d, turn, P, Q, t, s, arcs))
    return groups


# ------------------------------------------------------------------------------------------ contacts


def _judge_contacts(cases: Sequence[Case], group: Group, verdict: Verdict) -> None:
    shape, d, arcs = group.shape, group.d, group.arcs
    off = np.maximum(np.abs(shape.height(d, group.P)), np.abs(shape.height(d, group.Q)))
    missed = np.linalg.norm(arcs.Q - group.Q, axis=1)
    steepest = np.abs(shape.bending(d[:, None], arcs.points, arcs.tangents)).max(1)
    lost = np.flatnonzero(missed > LANDING)
    turned = np.full(len(missed), np.inf)
    if lost.size:
        backwards = arcs_of(shape, d[lost], group.P[lost], -group.t[lost], group.s[lost])
        turned[lost] = np.linalg.norm(backwards.Q - group.Q[lost], axis=1)
    for k, touch in enumerate(group.touches):
        if off[k] > ON_SURFACE:
            verdict.refute(touch.case, f"off surface: obstacle {touch.index} by {off[k]:.1e} m")
        t, w = touch.tangents
        if missed[k] > LANDING:
            word = "folded" if turned[k] <= LANDING else "no geodesic"
            verdict.refute(touch.case, f"{word}: obstacle {touch.index}, misses Q by {missed[k]:.1e} m")
        for e, tangent, size in ((touch.arriving, t, touch.before), (touch.leaving, w, touch.after)):
            error = float(np.linalg.norm(e - tangent))
            if size > 1e3 * ROUNDING and error > DIRECTION + 10.0 * ROUNDING * (1.0 / size + steepest[k]):
                word = "folded" if e @ tangent < 0.0 else "not tangent"
                verdict.refute(touch.case, f"{word}: obstacle {touch.index} by {error:.1e}")
        if arcs.bending[k] < -LIFTING * max(steepest[k], 1.0):
            verdict.refute(
                touch.case, f"lifts off: obstacle {touch.index}, curvature {arcs.bending[k]:.1e} / m"
            )
        if arcs.spread[k] <= 0.0:
            verdict.refute(touch.case, f"not minimal: conjugate point on obstacle {touch.index}")
        reach = half_length(cases[touch.case].obstacles[touch.index].surface)
        if arcs.reach[k] > reach * (1.0 + 1e-12):
            verdict.refute(touch.case, f"beyond the end: obstacle {touch.index} at {arcs.reach[k]:.3f} m")


# ------------------------------------------------------------------------------------ straight segments


def deepest(shape: Shape, d: Array, a: Array, b: Array) -> Array:
    """Return the smallest level of straight segments from a to b (m, 3) relative to surfaces d (m, k) [m].

    Heights are sampled, then minimised by golden sections around every sample near which the segment could pass below.
    """
    count = 3 if shape.convex else SEGMENT_SAMPLES
    share = np.linspace(0.0, 1.0, count)

    def level(rows: Ints, where: Array) -> Array:
        return shape.level(d[rows], a[rows] + where[:, None] * (b - a)[rows])

    grid = shape.level(d[:, None], a[:, None] + share[None, :, None] * (b - a)[:, None])
    padded = np.pad(grid, ((0, 0), (1, 1)), constant_values=np.inf)
    valley = (grid <= padded[:, :-2]) & (grid <= padded[:, 2:])
    gap = np.linalg.norm(b - a, axis=1) * share[1]
    rows, columns = np.nonzero(valley & (grid < 0.5 * gap[:, None] + ENTERING))
    lowest = grid.min(1)
    low, high = share[np.maximum(columns - 1, 0)], share[np.minimum(columns + 1, count - 1)]
    ratio = 0.5 * (np.sqrt(5.0) - 1.0)
    left, right = high - ratio * (high - low), low + ratio * (high - low)
    at_left, at_right = level(rows, left), level(rows, right)
    for _ in range(NARROWING if len(rows) else 0):
        down = at_left < at_right
        low, high = np.where(down, low, left), np.where(down, right, high)
        fresh = np.where(down, high - ratio * (high - low), low + ratio * (high - low))
        value = level(rows, fresh)
        left, right = np.where(down, fresh, right), np.where(down, left, fresh)
        at_left, at_right = np.where(down, value, at_right), np.where(down, at_left, value)
    np.minimum.at(lowest, rows, np.minimum(at_left, at_right))
    return lowest


def _judge_segments(
    cases: Sequence[Case], segments: list[tuple[int, int, Array, Array]], verdict: Verdict
) -> None:
    kinds: dict[type, list[int]] = {}
    for k, (case, index, _, _) in enumerate(segments):
        kinds.setdefault(type(cases[case].obstacles[index].surface), []).append(k)
    for kind, chosen in kinds.items():
        obstacles = [cases[segments[k][0]].obstacles[segments[k][1]] for k in chosen]
        turn, pos = np.array([rotation(o.quat) for o in obstacles]), np.array([o.pos for o in obstacles])
        a, b = (
            np.einsum("kji,kj->ki", turn, np.array([segments[k][end] for k in chosen]) - pos)
            for end in (2, 3)
        )
        lowest = deepest(SHAPES[kind], np.array([sizes(o.surface) for o in obstacles]), a, b)
        for k, depth in zip(chosen, lowest, strict=True):
            if depth < -ENTERING:
                verdict.refute(segments[k][0], f"penetrating: obstacle {segments[k][1]} by {-depth:.1e} m")


# ------------------------------------------------------------------------------------- local minimum


def stiffness(touches: list[Touch]) -> Array:
    """Return the second derivative of length with respect to sideways motions of one path's geodesics (2n, 2n).

    Each geodesic moves by x along b at P [m] and turns by w / s there (its far end moves by a x + r w / s along b).
    """
    n = len(touches)
    H = np.zeros((2 * n, 2 * n))
    near, far = [], []  # displacements of P and Q, (3, 2n)
    for k, touch in enumerate(touches):
        b_P, b_Q = (np.cross(t, m) for t, m in zip(touch.tangents, touch.normals, strict=True))
        a, da, r, dr = touch.jacobi
        scale = 1.0 / touch.s if touch.s > 0.0 else 1.0
        end, rate = np.array([a, r * scale]), np.array([da, dr * scale])
        block = 0.5 * (np.outer(end, rate) + np.outer(rate, end))
        block[0, 1] -= 0.5 * scale
        block[1, 0] -= 0.5 * scale
        own = slice(2 * k, 2 * k + 2)
        H[own, own] += block
        near.append(np.zeros((3, 2 * n)))
        far.append(np.zeros((3, 2 * n)))
        near[-1][:, 2 * k] = b_P
        far[-1][:, own] = np.outer(b_Q, end)
    for k in range(n + 1):
        shift = (near[k] if k < n else 0.0) - (far[k - 1] if k else 0.0)
        direction = touches[k].arriving if k < n else touches[-1].leaving
        size = touches[k].before if k < n else touches[-1].after
        across = shift - np.outer(direction, direction @ shift)
        H += across.T @ across / max(size, 1e-9)
    return H


def _judge_stiffness(count: int, touches: list[Touch], verdict: Verdict) -> None:
    paths: list[list[Touch]] = [[] for _ in range(count)]
    for touch in touches:
        paths[touch.case].append(touch)
    for case, path in enumerate(paths):
        if not path:
            continue
        H = stiffness(path)
        scale = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-12 * np.abs(H).max()))
        lowest = float(np.linalg.eigvalsh(scale[:, None] * H * scale).min())
        if lowest < -SLIPPING:
            verdict.refute(
                case, f"not minimal: stiffness {lowest:.1e} of its largest against a sideways shift"
            )
