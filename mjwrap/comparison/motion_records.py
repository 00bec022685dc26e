"""Poses, numbers and contact points over the poses of one motion, for a comparison of both programs."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.comparison.tendons import Span, SpanPoints

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class Frames:
    """The poses of geoms and sites over `count` poses: centre (T, ngeom, 3), rotation (T, ngeom, 3, 3), sites."""

    def __init__(self, count: int, model: mujoco.MjModel) -> None:
        self.centre, self.rotation = np.zeros((count, model.ngeom, 3)), np.zeros((count, model.ngeom, 3, 3))
        self.sites = np.zeros((count, model.nsite, 3))

    def keep(self, k: int, data: mujoco.MjData) -> None:
        """Store pose k."""
        self.centre[k], self.rotation[k] = data.geom_xpos, data.geom_xmat.reshape(-1, 3, 3)
        self.sites[k] = data.site_xpos

    def local(self, geom: int, points: Array) -> Array:
        """Return world points (T, 3) in a geom's frame."""
        return np.einsum("tji,tj->ti", self.rotation[:, geom], points - self.centre[:, geom])


class Numbers:
    """Lengths, velocities, jacobians and status of `n` paths over `count` poses."""

    def __init__(self, count: int, n: int, nv: int) -> None:
        self.length, self.velocity = np.zeros((count, n)), np.zeros((count, n))
        self.jacobian, self.status = np.zeros((count, n, nv)), np.zeros((count, n), dtype=np.int64)

    def keep(self, k: int, length: Array, velocity: Array, jacobian: Array, status: Ints | int = 0) -> None:
        """Store pose k."""
        self.length[k], self.velocity[k], self.jacobian[k], self.status[k] = (
            length,
            velocity,
            jacobian,
            status,
        )

    def of(self, i: int) -> tuple[Array, Array, Array]:
        """Return lengths (T,), velocities (T,) and jacobians (T, nv) of path i."""
        return self.length[:, i], self.velocity[:, i], self.jacobian[:, i]


def in_frame(
    model: mujoco.MjModel, geom: int, geoms: Frames, at: SpanPoints
) -> tuple[bool, float, Array, Array, NDArray[np.bool_], Array, Array]:
    """Return the arguments of `judge`: kind, radius, and the points in the geom's frame."""
    a, b, p, q = (geoms.local(geom, x) for x in (at.a, at.b, at.p, at.q))
    return is_cylinder(model, geom), float(model.geom_size[geom, 0]), a, b, at.touched, p, q


def is_cylinder(model: mujoco.MjModel, geom: int) -> bool:
    """Return whether a geom is a cylinder; other geoms that tendons wrap are spheres."""
    return int(model.geom_type[geom]) == int(mujoco.mjtGeom.mjGEOM_CYLINDER)


def own_points(native: SpanPoints) -> SpanPoints:
    """Return a span of mjwrap's path with the same end points and no contact yet."""
    own = SpanPoints.empty(len(native.a))
    own.a, own.b = native.a, native.b
    return own


def assign_contacts(
    spans: list[Span],
    own: list[SpanPoints],
    pairs: list[Array],
    model: mujoco.MjModel,
    geoms: Frames,
) -> None:
    """Assign every contact pair (k, 2, 3) of mjwrap to the span that it fits best, in order."""
    for t, contacts in enumerate(pairs):
        free = [s for s, span in enumerate(spans) if span.geom >= 0]
        for pair in contacts:
            s = min(free, key=lambda s: _misfit(spans[s], own[s], pair, model, geoms, t))
            own[s].touched[t], own[s].p[t], own[s].q[t] = True, pair[0], pair[1]
            free = [f for f in free if f > s]


def _misfit(span: Span, at: SpanPoints, pair: Array, model: mujoco.MjModel, geoms: Frames, t: int) -> float:
    """Return the distance of two contact points from a span's surface and tangents [m]."""
    rotation, centre, radius = (
        geoms.rotation[t, span.geom],
        geoms.centre[t, span.geom],
        float(model.geom_size[span.geom, 0]),
    )
    misfit = 0.0
    for point, end in ((pair[0], at.a[t]), (pair[1], at.b[t])):
        local, away = rotation.T @ (point - centre), rotation.T @ (end - point)
        if is_cylinder(model, span.geom):
            local[2] = 0.0
        distance = float(np.linalg.norm(local))
        corner = 0.0 if span.inside else abs(float(local @ away)) / max(distance, 1e-300)
        misfit = max(misfit, abs(distance - radius), corner)
    return misfit
