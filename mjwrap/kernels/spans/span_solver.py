"""Entry point for one span: warm start, continuation over large moves, cold start, end inside a surface (`solve_span`).

After a small move Newton's method starts from the saved solution. After a large move it could end on another side of a
surface than a continuous motion would. The saved solution says where the string ran relative to every surface, in the
surface's own frame: along the free segment, or along the tangents of the contact. So for each surface alone the ends of
the string are moved from there to their present places, in a straight line and in small steps, and the path is solved
at each step (continuation). The result is the side on which a slow motion would leave the string. Where this fails, the
path is searched for as at a cold start.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, jit
from mjwrap.kernels.geometry.projection import turn_into_frame
from mjwrap.kernels.geometry.traits import branched, closed_form, sided
from mjwrap.kernels.geometry.winding import TWO_PI, nearest_turn
from mjwrap.kernels.spans.active_set_method import solve_active_set
from mjwrap.kernels.spans.cold_start import ends_of_part
from mjwrap.kernels.spans.end_inside import NO_SUBSTITUTE, substitute_path
from mjwrap.kernels.spans.hinted_sides import meet_hints
from mjwrap.kernels.spans.lift_off_touchdown import remove_contact
from mjwrap.kernels.spans.lone_obstacle import solve_lone_obstacle
from mjwrap.kernels.spans.lost_spans import is_still_lost, mark_lost
from mjwrap.kernels.spans.saved_solutions import any_in_mode, restore_solutions, save_solutions, surface_end
from mjwrap.kernels.spans.sided_start import start_from_sides
from mjwrap.kernels.spans.span_ends import lies_on_surfaces
from mjwrap.kernels.wraps.sides import any_sided, forget

KIND, SIZE, POS, ROT = lay.KIND, lay.SIZE, lay.POS, lay.ROT
S_MODE, S_SWEEP, S_P, S_T = lay.S_MODE, lay.S_SWEEP, lay.S_P, lay.S_T
W_OLD, W_START, W_START_ERROR = lay.W_OLD, lay.W_START, lay.W_START_ERROR
LOST, COLD, FREE, TOUCHED = lay.LOST, lay.COLD, lay.FREE, lay.TOUCHED

# A move is large if one of these bounds is exceeded; lengths are shares of the surface's size.
FREE_MOVE = 0.25  # move of the ends of a free string
CONTACT_MOVE = 0.5  # move of a contact point on its surface
LARGE_ERROR = 0.1  # tangency error of the old contacts in the new pose, per obstacle
# a free string may also move by this share of its height over the surface, which it cannot have passed then
CLEARANCE_SHARE = 0.5
CONTINUATION_STEP = 0.05  # step of a string's ends in a continuation, as a share of the surface's size
MAX_CONTINUATION_STEPS = 100.0


@jit
def _is_found(status):
    """Return whether there is a path, or it is known that there is none on the present branch."""
    return status == lay.CONVERGED or status == lay.OUT_OF_RANGE or status == lay.NO_GEODESIC


@jit
def _any_hinted(lo, hi, node):
    """Return whether a row of several has a hint; a lone obstacle is wrapped with its hint between its own ends."""
    for k in range(lo, hi):
        if node[k, lay.HINT] > 0.0 and hi > surface_end(lo, hi, node):
            return True
    return False


@jit
def _free_string_moved_far(k, end, now, node):
    """Return whether a string that does not touch row k has moved so far that it may have passed through the surface.

    now: its present ends, as `ends` of a span. W_OLD holds its ends before, in S.
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
    # a string that runs high over the surface may move further
    clear = FREE_MOVE * node[k, SIZE]
    if not any_in_mode(k, end, node, TOUCHED):
        clear = max(clear, CLEARANCE_SHARE * node[k, lay.W_CLEARANCE])
    return known and max(a, b) > clear * clear


@jit
def _contact_moved_far(k, node):
    """Return whether the contact of row k has moved so far on its surface that it may be another one."""
    if node[k, W_OLD] != TOUCHED or node[k, S_MODE] != TOUCHED:
        return False
    i = W_OLD + S_P - S_MODE
    x, y, z = node[k, S_P] - node[k, i], node[k, S_P + 1] - node[k, i + 1], node[k, S_P + 2] - node[k, i + 2]
    return x * x + y * y + z * z > (CONTACT_MOVE * node[k, SIZE]) ** 2


@jit
def _moved_far(lo, hi, ends, node):
    """Return whether the path just found is so far from the one before that it may be on another side of a surface."""
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
    return follows and node[lo, W_START_ERROR] > LARGE_ERROR * LARGE_ERROR * (hi - lo)


@jit
def _previous_ends(k, end, now, node):
    """Return (whether they are known, the string's ends at rows k..end in the last solution, as `ends` of a span).

    They are fixed in the frame of the surface, so that they have moved with it. Rows k..end are those of one surface.
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
def _continue_to_present_ends(k, end, now, node, tol):
    """Move the string over rows k..end from its previous ends to its present ends `now`; return the evaluations.

    A continuation: the surface alone is solved at every step, from the solution of the step before.
    """
    known, old = _previous_ends(k, end, now, node)
    if not known:
        return 0
    a = math.sqrt((now[3] - old[3]) ** 2 + (now[4] - old[4]) ** 2 + (now[5] - old[5]) ** 2)
    b = math.sqrt((now[6] - old[6]) ** 2 + (now[7] - old[7]) ** 2 + (now[8] - old[8]) ** 2)
    count = math.ceil(min(MAX_CONTINUATION_STEPS, max(a, b) / (CONTINUATION_STEP * node[k, SIZE])))
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
        # the straight line of an end leads through the surface: the continuation has failed
        if status == lay.ENDPOINT_INSIDE:
            restore_solutions(k, end, now, node, W_START)
            break
    return spent


@jit
def _is_unwound(lo, hi, node):
    """Return whether a string that W_START had wound by more than a turn about a surface has lost a turn or more."""
    for k in range(lo, hi):
        before = node[k, W_START + S_SWEEP - S_MODE]
        if (
            branched(k, node)
            and node[k, lay.TOUCH] == 0.0
            and abs(before) > TWO_PI
            and abs(nearest_turn(node[k, S_SWEEP], before) - node[k, S_SWEEP]) > 1.0
        ):
            return True
    return False


@deferred(types.int64, types.float64, types.float64, types.int64, types.int64)
def solve_by_continuation(lo, hi, ends, node, tol, direct, found):
    """Solve again after a large move, by continuation from the last pose; where that fails, from a cold start.

    found: the solve before has found a path; where the continuation fails, the solution before the move is used again
    instead. A cold start that unwinds a string wound by more than a turn has not found its path (NO_GEODESIC).
    """
    evaluations = 0
    restore_solutions(lo, hi, ends, node, W_OLD)
    save_solutions(lo, hi, node, W_START)
    for k in range(lo, hi):
        if not closed_form(k, node) and node[k, lay.TOUCH] == 0.0:
            end = surface_end(k, hi, node)
            evaluations += _continue_to_present_ends(
                k, end, ends_of_part(lo, hi, k, end, ends, node), node, tol
            )
    status, total, error, iterations, e = solve_active_set(lo, hi, ends, node, tol, direct)
    evaluations += e
    if not _is_found(status):
        if found:
            restore_solutions(lo, hi, ends, node, W_START)
        else:  # without the contacts, but on the branch
            restore_solutions(lo, hi, ends, node, W_START)
            for k in range(lo, hi):
                remove_contact(k, node)
        status, total, error, i, e = solve_active_set(lo, hi, ends, node, tol, direct)
        iterations += i
        evaluations += e
    if not found and not _is_found(status):
        for k in range(lo, hi):
            node[k, S_MODE] = COLD
        status, total, error, i, e = solve_active_set(lo, hi, ends, node, tol, direct)
        iterations += i
        evaluations += e
        if status == lay.CONVERGED and _any_hinted(lo, hi, node):
            status, total, error, i, e = meet_hints(lo, hi, ends, node, tol, total, error, False)
            iterations += i
            evaluations += e
        if status == lay.CONVERGED and _is_unwound(lo, hi, node):
            status = lay.NO_GEODESIC
    # `chain.solve_motion` takes this as a sign that the extrapolated start was bad
    node[lo, lay.W_RESTARTS] += 1.0
    if status != lay.CONVERGED:
        for k in range(lo, hi):
            for j in range(lay.STATE):
                node[k, W_OLD + j] = node[k, W_START + j]
    return status, total, error, iterations, evaluations


@deferred(types.int64, types.float64, types.float64, types.int64, types.int64)
def _solve_without_hints(lo, hi, ends, node, tol, direct):
    """Search once more from a cold start that ignores the hints of surfaces without a closed form.

    On the allowed side of such a surface a path may be about to slip off, where no search ends.
    """
    forget(lo, hi, node)
    for k in range(lo, hi):
        if not closed_form(k, node):
            node[k, lay.HINT] = -abs(node[k, lay.HINT])
    return solve_active_set(lo, hi, ends, node, tol, direct)


@jit
def _straight_distance(ends):
    """Return the distance between the ends of a span [m]."""
    return math.sqrt((ends[6] - ends[3]) ** 2 + (ends[7] - ends[4]) ** 2 + (ends[8] - ends[5]) ** 2)


@jit
def solve_span(lo, hi, ends, node, tol, direct):
    """Find the path from A to B over nodes lo..hi; return (status, length, ||f||, iterations, evaluations).

    ends = (base x, y, z, A x, y, z, B x, y, z), A and B relative to the base [m]. Starts from the saved solution and
    replaces it by the new one; a path that is lost is searched for as at a cold start. With `direct` a lone obstacle is
    wrapped in closed form; of its saved solution only the branch is used. Of a span whose sides all hold at every pose
    nothing saved is used. Where an end lies inside a surface, length, error and saved solution are those of the
    substitute path (`end_inside.py`), which is the path where the end is as little inside as a rounded number may put
    it. Where a search has found neither of them, the next searches near by are left out (`lost_spans.py`).
    """
    if any_in_mode(lo, hi, node, LOST):
        if is_still_lost(lo, hi, ends, node):
            return lay.ENDPOINT_INSIDE, _straight_distance(ends), NO_SUBSTITUTE, 0, 0
        forget(lo, hi, node)
    warm = not any_in_mode(lo, hi, node, COLD)
    if warm and hi - lo == 1 and closed_form(lo, node) and (direct or sided(lo, node)):
        good, total, error = solve_lone_obstacle(lo, ends, node, tol)
        if good:
            return lay.CONVERGED, total, error, 0, 1
    # a side that holds at every pose: the path must not depend on the one before
    held = any_sided(lo, hi, node)
    if held and start_from_sides(lo, hi, ends, node):
        warm = False
    # Newton's method writes the error of its first evaluation here; `_moved_far` reads it
    node[lo, W_START_ERROR] = -1.0
    status, total, error, iterations, evaluations = solve_active_set(lo, hi, ends, node, tol, direct)
    if not warm and status == lay.CONVERGED and _any_hinted(lo, hi, node):
        status, total, error, i, e = meet_hints(lo, hi, ends, node, tol, total, error, False)
        return status, total, error, iterations + i, evaluations + e
    if _is_found(status) and not (warm and _moved_far(lo, hi, ends, node)):
        if held and warm and status == lay.CONVERGED:
            status, total, error, i, e = meet_hints(lo, hi, ends, node, tol, total, error, True)
            return status, total, error, iterations + i, evaluations + e
        return status, total, error, iterations, evaluations
    if warm and status != lay.ENDPOINT_INSIDE:
        status, total, error, i, e = solve_by_continuation(lo, hi, ends, node, tol, direct, _is_found(status))
        iterations += i
        evaluations += e
        if held and status == lay.CONVERGED:
            status, total, error, i, e = meet_hints(lo, hi, ends, node, tol, total, error, True)
            iterations += i
            evaluations += e
    if held and not warm and (status == lay.NOT_CONVERGED or status == lay.NOT_MINIMAL):
        status, total, error, i, e = _solve_without_hints(lo, hi, ends, node, tol, direct)
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
        if error <= tol and lies_on_surfaces(lo, hi, ends, node):
            status = lay.CONVERGED
        elif not warm and evaluations > 0 and error >= NO_SUBSTITUTE:
            mark_lost(lo, hi, ends, node)
    return status, total, error, iterations, evaluations
