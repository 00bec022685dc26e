"""solve_path: one path at one pose, by the production solver or by one of the paper's methods."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mjwrap import validation
from mjwrap.errors import GeometryError
from mjwrap.kernels import layout
from mjwrap.kernels.spans import chain
from mjwrap.paths.scene import SAVED, Array, Obstacle, Point, ViaPoint, owners, pack, point
from mjwrap.paths.solution import PathSolution


def _start(start: PathSolution | Array | None, node: Array) -> None:
    if start is None:
        return
    if isinstance(start, np.ndarray):
        if start.shape != (len(node), layout.STATE):
            raise GeometryError(
                f"start must be a branch of shape ({len(node)}, {layout.STATE}) for these obstacles, not {start.shape}"
            )
        if not np.isfinite(start).all():
            raise GeometryError("start must be a finite branch; this one has NaN or infinite numbers")
        node[:, SAVED] = start
        return
    if not isinstance(start, PathSolution):
        raise GeometryError(
            f"start must be the PathSolution of an earlier solve, or its branch, not {start!r}"
        )
    if not np.array_equal(start._node[:, layout.KIND], node[:, layout.KIND]):
        raise GeometryError(
            "start belongs to a path over different obstacles: number and kinds must be the same"
        )
    node[:, SAVED] = start._saved


def solve_path(
    origin: ArrayLike,
    insertion: ArrayLike,
    obstacles: Sequence[Obstacle | ViaPoint] = (),
    *,
    method: str = "newton",
    start: PathSolution | Array | None = None,
    tol: float = 1e-10,
    **options: Any,
) -> PathSolution:
    """Find the smooth geodesic path of a taut string from origin to insertion over a row of obstacles.

    Args:
        origin: (3,) first point of the path, world [m].
        insertion: (3,) last point of the path, world [m].
        obstacles: obstacles and via points in the order in which the path meets them. An obstacle need not be touched.
        method: "newton", mjwrap's own solver, or one of the paper's: "nr", "bfgs", "broyden" (`mjwrap.methods`). The
            paper's methods ignore hints and may find a path that winds further than a string would.
        start: an earlier solution for the same obstacles at other poses, or its `branch`. Side and winding are kept.
        tol: largest tangency error of a solution.
        **options: options of the paper's methods.

    Returns:
        The solution. Check `converged`: if no path was found, `status` says why.

    Raises:
        GeometryError: an argument is not valid.
    """
    tol = validation.positive(tol, "tol", GeometryError)
    here, there = point(origin, "origin"), point(insertion, "insertion")
    node, owner = pack(obstacles), owners(obstacles)
    _start(start, node)
    before = node[:, SAVED].copy()
    solution = PathSolution(here, there, node, owner, before)
    info = np.zeros((1, layout.INFO))
    if isinstance(method, str) and method == "newton":
        if options:
            raise GeometryError(f"method 'newton' has no options; got {', '.join(options)}")
        direct = start is None
        chain.solve_chain(*solution._ends, node, float(tol), direct, info, 0)
    else:
        _solve_with(method, here, there, obstacles, node, start is not None, float(tol), options, info)
    solution._finish(info[0], before)
    solution._obstacles = tuple(obstacles)
    return solution


def _solve_with(
    method: str,
    origin: Point,
    insertion: Point,
    obstacles: Sequence[Obstacle | ViaPoint],
    node: Array,
    warm: bool,
    tol: float,
    options: dict[str, Any],
    info: Array,
) -> None:
    """Solve one span after the other with one of the paper's methods, and evaluate the result with the kernels."""
    from mjwrap import methods

    validation.choice(method, ("newton", *methods.METHODS), "method", GeometryError)
    if node[:, layout.INSIDE].any():
        raise GeometryError(f"method {method!r} cannot hold a path inside an obstacle; use method 'newton'")
    good, iterations, evaluations = True, 0, 0
    stops = [k for k, obstacle in enumerate(obstacles) if isinstance(obstacle, ViaPoint)] + [len(obstacles)]
    first, here = 0, np.array(origin)
    for stop in stops:
        there = np.array(insertion) if stop == len(obstacles) else np.array(obstacles[stop].pos)
        if stop > first:
            result = _solve_span_with(
                method, here, there, obstacles[first:stop], node[first:stop], warm, tol, options
            )
            good = good and result.converged
            iterations += result.iterations
            evaluations += result.evaluations
        first, here = stop + 1, there
    chain.evaluate_chain(0, len(node), *origin, *insertion, node, info, 0)
    good = good and info[0, layout.I_ERROR] <= tol
    if not good:
        info[0, layout.I_STATUS] = layout.NOT_CONVERGED
    info[0, layout.I_ITERATIONS] = iterations
    info[0, layout.I_EVALUATIONS] = evaluations


def _solve_span_with(
    method: str,
    origin: Array,
    insertion: Array,
    obstacles: Sequence[Obstacle | ViaPoint],
    node: Array,
    warm: bool,
    tol: float,
    options: dict[str, Any],
) -> Any:
    """Run one of the paper's methods between two points and write its geodesics to the rows `node`."""
    from mjwrap import methods

    n = len(node)
    pos = node[:, layout.POS : layout.POS + 3].copy()
    rot = node[:, layout.ROT : layout.ROT + 9].reshape(n, 3, 3).copy()
    P, t = slice(layout.S_P, layout.S_P + 3), slice(layout.S_T, layout.S_T + 3)
    given = None
    if warm:
        given = (
            np.einsum("kij,kj->ki", rot, node[:, P]) + pos,
            np.einsum("kij,kj->ki", rot, node[:, t]),
            node[:, layout.S_ARC].copy(),
            node[:, layout.S_MODE] == layout.TOUCHED,
        )
    surfaces = [obstacle.surface for obstacle in obstacles if isinstance(obstacle, Obstacle)]
    result = methods.solve_chain(method, origin, insertion, surfaces, pos, rot, given, tol, **options)
    node[:, layout.S_MODE] = np.where(result.active, layout.TOUCHED, layout.FREE)
    node[:, P] = np.einsum("kji,kj->ki", rot, result.P - pos)
    node[:, t] = np.einsum("kji,kj->ki", rot, result.t)
    node[:, layout.S_ARC] = np.where(result.active, result.s, 0.0)
    return result
