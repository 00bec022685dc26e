"""Geodesics of every shape with their Jacobi fields, by methods that differ from those of the package.

Closed forms if the surface can be unrolled or is round; otherwise Gauss-Legendre collocation of p'' = -(t.Ht /
|g|^2) g in the embedding space (g, H: gradient and Hessian of the defining function), for a thousand arcs at
once. `slow_arc` integrates the same equation with SciPy's DOP853, one arc at a time, to test both.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.special import ellipeinc

from mjwrap.surfaces import Surface
from mjwrap.verification.shapes import (
    SHAPES,
    Array,
    Capsule,
    Cone,
    Cylinder,
    EllipticCylinder,
    Ints,
    Shape,
    Sphere,
    dot,
    sizes,
    unit,
)

STAGES = 8  # order 16
TURN = 1.0  # largest turn of the direction within one step [rad]
ITERATIONS = 25  # fixed-point iterations within one step; the error decreases like TURN^k / k!
HALVINGS = 3  # number of times that too long steps are halved
DRIFT = 1e-12  # largest error of a tangent's length, and of the end's distance from the surface in radii of curvature
INVERSIONS = 80  # Newton steps to the angle of an arc of an ellipse
SAMPLES = 17  # number of points at which a closed form is evaluated


@dataclass
class Arcs:
    """Geodesics (m) from P along t over s, in the surface's frame.

    Q, t (m, 3): end points and tangents there; jacobi (m, 4): a, a', r, r' at the end (docs/derivation.md, how a
    geodesic moves); bending (m): smallest normal curvature along them [1/m]; spread (m): smallest r(x) / x along them,
    positive before a conjugate point; reach (m): largest |z| [m]; points, tangents (m, k, 3): at arc lengths x (m, k).
    """

    Q: Array
    t: Array
    jacobi: Array
    bending: Array
    spread: Array
    reach: Array
    points: Array
    tangents: Array
    x: Array

    def of(self, which: NDArray[np.bool_]) -> Arcs:
        """Return some of the geodesics."""
        return Arcs(**{name: getattr(self, name)[which] for name in self.__dataclass_fields__})


def arcs_of(shape: Shape, d: Array, P: Array, t: Array, s: Array) -> Arcs:
    """Return the geodesics of surfaces with sizes d (m, k) from P along the unit tangents t (m, 3) over s >= 0 (m)."""
    if isinstance(shape, Capsule):
        return _capsules(shape, d, P, t, s)
    if not isinstance(shape, Sphere | Cone | EllipticCylinder):
        return _collocated(shape, d, P, t, s)
    x = s[:, None] * np.linspace(0.0, 1.0, SAMPLES)
    exact = _cone
    if isinstance(shape, Sphere):
        exact = _sphere
    elif isinstance(shape, Cylinder):
        exact = _cylinder
    elif isinstance(shape, EllipticCylinder):
        exact = _elliptic
    points, tangents, a, r = exact(d[:, None], P[:, None], t[:, None], x)
    return _listed(shape, d, points, tangents, x, a, r)


def _listed(
    shape: Shape, d: Array, points: Array, tangents: Array, x: Array, a: tuple[Array, ...], r: tuple
) -> Arcs:
    with np.errstate(divide="ignore", invalid="ignore"):
        spread = np.where(x > 0.0, r[0] / x, 1.0).min(1)
    return Arcs(
        points[:, -1],
        tangents[:, -1],
        np.stack([a[0][:, -1], a[1][:, -1], r[0][:, -1], r[1][:, -1]], 1),
        shape.bending(d[:, None], points, tangents).min(1),
        spread,
        np.abs(points[..., 2]).max(1),
        points,
        tangents,
        x,
    )


# ------------------------------------------------------------------------------------- closed forms


def _sphere(d: Array, P: Array, t: Array, x: Array) -> tuple[Array, Array, tuple, tuple]:
    """Return great circles."""
    radius = d[..., 0]
    c, s = np.cos(x / radius), np.sin(x / radius)
    points = c[..., None] * P + (s * radius)[..., None] * t
    tangents = c[..., None] * t - (s / radius)[..., None] * P
    return points, tangents, (c, -s / radius), (radius * s, c)


def _turned(v: Array, angle: Array) -> Array:
    """Return vectors turned about z."""
    c, s = np.cos(angle), np.sin(angle)
    x, y = v[..., 0], v[..., 1]
    return np.stack([c * x - s * y, s * x + c * y, np.broadcast_to(v[..., 2], c.shape)], -1)


def _cylinder(d: Array, P: Array, t: Array, x: Array) -> tuple[Array, Array, tuple, tuple]:
    """Return helices."""
    radius = d[..., 0]
    angle = x * (P[..., 0] * t[..., 1] - P[..., 1] * t[..., 0]) / radius**2
    points = _turned(P, angle)
    points[..., 2] += x * t[..., 2]
    one = np.ones_like(x)
    return points, _turned(t, angle), (one, 0.0 * x), (x, one)


def _cone(d: Array, P: Array, t: Array, x: Array) -> tuple[Array, Array, tuple, tuple]:
    """Return straight lines of the unrolled cone, in polar coordinates about the apex."""
    apex = np.zeros_like(P)
    apex[..., 2] = Cone().apex(d)
    slant = np.linalg.norm(P - apex, axis=-1)
    sine = np.hypot(P[..., 0], P[..., 1]) / slant  # cosine and sine of the angle between generators and axis
    cosine = (P - apex)[..., 2] / slant
    out = dot(t, (P - apex) / slant[..., None])
    around = (P[..., 0] * t[..., 1] - P[..., 1] * t[..., 0]) / (sine * slant)
    far = np.hypot(slant + x * out, x * around)
    turn = np.arctan2(x * around, slant + x * out)
    azimuth = np.arctan2(P[..., 1], P[..., 0]) + turn / sine
    generator = np.stack(
        [sine * np.cos(azimuth), sine * np.sin(azimuth), np.broadcast_to(cosine, far.shape)], -1
    )
    ring = np.stack([-np.sin(azimuth), np.cos(azimuth), 0.0 * far], -1)
    outward, sideways = out * np.cos(turn) + around * np.sin(turn), around * np.cos(turn) - out * np.sin(turn)
    points = apex + far[..., None] * generator
    one = np.ones_like(x)
    return (
        points,
        outward[..., None] * generator + sideways[..., None] * ring,
        (one, 0.0 * x),
        (x, one),
    )


def _elliptic(d: Array, P: Array, t: Array, x: Array) -> tuple[Array, Array, tuple, tuple]:
    """Return straight lines on the unrolled elliptic cylinder; the section's arc by SciPy's elliptic integral."""
    first, second = d[..., 0], d[..., 1]
    long, short = np.maximum(first, second), np.minimum(first, second)
    flat = first < second
    # u from the end of the minor axis: (long sin u, short cos u), counted against the azimuth
    px, py = np.where(flat, P[..., 1], P[..., 0]), np.where(flat, -P[..., 0], P[..., 1])
    tx, ty = np.where(flat, t[..., 1], t[..., 0]), np.where(flat, -t[..., 0], t[..., 1])
    start = np.arctan2(px / long, py / short)
    m = 1.0 - (short / long) ** 2

    def rate(u: Array) -> Array:
        return np.hypot(long * np.cos(u), short * np.sin(u))

    along = unit(np.stack([long * np.cos(start), -short * np.sin(start)], -1))
    forward = along[..., 0] * tx + along[..., 1] * ty
    wanted = long * ellipeinc(start, m) + x * forward
    # Newton's method within brackets; the arc is at least as long as a circle's of the shorter radius
    reach = np.abs(x * forward) / short
    low, high = start - reach - 1e-9, start + reach + 1e-9
    u = start + x * forward / rate(start)
    for _ in range(INVERSIONS):
        u = np.where((u < low) | (u > high), 0.5 * (low + high), u)
        miss = long * ellipeinc(u, m) - wanted
        low, high = np.where(miss < 0.0, u, low), np.where(miss > 0.0, u, high)
        step = miss / rate(u)
        u = u - step
        if (np.abs(step) < 1e-15).all():
            break
    qx, qy = long * np.sin(u), short * np.cos(u)
    vx, vy = forward * long * np.cos(u) / rate(u), -forward * short * np.sin(u) / rate(u)
    level, rise = np.broadcast_to(P[..., 2] + x * t[..., 2], u.shape), np.broadcast_to(t[..., 2], u.shape)
    points = np.stack([np.where(flat, -qy, qx), np.where(flat, qx, qy), level], -1)
    tangents = np.stack([np.where(flat, -vy, vx), np.where(flat, vx, vy), rise], -1)
    one = np.ones_like(x)
    return points, tangents, (one, 0.0 * x), (x, one)


def _piece(d: Array, P: Array, t: Array, left: float) -> tuple[Any, float]:
    """Return the part of a capsule on which an arc continues (0: cylinder, else the sign of the cap), and how far."""
    radius, half = d
    z, rise = P[2], t[2]
    slack = 1e-14 * (half + radius)
    side = np.sign(z) if abs(z) > half + slack or (abs(z) > half - slack and z * rise > 0.0) else 0.0
    if side == 0.0:
        gap = np.inf if rise == 0.0 else (np.sign(rise) * half - z) / rise
        return side, min(left, max(gap, 0.0))
    # on the cap: z - side half = c cos(x / R) + R rise sin(x / R); the next zero beyond the start
    angle = np.arctan2(side * (z - side * half), -side * radius * rise) % np.pi
    if abs(z - side * half) <= slack or angle <= 1e-15:
        angle = np.pi
    return side, min(left, radius * angle)


def _capsules(shape: Shape, d: Array, P: Array, t: Array, s: Array) -> Arcs:
    """Return great circles and helices in turn, one arc after another."""
    points, tangents, fields = [], [], []
    x = s[:, None] * np.linspace(0.0, 1.0, 4 * SAMPLES)
    for k in range(len(s)):
        where, p, v, jacobi = 0.0, P[k], t[k], np.eye(2)
        found = []
        while True:
            side, length = _piece(d[k], p, v, s[k] - where)
            last = where + length >= s[k]
            inside = (x[k] >= where) & ((x[k] < where + length) | last)
            local = np.append(x[k][inside] - where, length)
            centre = np.array([0.0, 0.0, side * d[k][1]])
            exact = _sphere if side else _cylinder
            q, w, a, r = exact(d[k], p - centre, v, local)
            field = np.stack([np.stack([a[0], r[0]], -1), np.stack([a[1], r[1]], -1)], -2) @ jacobi
            found.append((q[:-1] + centre, w[:-1], field[:-1]))
            where, p, v, jacobi = where + length, q[-1] + centre, w[-1], field[-1]
            if last:
                break
        q, w, field = (np.concatenate(parts) for parts in zip(*found, strict=True))
        points.append(q)
        tangents.append(w)
        fields.append(field)
    if not points:
        points, tangents, fields = (np.empty((0, 4 * SAMPLES, *rest)) for rest in ((3,), (3,), (2, 2)))
    field = np.array(fields)
    a, r = (field[..., 0, 0], field[..., 1, 0]), (field[..., 0, 1], field[..., 1, 1])
    return _listed(shape, d, np.array(points), np.array(tangents), x, a, r)


# --------------------------------------------------------------------------------------- collocation


def _gauss() -> tuple[Array, Array, Array]:
    """Return the nodes, the matrix and the weights of Gauss-Legendre collocation on [0, 1]."""
    c = 0.5 * (np.polynomial.legendre.leggauss(STAGES)[0] + 1.0)
    powers = np.arange(STAGES)
    basis = np.linalg.inv(c[:, None] ** powers)
    return c, (c[:, None] ** (powers + 1) / (powers + 1)) @ basis, (1.0 / (powers + 1)) @ basis


_C, _A, _B = _gauss()
_AA, _BA = _A @ _A, _B @ _A


def _pull(shape: Shape, d: Array, x: Array, v: Array) -> Array:
    """Return the acceleration of a geodesic."""
    g = shape.gradient(d, x)
    return -(shape.second(d, x, v) / dot(g, g))[..., None] * g


def _collocated(shape: Shape, d: Array, P: Array, t: Array, s: Array) -> Arcs:
    """Integrate arcs that need about the same number of steps together."""
    need = np.ceil(np.log2(np.maximum(shape.bend(d) * s / TURN, 1.0))).astype(int)
    most_steps = need + HALVINGS
    done: list[tuple[Ints, Arcs]] = []
    while (need >= 0).any():
        power = need[need >= 0].min()
        group = np.flatnonzero(need == power)
        arcs = _steps(shape, d[group], P[group], t[group], s[group], 2**power)
        # only accuracy keeps tangents at unit length and points on the surface
        drift = np.maximum(
            np.abs(dot(arcs.t, arcs.t) - 1.0), np.abs(shape.level(d[group], arcs.Q)) * shape.bend(d[group])
        )
        again = (drift > DRIFT) & (need[group] < most_steps[group])
        need[group] = np.where(again, power + 1, -1)
        done.append((group[~again], arcs.of(~again)))
    if not done:
        return _steps(shape, d, P, t, s, 1)
    order = np.argsort(np.concatenate([group for group, _ in done]))
    most = max(arcs.x.shape[1] for _, arcs in done)

    def joined(name: str) -> Array:
        parts = []
        for _, arcs in done:
            value = getattr(arcs, name)
            if name in ("points", "tangents", "x"):  # short arcs repeat their last point
                value = np.concatenate([value, np.repeat(value[:, -1:], most - value.shape[1], axis=1)], 1)
            parts.append(value)
        return np.concatenate(parts)[order]

    return Arcs(**{name: joined(name) for name in Arcs.__dataclass_fields__})


def _steps(shape: Shape, d: Array, P: Array, t: Array, s: Array, count: int) -> Arcs:
    h = (s / count)[:, None]
    p, v, dims = P, t, d[:, None]
    field, rate = (
        np.tile([1.0, 0.0], (len(s), 1)),
        np.tile([0.0, 1.0], (len(s), 1)),
    )  # a and r, then a' and r'
    x, points, tangents, spreads = [0.0 * h], [P[:, None]], [t[:, None]], [1.0 + 0.0 * h]
    for step in range(count):
        pull = np.repeat(_pull(shape, d, p, v)[:, None], STAGES, axis=1)
        for _ in range(ITERATIONS):
            before = pull
            w = v[:, None] + h[..., None] * (_A @ pull)
            q = p[:, None] + (h * _C)[..., None] * v[:, None] + (h * h)[..., None] * (_AA @ pull)
            pull = _pull(shape, dims, q, w)
            if np.abs(pull - before).max(initial=0.0) <= 1e-15 * np.abs(pull).max(initial=0.0):
                break
        curvature = np.zeros_like(q[..., 0]) if shape.flat else shape.gauss(dims, q)
        straight = field[:, None] + (h * _C)[..., None] * rate[:, None]
        system = np.eye(STAGES) + (h * h)[..., None] * curvature[..., None] * _AA
        bent = np.linalg.solve(system, -curvature[..., None] * straight)
        inner = straight + (h * h)[..., None] * (_AA @ bent)
        here = h * (step + _C)
        x.append(here)
        points.append(q)
        tangents.append(w)
        with np.errstate(divide="ignore", invalid="ignore"):
            spreads.append(np.where(here > 0.0, inner[..., 1] / here, 1.0))
        field = field + h * rate + h * h * (_BA @ bent)
        rate = rate + h * (_B @ bent)
        p = p + h * v + h * h * (_BA @ pull)
        v = v + h * (_B @ pull)
    x.append(s[:, None])
    points.append(p[:, None])
    tangents.append(v[:, None])
    with np.errstate(divide="ignore", invalid="ignore"):
        spreads.append(np.where(s > 0.0, field[:, 1] / s, 1.0)[:, None])
    points_all, tangents_all = np.concatenate(points, 1), np.concatenate(tangents, 1)
    return Arcs(
        p,
        v,
        np.stack([field[:, 0], rate[:, 0], field[:, 1], rate[:, 1]], 1),
        shape.bending(dims, points_all, tangents_all).min(1),
        np.concatenate(spreads, 1).min(1),
        np.abs(points_all[..., 2]).max(1),
        points_all,
        tangents_all,
        np.concatenate(x, 1),
    )


# ---------------------------------------------------------------------------------------- slow twin


def slow_arc(surface: Surface, P: Array, t: Array, s: float) -> tuple[Array, Array, Array]:
    """Return Q, its tangent and a, a', r, r' of one geodesic, by DOP853 at a tolerance of 1e-13; surface's frame."""
    shape, d = SHAPES[type(surface)], sizes(surface)

    def rates(_: float, y: Array) -> Array:
        curvature = 0.0 if shape.flat else float(shape.gauss(d, y[:3]))
        return np.concatenate(
            [y[3:6], _pull(shape, d, y[:3], y[3:6]), [y[7], -curvature * y[6], y[9], -curvature * y[8]]]
        )

    scale = 1e-13 * np.array([s + 1e-3] * 3 + [1.0] * 3 + [1.0, 1.0 / (s + 1e-3), s + 1e-3, 1.0])
    # a capsule's curvature jumps where its half spheres begin, so steps end there
    seams = [lambda _, y, z=z: y[2] - z for z in (-d[-1], d[-1])] if isinstance(shape, Capsule) else []
    for seam in seams:
        seam.terminal = True  # type: ignore[attr-defined]
    where, y = 0.0, np.concatenate([P, t, [1.0, 0.0, 0.0, 1.0]])
    while where < s:
        run = solve_ivp(rates, (where, s), y, "DOP853", rtol=1e-13, atol=scale, events=seams or None)
        y = run.y[:, -1]
        nudge = min(1e-12, s - run.t[-1])  # beyond the seam
        y = y + nudge * rates(0.0, y)
        where = run.t[-1] + nudge if nudge > 0.0 else s
    return y[:3], y[3:6], y[6:]
