"""Newton's method on the path error h of all touched obstacles of a span: init, step, terminate.

A step solves J d = -h for the natural geodesic variations of every obstacle (`block_elimination.py`, with the formulas
in `path_error.py`). It is accepted by the tangency error ||f|| (18), because h is zero on a path that folds back
(e = -t) as well: a step that does not reduce ||f|| is halved.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, inlined, jit, no_inline
from mjwrap.kernels.geometry.dispatch import height, project
from mjwrap.kernels.geometry.geodesics import displace
from mjwrap.kernels.geometry.projection import into_frame
from mjwrap.kernels.tangency.block_elimination import solve_newton_system
from mjwrap.kernels.tangency.path_error import dot_columns
from mjwrap.kernels.tangency.seams import any_seams, move_to_seams, step_over_seams
from mjwrap.kernels.tangency.tangency_error import (
    LEAST_HEIGHT,
    ON_SURFACE,
    connect_segments,
    ends_on_surface,
    evaluate,
)

S_MODE, S_P, S_ARC, SIZE = lay.S_MODE, lay.S_P, lay.S_ARC, lay.SIZE
W_E, W_L, W_NP, W_Y, W_SAVE = lay.W_E, lay.W_L, lay.W_NP, lay.W_Y, lay.W_SAVE
W_START_ERROR = lay.W_START_ERROR
TOUCHED = lay.TOUCHED

AT_END = 1e-11  # a contact nearer to an end on the surface than this share of the size has reached the end
MAX_END_MOVE = (
    0.3  # an end that has moved less on the surface takes the contact with it, as a share of the size
)
MAX_TURN = 0.5  # largest change of direction in one step [rad]
MAX_SHIFT = 0.5  # largest shift of a contact point in one step, in the surface's size
MAX_STRETCH = 1.0  # largest lengthening of a geodesic in one step, in the surface's size, beside half its arc
MAX_HALVINGS = 6
# Values of `square` where ||f||^2 of the start is not known: nothing is evaluated, or the geodesics alone are.
NOT_EVALUATED, GEODESICS_EVALUATED = -1.0, -2.0


@no_inline
def newton(lo, hi, ends, node, tol, max_iterations, square=NOT_EVALUATED):
    """Iterate until ||f|| <= tol; return (||f||, iterations, evaluations), the last state left in the rows.

    square: ||f||^2 where the rows hold the evaluation of their start, else NOT_EVALUATED or GEODESICS_EVALUATED. The
    iteration also stops where the Newton system is singular, and where no shortened step reduces ||f||.
    """
    square, evaluations = init(lo, hi, ends, node, square)
    aimed = -1
    if square > tol * tol:
        aimed = _row_at_end_on_surface(lo, hi, node)
        if aimed >= 0:
            aimed, square = _aim_at_end_on_surface(aimed, lo, hi, ends, node, square)
    iterations = 0
    if not terminate(square, iterations, tol, max_iterations):
        square, iterations, further = iterate(lo, hi, ends, node, square, tol, max_iterations)
        evaluations += further
    if aimed >= 0:
        node[aimed, lay.W_END_TARGET] = 0.0
    return math.sqrt(square), iterations, evaluations


@inlined
def init(lo, hi, ends, node, square):
    """Evaluate what the rows do not yet hold of their start; return (||f||^2, evaluations)."""
    evaluations = 0
    if square < 0.0:
        if square == GEODESICS_EVALUATED:
            square = connect_segments(lo, hi, ends, node)
        else:
            square = evaluate(lo, hi, ends, node)
        evaluations = 1
    if node[lo, W_START_ERROR] < 0.0:
        node[lo, W_START_ERROR] = square
    if _start_at_end_on_surface(lo, hi, ends, node):
        square = evaluate(lo, hi, ends, node)
        evaluations += 1
    return square, evaluations


@deferred(types.float64, types.int64, types.int64)
def iterate(lo, hi, ends, node, square, tol, max_iterations):
    """Take Newton steps until the iteration ends; return (||f||^2, iterations, evaluations).

    square: ||f||^2 of the evaluation that the rows hold.
    """
    seamed = any_seams(lo, hi, node)
    iterations, evaluations = 0, 0
    moved = True
    while moved and not terminate(square, iterations, tol, max_iterations):
        if seamed:
            moved, square, i, e = step_with_seams(lo, hi, ends, node, square)
        else:
            moved, square, i, e = step(lo, hi, ends, node, square, False)
        iterations += i
        evaluations += e
    return square, iterations, evaluations


@inlined
def step(lo, hi, ends, node, square, seamed=True):
    """Take one damped Newton step from rows that hold an evaluation with ||f||^2 = square.

    Returns (whether ||f|| went down, ||f||^2, iterations, evaluations); iterations is 0 where the Newton system is
    singular, else 1. Where no share of the step reduces ||f||, ||f||^2 is the old one and the rows hold the last trial.
    seamed: whether a touched surface may have seams.
    """
    solved = solve_newton_system(lo, hi, node)
    if seamed and move_to_seams(lo, hi, ends, node, MAX_SHIFT if solved else 0.0):
        return True, _evaluate(lo, hi, ends, node), 1, 1
    if not solved:
        return False, square, 0, 0
    share = _step_limit(lo, hi, node)
    if not math.isfinite(share) or share <= 0.0:
        return False, square, 1, 0
    if seamed:
        step_over_seams(lo, hi, share, ends, node)
    _save(lo, hi, node)
    evaluations = 0
    trial = square
    for _ in range(MAX_HALVINGS):
        _move(lo, hi, share, node)
        trial = evaluate(lo, hi, ends, node)
        evaluations += 1
        if not trial < square:
            trial = _stop_at_end_on_surface(lo, hi, ends, node, trial)
        if trial < square:
            break
        share *= 0.5
    if not trial < square:
        return False, square, 1, evaluations
    # a contact that has reached an end on the surface stays there from now on
    if _start_at_end_on_surface(lo, hi, ends, node):
        trial = evaluate(lo, hi, ends, node)
        evaluations += 1
    return True, trial, 1, evaluations


@inlined
def terminate(square, iterations, tol, max_iterations):
    """Return whether the iteration ends: converged, out of iterations, or ||f|| no longer finite."""
    return not (square > tol * tol and iterations < max_iterations and math.isfinite(square))


@jit
def _step_limit(lo, hi, node):
    """Return the largest share, at most 1, of the Newton step that stays within the limits of every obstacle.

    Beyond about half a radius the linearisation is not valid. One share for all obstacles keeps the step's direction.
    """
    worst = 1.0
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED:
            inverse = 1.0 / node[k, SIZE]
            worst = max(worst, abs(node[k, W_Y]) * inverse / MAX_SHIFT)
            worst = max(worst, abs(node[k, W_Y + 1]) * inverse / MAX_SHIFT)
            worst = max(worst, abs(node[k, W_Y + 2]) / MAX_TURN)
            stretch = MAX_STRETCH * node[k, SIZE] + 0.5 * abs(node[k, S_ARC])
            worst = max(worst, abs(node[k, W_Y + 3]) / stretch)
    return 1.0 / worst


@jit
def _save(lo, hi, node):
    """Save P, t and s of every row; the trials of a step start from them."""
    for k in range(lo, hi):
        for i in range(7):
            node[k, W_SAVE + i] = node[k, S_P + i]


@jit
def _move(lo, hi, share, node):
    """Set every touched obstacle to its saved geodesic moved by a share of the step."""
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED:
            for i in range(7):
                node[k, S_P + i] = node[k, W_SAVE + i]
            displace(
                k,
                share * node[k, W_Y],
                share * node[k, W_Y + 1],
                share * node[k, W_Y + 2],
                share * node[k, W_Y + 3],
                node,
            )


@jit
def _start_at_end_on_surface(lo, hi, ends, node):
    """If the path starts on the surface that it touches first, start the geodesic there; return whether it was moved.

    There is no straight segment then: the first contact point is known, and the other end is left to solve for.
    """
    for k in range(lo, hi):
        if node[k, S_MODE] != TOUCHED:
            continue
        normal = dot_columns(node, k, W_E, k, W_NP)
        size, bend = node[k, W_L], node[k, lay.W_KP]
        if size <= AT_END * node[k, SIZE]:
            return False
        if not ends_on_surface(k, -normal, size, bend, node) and (
            node[k, lay.S_BEFORE] > ON_SURFACE * node[k, SIZE]
            or not _moved_on_surface(k, size, ends, 3, node)
        ):
            return False
        x, y, z = into_frame(node, k, ends[0] + ends[3], ends[1] + ends[4], ends[2] + ends[5])
        x, y, z, _, _, _ = project(node, k, x, y, z)
        node[k, S_P] = x
        node[k, S_P + 1] = y
        node[k, S_P + 2] = z
        displace(k, 0.0, 0.0, 0.0, 0.0, node)
        return True
    return False


@no_inline
def _moved_on_surface(k, size, ends, column, node):
    """Return whether an end of the path, which lay on row k's surface in the path before, still does, nearby.

    size: length of the straight segment at that end, between the end now and the contact before [m].
    """
    if size > MAX_END_MOVE * node[k, SIZE]:
        return False
    x, y, z = into_frame(
        node, k, ends[0] + ends[column], ends[1] + ends[column + 1], ends[2] + ends[column + 2]
    )
    return abs(height(node, k, x, y, z)) <= LEAST_HEIGHT * node[k, SIZE]


@jit
def _row_at_end_on_surface(lo, hi, node):
    """Return the last touched row if the path before ended on its surface and now seems not to, else -1."""
    for k in range(hi - 1, lo - 1, -1):
        if node[k, S_MODE] == TOUCHED:
            ended = node[k, lay.S_BEFORE + 1] <= ON_SURFACE * node[k, SIZE]
            known = node[k, lay.W_END_ON_SURFACE] != 0.0 or node[k, lay.W_END_TARGET] != 0.0
            return k if ended and not known else -1
    return -1


@no_inline
def _aim_at_end_on_surface(k, lo, hi, ends, node, square):
    """Aim Q of row k at the end of the path if that has moved on the surface; return (k, or -1 if not, and ||f||^2)."""
    if not _moved_on_surface(k, node[k, lay.W_LQ], ends, 6, node):
        return -1, square
    node[k, lay.W_END_TARGET] = 1.0
    return k, _evaluate(lo, hi, ends, node)


@deferred(types.boolean, types.float64, types.int64, types.int64)
def step_with_seams(lo, hi, ends, node, square):
    """Take the same step where a touched surface has seams: a copy of its own, so that other paths are as fast."""
    return step(lo, hi, ends, node, square, True)


@no_inline
def _evaluate(lo, hi, ends, node):
    """Return `evaluate`, where it is called so seldom that its code should not be copied."""
    return evaluate(lo, hi, ends, node)


@no_inline
def _stop_at_end_on_surface(lo, hi, ends, node, square):
    """If the path ends on the surface, near Q, let the geodesic end there; return ||f||^2.

    Where the last straight segment vanishes, the distance from the end takes the place of its direction, and counts for
    more: without this a step that reaches the end but for a little would be refused.
    """
    for k in range(hi - 1, lo - 1, -1):
        if node[k, S_MODE] != TOUCHED:
            continue
        if node[k, lay.W_END_ON_SURFACE] == 0.0 or node[k, lay.W_END_TARGET] != 0.0:
            return square
        node[k, S_ARC] -= node[k, lay.W_CQ + 1]  # (Q - B)·t
        return _evaluate(lo, hi, ends, node)
    return square
