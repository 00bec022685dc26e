"""Scenes and slow twins for the tests of the paper's methods."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mjwrap as mw
from mjwrap.methods import ChainProblem, MethodResult
from mjwrap.surfaces import Surface

Array = NDArray[Any]
Scene = tuple[
    Array, Array, list[Surface], Array, Array
]  # the first arguments of solve_chain after the method

TOL = 1e-10  # the paper's, on ‖f‖
LENGTH = (
    1e-13  # relative: length is stationary in the contacts, so that of an error of TOL only rounding is left
)

ROWS: list[tuple[str, dict[str, Any]]] = [  # Table I
    ("nr", {"lam": 0.08}),
    ("nr", {"lam": 0.1}),
    ("nr", {"lam": 0.5}),
    ("bfgs", {"step": 1.0}),
    ("bfgs", {"step": "armijo"}),
    ("broyden", {"step": 1.0}),
    ("broyden", {"step": "line_search"}),
]
ORIGIN, INSERTION = np.array([0.02, 0.0, -0.025]), np.array([-0.02, 0.0, -0.005])
AMPLITUDE = {1: 0.009, 2: 0.02}
TIMES = 0.012 * np.arange(251)


def centre_y(case: int, t: float) -> float:
    return AMPLITUDE[case] * math.sin(2.0 * math.pi * t)


def paper_problem(case: int, t: float, residual: str = "tangency", mirror: float = 1.0) -> ChainProblem:
    centre = np.array([[0.0, mirror * centre_y(case, t), 0.0]])
    return ChainProblem(ORIGIN, INSERTION, [mw.Cylinder(0.01)], centre, np.eye(3)[None], residual)


def exact_length(y: float) -> tuple[float, bool]:
    """Return the length over the top of a circle of radius 0.01 round (0, y), unrolled, and whether it wraps.

    By symmetry the arc turns by 2 (asin(R/d) − the angle by which the centre lies above the end points).
    """
    d = math.hypot(0.02, y)
    turn = 2.0 * (math.asin(0.01 / d) + math.atan2(y, 0.02))
    if turn <= 0.0:
        return math.hypot(0.04, 0.02), False
    return math.hypot(2.0 * math.sqrt(d * d - 1e-4) + 0.01 * turn, 0.02), True


def corner(path: MethodResult, centres: Array) -> float:
    """Return the largest component of f for upright cylinders, from the contact points: t_Q is t turned about z."""
    if not path.active.any():
        return 0.0
    points, tangents = [ORIGIN], []
    for P, t, Q, centre, on in zip(path.P, path.t, path.Q, centres, path.active, strict=True):
        if on:
            p, q = P - centre, Q - centre
            c, i = (p[:2] @ q[:2]) / (p[:2] @ p[:2]), (p[0] * q[1] - p[1] * q[0]) / (p[:2] @ p[:2])
            points += [P, Q]
            tangents += [t, np.array([c * t[0] - i * t[1], i * t[0] + c * t[1], t[2]])]
    straight = np.diff([*points, INSERTION], axis=0)[::2]
    e = straight / np.linalg.norm(straight, axis=1)[:, None]
    arriving_and_leaving = np.stack([e[:-1], e[1:]], axis=1).reshape(-1, 3)
    return float(np.abs(arriving_and_leaving - np.array(tangents)).max())


def random_problem(rng: np.random.Generator, residual: str) -> tuple[ChainProblem, Array]:
    n = int(rng.integers(1, 4))
    surfaces: list[Surface] = [
        mw.Cylinder(r) if rng.random() < 0.5 else mw.Sphere(r) for r in rng.uniform(0.5, 1.5, n)
    ]
    positions = np.column_stack([4.0 * np.arange(n), rng.normal(size=(n, 2))])
    rotations = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
    rotations[:, :, 0] *= np.linalg.det(rotations)[:, None]
    ends = np.array([-4.0, 0.0, 0.0]), np.array([4.0 * n, 0.0, 0.0])
    x = rng.uniform(-1.0, 1.0, (n, 5))
    x[:, 2:4] = rng.normal(size=(n, 2)) + 0.1
    return ChainProblem(*ends, surfaces, positions, rotations, residual), x.ravel()


def exact_jacobian(problem: ChainProblem, x: Array) -> Array:
    """Differentiate by a complex step, which cancels nothing."""
    return np.imag(problem.residuals(x + 1e-30j * np.eye(len(x)))).T / 1e-30


def made_path(rng: np.random.Generator) -> tuple[Scene, MethodResult]:
    """Draw a path and put surfaces under it: the exact answer without a solver. Unit: one typical radius."""
    n = int(rng.integers(1, 4))
    point, along = rng.normal(size=3), _direction(rng)
    origin = point
    surfaces: list[Surface] = []
    positions, rotations, first, tangents, last, arcs = [], [], [], [], [], []
    length = 0.0
    for _ in range(n):
        gap, radius = rng.uniform(1.5, 3.0), rng.uniform(0.5, 1.5)
        P = point + gap * along
        normal = np.cross(along, _direction(rng))
        normal /= np.linalg.norm(normal)
        across = np.cross(along, normal)
        if rng.random() < 0.5:
            surfaces.append(mw.Sphere(radius))
            rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            rotation[:, 0] *= np.linalg.det(rotation)
            turn = rng.uniform(0.3, 1.5)
            arc = radius * turn
            leaving = math.cos(turn) * along - math.sin(turn) * normal
            Q = P + radius * (math.sin(turn) * along - (1.0 - math.cos(turn)) * normal)
        else:
            surfaces.append(mw.Cylinder(radius))
            pitch = rng.uniform(-1.0, 1.0)  # from the circle
            round_ = math.cos(pitch) * along - math.sin(pitch) * across
            axis = math.sin(pitch) * along + math.cos(pitch) * across
            rotation = np.column_stack([normal, np.cross(axis, normal), axis])
            turn = rng.uniform(0.3, 1.5)
            arc = radius * turn / math.cos(pitch)
            ahead = math.cos(turn) * round_ - math.sin(turn) * normal
            leaving = math.cos(pitch) * ahead + math.sin(pitch) * axis
            Q = P + radius * (math.sin(turn) * round_ - (1.0 - math.cos(turn)) * normal)
            Q = Q + arc * math.sin(pitch) * axis
        positions.append(P - radius * normal)
        rotations.append(rotation)
        first.append(P)
        tangents.append(along)
        last.append(Q)
        arcs.append(arc)
        length += gap + arc
        point, along = Q, leaving
    gap = rng.uniform(1.5, 3.0)
    exact = MethodResult(
        P=np.array(first),
        t=np.array(tangents),
        s=np.array(arcs),
        active=np.ones(n, dtype=bool),
        Q=np.array(last),
        length=length + gap,
        iterations=0,
        evaluations=0,
        tangency_error=0.0,
        residual_error=0.0,
        converged=True,
    )
    return (origin, point + gap * along, surfaces, np.array(positions), np.array(rotations)), exact


def _direction(rng: np.random.Generator) -> Array:
    d = rng.normal(size=3)
    return d / np.linalg.norm(d)


def contact_error(scene: Scene, exact: MethodResult) -> float:
    """Return how far off contacts may be where ‖f‖ = TOL: that over the least singular value, times 3 for s and Q."""
    problem = ChainProblem(*scene)
    J = exact_jacobian(problem, problem.unknowns(exact.P, exact.t, exact.s))
    least = np.linalg.svd(J, compute_uv=False)[-1 - problem.n]  # below it, one null direction per obstacle
    return 3.0 * TOL / float(least) * float(problem.radii.max())
