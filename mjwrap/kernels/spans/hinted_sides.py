"""Whether a path passes every obstacle on the side of its hint, and cold starts that see to it.

A cold start wraps each obstacle between points that stand for its neighbours' contacts, such as their hints; the side
that it takes there need not be that of the hint between the contacts of the final path. So each obstacle whose hint is
not met is wrapped anew there (`meet_hints`). A string that slips off a sphere, or past a fold of an ellipsoid, has left
the hinted side rightly: the path stands, and `mark_unmet_hints` says so.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, jit
from mjwrap.kernels.geometry.dispatch import segment_clearance, segment_winding_angle, winding_angle
from mjwrap.kernels.geometry.projection import turn_into_frame
from mjwrap.kernels.geometry.traits import branched, closed_form, one_sided, sided
from mjwrap.kernels.spans.active_set_method import solve_active_set
from mjwrap.kernels.spans.cold_start import next_contact_point
from mjwrap.kernels.spans.lift_off_touchdown import remove_contact
from mjwrap.kernels.spans.saved_solutions import restore_solutions, save_solutions, surface_end
from mjwrap.kernels.tangency.tangency_error import evaluate
from mjwrap.kernels.wraps.hinted_half import hint_is_behind, hint_outside
from mjwrap.kernels.wraps.ring import NO_SIDE, asked_side, hint_is_level, is_on_side
from mjwrap.kernels.wraps.sides import contact_in_frame, middle_of_contact, on_allowed_half
from mjwrap.kernels.wraps.single import sweep_asked_for, wrap

HINT, POS, SIZE, S_MODE = lay.HINT, lay.POS, lay.SIZE, lay.S_MODE
W_P, W_Q, W_BEST, UNMET_HINT = lay.W_P, lay.W_Q, lay.W_BEST, lay.UNMET_HINT

ATTEMPTS = 4  # largest number of times that obstacles are wrapped anew
SAME = 1e-9  # paths whose lengths differ by a smaller share are the same
PASSES = 8  # of wrapping all obstacles, with the hinted ones
LEVEL = 1e-9  # a hint that is less far on the other side, in the surface's size, is in the middle


@jit
def _neighbours(k, lo, hi, ends, node):
    """Return the ends A and B of the string over row k's surface, relative to the base: contacts next to it [m]."""
    x, y, z = ends[3], ends[4], ends[5]
    for j in range(k - 1, lo - 1, -1):
        if node[j, S_MODE] == lay.TOUCHED:
            x, y, z = node[j, W_Q], node[j, W_Q + 1], node[j, W_Q + 2]
            break
    for j in range(surface_end(k, hi, node), hi):
        if node[j, S_MODE] == lay.TOUCHED:
            return x, y, z, node[j, W_P], node[j, W_P + 1], node[j, W_P + 2]
    return x, y, z, ends[6], ends[7], ends[8]


@jit
def _ring_is_met(k, hi, base, node, ax, ay, az, bx, by, bz):
    """Return whether the string from A to B, in S, passes row k, a ring, on the side for which its hint asks."""
    side = asked_side(k, node, az, bz)
    further = surface_end(k, hi, node) > k + 1 and node[k + 1, S_MODE] == lay.TOUCHED
    if side == NO_SIDE or (hint_is_level(k, node) and node[k, S_MODE] == lay.TOUCHED):
        return (
            node[k, S_MODE] == lay.TOUCHED or further or not _hint_is_behind(k, node, ax, ay, az, bx, by, bz)
        )
    if node[k, S_MODE] != lay.TOUCHED and not further:
        winding = segment_winding_angle(k, node, ax, ay, az, bx, by, bz)
    elif node[k, S_MODE] == lay.TOUCHED and further:
        # the segment between the two contacts belongs to the winding angles of both
        qx, qy, qz = contact_in_frame(k, W_Q, base, node)
        px, py, pz = contact_in_frame(k + 1, W_P, base, node)
        winding = winding_angle(k, node) + winding_angle(k + 1, node)
        winding -= segment_winding_angle(k, node, qx, qy, qz, px, py, pz)
    else:
        winding = winding_angle(k + 1 if further else k, node)
    return is_on_side(k, node, side, winding, ax, ay, az, bx, by, bz)


@jit
def _axis_is_met(k, node, ax, ay, az, bx, by, bz):
    """Return whether the string from A to B, in S, passes the axis of row k's surface on the side of its hint.

    A string that winds a whole turn passes on every side; for a side that holds at every pose turns count.
    """
    winding = node[k, lay.S_SWEEP]
    if node[k, S_MODE] == lay.TOUCHED:
        winding = winding_angle(k, node)
    asked = sweep_asked_for(k, node, ax, ay, az, bx, by, bz)
    if sided(k, node):
        return abs(winding - asked) < math.pi
    return abs(winding) >= 2.0 * math.pi or abs(winding - asked) < math.pi


@jit
def _hint_is_behind(k, node, ax, ay, az, bx, by, bz):
    """Return whether the hint lies behind row k's surface, seen from the segment from A to B."""
    _, share = segment_clearance(node, k, ax, ay, az, bx, by, bz)
    return hint_is_behind(k, node, share, ax, ay, az, bx - ax, by - ay, bz - az)


@jit
def _bounded_is_met(k, ends, node, ax, ay, az, bx, by, bz):
    """Return whether the string from A to B, in S, passes row k's surface on the side of its hint.

    Seen from the lowest point of AB, the middle of the contact and the hint lie on the same side of AB.
    """
    if node[k, S_MODE] != lay.TOUCHED:
        return not _hint_is_behind(k, node, ax, ay, az, bx, by, bz)
    _, share = segment_clearance(node, k, ax, ay, az, bx, by, bz)
    dx, dy, dz = bx - ax, by - ay, bz - az
    square = max(dx * dx + dy * dy + dz * dz, 1e-300)
    fx, fy, fz = ax + share * dx, ay + share * dy, az + share * dz
    mx, my, mz = middle_of_contact(k, ends, node)
    mx, my, mz = mx - fx, my - fy, mz - fz
    hx, hy, hz = hint_outside(k, node)
    hx, hy, hz = hx - fx, hy - fy, hz - fz
    across = mx * hx + my * hy + mz * hz
    across -= (mx * dx + my * dy + mz * dz) * (hx * dx + hy * dy + hz * dz) / square
    return across >= -LEVEL * node[k, SIZE] * node[k, SIZE]


@jit
def _half_is_met(k, ends, node, ax, ay, az, bx, by, bz):
    """Return whether the string from A to B, in S, passes row k's surface, which is SIDED, on the allowed half."""
    if node[k, S_MODE] == lay.TOUCHED:
        x, y, z = middle_of_contact(k, ends, node)
        return on_allowed_half(k, node, x, y, z)
    _, share = segment_clearance(node, k, ax, ay, az, bx, by, bz)
    return on_allowed_half(k, node, ax + share * (bx - ax), ay + share * (by - ay), az + share * (bz - az))


@jit
def _is_met(k, lo, hi, ends, node):
    """Return whether the path of the last evaluation passes row k's surface on the side of its hint."""
    ax, ay, az, bx, by, bz = _neighbours(k, lo, hi, ends, node)
    x, y, z = node[k, POS] - ends[0], node[k, POS + 1] - ends[1], node[k, POS + 2] - ends[2]
    ax, ay, az = turn_into_frame(node, k, ax - x, ay - y, az - z)
    bx, by, bz = turn_into_frame(node, k, bx - x, by - y, bz - z)
    if not branched(k, node) and sided(k, node):
        return _half_is_met(k, ends, node, ax, ay, az, bx, by, bz)
    if not branched(k, node):
        return _bounded_is_met(k, ends, node, ax, ay, az, bx, by, bz)
    if closed_form(k, node):
        return _axis_is_met(k, node, ax, ay, az, bx, by, bz)
    return _ring_is_met(k, hi, ends[:3], node, ax, ay, az, bx, by, bz)


@jit
def _mark_span(lo, hi, ends, node, searched, only_sided):
    """Write to the flags HINT which hints the path over lo..hi does not meet; return how many.

    searched: a side that no search can reach counts as met. only_sided: a hint that only picks a start does.
    """
    count = 0
    for k in range(lo, hi):
        if node[k, HINT] > 0.0 and node[k, lay.INSIDE] == 0.0:
            met = only_sided and not sided(k, node)
            # a sphere's wrap is the only one: no search can bring it to its side
            met = met or (searched and sided(k, node) and one_sided(k, node))
            met = met or _is_met(k, lo, hi, ends, node)
            node[k, HINT] = 1.0 if met else UNMET_HINT
            count += 0 if met else 1
    return count


@jit
def _wrap_by_hints(lo, hi, ends, node, all_sides, only_sided):
    """Wrap every obstacle in turn, PASSES times, those with unmet hints anew by their hints; return the passes.

    all_sides: also those with hints that are met, where the side is topological; with only_sided, only SIDED ones.
    """
    for _ in range(PASSES):
        x, y, z = ends[3], ends[4], ends[5]
        for k in range(lo, hi):
            again = all_sides and node[k, HINT] > 0.0 and branched(k, node)
            again = again and (not only_sided or sided(k, node))
            if node[k, HINT] == UNMET_HINT or again:
                for j in range(k, surface_end(k, hi, node)):
                    remove_contact(j, node)
                node[k, S_MODE] = lay.COLD
            qx, qy, qz = next_contact_point(k, hi, ends, node, False)
            node[k, lay.W_WRAP_ERROR] = -1.0
            wrap(k, node, ends[0], ends[1], ends[2], x, y, z, qx, qy, qz, False)
            if node[k, S_MODE] == lay.TOUCHED:
                x, y, z = node[k, W_Q], node[k, W_Q + 1], node[k, W_Q + 2]
    return PASSES


@deferred(types.int64)
def mark_unmet_hints(lo, hi, ox, oy, oz, ix, iy, iz, node):
    """Write to the flags HINT which hints the path over nodes lo..hi does not meet; return how many.

    The rows hold the last evaluation of a path from (ox, oy, oz) to (ix, iy, iz), world [m].
    """
    count, start = 0, lo
    ax, ay, az = 0.0, 0.0, 0.0
    for k in range(lo, hi + 1):
        if k < hi and node[k, lay.KIND] != lay.VIA:
            continue
        bx, by, bz = ix - ox, iy - oy, iz - oz
        if k < hi:
            bx, by, bz = node[k, POS] - ox, node[k, POS + 1] - oy, node[k, POS + 2] - oz
        count += _mark_span(start, k, (ox, oy, oz, ax, ay, az, bx, by, bz), node, False, False)
        ax, ay, az = bx, by, bz
        start = k + 1
    return count


@deferred(types.int64, types.float64, types.float64, types.int64, types.int64)
def meet_hints(lo, hi, ends, node, tol, length, error, only_sided):
    """Wrap the obstacles whose hints are not met anew, after a cold start; returns as `solve_active_set`.

    length, error: of the path over lo..hi, which is converged. It stays where no path meets more hints. only_sided:
    after a warm start, where only sides that hold at every pose ask for anything.
    """
    iterations, evaluations = 0, 0
    unmet = _mark_span(lo, hi, ends, node, True, only_sided)
    least, last, result, is_best = unmet, length, lay.CONVERGED, True
    save_solutions(lo, hi, node, W_BEST)
    for attempt in range(ATTEMPTS):
        if unmet == 0:
            break
        evaluations += _wrap_by_hints(lo, hi, ends, node, attempt > 0, only_sided)
        status, total, square, i, e = solve_active_set(lo, hi, ends, node, tol, False)
        iterations += i
        evaluations += e
        before = unmet
        unmet = _mark_span(lo, hi, ends, node, True, only_sided)
        same = attempt > 0 and unmet == before and abs(total - last) <= SAME * total
        last = total
        # a path that meets all hints counts also where it leaves the range of a surface
        is_best = unmet < least and (status == lay.CONVERGED or (status == lay.OUT_OF_RANGE and unmet == 0))
        if is_best:
            least, length, error, result = unmet, total, square, status
            save_solutions(lo, hi, node, W_BEST)
        if same:
            break
    if not is_best:
        restore_solutions(lo, hi, ends, node, W_BEST)
        evaluate(lo, hi, ends, node)
    return result, length, error, iterations, evaluations
