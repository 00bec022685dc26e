"""The substitute path of a span with an end inside a surface, where no string can lie, and its gradient.

Length and force have to follow the bodies nevertheless. So the end A is replaced by F, the nearest point of the
surface; the distance between A and F is not counted, and the length is that of the path from F. Length and gradient are
continuous as A passes through the surface: a string that wraps leaves F along the tangent t, and to first order F moves
as A does, except along the normal, which is perpendicular to t.

A string that leaves F without touching the surface has a component along the normal. Then the straight path from A that
ignores this surface is longer than the path from F, and continues the path outside without a kink. So the longest of
these paths is taken. The gradient has a kink, of the order of the depth, where another path becomes the longest.

Let W be the shape operator at F and h < 0 the height of A. Along the surface, A = F + h n moves by (I + h W) dF, so
that the gradient with respect to A is -(I + h W)^-1 t. As a force e it acts between A's body and the surface's body, at
A. It grows without bound at an axis or a centre, and F jumps where another surface point gets nearer; so the path from
F is used down to half of that depth only.

An end that is as little inside as a number written with six digits may put it (AS_WRITTEN) lies on the surface: its
substitute path is the path, and its status CONVERGED.

Deeper inside there is no substitute with both ends inside one surface whose wraps have to be searched for (ellipsoid,
capsule, torus, user's surface): there the length jumped at 16 of 62,000 small steps, at some of them to a longer path.
See "An end inside a surface" in docs/derivation.md.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, from_python, jit
from mjwrap.kernels.geometry.dispatch import nearest
from mjwrap.kernels.geometry.projection import into_frame
from mjwrap.kernels.geometry.traits import closed_form
from mjwrap.kernels.solved.segments import G_A, G_B, G_FAR, G_NEAR, list_segments, set_pull_at_end
from mjwrap.kernels.spans.active_set_method import solve_active_set
from mjwrap.kernels.spans.saved_solutions import restore_solutions, save_solutions, surface_end
from mjwrap.kernels.spans.span_ends import lies_on_surfaces
from mjwrap.kernels.tangency.tangency_error import ON_SURFACE
from mjwrap.kernels.wraps.single import contains

KIND, POS, ROT, S_MODE = lay.KIND, lay.POS, lay.ROT, lay.S_MODE
NO_SUBSTITUTE = 1e300  # the tangency error where there is no substitute path
# smallest eigenvalue of I + h W: bounds the depth of an end whose string wraps the surface
LEAST_EIGENVALUE = 0.5


@jit
def _nearest_surface_point(k, ends, column, node):
    """Return F, obstacle k's surface point nearest to an end inside it; both relative to the base."""
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
def _containing_obstacle(lo, hi, ends, column, node):
    """Return the first obstacle inside which an end of the span lies, or -1."""
    for k in range(lo, hi):
        if contains(k, node, ends[0] + ends[column], ends[1] + ends[column + 1], ends[2] + ends[column + 2]):
            return k
    return -1


@jit
def _first_and_last_contact(lo, hi, node):
    """Return the first and the last touched row, -1 where there is none."""
    first, last = -1, -1
    for k in range(lo, hi):
        if node[k, S_MODE] == lay.TOUCHED:
            first = k if first < 0 else first
            last = k
    return first, last


@jit
def _is_too_deep(k, point, normal, curvature, ends, column, node):
    """Return whether an end is too deep below the contact of row k at which the path begins or ends.

    The smallest eigenvalue of I + h W decides: where it is zero the gradient is infinite.
    """
    h = 0.0
    for i in range(3):
        h += node[k, normal + i] * (ends[column + i] - node[k, point + i])
    kappa, tau, beta = node[k, curvature], node[k, curvature + 1], node[k, curvature + 2]
    largest = 0.5 * (kappa + beta) + math.sqrt(0.25 * (kappa - beta) ** 2 + tau * tau)
    return 1.0 + h * largest < LEAST_EIGENVALUE


@jit
def _is_past_half_way(k, ends, column, node):
    """Return whether an end lies deeper inside obstacle k than half way to where another surface point gets nearer.

    Twice as deep, straight below the nearest point of the end, that point is not the nearest one any more.
    """
    x, y, z = into_frame(
        node, k, ends[0] + ends[column], ends[1] + ends[column + 1], ends[2] + ends[column + 2]
    )
    px, py, pz = nearest(node, k, x, y, z)
    dx, dy, dz = 2.0 * (x - px), 2.0 * (y - py), 2.0 * (z - pz)
    x, y, z = px + dx, py + dy, pz + dz
    qx, qy, qz = nearest(node, k, x, y, z)
    far = (x - qx) ** 2 + (y - qy) ** 2 + (z - qz) ** 2
    return far < (dx * dx + dy * dy + dz * dz) * (1.0 - 1e-9)


@jit
def _has_no_substitute(lo, hi, a, b, ends, node):
    """Return whether it is known before any search that there is no substitute path.

    a, b: the obstacles inside which the ends lie, -1 where an end is outside of all.
    """
    # with both ends inside one surface a search may find another wrap from these nearest points than from the last ones
    if a >= 0 and a == b and not closed_form(a, node):
        return True
    # an end inside a surface that is not next to it: the path has to touch that surface, and to be its path from F
    if a > lo and _is_past_half_way(a, ends, 3, node):
        return True
    return b >= 0 and surface_end(b, hi, node) != hi and _is_past_half_way(b, ends, 6, node)


@jit
def _holds_an_end(lo, before, after, hi, ends, node):
    """Return whether an obstacle of lo..before contains the first end, or one of after..hi the last one."""
    return (
        _containing_obstacle(lo, before, ends, 3, node) >= 0
        or _containing_obstacle(after, hi, ends, 6, node) >= 0
    )


@jit
def _lift_all(lo, hi, node):
    """Remove the contacts of rows lo..hi; their saved sides stay, or are those of a string without length."""
    for k in range(lo, hi):
        if node[k, S_MODE] == lay.COLD:
            node[k, lay.S_SWEEP] = 0.0
        node[k, S_MODE] = lay.FREE
        for i in range(lay.S_P - S_MODE, lay.STATE):
            node[k, S_MODE + i] = 0.0


@deferred(types.float64, types.float64, types.int64, types.int64)
def substitute_path(lo, hi, ends, node, tol, direct):
    """Find the substitute path of a span with an end inside; return (length, error, iterations, evaluations).

    ends, tol and direct as in `span_solver.solve_span`. The error is NO_SUBSTITUTE where there is no substitute path.
    The saved solution is that of the substitute path; surfaces that it ignores keep the sides of the path from F.
    """
    # a, b: obstacles inside which A and B lie; p, q: their nearest surface points, or A and B themselves
    a, b = _containing_obstacle(lo, hi, ends, 3, node), _containing_obstacle(lo, hi, ends, 6, node)
    gx, gy, gz, ax, ay, az, bx, by, bz = ends
    px, py, pz, qx, qy, qz = ax, ay, az, bx, by, bz
    if a >= 0:
        px, py, pz = _nearest_surface_point(a, ends, 3, node)
    if b >= 0:
        qx, qy, qz = _nearest_surface_point(b, ends, 6, node)
    # the path of an end that lies on the surface needs no more than to be found
    shallow = lies_on_surfaces(lo, hi, ends, node)
    if not shallow and _has_no_substitute(lo, hi, a, b, ends, node):
        return math.sqrt((bx - ax) ** 2 + (by - ay) ** 2 + (bz - az) ** 2), NO_SUBSTITUTE, 0, 0
    # the path between the nearest points; leaves_a, leaves_b: it does not touch the surface at F
    moved = (gx, gy, gz, px, py, pz, qx, qy, qz)
    # surfaces between an end and the one that contains it, to which the path from F would have to come back
    before, after = lo, hi
    if not shallow:
        before, after = max(a, lo), surface_end(b, hi, node) if b >= 0 else hi
    if before >= after or _holds_an_end(lo, before, after, hi, moved, node):
        return math.sqrt((bx - ax) ** 2 + (by - ay) ** 2 + (bz - az) ** 2), NO_SUBSTITUTE, 0, 0
    _lift_all(lo, before, node)
    _lift_all(after, hi, node)
    status, best, error, iterations, evaluations = solve_active_set(before, after, moved, node, tol, direct)
    behind = surface_end(a, hi, node) if a >= 0 else lo
    k, j = _first_and_last_contact(lo, hi, node)
    leaves_a, leaves_b = a >= 0 and not a <= k < behind, b >= 0 and j < b
    good = not leaves_a or a == lo  # only the surface next to an end can be ignored
    good = good and (not leaves_b or surface_end(b, hi, node) == hi)
    # a path that leaves F and touches the same surface again, behind a hollow, is not covered
    good = good and (a < 0 or leaves_a or node[k, lay.W_L] <= ON_SURFACE * node[k, lay.SIZE])
    good = good and (b < 0 or leaves_b or node[j, lay.W_LQ] <= ON_SURFACE * node[j, lay.SIZE])
    if status != lay.CONVERGED or not (good or shallow):
        return best, NO_SUBSTITUTE, iterations, evaluations
    save_solutions(lo, hi, node, lay.W_START)
    # the paths that ignore the surface of A, of B, and of both; over_a, over_b: it is ignored
    for choice in range(1, 4):
        over_a, over_b = choice % 2 == 1, choice >= 2
        if (over_a and a != lo) or (over_b and (b < 0 or surface_end(b, hi, node) != hi)):
            continue
        if a == b and choice < 3:
            continue
        first, last = behind if over_a else before, b if over_b else after
        last = max(first, last)
        sx, sy, sz, tx, ty, tz = px, py, pz, qx, qy, qz
        if over_a:
            sx, sy, sz = ax, ay, az
        if over_b:
            tx, ty, tz = bx, by, bz
        length, off = math.sqrt((tx - sx) ** 2 + (ty - sy) ** 2 + (tz - sz) ** 2), 0.0
        if first < last:
            part = (gx, gy, gz, sx, sy, sz, tx, ty, tz)
            status, length, off, i, e = solve_active_set(first, last, part, node, tol, direct)
            iterations += i
            evaluations += e
        # where the string leaves F without touching, the path that ignores the surface is needed
        if status != lay.CONVERGED and not shallow and ((over_a and leaves_a) or (over_b and leaves_b)):
            return best, NO_SUBSTITUTE, iterations, evaluations
        if status == lay.CONVERGED and length > best:
            _lift_all(lo, first, node)
            _lift_all(last, hi, node)
            save_solutions(lo, hi, node, lay.W_START)
            best, error = length, off
        status = lay.CONVERGED
    restore_solutions(lo, hi, ends, node, lay.W_START)
    k, j = _first_and_last_contact(lo, hi, node)
    deep = False
    if a >= 0 and a <= k < behind and not shallow:
        deep = _is_too_deep(k, lay.W_P, lay.W_NP, lay.W_KP, ends, 3, node) or _is_past_half_way(
            a, ends, 3, node
        )
    if b >= 0 and j >= b and not shallow and not deep:
        deep = _is_too_deep(j, lay.W_Q, lay.W_NQ, lay.W_KQ, ends, 6, node) or _is_past_half_way(
            b, ends, 6, node
        )
    if deep:
        error = NO_SUBSTITUTE
    return best, error, iterations, evaluations


@from_python
def has_valid_length(status, error):
    """Return whether there is a path or a substitute path, from status and error in `info`."""
    return status == lay.CONVERGED or (status == lay.ENDPOINT_INSIDE and error < NO_SUBSTITUTE)


@from_python
def list_pulling_segments(lo, hi, ox, oy, oz, ix, iy, iz, node, seg, first):
    """Write the segments of a substitute path as `list_segments` does; the one at an end inside has no length.

    Its vector e is not a unit vector but minus the gradient of the length with respect to the end, see the top of this
    file.
    """
    count = list_segments(lo, hi, ox, oy, oz, ix, iy, iz, node, seg, first)
    base = (ox, oy, oz)
    for j in range(first, first + count):
        near, far = int(seg[j, G_NEAR]), int(seg[j, G_FAR])
        from_surface = lo <= near and node[near, KIND] != lay.VIA
        to_surface = far < hi and node[far, KIND] != lay.VIA
        a, b, c = seg[j, G_A], seg[j, G_A + 1], seg[j, G_A + 2]
        if to_surface and not from_surface and node[far, lay.INSIDE] == 0.0 and contains(far, node, a, b, c):
            set_pull_at_end(j, far, True, node, base, seg)
        a, b, c = seg[j, G_B], seg[j, G_B + 1], seg[j, G_B + 2]
        if (
            from_surface
            and not to_surface
            and node[near, lay.INSIDE] == 0.0
            and contains(near, node, a, b, c)
        ):
            set_pull_at_end(j, near, False, node, base, seg)
    return count
