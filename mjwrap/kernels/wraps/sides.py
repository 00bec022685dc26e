"""Sides that hold at every pose: the half on which a string passes a surface, so that its length follows from the pose.

A hint picks where a search starts; then the path follows by continuity. A side (the trait SIDED) is a constraint. The
hint's direction d, seen from the origin of S, says which half is allowed:

- about an axis the string never crosses the half plane that leads from the axis away from d. So the angle that it
  sweeps is the plain difference of its ends' angles from d, each within half a turn, and may be more than half a turn;
- a bounded surface is passed where the middle of the contact, or the lowest point of a straight string, is on d's side
  of the origin. Of several such paths the shortest is taken, and where there is none the path that exists;
- a ring is passed through its hole or outside, as a cold start with the hint would do.

Where an end crosses the half plane, or the middle of the contact leaves the half, the path jumps.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.geometry.dispatch import project
from mjwrap.kernels.geometry.geodesics import geodesic
from mjwrap.kernels.geometry.projection import turn_into_frame
from mjwrap.kernels.geometry.traits import one_sided, sided

HINT, POS, SIZE, S_MODE, S_ARC = lay.HINT, lay.POS, lay.SIZE, lay.S_MODE, lay.S_ARC

LEVEL = 1e-9  # a place that is less far on the other half, in the surface's size, is in the middle
# a guess whose middle is so deep on the other half, in sizes, or whose detour is longer by such a share, is given up
HOPELESS_DEPTH = 0.3
HOPELESS_DETOUR = 0.4
ON_AXIS = 1e-9  # a direction whose part across the axis is a smaller share of the size gives no side


@jit
def _angle_from(ux, uy, x, y):
    """Return the angle from the direction (ux, uy) to the point (x, y), within half a turn [rad]."""
    return math.atan2(ux * y - uy * x, ux * x + uy * y)


@jit
def side_sweep(k, node, ax, ay, bx, by, a, b):
    """Return the angle that a string from A to B sweeps about the axis of row k, which is SIDED [rad].

    The points are divided by (a, b), lengths in which the hint is measured, too.
    """
    ux, uy = node[k, HINT + 1] / a, node[k, HINT + 2] / b
    if math.sqrt(ux * ux + uy * uy) * min(a, b) < ON_AXIS * node[k, SIZE]:
        return math.atan2(ax * by - ay * bx, ax * bx + ay * by)
    return _angle_from(ux, uy, bx, by) - _angle_from(ux, uy, ax, ay)


@jit
def point_of_side(k, node):
    """Return the surface point next to the place in the direction of row k's hint at a distance of its size, in S."""
    x, y, z = node[k, HINT + 1], node[k, HINT + 2], node[k, HINT + 3]
    scale = node[k, SIZE] / max(math.sqrt(x * x + y * y + z * z), 1e-300)
    x, y, z, _, _, _ = project(node, k, scale * x, scale * y, scale * z)
    return x, y, z


@jit
def on_allowed_half(k, node, x, y, z):
    """Return whether a point in S is on the side of the origin to which row k's hint points."""
    hx, hy, hz = node[k, HINT + 1], node[k, HINT + 2], node[k, HINT + 3]
    return x * hx + y * hy + z * hz >= -LEVEL * node[k, SIZE] * math.sqrt(hx * hx + hy * hy + hz * hz)


@jit
def contact_in_frame(k, column, base, node):
    """Return the contact point of row k that begins at `column`, W_P or W_Q, in S."""
    x, y, z = node[k, POS] - base[0], node[k, POS + 1] - base[1], node[k, POS + 2] - base[2]
    return turn_into_frame(node, k, node[k, column] - x, node[k, column + 1] - y, node[k, column + 2] - z)


@jit
def middle_of_contact(k, ends, node):
    """Return the middle of row k's geodesic, in S."""
    arc = node[k, S_ARC]
    node[k, S_ARC] = 0.5 * arc
    geodesic(k, node, ends[0], ends[1], ends[2])
    x, y, z = contact_in_frame(k, lay.W_Q, ends[:3], node)
    node[k, S_ARC] = arc
    geodesic(k, node, ends[0], ends[1], ends[2])
    return x, y, z


@jit
def is_hopeless(k, ends, node, best):
    """Return whether a guess of row k's contact cannot lead to a path on the allowed half shorter than `best` [m].

    A path that it could lead to differs little from it: the guess nearest to that path does not count as hopeless.
    """
    arc = node[k, S_ARC]
    node[k, S_ARC] = 0.5 * arc
    geodesic(k, node, ends[0], ends[1], ends[2])
    x, y, z = contact_in_frame(k, lay.W_Q, ends[:3], node)
    node[k, S_ARC] = arc
    hx, hy, hz = node[k, HINT + 1], node[k, HINT + 2], node[k, HINT + 3]
    depth = x * hx + y * hy + z * hz
    if depth < -HOPELESS_DEPTH * node[k, SIZE] * math.sqrt(hx * hx + hy * hy + hz * hz):
        return True
    geodesic(k, node, ends[0], ends[1], ends[2])
    p, q = lay.W_P, lay.W_Q
    px, py, pz = node[k, p] - ends[3], node[k, p + 1] - ends[4], node[k, p + 2] - ends[5]
    qx, qy, qz = node[k, q] - ends[6], node[k, q + 1] - ends[7], node[k, q + 2] - ends[8]
    total = math.sqrt(px * px + py * py + pz * pz) + arc + math.sqrt(qx * qx + qy * qy + qz * qz)
    dx, dy, dz = ends[6] - ends[3], ends[7] - ends[4], ends[8] - ends[5]
    straight = math.sqrt(dx * dx + dy * dy + dz * dz)
    return total - straight > (1.0 + HOPELESS_DETOUR) * (best - straight)


@jit
def any_sided(lo, hi, node):
    """Return whether a row of lo..hi holds its side at every pose."""
    for k in range(lo, hi):
        if sided(k, node):
            return True
    return False


@jit
def all_sided(lo, hi, node):
    """Return whether every row of lo..hi has a side that follows from the pose alone."""
    for k in range(lo, hi):
        if node[k, lay.TOUCH] == 0.0 and not (sided(k, node) or one_sided(k, node)):
            return False
    return True


@jit
def forget(lo, hi, node):
    """Make rows lo..hi COLD, as if there were no solution before."""
    for k in range(lo, hi):
        node[k, S_MODE] = lay.COLD
        for i in range(1, lay.STATE):
            node[k, S_MODE + i] = 0.0
