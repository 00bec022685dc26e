"""Cold starts: each obstacle is wrapped by itself, between its neighbours' contact points, one after the other.

Every such wrap shortens the path; afterwards Newton's method makes it tangent.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.wraps.single import wrap

KIND, POS, ROT, HINT = lay.KIND, lay.POS, lay.ROT, lay.HINT
S_MODE, S_SWEEP, S_ARC = lay.S_MODE, lay.S_SWEEP, lay.S_ARC
W_P, W_Q, W_OLD = lay.W_P, lay.W_Q, lay.W_OLD
COLD, FREE, TOUCHED = lay.COLD, lay.FREE, lay.TOUCHED
SEARCH_EVERY = 6  # lost contacts are searched for in every sixth pass: a search costs as much as fifty wraps


@jit
def next_contact_point(k, hi, ends, node, centred):
    """Return the contact point that comes next after node k, or the span's end B, relative to the base.

    For an obstacle that was not wrapped yet its hint stands for the contact point; with `centred`, where it has no
    hint, its centre does.
    """
    for j in range(k + 1, hi):
        if centred and node[j, S_MODE] == COLD and node[j, HINT] <= 0.0:
            return node[j, POS] - ends[0], node[j, POS + 1] - ends[1], node[j, POS + 2] - ends[2]
        if node[j, S_MODE] == TOUCHED:
            return node[j, W_P], node[j, W_P + 1], node[j, W_P + 2]
        # not wrapped yet: its hint, from S to the world
        if node[j, S_MODE] == COLD and node[j, HINT] > 0.0:
            hx, hy, hz = node[j, HINT + 1], node[j, HINT + 2], node[j, HINT + 3]
            return (
                node[j, ROT] * hx + node[j, ROT + 1] * hy + node[j, ROT + 2] * hz + node[j, POS] - ends[0],
                node[j, ROT + 3] * hx
                + node[j, ROT + 4] * hy
                + node[j, ROT + 5] * hz
                + node[j, POS + 1]
                - ends[1],
                node[j, ROT + 6] * hx
                + node[j, ROT + 7] * hy
                + node[j, ROT + 8] * hz
                + node[j, POS + 2]
                - ends[2],
            )
    return ends[6], ends[7], ends[8]


@jit
def wrap_in_turn(lo, hi, ends, node, passes, centred):
    """Wrap every obstacle in turn between its neighbours' contact points, `passes` times; return `passes`.

    Lost contacts are searched for in every SEARCH_EVERY-th pass, beginning with the first.
    """
    # a Gauss-Seidel sweep: each obstacle uses the new contact point of the one before it
    for i in range(passes):
        x, y, z = ends[3], ends[4], ends[5]
        for k in range(lo, hi):
            qx, qy, qz = next_contact_point(k, hi, ends, node, centred)
            if i == 0:
                node[k, lay.W_WRAP_ERROR] = -1.0
            wrap(k, node, ends[0], ends[1], ends[2], x, y, z, qx, qy, qz, i % SEARCH_EVERY == 0)
            if node[k, S_MODE] == TOUCHED:
                x, y, z = node[k, W_Q], node[k, W_Q + 1], node[k, W_Q + 2]
    return passes


@jit
def path_length(lo, hi, ends, node):
    """Return the length of the path through the present contact points: straight segments and geodesics (1) [m]."""
    total = 0.0
    x, y, z = ends[3], ends[4], ends[5]
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED:
            dx, dy, dz = node[k, W_P] - x, node[k, W_P + 1] - y, node[k, W_P + 2] - z
            total += math.sqrt(dx * dx + dy * dy + dz * dz) + node[k, S_ARC]
            x, y, z = node[k, W_Q], node[k, W_Q + 1], node[k, W_Q + 2]
    dx, dy, dz = ends[6] - x, ends[7] - y, ends[8] - z
    return total + math.sqrt(dx * dx + dy * dy + dz * dz)


@jit
def ends_of_part(lo, hi, first, last, ends, node):
    """Return `ends` for the part first..last of a span: the contact points before and behind it."""
    ax, ay, az = ends[3], ends[4], ends[5]
    for j in range(first - 1, lo - 1, -1):
        if node[j, S_MODE] == TOUCHED:
            ax, ay, az = node[j, W_Q], node[j, W_Q + 1], node[j, W_Q + 2]
            break
    bx, by, bz = next_contact_point(last - 1, hi, ends, node, False)
    return (ends[0], ends[1], ends[2], ax, ay, az, bx, by, bz)
