"""One span: the path between two fixed points over a row of obstacles, found and certified.

Which obstacles are touched is part of the answer (method section 4): Newton's method runs on the touched ones, those
whose arc would be negative are dropped, those that a straight segment enters are taken in, until nothing changes.
Where that fails, and at a cold start, obstacle after obstacle is wrapped in closed form between its neighbours'
contact points (each such wrap shortens the path), and Newton's method polishes the result.
"""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit
from mjwrap.kernels.certify import minimal, swept
from mjwrap.kernels.direct import A_INSIDE, B_INSIDE, follow, holds, wrap
from mjwrap.kernels.geodesics import geodesic
from mjwrap.kernels.newton import newton
from mjwrap.kernels.relax import path_length, relax, shorten

KIND = lay.KIND
S_MODE, S_SWEEP, S_ARC = lay.S_MODE, lay.S_SWEEP, lay.S_ARC
W_P, W_Q, W_OLD = lay.W_P, lay.W_Q, lay.W_OLD
COLD, FREE, TOUCHED = lay.COLD, lay.FREE, lay.TOUCHED

MAX_NEWTON = 25
MAX_ROUNDS = 50  # changes of the set of touched obstacles, repairs included
MAX_REPAIRS = 4
COLD_PASSES = 3  # of obstacle-by-obstacle wrapping before Newton's method is tried
REPAIR_PASSES = 7  # the first repair; further ones take about four times as many each
CALM = 4  # changes of the set of touched obstacles, beyond one for each, that count as going round in circles


@jit
def _any(lo, hi, node, mode):
    """Return whether a node of lo..hi is in the given mode."""
    for k in range(lo, hi):
        if node[k, S_MODE] == mode:
            return True
    return False


@jit
def _remember(lo, hi, node):
    for k in range(lo, hi):
        for i in range(lay.STATE):
            node[k, W_OLD + i] = node[k, S_MODE + i]


@jit
def _restore(lo, hi, ends, node):
    for k in range(lo, hi):
        for i in range(lay.STATE):
            node[k, S_MODE + i] = node[k, W_OLD + i]
        if node[k, S_MODE] == TOUCHED:
            geodesic(k, node, ends[0], ends[1], ends[2])


@jit
def _follow_branch(lo, hi, node):
    """Note how far the path sweeps about every cylinder; return False where that is not the way it went before."""
    same = True
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED and node[k, KIND] == lay.CYLINDER:
            angle = swept(k, node)
            if abs(angle - follow(angle, node[k, S_SWEEP])) > 1.0:
                same = False
            else:
                node[k, S_SWEEP] = angle
    return same


@jit
def _drop(lo, hi, node):
    """Release the obstacles whose arc is negative; return how many."""
    dropped = 0
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED and node[k, S_ARC] < 0.0:
            node[k, S_MODE] = FREE
            node[k, S_ARC] = 0.0
            dropped += 1
    return dropped


@jit
def _take_in(lo, hi, ends, node):
    """Take in the obstacles that a straight segment enters; return how many, and the status that forbids a path."""
    x, y, z = ends[3], ends[4], ends[5]
    added = 0
    status = lay.CONVERGED
    before = -1
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED:
            x, y, z = node[k, W_Q], node[k, W_Q + 1], node[k, W_Q + 2]
            before = k
            continue
        qx, qy, qz = ends[6], ends[7], ends[8]
        after = -1
        for j in range(k + 1, hi):
            if node[j, S_MODE] == TOUCHED:
                qx, qy, qz = node[j, W_P], node[j, W_P + 1], node[j, W_P + 2]
                after = j
                break
        held = wrap(k, node, ends[0], ends[1], ends[2], x, y, z, qx, qy, qz)
        if held != 0:
            if (held & A_INSIDE and before < 0) or (held & B_INSIDE and after < 0):
                status = lay.ENDPOINT_INSIDE
            elif status == lay.CONVERGED:
                status = lay.PENETRATING
        if node[k, S_MODE] == TOUCHED:
            geodesic(k, node, ends[0], ends[1], ends[2])
            x, y, z = node[k, W_Q], node[k, W_Q + 1], node[k, W_Q + 2]
            before = k
            added += 1
    return added, status


@jit
def _end_inside(lo, hi, ends, node):
    """Return whether A or B lies inside an obstacle of the span."""
    for k in range(lo, hi):
        if holds(k, node, ends[0] + ends[3], ends[1] + ends[4], ends[2] + ends[5]):
            return True
        if holds(k, node, ends[0] + ends[6], ends[1] + ends[7], ends[2] + ends[8]):
            return True
    return False


@jit
def solve_span(lo, hi, ends, node, tol, direct):
    """Find the path from A to B over nodes lo..hi; return (status, length, ||f||, iterations, evaluations).

    ends = (base x, y, z, A x, y, z, B x, y, z), A and B relative to the base [m]. Starts from the saved solution and
    leaves the new one in its place. With `direct` a single obstacle is wrapped in closed form whatever is saved but
    its branch.
    """
    iterations, evaluations, repairs = 0, 0, 0
    error = 0.0
    status = lay.CONVERGED
    cold = _any(lo, hi, node, COLD)
    if cold or (direct and hi - lo == 1):
        passes = COLD_PASSES if hi - lo > 1 else 1
        evaluations += relax(lo, hi, ends, node, passes)
        if cold and hi - lo > 1:
            evaluations += shorten(lo, hi, ends, node, COLD_PASSES)
    _remember(lo, hi, node)
    settled = False
    changes = 0
    for _ in range(MAX_ROUNDS):
        good = True
        error = 0.0
        if _any(lo, hi, node, TOUCHED):
            error, i, e = newton(lo, hi, ends, node, tol, MAX_NEWTON)
            iterations += i
            evaluations += e
            good = error <= tol and _follow_branch(lo, hi, node)
        if good and minimal(lo, hi, node):
            dropped = _drop(lo, hi, node)
            added, status = _take_in(lo, hi, ends, node)
            if dropped + added == 0:
                settled = True
                break
            changes += 1
            if changes <= hi - lo + CALM:
                continue
        if repairs == MAX_REPAIRS:
            status = lay.NOT_MINIMAL if good and changes == 0 else lay.NOT_CONVERGED
            break
        if repairs == 0:
            _restore(lo, hi, ends, node)
        passes = REPAIR_PASSES + repairs if hi - lo > 1 else 1
        evaluations += relax(lo, hi, ends, node, passes << 2 * repairs)
        repairs += 1
        changes = 0
    if not settled and status != lay.NOT_MINIMAL:
        _, status = _take_in(lo, hi, ends, node)
        if _end_inside(lo, hi, ends, node):
            status = lay.ENDPOINT_INSIDE
        elif status == lay.CONVERGED:
            status = lay.NOT_CONVERGED
    total = path_length(lo, hi, ends, node)
    return status, total, error, iterations, evaluations
