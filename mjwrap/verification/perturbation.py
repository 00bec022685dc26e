"""The second derivative of a path's length, measured by perturbing the path.

Contact points are shifted sideways on their surfaces, geodesics between them are computed again, and lengths are
measured. Nothing here uses the theory of Jacobi fields, with which `certificate.stiffness` and the solver distinguish
a minimum from a saddle. It costs a few hundred geodesics, so it is used in tests, and for a random share of the scenes
of robustness.py.
"""

from __future__ import annotations

import numpy as np

from mjwrap.verification.arcs import arcs_of
from mjwrap.verification.certificate import Case, Group, grouped, laid_out
from mjwrap.verification.shapes import Array, Shape, dot, unit

STEP = 1e-3  # length of a shift, in radii; the error of the differences is of the order of its square
SHOOTING = 12  # Newton steps for the geodesic between two given points
SHORT = 0.02  # an arc shorter than this share of a radius is not tested, because its ends move together


def between(shape: Shape, d: Array, P: Array, Q: Array, t: Array, s: Array) -> Array:
    """Return the lengths of geodesics from P to Q (m, 3) near those that leave P along t after s, by shooting."""
    n = shape.normal(d, P)
    t = unit(t - dot(t, n)[:, None] * n)
    for _ in range(SHOOTING):
        arcs = arcs_of(shape, d, P, t, s)
        b, b_far = np.cross(t, n), np.cross(arcs.t, shape.normal(d, arcs.Q))
        miss = Q - arcs.Q
        t = unit(t + (dot(miss, b_far) / arcs.jacobi[:, 2])[:, None] * b)
        s = s + dot(miss, arcs.t)
    return s


def shifted(shape: Shape, d: Array, P: Array, b: Array, by: Array) -> Array:
    """Return points moved by a distance along the geodesic that leaves P along b."""
    return arcs_of(shape, d, P, np.sign(by)[:, None] * b, np.abs(by)).Q


def stiffness_by_differences(case: Case) -> Array:
    """Return the second derivative of a path's length (2n, 2n) in sideways shifts of P and Q of its n geodesics [1/m].

    Computed by second differences. Raises `ValueError` for an arc that is too short for them.
    """
    touches, _, _ = laid_out(0, case)
    groups = grouped([case], touches)
    n = len(touches)
    H = np.zeros((2 * n, 2 * n))
    places = {id(touch): k for k, touch in enumerate(touches)}
    moved: list[tuple[Array, Array, Array]] = [(np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(2))] * n
    for group in groups:
        for k in range(len(group.touches)):
            place = places[id(group.touches[k])]
            H[2 * place : 2 * place + 2, 2 * place : 2 * place + 2], moved[place] = _differentiated_arc(
                case, group, k
            )
    fixed = np.zeros(1)
    ends = [(case.origin[None], fixed), *((far, step[1:]) for _, far, step in moved)]
    starts = [*((near, step[:1]) for near, _, step in moved), (case.insertion[None], fixed)]
    for k, ((a, h_a), (b, h_b)) in enumerate(zip(ends, starts, strict=True)):
        lengths = np.linalg.norm(
            b[None] - a[:, None], axis=2
        )  # [shift of the near end, shift of the far end]
        rows = [i for i, x in ((2 * k - 1, a), (2 * k, b)) if len(x) == 3]
        steps = [float(h[0]) for h, x in ((h_a, a), (h_b, b)) if len(x) == 3]
        H[np.ix_(rows, rows)] += _second(lengths, steps)
    return H


def _differentiated_arc(case: Case, group: Group, k: int) -> tuple[Array, tuple[Array, Array, Array]]:
    """Return the second derivative of one geodesic's length, and its ends shifted by -h, 0, h (3, 3), in the world."""
    shape, d = group.shape, group.d[k : k + 1]
    size = 1.0 / float(shape.bend(d)[0])
    if group.s[k] < SHORT * size:
        raise ValueError(f"an arc of {group.s[k]:.1e} m is too short for differences")
    h = min(STEP * size, 0.05 * float(group.s[k]))
    P, Q, t = group.P[k], group.arcs.Q[k], group.t[k]
    b_P = np.cross(t, shape.normal(d, P[None])[0])
    b_Q = np.cross(group.arcs.t[k], shape.normal(d, Q[None])[0])
    by = np.array([-h, h])
    many = np.repeat(d, 2, axis=0)
    near = shifted(shape, many, np.tile(P, (2, 1)), np.tile(b_P, (2, 1)), by)
    far = shifted(shape, many, np.tile(Q, (2, 1)), np.tile(b_Q, (2, 1)), by)
    near, far = (np.array([x[0], middle, x[1]]) for x, middle in ((near, P), (far, Q)))
    i, j = np.divmod(np.arange(9), 3)
    lengths = between(
        shape, np.repeat(d, 9, axis=0), near[i], far[j], np.tile(t, (9, 1)), np.full(9, group.s[k])
    )
    turn, pos = group.turn[k], np.asarray(case.obstacles[group.touches[k].index].pos)
    world = near @ turn.T + pos, far @ turn.T + pos, np.array([h, h])
    return _second(lengths.reshape(3, 3), [h, h]), world


def _second(f: Array, steps: list[float]) -> Array:
    """Return the matrix of second differences of f at (-h, 0, h) in each direction that is shifted."""
    f = f.reshape([3] * len(steps))
    if not steps:
        return np.zeros((0, 0))
    if len(steps) == 1:
        return np.array([[(f[0] - 2.0 * f[1] + f[2]) / steps[0] ** 2]])
    h, k = steps
    mixed = (f[2, 2] - f[2, 0] - f[0, 2] + f[0, 0]) / (4.0 * h * k)
    first = (f[0, 1] - 2.0 * f[1, 1] + f[2, 1]) / h**2
    second = (f[1, 0] - 2.0 * f[1, 1] + f[1, 2]) / k**2
    return np.array([[first, mixed], [mixed, second]])


def lowest(H: Array) -> float:
    """Return the smallest eigenvalue of a stiffness, scaled to a unit diagonal."""
    scale = 1.0 / np.sqrt(np.maximum(np.abs(np.diag(H)), 1e-12 * np.abs(H).max()))
    return float(np.linalg.eigvalsh(scale[:, None] * H * scale).min())
