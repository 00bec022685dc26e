"""Read the routes of MuJoCo's tendons, and the points of their paths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.mjcf import MuscleDeclaration, Node, tendon_stops

Array = NDArray[np.float64]
_PULLEY_MARK = -2  # in wrap_obj: -1 for sites, the id for geoms


class Span(NamedTuple):
    """A part of a tendon from one site to the next, over a geom (-1: none); weight: its factor in the length (pulleys).

    inside: whether it must meet the geom's solid. turn: as for `mjcf.Node`, for mjwrap's paths.
    """

    start: int
    end: int
    geom: int
    hint: int
    weight: float
    inside: bool = False
    turn: float = 0.0


def tendon_spans(model: mujoco.MjModel, poses: mujoco.MjData, tendon: int) -> list[Span]:
    """Return the spans of a spatial tendon in order. poses: any, with kinematics."""
    spans: list[Span] = []
    last, geom, hint, weight, inside = -1, -1, -1, 1.0, False
    for stop in tendon_stops(model, poses, tendon):
        if stop.kind == "pulley":
            last, geom, hint, weight, inside = -1, -1, -1, 1.0 / stop.divisor, False
        elif stop.kind == "geom":
            geom, inside = stop.index, stop.inside
        elif stop.kind == "hint":
            hint = stop.index
        else:
            if last >= 0:
                spans.append(Span(last, stop.index, geom, hint, weight, inside))
            last, geom, hint, inside = stop.index, -1, -1, False
    return spans


def muscle_spans(muscle: MuscleDeclaration) -> list[Span] | None:
    """Return the spans of a declared muscle, or None if it has several geoms between two sites."""
    spans: list[Span] = []
    for route in muscle.routes:
        last, over = route.origin, Node()
        for node in (*route.nodes, Node(site=route.insertion)):
            if node.geom < 0:
                spans.append(
                    Span(last, node.site, over.geom, over.hint_site, route.weight, over.inside, over.turn)
                )
                last, over = node.site, Node()
            elif over.geom < 0:
                over = node
            else:
                return None
    return spans


@dataclass
class SpanPoints:
    """The points of one span at each pose: a to b (T, 3), over p and q (T, 3) where touched (T,). World [m]."""

    a: Array
    b: Array
    touched: NDArray[np.bool_]
    p: Array
    q: Array

    @classmethod
    def empty(cls, count: int) -> SpanPoints:
        """Return empty points for `count` poses."""
        a, b, p, q = (np.zeros((count, 3)) for _ in range(4))
        return cls(a, b, np.zeros(count, dtype=np.bool_), p, q)


class WrapRecord:
    """The points of all tendons over a motion, from MuJoCo's wrap_obj and wrap_xpos."""

    def __init__(self, model: mujoco.MjModel, count: int) -> None:
        self.model = model
        self.adr = np.zeros((count, model.ntendon), dtype=np.int64)
        self.num = np.zeros((count, model.ntendon), dtype=np.int64)
        self.obj = np.zeros((count, 2 * model.nwrap), dtype=np.int64)
        self.pos = np.zeros((count, 2 * model.nwrap, 3))

    def keep(self, k: int, data: mujoco.MjData) -> None:
        """Store the points of pose k."""
        self.adr[k], self.num[k] = data.ten_wrapadr, data.ten_wrapnum
        self.obj[k], self.pos[k] = data.wrap_obj.reshape(-1), data.wrap_xpos.reshape(-1, 3)

    def points(self, tendon: int, spans: list[Span]) -> list[SpanPoints]:
        """Return the points of a tendon's spans at all stored poses."""
        found = [SpanPoints.empty(len(self.obj)) for _ in spans]
        width = int(self.num[:, tendon].max(initial=0))
        index = self.adr[:, tendon, None] + np.arange(width)
        inside = np.arange(width) < self.num[:, tendon, None]
        rows = np.where(
            inside, np.take_along_axis(self.obj, np.minimum(index, self.obj.shape[1] - 1), axis=1), -9
        )
        patterns, group = np.unique(rows, axis=0, return_inverse=True)
        for g, pattern in enumerate(patterns):
            poses = np.flatnonzero(group.reshape(-1) == g)
            for span, place in zip(found, _places(spans, pattern), strict=True):
                a, p, q, b = (self.pos[poses, self.adr[poses, tendon] + column] for column in place)
                span.a[poses], span.b[poses], span.p[poses], span.q[poses] = a, b, p, q
                span.touched[poses] = place[1] != place[0]
        return found


def _places(spans: list[Span], pattern: NDArray[np.int64]) -> list[tuple[int, int, int, int]]:
    """Return for every span the columns of a, p, q, b in a row of wrap_obj; p = q = a if no geom is touched."""
    places: list[tuple[int, int, int, int]] = []
    column = 0
    for span in spans:
        if places and column + 1 < len(pattern) and pattern[column + 1] == _PULLEY_MARK:
            column += 1
        if pattern[column] == _PULLEY_MARK:
            column += 1
        if span.geom >= 0 and pattern[column + 1] == span.geom:
            places.append((column, column + 1, column + 2, column + 3))
            column += 3
        else:
            places.append((column, column, column, column + 1))
            column += 1
    return places
