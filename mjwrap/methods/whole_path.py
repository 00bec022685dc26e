"""Solve a whole path with one of the paper's methods: find the touched obstacles and solve the coupled system."""

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
    """The result of one of the paper's methods, converged or not.

    On an untouched obstacle P = Q is the point next to the path, t the path's direction there, and s = 0.

    Attributes:
        P: (n, 3) first contact points, world [m].
        t: (n, 3) unit tangents at P, world.
        s: (n,) arc lengths [m], not negative on a converged path.
        active: (n,) whether each obstacle is touched.
        Q: (n, 3) last contact points, world [m].
        length: [m].
        iterations: iterations of the method.
        evaluations: evaluations of the residual of the whole path.
        tangency_error: ‖f‖ (30) over the touched obstacles.
        residual_error: norm of the residual that was solved, ‖h‖ with `residual="normals_binormals"`.
        converged: tangency_error is at most tol, and no obstacle has to be dropped or added.
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

    An obstacle is dropped if its arc length becomes negative, and added if a straight segment passes below its surface.

    Args:
        method: "nr", "bfgs" or "broyden".
        origin: (3,) world [m].
        insertion: (3,) world [m].
        surfaces: n of `Cylinder`, `Sphere`.
        positions: (n, 3) of their frames, world [m].
        rotations: (n, 3, 3) surface to world.
        start: P (n, 3), t (n, 3), s (n,), active (n,) of a similar path; None for the paper's first guess, with every
            obstacle touched.
        tol: largest norm of the residual.
        residual: "tangency" or "normals_binormals", as in `ChainProblem`.
        **options: options of the method, used for each solve between changes of the touched obstacles.

    Returns:
        The path; if it was not found, `converged` is False.

    Raises:
        GeometryError: an argument is not valid.
    """
    solver = make_solver(method, **options)
    scene = Scene(origin, insertion, surfaces, positions, rotations, residual)
    path = TouchState.at(scene, start)
    iterations = evaluations = 0
    outcome: Outcome | None = None
    settled = False
    given_up = np.zeros(scene.n, dtype=bool)
    for _ in range(2 * scene.n + 6):  # rounds of removing and adding obstacles; more rounds would be a cycle
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
        ):  # perhaps because an obstacle should not be touched; try without each obstacle only once
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
