"""A whole path with one of the paper's methods: which obstacles it touches, and the coupled system over those."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mjwrap.methods.iteration import Outcome
from mjwrap.methods.problem import Array
from mjwrap.methods.registry import make_solver
from mjwrap.methods.touching import Scene, Start, TouchState
from mjwrap.surfaces import Surface


@dataclass(frozen=True)
class MethodResult:
    """A path, found or not.

    P, Q (n, 3): contact points, world [m]; t (n, 3): unit tangent at P, world; s (n,): arc lengths [m], at least 0 on a
    converged path; active (n,): touched. On an untouched obstacle P = Q is the point next to the path, t the path's
    direction there and s = 0. length [m]; tangency_error: ‖f‖ (30) over the touched obstacles; residual_error: norm of
    the residual solved for, ‖h‖ with `residual="normals_binormals"`. converged: tangency_error ≤ tol and nothing left
    to drop or take in.
    """

    P: Array
    t: Array
    s: Array
    active: Array
    Q: Array
    length: float
    iterations: int
    evaluations: int
    tangency_error: float
    residual_error: float
    converged: bool


def solve_chain(
    method: str,
    origin: Array,
    insertion: Array,
    surfaces: Sequence[Surface],
    positions: Array,
    rotations: Array,
    start: Start | None = None,
    tol: float = 1e-10,
    *,
    residual: str = "tangency",
    **options: Any,
) -> MethodResult:
    """Find a path over n obstacles with one of the paper's methods.

    origin, insertion (3,), positions (n, 3): world [m]; rotations (n, 3, 3): surface to world. start: P (n, 3),
    t (n, 3), s (n,), active (n,) of a path nearby; None is the paper's first guess, with every obstacle touched. An
    obstacle is dropped when its arc comes out negative and taken in where a straight segment runs below its surface;
    options of the method hold for each solve in between. A path that is not found has `converged` False;
    `GeometryError` is for input that describes no problem.
    """
    solver = make_solver(method, **options)
    scene = Scene(origin, insertion, surfaces, positions, rotations, residual)
    path = TouchState.at(scene, start)
    iterations = evaluations = 0
    outcome: Outcome | None = None
    settled = False
    given_up = np.zeros(scene.n, dtype=bool)
    for _ in range(2 * scene.n + 6):  # drop and take in; a chain that goes on longer is cycling
        before = path.copy()
        solved = True
        if path.active.any():
            outcome = path.solve(scene, solver, tol)
            iterations += outcome.iterations
            evaluations += outcome.evaluations
            solved = outcome.converged
        lifted = path.active & (path.s < 0.0)
        if (
            not solved
        ):  # perhaps because an obstacle is far from touching; but try to do without each only once
            lifted &= ~given_up
            if not lifted.any():
                break
            given_up |= lifted
            path = before
        if lifted.any():
            path.active = path.active & ~lifted
        elif not path.touch_down(scene):
            settled = True
            break
    Q, error = path.contacts(scene)
    straight = sum(float(np.linalg.norm(b - a)) for a, b, _ in path.segments(scene))
    s = np.where(path.active, path.s, 0.0)
    return MethodResult(
        P=path.P,
        t=path.t,
        s=s,
        active=path.active,
        Q=Q,
        length=straight + float(s.sum()),
        iterations=iterations,
        evaluations=evaluations,
        tangency_error=error,
        residual_error=outcome.error if outcome is not None and path.active.any() else 0.0,
        converged=settled and error <= tol,
    )
