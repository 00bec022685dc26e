"""On which segments of a path a wrap object acts: at one pose, by where the straight segments meet its solid."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjwrap.osim.description.paths import Path, PathWrap, WrapObject
from mjwrap.osim.kinematics import Pose, frame_pose, point_position
from mjwrap.osim.kinematics.paths import holds
from mjwrap.osim.writing.wraps import WrittenWrap, side_point
from mjwrap.paths import Obstacle, solve_path

Array = NDArray[np.float64]
ON_SURFACE = 1e-4  # as in mjwrap: an end no deeper than this part of a radius lies on the surface
SAMPLES = 65  # points of a segment, for a torus


class Sample(NamedTuple):
    """A pose of a model: the pose of every body in ground, and the values of all coordinates."""

    bodies: Mapping[str, Pose]
    values: Mapping[str, float]


class Act(NamedTuple):
    """What a wrap does on one segment, from point `first` to point `last` of the path, at one pose.

    hit: the straight segment meets the solid. touched: the path touches it, maybe because of its side only. added: by
    how much that lengthens the path [m]. along: where on the segment, 0 to 1. inside: an end lies inside. beyond: the
    path would touch a cylinder only beyond its ends.
    """

    first: int
    last: int
    hit: bool
    touched: bool
    added: float
    along: float
    inside: bool
    beyond: bool
    contact: tuple[Array, Array] | None = None


def active_points(path: Path, sample: Sample) -> list[int]:
    """Return the indices of the points that belong to a path at a pose, as written: always with its ends."""
    ends = 0, len(path.points) - 1
    return [k for k, point in enumerate(path.points) if k in ends or holds(point.condition, sample.values)]


def acts_of(path: Path, wrap: PathWrap, written: WrittenWrap, sample: Sample) -> list[Act]:
    """Return what a wrap does at a pose on every segment of its range."""
    there = [k for k in active_points(path, sample) if wrap.first <= k <= wrap.last]
    frame = frame_pose(sample.bodies, written.wrap.frame)
    places = {
        k: frame.rotation.T @ (point_position(path.points[k], sample.bodies, sample.values) - frame.position)
        for k in there
    }
    return [
        act_between(written, first, last, places[first], places[last])
        for first, last in itertools.pairwise(there)
    ]


def best_act(acts: Sequence[Act]) -> Act | None:
    """Return the segment on which OpenSim's wrap acts: the first one hit, else the one lengthened least."""
    touched = [act for act in acts if act.touched and not act.inside]
    hit = [act for act in touched if act.hit]
    if hit:
        return hit[0]
    return min(touched, key=lambda act: act.added, default=None)


def act_between(written: WrittenWrap, first: int, last: int, start: Array, end: Array) -> Act:
    """Return what a wrap does on the segment between two points (3,) in the wrap's frame."""
    wrap = written.wrap
    depth, along = _deepest(wrap, start, end)
    inside = min(_height(wrap, start[None])[0], _height(wrap, end[None])[0]) < -ON_SURFACE
    hit = depth < 0.0
    nothing = Act(first, last, hit, False, 0.0, along, inside, False)
    side = side_point(wrap) if written.side else None
    if (
        inside
        or np.array_equal(start, end)
        or not (hit or (side is not None and wrap.kind == "WrapCylinder"))
    ):
        return nothing
    hint = None if side is None else tuple(side)
    solution = solve_path(start, end, [Obstacle(written.surface, hint=hint)])
    contact = solution.contacts[0]
    if not contact.active or contact.P is None or contact.Q is None:
        return nothing._replace(touched=hit and not solution.converged)
    straight = end - start
    along = float(straight @ (0.5 * (contact.P + contact.Q) - start) / (straight @ straight))
    beyond = (
        wrap.kind == "WrapCylinder" and min(abs(contact.P[2]), abs(contact.Q[2])) > 0.5 * wrap.dimensions[1]
    )
    added = solution.length - float(np.linalg.norm(straight))
    return Act(first, last, hit, not beyond, added, along, inside, beyond, (contact.P, contact.Q))


def _height(wrap: WrapObject, points: Array) -> Array:
    """Return how far points (n, 3) are outside a wrap object [radii]; negative inside."""
    size = wrap.dimensions
    match wrap.kind:
        case "WrapCylinder":
            return np.hypot(points[:, 0], points[:, 1]) / size[0] - 1.0
        case "WrapTorus":
            ring = np.hypot(points[:, 0], points[:, 1]) - max(size[:2])
            return np.hypot(ring, points[:, 2]) / min(size[:2]) - 1.0
        case "WrapEllipsoid":
            return np.linalg.norm(points / np.array(size[:3]), axis=1) - 1.0
        case _:
            return np.linalg.norm(points, axis=1) / size[0] - 1.0


def _deepest(wrap: WrapObject, start: Array, end: Array) -> tuple[float, float]:
    """Return the least height [radii] on a straight segment, and where it is, 0 to 1."""
    if wrap.kind == "WrapTorus":
        along = np.linspace(0.0, 1.0, SAMPLES)
    else:
        scale = {"WrapEllipsoid": np.array(wrap.dimensions[:3]), "WrapCylinder": np.array([1.0, 1.0, np.inf])}
        a, b = (point / scale.get(wrap.kind, 1.0) for point in (start, end))
        square = float((b - a) @ (b - a))
        along = np.array([0.5 if square == 0.0 else min(1.0, max(0.0, float(-a @ (b - a)) / square))])
    heights = _height(wrap, start + along[:, None] * (end - start))
    best = int(np.argmin(heights))
    return float(heights[best]), float(along[best])
