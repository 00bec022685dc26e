"""All taut paths over one surface: closed forms if it can be unrolled or is round, else rays shot from one end point.

A path over one surface starts along a ray from the origin that grazes the surface. Those rays are a family with
one parameter: a hundred of them are taken, each is continued along its geodesic, and along each geodesic the
places are found at which the insertion lies in the surface's tangent plane straight ahead. Where the sideways
miss changes sign from ray to ray there is a path.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ellipeinc

import mjwrap as mw
from mjwrap.surfaces import Surface
from mjwrap.verification.arcs import arcs_of
from mjwrap.verification.certificate import Case, deepest, rotation
from mjwrap.verification.polish import Touch, polish
from mjwrap.verification.shapes import (
    SHAPES,
    Array,
    Capsule,
    Ellipsoid,
    Ints,
    Shape,
    Torus,
    dot,
    orthogonal_unit,
    sizes,
    unit,
)

RAYS = 64
TORUS_RAYS = 96  # rays on each of the two sides of the tube
WINDING = 1.5 * np.pi  # turn of the longest geodesics [rad]
PIECE = 2.0  # largest turn of a piece of a geodesic [rad]
SMALLEST_TURN = 1e-7  # of a touch [rad]


def free(origin: Array, insertion: Array, obstacle: mw.Obstacle) -> bool:
    """Return whether the straight segment misses the surface."""
    a, b = _local(obstacle, origin), _local(obstacle, insertion)
    shape, d = SHAPES[type(obstacle.surface)], sizes(obstacle.surface)
    return bool(deepest(shape, d[None], a[None], b[None])[0] >= 0.0)


def paths_over_one(origin: Array, insertion: Array, obstacle: mw.Obstacle) -> list[Case]:
    """Return all paths over one surface that are tangent at both ends, including the straight one if it is free."""
    found = [Case(origin, insertion, [obstacle], [[]], float(np.linalg.norm(insertion - origin)))]
    if not free(origin, insertion, obstacle):
        found = []
    a, b = _local(obstacle, origin), _local(obstacle, insertion)
    turn, pos = rotation(obstacle.quat), np.array(obstacle.pos)
    match obstacle.surface:
        case mw.Cylinder() | mw.EllipticCylinder():
            touches = _over_cylinder(obstacle.surface, a, b)
        case mw.Cone():
            touches = _over_cone(obstacle.surface, a, b)
        case mw.Sphere():
            touches = _over_sphere(obstacle.surface.radius, a, b)
        case _:
            touches = _shot(obstacle.surface, a, b)
    rough = [[Touch(0, turn @ P + pos, turn @ t, s)] for P, t, s in touches]
    return found + [case for case in polish(origin, insertion, [obstacle], rough) if case is not None]


def _local(obstacle: mw.Obstacle, point: Array) -> Array:
    return rotation(obstacle.quat).T @ (point - obstacle.pos)


# ------------------------------------------------------------------------------------- closed forms


def _over_cylinder(surface: mw.Cylinder | mw.EllipticCylinder, a: Array, b: Array) -> list[tuple]:
    """Return the paths over a cylinder, unrolled: tangents to the section from both ends, arc, and straight rise."""
    axes = np.full(2, surface.radius) if isinstance(surface, mw.Cylinder) else np.array(surface.radii)
    order = np.argsort(axes)[
        ::-1
    ]  # ellipeinc measures from the end of the minor axis: x = A sin u, y = B cos u
    big, small = axes[order]
    m = 1.0 - (small / big) ** 2
    found = []
    for side in (1.0, -1.0):  # counter-clockwise or clockwise
        ends = []
        for point, leaving in ((a, side), (b, -side)):
            scaled = point[:2] / axes
            reach = np.linalg.norm(scaled)
            if reach <= 1.0:
                return []
            angle = np.arctan2(scaled[1], scaled[0]) + leaving * np.arccos(1.0 / reach)
            ends.append((angle, axes * [np.cos(angle), np.sin(angle)]))
        sweep = (side * (ends[1][0] - ends[0][0])) % (2.0 * np.pi)

        def measure(angle: float) -> float:
            """Return the length of the section's arc from the angle 0 [m]."""
            if order[0] == 0:
                return big * (ellipeinc(angle + 0.5 * np.pi, m) - ellipeinc(0.5 * np.pi, m))
            return big * ellipeinc(angle, m)

        around = abs(measure(ends[0][0] + side * sweep) - measure(ends[0][0]))
        before, after = np.linalg.norm(ends[0][1] - a[:2]), np.linalg.norm(b[:2] - ends[1][1])
        slope = (b[2] - a[2]) / (before + around + after)
        tangent = side * axes * [-np.sin(ends[0][0]), np.cos(ends[0][0])]
        tangent = np.append(tangent / np.linalg.norm(tangent), slope) / np.hypot(1.0, slope)
        P = np.append(ends[0][1], a[2] + slope * before)
        found.append((P, tangent, around * np.hypot(1.0, slope)))
    return found


def _over_cone(surface: mw.Cone, a: Array, b: Array) -> list[tuple]:
    """Return the paths over a cone, unrolled: the plane of the origin, the sector, and the plane of the insertion."""
    radius, slope, _ = sizes(surface)
    apex = np.array([0.0, 0.0, -radius / slope])
    sine = abs(slope) / np.hypot(1.0, slope)
    found = []
    for side in (1.0, -1.0):
        polar = []
        for point, leaving in ((a, side), (b, -side)):
            rho, rise = np.hypot(point[0], point[1]), (point - apex)[2]
            section = slope * rise  # radius of the cone at this height
            if (
                section <= 0.0 or rho <= section
            ):  # beside the apex no plane through the point touches the cone
                return []
            azimuth = np.arctan2(point[1], point[0]) + leaving * np.arccos(section / rho)
            generator = np.array(
                [sine * np.cos(azimuth), sine * np.sin(azimuth), np.sign(slope) * np.sqrt(1 - sine**2)]
            )
            along = float((point - apex) @ generator)
            polar.append((azimuth, generator, along, float(np.linalg.norm(point - apex - along * generator))))
        sector = ((side * (polar[1][0] - polar[0][0])) % (2.0 * np.pi)) * sine
        first, last = (np.arctan2(away, along) for _, _, along, away in polar)
        total = first + sector + last
        if total >= np.pi:
            continue  # a string would slip over the apex
        start = np.array([polar[0][2], -polar[0][3]])  # the first generator along x, the origin below it
        far = np.hypot(polar[1][2], polar[1][3])
        end = far * np.array([np.cos(sector + last), np.sin(sector + last)])
        heading = (end - start) / np.linalg.norm(end - start)
        meet = start - heading * start[1] / heading[1]
        out = meet[0]
        normal_angle = np.array([np.cos(sector), np.sin(sector)])
        cross = start[0] * heading[1] - start[1] * heading[0]
        leave = cross / (normal_angle[0] * heading[1] - normal_angle[1] * heading[0])
        if out <= 0.0 or leave <= 0.0:
            continue
        ring = side * np.array([-np.sin(polar[0][0]), np.cos(polar[0][0]), 0.0])
        P = apex + out * polar[0][1]
        found.append(
            (
                P,
                heading[0] * polar[0][1] + heading[1] * ring,
                float(np.linalg.norm(leave * normal_angle - meet)),
            )
        )
    return found


def _over_sphere(radius: float, a: Array, b: Array) -> list[tuple]:
    """Return the shorter way round, in the plane of the centre; from the longer one a string slips off."""
    normal = np.cross(a, b)
    if np.linalg.norm(normal) < 1e-12 * np.linalg.norm(a) * np.linalg.norm(b):
        return []
    far = [np.linalg.norm(a), np.linalg.norm(b)]
    if min(far) <= radius:
        return []
    arc = np.arctan2(np.linalg.norm(normal), a @ b) - np.arccos(radius / far[0]) - np.arccos(radius / far[1])
    if arc <= SMALLEST_TURN:
        return []
    along, up = np.cross(unit(normal), a) / far[0], a / far[0]
    c = radius / far[0]
    s = np.sqrt(1.0 - c * c)
    return [(radius * (c * up + s * along), c * along - s * up, radius * arc)]


# ------------------------------------------------------------------------------------------ shooting


def _horizon(surface: Surface, a: Array) -> list[Array]:
    """Return the points at which rays from a touch a surface tangentially, as curves (m, 3) of neighbouring points."""
    shape, d = SHAPES[type(surface)], sizes(surface)
    angle = np.linspace(0.0, 2.0 * np.pi, RAYS + 1)
    ring = np.stack([np.cos(angle), np.sin(angle)], 1)
    if isinstance(shape, Ellipsoid):
        return [d * _polar_circle(a / d, 1.0, ring)]
    if isinstance(shape, Torus):
        azimuth = np.linspace(0.0, 2.0 * np.pi, TORUS_RAYS + 1)
        away = d[0] - a[0] * np.cos(azimuth) - a[1] * np.sin(azimuth)
        size = np.hypot(away, a[2])
        with np.errstate(invalid="ignore"):
            half = np.arccos(-d[1] / np.where(size > 0.0, size, np.nan))
        tubes = [np.arctan2(-a[2], away) + sign * half for sign in (1.0, -1.0)]
        return [
            np.stack(
                [
                    (d[0] + d[1] * np.cos(v)) * np.cos(azimuth),
                    (d[0] + d[1] * np.cos(v)) * np.sin(azimuth),
                    d[1] * np.sin(v),
                ],
                1,
            )
            for v in tubes
        ]
    assert isinstance(shape, Capsule)
    radius, half = d
    curves = []
    for sign in (1.0, -1.0):
        centre = np.array([0.0, 0.0, sign * half])
        if np.linalg.norm(a - centre) > radius:
            curve = _polar_circle((a - centre) / radius, 1.0, ring) * radius
            curves.append(np.where((sign * curve[:, 2:] >= 0.0), curve, np.nan) + centre)
    rho = np.hypot(a[0], a[1])
    if rho > radius:
        for sign in (1.0, -1.0):
            turn = np.arctan2(a[1], a[0]) + sign * np.arccos(radius / rho)
            z = np.linspace(-half, half, RAYS // 2)
            curves.append(np.stack([radius * np.cos(turn) + 0 * z, radius * np.sin(turn) + 0 * z, z], 1))
    return curves


def _polar_circle(a: Array, radius: float, ring: Array) -> Array:
    """Return the circle on which rays from a touch the sphere about the origin tangentially."""
    far = np.linalg.norm(a)
    up = a / far
    side = orthogonal_unit(up)
    plane = ring @ np.stack([side, np.cross(up, side)])
    return radius**2 / far * up + radius * np.sqrt(1.0 - (radius / far) ** 2) * plane


def _shot(surface: Surface, a: Array, b: Array) -> list[tuple]:
    """Return rough touches (P, t, s) of all paths from a to b over a surface, in its frame."""
    shape, d = SHAPES[type(surface)], sizes(surface)
    found = []
    for curve in _horizon(surface, a):
        t = unit(curve - a)
        with np.errstate(invalid="ignore"):
            good = np.isfinite(curve).all(1) & (shape.bending(d, curve, t) > 0.0)
        rows = np.flatnonzero(good)
        if not len(rows):
            continue
        points, tangents, x = _followed(shape, d, curve[rows], t[rows])
        ahead = b - points
        n = shape.normal(d, points)
        rise, forward = dot(ahead, n), dot(ahead, tangents)
        sideways = dot(ahead, np.cross(tangents, n))
        crossing = (rise[:, :-1] < 0.0) & (rise[:, 1:] >= 0.0) & (forward[:, 1:] > 0.0)
        found += _roots(rows, x, rise, sideways, crossing, curve, t)
    return found


def _followed(shape: Shape, d: Array, P: Array, t: Array) -> tuple[Array, Array, Array]:
    """Return points and tangents (m, k, 3) of geodesics at arc lengths x (m, k), NaN where a string cannot follow.

    That is where the surface is concave along it, after a conjugate point, or after one and a half half turns.
    """
    count, piece = len(P), PIECE / float(shape.bend(d))
    alive = np.arange(count)
    where, turned = np.zeros(count), np.zeros(count)
    r, rate = np.zeros(count), np.ones(count)
    P, t = P.copy(), t.copy()
    points, tangents, xs = [], [], []
    while len(alive):
        arcs = arcs_of(
            shape, np.repeat(d[None], len(alive), axis=0), P[alive], t[alive], np.full(len(alive), piece)
        )
        for found, value in (
            (points, arcs.points),
            (tangents, arcs.tangents),
            (xs, where[alive, None] + arcs.x),
        ):
            whole = np.full((count, *value.shape[1:]), np.nan)
            whole[alive] = value
            found.append(whole)
        bending = shape.bending(d, arcs.points, arcs.tangents)
        a, da, b, db = arcs.jacobi.T
        r[alive], rate[alive] = a * r[alive] + b * rate[alive], da * r[alive] + db * rate[alive]
        P[alive], t[alive] = arcs.Q, arcs.t
        where[alive] += piece
        turned[alive] += piece * bending.mean(1)
        alive = alive[(r[alive] > 0.0) & (bending.min(1) >= 0.0) & (turned[alive] < WINDING)]
    return np.concatenate(points, 1), np.concatenate(tangents, 1), np.concatenate(xs, 1)


def _roots(
    rows: Ints, x: Array, rise: Array, sideways: Array, crossing: NDArray[np.bool_], curve: Array, t: Array
) -> list[tuple]:
    """Return touches between neighbouring rays that pass the insertion on different sides."""
    hits: dict[int, list[tuple[float, float]]] = {}
    for i, j in zip(*np.nonzero(crossing), strict=True):
        share = -rise[i, j] / (rise[i, j + 1] - rise[i, j])
        s = x[i, j] + share * (x[i, j + 1] - x[i, j])
        miss = sideways[i, j] + share * (sideways[i, j + 1] - sideways[i, j])
        hits.setdefault(int(rows[i]), []).append((float(s), float(miss)))
    found = []
    for i, here in hits.items():
        for s, miss in here:
            others = [o for o in hits.get(i + 1, []) if abs(o[0] - s) < 0.25 * (s + o[0]) + 0.01]
            for s2, miss2 in sorted(others, key=lambda o: abs(o[0] - s))[:1]:
                if miss * miss2 <= 0.0:
                    share = miss / (miss - miss2) if miss != miss2 else 0.5
                    P = curve[i] + share * (curve[i + 1] - curve[i])
                    heading = t[i] + share * (t[i + 1] - t[i])
                    found.append((P, unit(heading), s + share * (s2 - s)))
    return found
