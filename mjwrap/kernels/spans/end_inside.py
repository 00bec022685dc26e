"""Where an end lies inside a surface: what stands in for the path that does not exist, and its gradient.

A string cannot leave a point inside a surface. So that length and force follow the bodies all the same, its
end A is taken to F, the surface's nearest point, and what lies between them is not counted: the length is
that of the path from F. Across the surface length and gradient are continuous: a string that wraps leaves
along the tangent t, and to first order F moves as A does, but for the normal, which makes no difference. A
string that leaves F at once has a component along the normal. From the surface on, the straight way through,
which ignores that surface, is longer than the one from F, and goes on from the path outside without a kink;
it is longer for as long as the string leaves F at once. So the longest of these ways stands in. The gradient
has a kink, of the order of the depth, where one way takes over.

With W the shape operator at F and h < 0 the height of A, A = F + h n moves by (I + h W) dF along the surface, so the
gradient with respect to A is -(I + h W)^-1 t. As a pull e it acts between A's body and the surface's at A itself. It
grows without bounds towards where F is no longer the only nearest point, an axis or a centre, so no deeper than half
the way there the way from F stands in.

Nothing stands in on a surface whose wraps have to be searched for: an ellipsoid, a capsule, a torus, a user's own.
There the way from one foot was found on another side than that from the next, in some of 10,000 small steps, and with
both ends inside one capsule in many.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import apart, inlined, jit
from mjwrap.kernels.geometry.projection import into_frame
from mjwrap.kernels.geometry.table import nearest
from mjwrap.kernels.geometry.traits import closed_form
from mjwrap.kernels.solved.segments import G_A, G_B, G_E, G_FAR, G_NEAR, list_segments
from mjwrap.kernels.spans.cold_start import keep
from mjwrap.kernels.spans.span import last_row, settle, take_back
from mjwrap.kernels.tangency.newton import ON_SURFACE
from mjwrap.kernels.wraps.single import holds

KIND, POS, ROT, S_MODE = lay.KIND, lay.POS, lay.ROT, lay.S_MODE
NOWHERE = 1e300  # the tangency error where nothing stands in
DEEPEST = 0.5  # least eigenvalue of I + h W: how deep an end may be below a surface on which it wraps


@jit
def _foot(k, ends, column, node):
    """Return obstacle k's surface point nearest to an end inside it; both relative to the base."""
    x, y, z = into_frame(
        node, k, ends[0] + ends[column], ends[1] + ends[column + 1], ends[2] + ends[column + 2]
    )
    x, y, z = nearest(node, k, x, y, z)
    return (
        node[k, POS] + node[k, ROT] * x + node[k, ROT + 1] * y + node[k, ROT + 2] * z - ends[0],
        node[k, POS + 1] + node[k, ROT + 3] * x + node[k, ROT + 4] * y + node[k, ROT + 5] * z - ends[1],
        node[k, POS + 2] + node[k, ROT + 6] * x + node[k, ROT + 7] * y + node[k, ROT + 8] * z - ends[2],
    )


@jit
def _holder(lo, hi, ends, column, node):
    """Return the first obstacle that holds an end of the span, or -1."""
    for k in range(lo, hi):
        if holds(k, node, ends[0] + ends[column], ends[1] + ends[column + 1], ends[2] + ends[column + 2]):
            return k
    return -1


@jit
def _contacts(lo, hi, node):
    """Return the first and the last touched row, -1 where there is none."""
    first, last = -1, -1
    for k in range(lo, hi):
        if node[k, S_MODE] == lay.TOUCHED:
            first = k if first < 0 else first
            last = k
    return first, last


@jit
def _too_deep(k, point, normal, curvature, ends, column, node):
    """Return whether an end is too far below the contact of row k on which the path begins, or ends."""
    h = 0.0
    for i in range(3):
        h += node[k, normal + i] * (ends[column + i] - node[k, point + i])
    kappa, tau, beta = node[k, curvature], node[k, curvature + 1], node[k, curvature + 2]
    largest = 0.5 * (kappa + beta) + math.sqrt(0.25 * (kappa - beta) ** 2 + tau * tau)
    return 1.0 + h * largest < DEEPEST


@jit
def _free(lo, hi, node):
    """Take the string off rows lo..hi; the sides that they keep stay."""
    for k in range(lo, hi):
        node[k, S_MODE] = lay.FREE
        for i in range(lay.S_P - S_MODE, lay.STATE):
            node[k, S_MODE + i] = 0.0


@apart
def stand_in(lo, hi, ends, node, tol, direct):
    """Find what stands in for the path of a span with an end inside; return (length, error, iterations, evaluations).

    ends, tol and direct as in `jumps.solve_span`. The error is NOWHERE where nothing stands in. The saved solution is
    that of the way that stands in, but for the surfaces that it ignores, which keep the sides of the way from F.
    """
    a, b = _holder(lo, hi, ends, 3, node), _holder(lo, hi, ends, 6, node)
    gx, gy, gz, ax, ay, az, bx, by, bz = ends
    px, py, pz, qx, qy, qz = ax, ay, az, bx, by, bz
    if a >= 0:
        px, py, pz = _foot(a, ends, 3, node)
    if b >= 0:
        qx, qy, qz = _foot(b, ends, 6, node)
    feet = (gx, gy, gz, px, py, pz, qx, qy, qz)
    status, best, error, iterations, evaluations = settle(lo, hi, feet, node, tol, direct)
    behind = last_row(a, hi, node) if a >= 0 else lo
    k, j = _contacts(lo, hi, node)
    leaves_a, leaves_b = a >= 0 and not a <= k < behind, b >= 0 and j < b
    # a search may find another wrap from one foot than from the next
    good = (a < 0 or closed_form(a, node)) and (b < 0 or closed_form(b, node))
    good = good and (not leaves_a or a == lo)  # only the surface next to an end can be ignored
    good = good and (not leaves_b or last_row(b, hi, node) == hi)
    # one that leaves the foot and meets the same surface again, behind a hollow, is none of the ways that are known
    good = good and (a < 0 or leaves_a or node[k, lay.W_L] <= ON_SURFACE * node[k, lay.SIZE])
    good = good and (b < 0 or leaves_b or node[j, lay.W_LQ] <= ON_SURFACE * node[j, lay.SIZE])
    if status != lay.CONVERGED or not good:
        return best, NOWHERE, iterations, evaluations
    keep(lo, hi, node, lay.W_START, False)
    for choice in range(1, 4):
        over_a, over_b = choice % 2 == 1, choice >= 2
        if (over_a and a != lo) or (over_b and (b < 0 or last_row(b, hi, node) != hi)):
            continue
        if a == b and choice < 3:
            continue
        first, last = behind if over_a else lo, b if over_b else hi
        last = max(first, last)
        sx, sy, sz, tx, ty, tz = px, py, pz, qx, qy, qz
        if over_a:
            sx, sy, sz = ax, ay, az
        if over_b:
            tx, ty, tz = bx, by, bz
        length, off = math.sqrt((tx - sx) ** 2 + (ty - sy) ** 2 + (tz - sz) ** 2), 0.0
        if first < last:
            part = (gx, gy, gz, sx, sy, sz, tx, ty, tz)
            status, length, off, i, e = settle(first, last, part, node, tol, direct)
            iterations += i
            evaluations += e
        if status != lay.CONVERGED and ((over_a and leaves_a) or (over_b and leaves_b)):
            return best, NOWHERE, iterations, evaluations
        if status == lay.CONVERGED and length > best:
            _free(lo, first, node)
            _free(last, hi, node)
            keep(lo, hi, node, lay.W_START, False)
            best, error = length, off
        status = lay.CONVERGED
    take_back(lo, hi, ends, node)
    k, j = _contacts(lo, hi, node)
    if a >= 0 and a <= k < behind and _too_deep(k, lay.W_P, lay.W_NP, lay.W_KP, ends, 3, node):
        error = NOWHERE
    if b >= 0 and j >= b and _too_deep(j, lay.W_Q, lay.W_NQ, lay.W_KQ, ends, 6, node):
        error = NOWHERE
    return best, error, iterations, evaluations


@inlined
def has_length(status, error):
    """Return whether a path was found, or something stands in for it, from the status and error in `info`."""
    return status == lay.CONVERGED or (status == lay.ENDPOINT_INSIDE and error < NOWHERE)


@jit
def _pull(j, k, point, tangent, normal, binormal, curvature, end, node, base, seg):
    """Let segment j pull between the surface and its end, at the end: e = (I + h W)^-1 t."""
    h = 0.0
    for i in range(3):
        h += node[k, normal + i] * (seg[j, end + i] - base[i] - node[k, point + i])
    kappa, tau, beta = node[k, curvature], node[k, curvature + 1], node[k, curvature + 2]
    over = 1.0 / ((1.0 + h * kappa) * (1.0 + h * beta) - h * h * tau * tau)
    along, aside = (1.0 + h * beta) * over, -h * tau * over
    for i in range(3):
        seg[j, G_E + i] = along * node[k, tangent + i] + aside * node[k, binormal + i]
        seg[j, G_A + i + G_B - end] = seg[j, end + i]


@jit
def list_standing(lo, hi, ox, oy, oz, ix, iy, iz, node, seg, first):
    """Do `list_segments` for what stands in where ends lie inside: a segment at such an end has no length, but pulls.

    Its vector e is not a unit vector: it is what the length loses as the end moves, see the head of this file.
    """
    count = list_segments(lo, hi, ox, oy, oz, ix, iy, iz, node, seg, first)
    base = (ox, oy, oz)
    for j in range(first, first + count):
        near, far = int(seg[j, G_NEAR]), int(seg[j, G_FAR])
        from_surface = lo <= near and node[near, KIND] != lay.VIA
        to_surface = far < hi and node[far, KIND] != lay.VIA
        a, b, c = seg[j, G_A], seg[j, G_A + 1], seg[j, G_A + 2]
        if to_surface and not from_surface and node[far, lay.INSIDE] == 0.0 and holds(far, node, a, b, c):
            _pull(j, far, lay.W_P, lay.W_TP, lay.W_NP, lay.W_BP, lay.W_KP, G_A, node, base, seg)
        a, b, c = seg[j, G_B], seg[j, G_B + 1], seg[j, G_B + 2]
        if from_surface and not to_surface and node[near, lay.INSIDE] == 0.0 and holds(near, node, a, b, c):
            _pull(j, near, lay.W_Q, lay.W_TQ, lay.W_NQ, lay.W_BQ, lay.W_KQ, G_B, node, base, seg)
    return count
