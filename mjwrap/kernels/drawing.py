"""Polylines, contact points and forces of all muscles in one call each, for pictures and recordings."""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import inlined, jit
from mjwrap.kernels.coupling import R_HI, R_LO, R_MUSCLE
from mjwrap.kernels.moments import length_jacobian
from mjwrap.kernels.polyline import polyline
from mjwrap.kernels.segments import G_A, G_B, G_E, G_FAR


@inlined
def _append(out, count, x, y, z):
    """Append a point where there is room; return the new count."""
    if count < out.shape[0]:
        out[count, 0], out[count, 1], out[count, 2] = x, y, z
    return count + 1


@jit
def route_points(c, routes, node, seg, seg_count, info, spacing, out, count):
    """Write the points of one route's path to out from row `count` on; return the new count, as `polylines` does."""
    if seg_count[c] == 0:
        return count
    lo, hi = routes[c, R_LO], routes[c, R_HI]
    first, last = lo + c, lo + c + seg_count[c] - 1
    if info[c, lay.I_STATUS] == lay.CONVERGED:
        return count + polyline(
            lo, hi, seg[first, G_A], seg[first, G_A + 1], seg[first, G_A + 2],
            seg[last, G_B], seg[last, G_B + 1], seg[last, G_B + 2], node, spacing, out, count,
        )  # fmt: skip
    for j in range(first, last + 1):
        count = _append(out, count, seg[j, G_A], seg[j, G_A + 1], seg[j, G_A + 2])
        count = _append(out, count, seg[j, G_B], seg[j, G_B + 1], seg[j, G_B + 2])
    return count


@jit
def route_contacts(c, routes, node, seg, seg_count, out, count):
    """Write P and Q of each obstacle that a route touches to out, from row `count` on; return the new count."""
    first = routes[c, R_LO] + c
    for j in range(first, first + seg_count[c] - 1):
        k = int(seg[j, G_FAR])
        if k < routes[c, R_HI] and node[k, lay.KIND] != lay.VIA:
            count = _append(out, count, seg[j, G_B], seg[j, G_B + 1], seg[j, G_B + 2])
            count = _append(out, count, seg[j + 1, G_A], seg[j + 1, G_A + 1], seg[j + 1, G_A + 2])
    return count


@jit
def polylines(routes, node, seg, seg_count, info, spacing, only, out, starts):
    """Write the points of every muscle's path to out and where each muscle begins to starts (n + 1,); return how many.

    only: one muscle's index, or -1 for all. Routes without a path at the last evaluation are drawn along the segments
    that they hold. Where `out` is too short the points are counted and not written. World frame [m].
    """
    count = 0
    muscle = -1
    for c in range(routes.shape[0]):
        while muscle < routes[c, R_MUSCLE]:
            muscle += 1
            starts[muscle] = count
        if only < 0 or only == muscle:
            count = route_points(c, routes, node, seg, seg_count, info, spacing, out, count)
    while muscle + 1 < starts.shape[0]:
        muscle += 1
        starts[muscle] = count
    return count


@jit
def contacts(routes, node, seg, seg_count, only, out, starts):
    """Write P and Q of every touched obstacle to out, two rows each, and starts (n + 1,); return how many rows."""
    count = 0
    muscle = -1
    for c in range(routes.shape[0]):
        while muscle < routes[c, R_MUSCLE]:
            muscle += 1
            starts[muscle] = count
        if only < 0 or only == muscle:
            count = route_contacts(c, routes, node, seg, seg_count, out, count)
    while muscle + 1 < starts.shape[0]:
        muscle += 1
        starts[muscle] = count
    return count


# ---------------------------------------------- many frames: seg (T, N + C, SEGMENT), seg_count (T, C), tension (T, n)


@jit
def contacts_over(routes, node, seg, seg_count, out, counts):
    """Do `contacts` for T frames, all of a muscle one after the other; counts (n, T); return how many rows.

    node: of any frame; only the kinds of the obstacles are read.
    """
    total = 0
    c = 0
    for m in range(counts.shape[0]):
        first = c
        while c < routes.shape[0] and routes[c, R_MUSCLE] == m:
            c += 1
        for t in range(seg.shape[0]):
            before = total
            for r in range(first, c):
                total = route_contacts(r, routes, node, seg[t], seg_count[t], out, total)
            counts[m, t] = total - before
    return total


@inlined
def _arrow(out, count, x, y, z, vx, vy, vz):
    """Append an arrow where there is room: tail, then vector; return the new count."""
    if count < out.shape[0]:
        out[count, 0], out[count, 1], out[count, 2] = x, y, z
        out[count, 3], out[count, 4], out[count, 5] = vx, vy, vz
    return count + 1


@jit
def _route_arrows(c, routes, seg, seg_count, size, out, count):
    """Append the forces of route c as arrows, `size` times the unit vectors of its segments; return the new count."""
    if seg_count[c] == 0:
        return count
    first = routes[c, R_LO] + c
    last = first + seg_count[c] - 1
    count = _arrow(
        out, count, seg[first, G_A], seg[first, G_A + 1], seg[first, G_A + 2],
        size * seg[first, G_E], size * seg[first, G_E + 1], size * seg[first, G_E + 2],
    )  # fmt: skip
    for j in range(first, last):
        k = j + 1
        vx = size * (seg[k, G_E] - seg[j, G_E])
        vy = size * (seg[k, G_E + 1] - seg[j, G_E + 1])
        vz = size * (seg[k, G_E + 2] - seg[j, G_E + 2])
        x = 0.5 * (seg[j, G_B] + seg[k, G_A])
        y = 0.5 * (seg[j, G_B + 1] + seg[k, G_A + 1])
        z = 0.5 * (seg[j, G_B + 2] + seg[k, G_A + 2])
        count = _arrow(out, count, x - vx, y - vy, z - vz, vx, vy, vz)
    return _arrow(
        out, count, seg[last, G_B], seg[last, G_B + 1], seg[last, G_B + 2],
        -size * seg[last, G_E], -size * seg[last, G_E + 1], -size * seg[last, G_E + 2],
    )  # fmt: skip


@jit
def arrows_over(routes, weights, seg, seg_count, tension, scale, out, counts):
    """Write the forces on bodies as arrows (tail [m], vector [scale N]) to out (m, 6), counts (n, T); return m.

    A route pulls at its origin and insertion, where the arrows' tails are. A surface or via point between them is
    pressed by the sum of the pulls at both ends of the contact: an arrow whose tip is midway between them.
    """
    total = 0
    c = 0
    for m in range(counts.shape[0]):
        first = c
        while c < routes.shape[0] and routes[c, R_MUSCLE] == m:
            c += 1
        for t in range(seg.shape[0]):
            before = total
            for r in range(first, c):
                size = scale * weights[r] * tension[t, m]
                total = _route_arrows(r, routes, seg[t], seg_count[t], size, out, total)
            counts[m, t] = total - before
    return total


@jit
def moment_arms_over(
    routes, weights, links, seg, seg_count, last_dof, dof_parentid, body_rootid, cdof, subtree_com, muscles, columns,
    jacobian, out,
):  # fmt: skip
    """Write -dl/dq of the pairs (muscles, columns), (K,) each, in T frames to out (T, K); jacobian (n, nv): scratch."""
    for t in range(seg.shape[0]):
        length_jacobian(
            routes, weights, links, seg[t], seg_count[t], last_dof, dof_parentid, body_rootid, cdof[t], subtree_com[t],
            jacobian,
        )  # fmt: skip
        for k in range(muscles.shape[0]):
            out[t, k] = -jacobian[muscles[k], columns[k]]
