"""One span: the path between two fixed points over a row of obstacles, found and certified.

Which obstacles are touched is part of the answer (method section 4): Newton's method runs on the touched ones, those
whose arc would be negative are dropped, those that a straight segment enters are taken in, until nothing changes.
Where that fails, and at a cold start, obstacle after obstacle is wrapped by itself between its neighbours'
contact points (each such wrap shortens the path), and Newton's method polishes the result.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import apart, jit
from mjwrap.kernels.geometry.geodesics import displace, geodesic
from mjwrap.kernels.geometry.traits import branched, closed_form, one_sided
from mjwrap.kernels.spans.active_set import (
    MEETING,
    MET,
    drop,
    follow_branch,
    in_range,
    join,
    split,
    take_in,
)
from mjwrap.kernels.spans.cold_start import keep, path_length, relax
from mjwrap.kernels.spans.side_search import search_rows, shorten
from mjwrap.kernels.tangency.certify import minimal, slip
from mjwrap.kernels.tangency.newton import GEODESICS, ON_SURFACE, UNKNOWN, connect, newton
from mjwrap.kernels.wraps.single import holds, wrap

HINT, S_MODE, W_OLD, W_Y, W_FRESH = lay.HINT, lay.S_MODE, lay.W_OLD, lay.W_Y, lay.W_FRESH
COLD, TOUCHED = lay.COLD, lay.TOUCHED

MAX_NEWTON = 25
MAX_ROUNDS = 50  # changes of the set of touched obstacles, repairs included
MAX_REPAIRS = 4
COLD_PASSES = 3  # of obstacle-by-obstacle wrapping before Newton's method is tried
REPAIR_PASSES = 7  # the first repair; further ones take about twice as many each
AFRESH = 2  # repairs after which the search begins anew
KICK = 0.3  # off a saddle, in radii
CALM = 4  # changes of the set of touched obstacles, beyond one for each, that count as going round in circles


@jit
def any_in(lo, hi, node, mode):
    """Return whether a node of lo..hi is in the given mode."""
    for k in range(lo, hi):
        if node[k, S_MODE] == mode:
            return True
    return False


@jit
def _passes(lo, hi, node):
    """Return how often a cold start wraps obstacle after obstacle: once where a wrap is a search.

    Newton's method on all of them takes as many steps from there as after a second pass, which costs more than one.
    """
    if hi - lo == 1:
        return 1
    for k in range(lo, hi):
        if not closed_form(k, node):
            return COLD_PASSES - 1
    return COLD_PASSES


@jit
def _all_hinted(lo, hi, node):
    """Return whether hints choose the side of every obstacle."""
    for k in range(lo, hi):
        if node[k, HINT] <= 0.0 and node[k, lay.TOUCH] == 0.0 and not one_sided(k, node):
            return False
    return True


@jit
def _remember(lo, hi, node):
    for k in range(lo, hi):
        for i in range(lay.STATE):
            node[k, W_OLD + i] = node[k, S_MODE + i]


@jit
def restore(lo, hi, ends, node):
    for k in range(lo, hi):
        for i in range(lay.STATE):
            node[k, S_MODE + i] = node[k, W_OLD + i]
        if node[k, S_MODE] == TOUCHED:
            geodesic(k, node, ends[0], ends[1], ends[2])


@jit
def _start_afresh(lo, hi, cold, node):
    """Forget what was found and ignore the hints: they may ask for a side on which no string holds.

    A warm start keeps its topological sides; what it loses is a minimum that has ceased to exist.
    """
    for k in range(lo, hi):
        if cold or not branched(k, node):
            node[k, S_MODE] = COLD
            node[k, HINT] = -abs(node[k, HINT])


@jit
def _slip_off(lo, hi, ends, node, sign):
    """Move a path that is a saddle of length a little down the side on which a string would slip.

    The obstacles behind the last one moved follow first: wraps in order from the origin on would undo the move.
    """
    failed = slip(lo, hi, node, KICK)
    if failed < 0:
        return
    for k in range(lo, failed + 1):
        if node[k, S_MODE] == TOUCHED:
            displace(k, 0.0, sign * node[k, W_Y + 1], sign * node[k, W_Y + 2], 0.0, node)
            geodesic(k, node, ends[0], ends[1], ends[2])
    q = lay.W_Q
    ends = (
        ends[0], ends[1], ends[2], node[failed, q], node[failed, q + 1], node[failed, q + 2],
        ends[6], ends[7], ends[8],
    )  # fmt: skip
    relax(failed + 1, hi, ends, node, 1, False)


@jit
def last_row(k, hi, node):
    """Return the row behind the last one of row k's surface."""
    k += 1
    while k < hi and node[k, lay.TOUCH] > 0.0:
        k += 1
    return k


@jit
def take_back(lo, hi, ends, node):
    """Go back to the solutions that W_START holds."""
    keep(lo, hi, node, lay.W_START, True)
    for j in range(lo, hi):
        if node[j, S_MODE] == TOUCHED:
            geodesic(j, node, ends[0], ends[1], ends[2])


@jit
def _end_inside(lo, hi, ends, node):
    """Return whether an end of the span lies inside an obstacle."""
    x, y, z = ends[0], ends[1], ends[2]
    for k in range(lo, hi):
        if holds(k, node, x + ends[3], y + ends[4], z + ends[5]):
            return True
        if holds(k, node, x + ends[6], y + ends[7], z + ends[8]):
            return True
    return False


@jit
def _ends_short(lo, hi, node):
    """Return whether the path's first or last straight segment is so short that the end may lie inside the surface."""
    last = -1
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED:
            if last < 0 and node[k, lay.W_L] <= ON_SURFACE * node[k, lay.SIZE]:
                return True
            last = k
    return last >= 0 and node[last, lay.W_LQ] <= ON_SURFACE * node[last, lay.SIZE]


@jit
def wrap_lone(k, ends, node, tol):
    """Find the path over obstacle k alone, whose wrap has a closed form, on its saved branch.

    Returns whether it is certified as `settle` certifies it, its length [m] and ||f||; the saved solution stays as it
    was where it is not.
    """
    hi = k + 1
    _remember(k, hi, node)
    good = (
        wrap(k, node, ends[0], ends[1], ends[2], ends[3], ends[4], ends[5], ends[6], ends[7], ends[8], False)
        == 0
    )
    error = 0.0
    if node[k, S_MODE] == TOUCHED:
        error = math.sqrt(connect(k, hi, ends, node))
        good = good and error <= tol and not _ends_short(k, hi, node)
        good = good and follow_branch(k, hi, node) and minimal(k, hi, node) and in_range(k, hi, ends, node)
        node[k, lay.S_BEFORE] = node[k, lay.W_L]
        node[k, lay.S_BEFORE + 1] = node[k, lay.W_LQ]
    total = path_length(k, hi, ends, node)
    if not good:
        for i in range(lay.STATE):
            node[k, S_MODE + i] = node[k, W_OLD + i]
    node[k, lay.W_REPAIRS] = 0.0
    return good, total, error


@apart
def settle(lo, hi, ends, node, tol, direct):
    """Find the path as `solve_span` says, from the saved solution alone, for ends that lie outside of every surface."""
    iterations, evaluations, repairs = 0, 0, 0
    error = 0.0
    status = lay.CONVERGED
    cold = any_in(lo, hi, node, COLD)
    if not cold:
        _remember(lo, hi, node)
    if cold and hi - lo > 1 and not _all_hinted(lo, hi, node):
        evaluations += search_rows(lo, hi, ends, node, COLD_PASSES)
    elif cold or (direct and hi - lo == 1):
        evaluations += relax(lo, hi, ends, node, _passes(lo, hi, node), False)
        if cold and hi - lo == 1 and closed_form(lo, node):
            evaluations += shorten(lo, hi, ends, node, 1)
    if cold:
        _remember(lo, hi, node)
    fresh = GEODESICS if cold or (direct and hi - lo == 1) else UNKNOWN
    if cold and hi - lo == 1 and node[lo, W_FRESH] >= 0.0 and not closed_form(lo, node):
        fresh = node[lo, W_FRESH]
    settled = False
    changes = 0
    for _ in range(MAX_ROUNDS):
        good = True
        error = 0.0
        if any_in(lo, hi, node, TOUCHED):
            error, i, e = newton(lo, hi, ends, node, tol, MAX_NEWTON, fresh)
            fresh = GEODESICS
            iterations += i
            evaluations += e
            good = error <= tol and follow_branch(lo, hi, node)
        if good and minimal(lo, hi, node):
            dropped = drop(lo, hi, node) + join(lo, hi, ends, node, MET)
            added, status = take_in(lo, hi, ends, node)
            if dropped + added == 0:
                settled = True
                break
            changes += 1
            if changes <= hi - lo + CALM:
                continue
        elif (good and split(lo, hi, ends, node) > 0) or (not good and join(lo, hi, ends, node, MEETING) > 0):
            changes += 1
            if changes <= hi - lo + CALM:
                continue
        if repairs == MAX_REPAIRS or (hi - lo == 1 and repairs == 1):
            status = lay.NOT_MINIMAL if good and changes == 0 else lay.NOT_CONVERGED
            break
        saddle = good and changes == 0
        if repairs == 0 and not saddle:
            restore(lo, hi, ends, node)
        if repairs == AFRESH:
            _start_afresh(lo, hi, cold, node)
        elif saddle:
            _slip_off(lo, hi, ends, node, 1.0 if repairs % 2 == 0 else -1.0)
        passes = (REPAIR_PASSES + repairs) << repairs if hi - lo > 1 else 1
        evaluations += relax(lo, hi, ends, node, passes, False)
        repairs += 1
        changes = 0
    if not settled:
        if _end_inside(lo, hi, ends, node):
            status = lay.ENDPOINT_INSIDE
        elif status != lay.NOT_MINIMAL:
            _, status = take_in(lo, hi, ends, node)
            if status == lay.CONVERGED:
                status = lay.NOT_CONVERGED
    elif (
        status == lay.PENETRATING or (status == lay.CONVERGED and _ends_short(lo, hi, node))
    ) and _end_inside(lo, hi, ends, node):
        status = lay.ENDPOINT_INSIDE
    elif status == lay.CONVERGED and not in_range(lo, hi, ends, node):
        status = lay.OUT_OF_RANGE
    node[lo, lay.W_REPAIRS] = repairs
    for k in range(lo, hi):
        node[k, HINT] = abs(node[k, HINT])
        if settled and node[k, S_MODE] == TOUCHED:
            node[k, lay.S_BEFORE] = node[k, lay.W_L]
            node[k, lay.S_BEFORE + 1] = node[k, lay.W_LQ]
    total = path_length(lo, hi, ends, node)
    if not math.isfinite(error):
        status = lay.NOT_CONVERGED
    return status, total, error, iterations, evaluations
