"""Which obstacles are touched: lift-off, touchdown, the branch that is kept, and where a contact may lie."""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit
from mjwrap.kernels.geometry.geodesics import geodesic
from mjwrap.kernels.geometry.projection import turn_into_frame
from mjwrap.kernels.geometry.table import dip, swept
from mjwrap.kernels.geometry.traits import branched, hollow
from mjwrap.kernels.geometry.winding import follow
from mjwrap.kernels.wraps.ruled import A_INSIDE, B_INSIDE, SLIPPED
from mjwrap.kernels.wraps.single import wrap

SIZE, POS = lay.SIZE, lay.POS
S_MODE, S_SWEEP, S_P, S_ARC = lay.S_MODE, lay.S_SWEEP, lay.S_P, lay.S_ARC
W_P, W_Q = lay.W_P, lay.W_Q
FREE, TOUCHED = lay.FREE, lay.TOUCHED

MET = 1e-5  # contacts on both sides of a hollow that are so near, in the surface's size, have met
MEETING = 1e-3  # the same where Newton's method fails: a segment that vanishes has no direction
PIECES = 24  # of a geodesic, to find where it runs through a hollow
DEPTH = (
    -1e-9
)  # a segment that dips less below the surface that it leaves or meets, in its size, only touches it


@jit
def _has_twin(k, hi, node):
    """Return whether the next row is the same surface once more."""
    return k + 1 < hi and node[k + 1, lay.TOUCH] != 0.0


@jit
def follow_branch(lo, hi, node):
    """Note how far the path sweeps about every surface; return False where that is not the way it went before.

    Of the two contacts of a bridged hollow only their sum is topological, and Newton's method keeps them.
    """
    same = True
    for k in range(lo, hi):
        if node[k, S_MODE] != TOUCHED or node[k, S_ARC] < 0.0:
            continue
        if branched(k, node) and node[k, lay.TOUCH] == 0.0:
            angle = swept(k, node)
            if _has_twin(k, hi, node) and node[k + 1, S_MODE] == TOUCHED:
                node[k, S_SWEEP] = angle
            elif abs(angle - follow(angle, node[k, S_SWEEP])) > 1.0:
                same = False
            else:
                node[k, S_SWEEP] = angle
    return same


@jit
def release(k, node):
    """Let go of a contact; where the straight segment beside the surface runs is not known yet."""
    node[k, S_MODE] = FREE
    for i in range(7):
        node[k, S_P + i] = 0.0


@jit
def drop(lo, hi, node):
    """Release the obstacles whose arc is negative; return how many."""
    dropped = 0
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED and node[k, S_ARC] < 0.0:
            release(k, node)
            dropped += 1
    return dropped


@jit
def _dips(k, node, ends, ax, ay, az, bx, by, bz):
    """Return whether the segment from A to B, relative to the base, enters obstacle k."""
    x, y, z = node[k, POS] - ends[0], node[k, POS + 1] - ends[1], node[k, POS + 2] - ends[2]
    ax, ay, az = turn_into_frame(node, k, ax - x, ay - y, az - z)
    bx, by, bz = turn_into_frame(node, k, bx - x, by - y, bz - z)
    low, _ = dip(node, k, ax, ay, az, bx, by, bz)
    return low < DEPTH * node[k, SIZE]


@jit
def _next_contact(k, hi, ends, node):
    """Return the next touched node after k (or hi) and the point at which the path meets it (or B)."""
    for j in range(k + 1, hi):
        if node[j, S_MODE] == TOUCHED:
            return j, node[j, W_P], node[j, W_P + 1], node[j, W_P + 2]
    return hi, ends[6], ends[7], ends[8]


@jit
def _hand_over(k, node):
    """Move the contact of row k to its twin, the surface's second row."""
    for i in range(lay.STATE):
        node[k + 1, S_MODE + i] = node[k, S_MODE + i]
    release(k, node)


@jit
def split(lo, hi, ends, node):
    """Where a geodesic runs through a hollow that the string would bridge, give its far part to the surface's second
    row.

    Returns how many contacts were split.
    """
    count = 0
    for k in range(lo, hi - 1):
        if node[k, S_MODE] != TOUCHED or node[k, lay.W_KMIN] >= 0.0:
            continue
        if not _has_twin(k, hi, node) or node[k + 1, S_MODE] == TOUCHED:
            continue
        arc = node[k, S_ARC]
        first, last = -1, -1
        for i in range(PIECES + 1):
            node[k, S_ARC] = arc * i / PIECES
            geodesic(k, node, ends[0], ends[1], ends[2])
            if node[k, lay.W_KQ] < 0.0:
                first = i if first < 0 else first
                last = i
        if first <= 0 or last >= PIECES:  # it starts or ends in the hollow: no string does
            node[k, S_ARC] = arc
            geodesic(k, node, ends[0], ends[1], ends[2])
            continue
        node[k, S_ARC] = arc * (last + 1) / PIECES
        geodesic(k, node, ends[0], ends[1], ends[2])
        x, y, z = (
            node[k, W_Q] - node[k, W_P],
            node[k, W_Q + 1] - node[k, W_P + 1],
            node[k, W_Q + 2] - node[k, W_P + 2],
        )
        x, y, z = turn_into_frame(node, k, x, y, z)
        tx, ty, tz = turn_into_frame(node, k, node[k, lay.W_TQ], node[k, lay.W_TQ + 1], node[k, lay.W_TQ + 2])
        node[k + 1, S_MODE] = TOUCHED
        node[k + 1, S_P] = node[k, S_P] + x
        node[k + 1, S_P + 1] = node[k, S_P + 1] + y
        node[k + 1, S_P + 2] = node[k, S_P + 2] + z
        node[k + 1, lay.S_T] = tx
        node[k + 1, lay.S_T + 1] = ty
        node[k + 1, lay.S_T + 2] = tz
        node[k + 1, S_ARC] = arc * (PIECES - last - 1) / PIECES
        node[k, S_ARC] = arc * (first - 1) / PIECES
        geodesic(k, node, ends[0], ends[1], ends[2])
        geodesic(k + 1, node, ends[0], ends[1], ends[2])
        count += 1
    return count


@jit
def join(lo, hi, ends, node, met):
    """Make one contact of two that have met, where the surface in between bears the string; return how many.

    met: largest distance between them, in the surface's size.
    """
    count = 0
    for k in range(lo, hi - 1):
        if node[k, S_MODE] != TOUCHED or not _has_twin(k, hi, node) or node[k + 1, S_MODE] != TOUCHED:
            continue
        if node[k, lay.W_LQ] > met * node[k, SIZE]:
            continue
        arc = node[k, S_ARC]
        node[k, S_ARC] = arc + node[k, lay.W_LQ] + node[k + 1, S_ARC]
        geodesic(k, node, ends[0], ends[1], ends[2])
        if node[k, lay.W_KMIN] >= 0.0:
            release(k + 1, node)
            count += 1
        else:
            node[k, S_ARC] = arc
            geodesic(k, node, ends[0], ends[1], ends[2])
    return count


@jit
def take_in(lo, hi, ends, node):
    """Take in the obstacles that a straight segment enters; return how many, and the status that forbids a path."""
    x, y, z = ends[3], ends[4], ends[5]
    added = 0
    status = lay.CONVERGED
    before = -1
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED and hollow(k, node):
            if _dips(k, node, ends, x, y, z, node[k, W_P], node[k, W_P + 1], node[k, W_P + 2]):
                if _has_twin(k, hi, node) and node[k + 1, S_MODE] != TOUCHED:
                    _hand_over(k, node)
                    geodesic(k + 1, node, ends[0], ends[1], ends[2])
                    added += 1
                elif status == lay.CONVERGED:
                    status = lay.PENETRATING
            elif not _has_twin(k, hi, node):
                _, qx, qy, qz = _next_contact(k, hi, ends, node)
                last = _dips(k, node, ends, node[k, W_Q], node[k, W_Q + 1], node[k, W_Q + 2], qx, qy, qz)
                if last and status == lay.CONVERGED:
                    status = lay.PENETRATING
        if node[k, S_MODE] == TOUCHED:
            x, y, z = node[k, W_Q], node[k, W_Q + 1], node[k, W_Q + 2]
            before = k
            continue
        after, qx, qy, qz = _next_contact(k, hi, ends, node)
        held = wrap(k, node, ends[0], ends[1], ends[2], x, y, z, qx, qy, qz, True)
        if held != 0:
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
