"""Changes of the active set, the obstacles that a path touches: lift-off, touchdown, splitting and merging of contacts.

"Touching or not" in docs/derivation.md. `_penetrates` tests a straight segment against a surface, by
`geometry.dispatch.segment_clearance`. A surface with hollows has two rows, because a string may touch it on both sides
of a hollow that it bridges ("Hollows"); the second row has TOUCH > 0.
"""

from __future__ import annotations

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, jit
from mjwrap.kernels.geometry.dispatch import segment_clearance, winding_angle
from mjwrap.kernels.geometry.geodesics import geodesic, move_start_along
from mjwrap.kernels.geometry.projection import turn_into_frame
from mjwrap.kernels.geometry.traits import branched, hollow
from mjwrap.kernels.geometry.winding import unwrap_angle
from mjwrap.kernels.wraps.ruled import A_INSIDE, B_INSIDE, SLIPPED
from mjwrap.kernels.wraps.single import wrap

SIZE, POS = lay.SIZE, lay.POS
S_MODE, S_SWEEP, S_P, S_ARC = lay.S_MODE, lay.S_SWEEP, lay.S_P, lay.S_ARC
W_P, W_Q = lay.W_P, lay.W_Q
FREE, TOUCHED = lay.FREE, lay.TOUCHED

# Lengths are shares of the surface's size.
MERGE_DISTANCE = 1e-5  # contacts on both sides of a hollow that are nearer to each other than this have met
MERGE_DISTANCE_ON_FAILURE = 1e-3  # the same after Newton's method failed, as on a segment that vanishes
HOLLOW_SAMPLES = 24  # samples of a geodesic, to find where it runs through a hollow
PENETRATION_DEPTH = 1e-9  # a segment that goes less deep below a surface touches it but does not enter it


@jit
def _has_second_row(k, hi, node):
    """Return whether the next row belongs to the same surface."""
    return k + 1 < hi and node[k + 1, lay.TOUCH] != 0.0


@jit
def follow_branch(lo, hi, node):
    """Write the path's winding angle about every surface; return False if it is on another branch than before.

    With two contacts at a bridged hollow only their sum is topological; Newton's method stays on their branch.
    """
    same = True
    for k in range(lo, hi):
        if node[k, S_MODE] != TOUCHED or node[k, S_ARC] < 0.0:
            continue
        if branched(k, node) and node[k, lay.TOUCH] == 0.0:
            angle = winding_angle(k, node)
            if _has_second_row(k, hi, node) and node[k + 1, S_MODE] == TOUCHED:
                node[k, S_SWEEP] = angle
            # another branch differs by whole turns, the same branch by rounding errors; the bound is in between
            elif abs(angle - unwrap_angle(angle, node[k, S_SWEEP])) > 1.0:
                same = False
            else:
                node[k, S_SWEEP] = angle
    return same


@jit
def remove_contact(k, node):
    """Remove the contact of row k, and make the row FREE."""
    node[k, S_MODE] = FREE
    # zeros: the ends of the straight segment are not known yet
    for i in range(7):
        node[k, S_P + i] = 0.0


@jit
def lift_off(lo, hi, node):
    """Remove the contacts whose arc is negative; return how many.

    Where the arc is zero the contact is a point with e = e' = t, so that length and forces are continuous there.
    """
    removed = 0
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED and node[k, S_ARC] < 0.0:
            remove_contact(k, node)
            removed += 1
    return removed


@jit
def _penetrates(k, node, ends, ax, ay, az, bx, by, bz):
    """Return whether the straight segment from A to B, relative to the base, enters obstacle k."""
    x, y, z = node[k, POS] - ends[0], node[k, POS + 1] - ends[1], node[k, POS + 2] - ends[2]
    ax, ay, az = turn_into_frame(node, k, ax - x, ay - y, az - z)
    bx, by, bz = turn_into_frame(node, k, bx - x, by - y, bz - z)
    low, _ = segment_clearance(node, k, ax, ay, az, bx, by, bz)
    return low < -PENETRATION_DEPTH * node[k, SIZE]


@jit
def _next_contact(k, hi, ends, node):
    """Return the next touched node after k (or hi) and the point at which the path meets it (or B)."""
    for j in range(k + 1, hi):
        if node[j, S_MODE] == TOUCHED:
            return j, node[j, W_P], node[j, W_P + 1], node[j, W_P + 2]
    return hi, ends[6], ends[7], ends[8]


@jit
def _move_to_second_row(k, node):
    """Move the contact of row k to the surface's second row."""
    for i in range(lay.STATE):
        node[k + 1, S_MODE + i] = node[k, S_MODE + i]
    remove_contact(k, node)


@deferred(types.int64)
def split_at_hollow(lo, hi, ends, node):
    """Split the geodesics that run through a hollow, where a string would lift off; return how many.

    The part before the hollow stays in its row, the part behind it goes to the surface's second row.
    """
    count = 0
    for k in range(lo, hi - 1):
        if node[k, S_MODE] != TOUCHED or node[k, lay.W_KMIN] >= 0.0:
            continue
        if not _has_second_row(k, hi, node) or node[k + 1, S_MODE] == TOUCHED:
            continue
        arc = node[k, S_ARC]
        # first and last of the pieces at whose end the surface is concave along the geodesic
        first, last = -1, -1
        for i in range(HOLLOW_SAMPLES + 1):
            node[k, S_ARC] = arc * i / HOLLOW_SAMPLES
            geodesic(k, node, ends[0], ends[1], ends[2])
            if node[k, lay.W_KQ] < 0.0:
                first = i if first < 0 else first
                last = i
        # a geodesic that starts or ends in the hollow is too far from a real path to be split
        if first <= 0 or last >= HOLLOW_SAMPLES:
            node[k, S_ARC] = arc
            geodesic(k, node, ends[0], ends[1], ends[2])
            continue
        # the second contact starts at the first sample behind the hollow
        node[k + 1, S_MODE] = TOUCHED
        for i in range(6):
            node[k + 1, S_P + i] = node[k, S_P + i]
        node[k + 1, S_ARC] = arc
        move_start_along(k + 1, node, ends, arc * (last + 1) / HOLLOW_SAMPLES)
        # the first contact ends one sample before the hollow; Newton's method finds the exact ends of both
        node[k, S_ARC] = arc * (first - 1) / HOLLOW_SAMPLES
        geodesic(k, node, ends[0], ends[1], ends[2])
        geodesic(k + 1, node, ends[0], ends[1], ends[2])
        count += 1
    return count


@jit
def merge_contacts(lo, hi, ends, node, distance):
    """Merge the two contacts of a surface where they have met and it is not concave in between; return how many.

    distance: the largest between them that counts as met, in the surface's size.
    """
    count = 0
    for k in range(lo, hi - 1):
        if node[k, S_MODE] != TOUCHED or not _has_second_row(k, hi, node) or node[k + 1, S_MODE] != TOUCHED:
            continue
        if node[k, lay.W_LQ] > distance * node[k, SIZE]:
            continue
        # try the geodesic through both of them, and go back where it runs through a hollow
        arc = node[k, S_ARC]
        node[k, S_ARC] = arc + node[k, lay.W_LQ] + node[k + 1, S_ARC]
        geodesic(k, node, ends[0], ends[1], ends[2])
        if node[k, lay.W_KMIN] >= 0.0:
            remove_contact(k + 1, node)
            count += 1
        else:
            node[k, S_ARC] = arc
            geodesic(k, node, ends[0], ends[1], ends[2])
    return count


@jit
def touchdown(lo, hi, ends, node):
    """Wrap the obstacles that a straight segment enters; return (how many, status).

    The status is CONVERGED unless some obstacle makes a path impossible. Each obstacle is wrapped between the contact
    points before and after it.
    """
    # (x, y, z): where the straight segment that arrives at row k begins
    x, y, z = ends[3], ends[4], ends[5]
    added = 0
    status = lay.CONVERGED
    before = -1
    for k in range(lo, hi):
        # a segment that touches a surface with hollows may enter it elsewhere
        if node[k, S_MODE] == TOUCHED and hollow(k, node):
            if _penetrates(k, node, ends, x, y, z, node[k, W_P], node[k, W_P + 1], node[k, W_P + 2]):
                if _has_second_row(k, hi, node) and node[k + 1, S_MODE] != TOUCHED:
                    _move_to_second_row(k, node)
                    geodesic(k + 1, node, ends[0], ends[1], ends[2])
                    added += 1
                elif status == lay.CONVERGED:
                    status = lay.PENETRATING
            elif not _has_second_row(k, hi, node):
                _, qx, qy, qz = _next_contact(k, hi, ends, node)
                last = _penetrates(
                    k, node, ends, node[k, W_Q], node[k, W_Q + 1], node[k, W_Q + 2], qx, qy, qz
                )
                if last and status == lay.CONVERGED:
                    status = lay.PENETRATING
        if node[k, S_MODE] == TOUCHED:
            x, y, z = node[k, W_Q], node[k, W_Q + 1], node[k, W_Q + 2]
            before = k
            continue
        # an untouched row: `wrap` tests the segment and leaves the row FREE where it is clear
        after, qx, qy, qz = _next_contact(k, hi, ends, node)
        held = wrap(k, node, ends[0], ends[1], ends[2], x, y, z, qx, qy, qz, True)
        if held != 0:
            # only ends of the span count as inside; contact points may lie below another surface
            if (held & A_INSIDE and before < 0) or (held & B_INSIDE and after == hi):
                status = lay.ENDPOINT_INSIDE
            elif status == lay.CONVERGED:
                status = lay.NO_GEODESIC if held & SLIPPED else lay.PENETRATING
        if node[k, S_MODE] == TOUCHED:
            x, y, z = node[k, W_Q], node[k, W_Q + 1], node[k, W_Q + 2]
            before = k
            added += 1
    return added, status


@jit
def in_range(lo, hi, ends, node):
    """Return whether every contact lies where its surface exists: within the half length, within a user's ranges."""
    for k in range(lo, hi):
        if node[k, S_MODE] != TOUCHED:
            continue
        if node[k, lay.W_OUT] != 0.0:
            return False
        half = node[k, lay.Z_LIMIT]
        if half < 1e300:
            x, y, z = (
                node[k, W_Q] - node[k, W_P],
                node[k, W_Q + 1] - node[k, W_P + 1],
                node[k, W_Q + 2] - node[k, W_P + 2],
            )
            _, _, rise = turn_into_frame(node, k, x, y, z)
            if abs(node[k, S_P + 2]) > half or abs(node[k, S_P + 2] + rise) > half:
                return False
    return True
