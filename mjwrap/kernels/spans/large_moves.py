"""Warm starts: Newton's method follows small moves; large ones are followed in strides, lost paths searched for anew.

A saved solution says where the string ran beside every surface, in the surface's own frame: along the segment that
it left free, or along the tangents of its contact. Where the ends of that string have moved far, the surface alone is
wrapped again and again while they move there in a straight line, so that it catches a string that it is pulled
through on the side on which it was, as it does in small steps.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import deferred, jit
from mjwrap.kernels.geometry.projection import turn_into_frame
from mjwrap.kernels.geometry.traits import closed_form
from mjwrap.kernels.spans.cold_start import ends_of_part
from mjwrap.kernels.spans.end_inside import substitute_path
from mjwrap.kernels.spans.lone_obstacle import solve_lone_obstacle
from mjwrap.kernels.spans.saved_solutions import any_in_mode, restore_solutions, save_solutions, surface_end
from mjwrap.kernels.spans.span import solve_active_set

KIND, SIZE, POS, ROT = lay.KIND, lay.SIZE, lay.POS, lay.ROT
S_MODE, S_P, S_T = lay.S_MODE, lay.S_P, lay.S_T
W_OLD, W_START, W_FIRST = lay.W_OLD, lay.W_START, lay.W_FIRST
COLD, FREE, TOUCHED = lay.COLD, lay.FREE, lay.TOUCHED

# Move of a free string's ends, in the surface's size, up to which it meets the surface on the side on which it was.
FREE_MOVE = 0.25
LARGE_ERROR = 0.1  # tangency error of an obstacle's old contact beyond which the move is a large one
CONTACT_MOVE = 0.5  # of a contact on its surface, in its size, likewise
STRIDE = 0.05  # of a string's ends in a large move, in the surface's size
MOST_STRIDES = 100.0
CLEARANCE_SHARE = 0.5  # share of a segment's height over the surface by which it cannot have passed through


@jit
def _is_found(status):
    """Return whether there is a path, or is none on the branch that the path is on."""
    return status == lay.CONVERGED or status == lay.OUT_OF_RANGE or status == lay.NO_GEODESIC


@jit
def _free_string_moved_far(k, end, now, node):
    """Return whether the free string beside row k has moved so far that it may have gone through the surface.

    now: its ends as of a span. W_OLD holds where it ran before, in S.
    """
    if node[k, W_OLD] != FREE:
        return False
    x, y, z = node[k, POS] - now[0], node[k, POS + 1] - now[1], node[k, POS + 2] - now[2]
    ax, ay, az = turn_into_frame(node, k, now[3] - x, now[4] - y, now[5] - z)
    bx, by, bz = turn_into_frame(node, k, now[6] - x, now[7] - y, now[8] - z)
    # of a FREE row S_P and S_T are the ends of the string before; zeros: not known
    i, j = W_OLD + S_P - S_MODE, W_OLD + S_T - S_MODE
    known = abs(node[k, j]) + abs(node[k, j + 1]) + abs(node[k, j + 2]) > 0.0
    a = (ax - node[k, i]) ** 2 + (ay - node[k, i + 1]) ** 2 + (az - node[k, i + 2]) ** 2
    b = (bx - node[k, j]) ** 2 + (by - node[k, j + 1]) ** 2 + (bz - node[k, j + 2]) ** 2
    # one that runs high over the surface may move further
    clear = FREE_MOVE * node[k, SIZE]
    if not any_in_mode(k, end, node, TOUCHED):
        clear = max(clear, CLEARANCE_SHARE * node[k, lay.W_LOW])
    return known and max(a, b) > clear * clear


@jit
def _contact_moved_far(k, node):
    """Return whether the contact of row k has gone so far on its surface that it may be another one."""
    if node[k, W_OLD] != TOUCHED or node[k, S_MODE] != TOUCHED:
        return False
    i = W_OLD + S_P - S_MODE
    x, y, z = node[k, S_P] - node[k, i], node[k, S_P + 1] - node[k, i + 1], node[k, S_P + 2] - node[k, i + 2]
    return x * x + y * y + z * z > (CONTACT_MOVE * node[k, SIZE]) ** 2


@jit
def _moved_far(lo, hi, ends, node):
    """Return whether a path just found is so far from the one before that it may have missed a surface or a side."""
    follows = False
    for k in range(lo, hi):
        if closed_form(k, node) or node[k, lay.TOUCH] > 0.0:
            continue
        follows = True
        if _contact_moved_far(k, node):
            return True
        end = surface_end(k, hi, node)
        if node[k, W_OLD] == FREE and _free_string_moved_far(
            k, end, ends_of_part(lo, hi, k, end, ends, node), node
        ):
            return True
    return follows and node[lo, W_FIRST] > LARGE_ERROR * LARGE_ERROR * (hi - lo)


@jit
def _before(k, end, now, node):
    """Return whether it is known where the string ran beside rows k..end, and its ends then, as of a span.

    Relative to the surface, so that they have moved with it. Rows k..end are those of one surface.
    """
    first, last = -1, -1
    for j in range(k, end):
        if node[j, S_MODE] == TOUCHED:
            first = j if first < 0 else first
            last = j
    gx, gy, gz = now[0], now[1], now[2]
    # touched: along the tangents at P and Q, as long as the straight segments were
    if first >= 0:
        p, t, q, u = lay.W_P, lay.W_TP, lay.W_Q, lay.W_TQ
        px, py, pz = node[first, p], node[first, p + 1], node[first, p + 2]
        qx, qy, qz = node[last, q], node[last, q + 1], node[last, q + 2]
        a, b = node[first, lay.S_BEFORE], node[last, lay.S_BEFORE + 1]
        return True, (
            gx, gy, gz,
            px - a * node[first, t], py - a * node[first, t + 1], pz - a * node[first, t + 2],
            qx + b * node[last, u], qy + b * node[last, u + 1], qz + b * node[last, u + 2],
        )  # fmt: skip
    # free: the ends are saved in S
    ax, ay, az, bx, by, bz = (
        node[k, S_P], node[k, S_P + 1], node[k, S_P + 2], node[k, S_T], node[k, S_T + 1], node[k, S_T + 2],
    )  # fmt: skip
    x, y, z = node[k, POS] - gx, node[k, POS + 1] - gy, node[k, POS + 2] - gz
    return abs(bx) + abs(by) + abs(bz) > 0.0, (
        gx, gy, gz,
        x + node[k, ROT] * ax + node[k, ROT + 1] * ay + node[k, ROT + 2] * az,
        y + node[k, ROT + 3] * ax + node[k, ROT + 4] * ay + node[k, ROT + 5] * az,
        z + node[k, ROT + 6] * ax + node[k, ROT + 7] * ay + node[k, ROT + 8] * az,
        x + node[k, ROT] * bx + node[k, ROT + 1] * by + node[k, ROT + 2] * bz,
        y + node[k, ROT + 3] * bx + node[k, ROT + 4] * by + node[k, ROT + 5] * bz,
        z + node[k, ROT + 6] * bx + node[k, ROT + 7] * by + node[k, ROT + 8] * bz,
    )  # fmt: skip


@jit
def _follow_in_strides(k, end, now, node, tol):
    """Move the string over rows k..end from where it ran to its present ends `now`; return the evaluations spent.

    A continuation: the surface alone is solved at every stride, from the solution of the one before.
    """
    known, old = _before(k, end, now, node)
    if not known:
        return 0
    a = math.sqrt((now[3] - old[3]) ** 2 + (now[4] - old[4]) ** 2 + (now[5] - old[5]) ** 2)
    b = math.sqrt((now[6] - old[6]) ** 2 + (now[7] - old[7]) ** 2 + (now[8] - old[8]) ** 2)
    count = math.ceil(min(MOST_STRIDES, max(a, b) / (STRIDE * node[k, SIZE])))
    spent = 0
    for i in range(1, count + 1):
        f = i / count
        g = 1.0 - f
        part = (
            now[0], now[1], now[2],
            g * old[3] + f * now[3], g * old[4] + f * now[4], g * old[5] + f * now[5],
            g * old[6] + f * now[6], g * old[7] + f * now[7], g * old[8] + f * now[8],
        )  # fmt: skip
        status, _, _, _, e = solve_active_set(k, end, part, node, tol, False)
        spent += e
        # the straight line of an end leads through the surface: what was found so far is worth nothing
        if status == lay.ENDPOINT_INSIDE:
            restore_solutions(k, end, now, node, W_START)
            break
    return spent


@deferred(types.int64, types.float64, types.float64, types.int64, types.int64)
def follow_large_move(lo, hi, ends, node, tol, direct, found):
    """Solve again, by continuation from before a large move; where that fails, from a cold start.

    found: the solve just done has found a path, which is kept where strides lead to none.
    """
    evaluations = 0
    restore_solutions(lo, hi, ends, node, W_OLD)
    save_solutions(lo, hi, node, W_START)
    for k in range(lo, hi):
        if not closed_form(k, node) and node[k, lay.TOUCH] == 0.0:
            end = surface_end(k, hi, node)
            evaluations += _follow_in_strides(k, end, ends_of_part(lo, hi, k, end, ends, node), node, tol)
    status, total, error, iterations, e = solve_active_set(lo, hi, ends, node, tol, direct)
    evaluations += e
    if not _is_found(status):
        if found:
            restore_solutions(lo, hi, ends, node, W_START)
        else:
            for k in range(lo, hi):
                node[k, S_MODE] = COLD
        status, total, error, i, e = solve_active_set(lo, hi, ends, node, tol, direct)
        iterations += i
        evaluations += e
    # `chain.solve_motion` reads this as: the extrapolated start was no good
    node[lo, lay.W_REPAIRS] += 1.0
    if status != lay.CONVERGED:
        for k in range(lo, hi):
            for j in range(lay.STATE):
                node[k, W_OLD + j] = node[k, W_START + j]
    return status, total, error, iterations, evaluations


@jit
def solve_span(lo, hi, ends, node, tol, direct):
    """Find the path from A to B over nodes lo..hi; return (status, length, ||f||, iterations, evaluations).

    ends = (base x, y, z, A x, y, z, B x, y, z), A and B relative to the base [m]. Starts from the saved solution and
    leaves the new one in its place; a path that is lost is searched for as at a cold start. With `direct` a lone
    obstacle is wrapped in closed form whatever is saved but its branch. Where an end lies inside a surface, length,
    error and saved solution are those of the substitute path (`end_inside.py`).
    """
    warm = not any_in_mode(lo, hi, node, COLD)
    if direct and warm and hi - lo == 1 and closed_form(lo, node):
        good, total, error = solve_lone_obstacle(lo, ends, node, tol)
        if good:
            return lay.CONVERGED, total, error, 0, 1
    # Newton's method writes the error of its very first evaluation there, by which `_moved_far` judges the start
    node[lo, W_FIRST] = -1.0
    status, total, error, iterations, evaluations = solve_active_set(lo, hi, ends, node, tol, direct)
    if _is_found(status) and not (warm and _moved_far(lo, hi, ends, node)):
        return status, total, error, iterations, evaluations
    if warm and status != lay.ENDPOINT_INSIDE:
        status, total, error, i, e = follow_large_move(lo, hi, ends, node, tol, direct, _is_found(status))
        iterations += i
        evaluations += e
    if status == lay.ENDPOINT_INSIDE:
        if warm:
            restore_solutions(lo, hi, ends, node, W_OLD)
        else:
            for k in range(lo, hi):
                node[k, S_MODE] = COLD
        total, error, i, e = substitute_path(lo, hi, ends, node, tol, direct)
        iterations += i
        evaluations += e
    return status, total, error, iterations, evaluations
