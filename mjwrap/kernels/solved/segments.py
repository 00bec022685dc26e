"""Velocity and forces of a solved path, from its straight segments alone ("Velocity and force" in docs/derivation.md).

At any instant each end of a straight segment is a material point of some body. The list `seg` has a row for each
segment: its near and far node (lo - 1 is the chain's origin, hi its insertion), near point, far point, and the unit
vector e from near to far, in the world frame. Where a segment on a surface has no length, e is the geodesic's tangent.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.tangency.tangency_error import ON_SURFACE

G_NEAR = 0
G_FAR = 1
G_A = 2  # near point (3) [m]
G_B = 5  # far point (3) [m]
G_E = 8  # unit vector (3)
SEGMENT = 11

VANISHING = 1e-200  # a segment that is not longer has no direction [m]


@jit
def list_segments(lo, hi, ox, oy, oz, ix, iy, iz, node, seg, first):
    """Write the straight segments of the solved chain lo..hi to seg[first:]; return how many."""
    x, y, z = 0.0, 0.0, 0.0
    near = lo - 1
    count = first
    for k in range(lo, hi + 1):
        if k < hi:
            if node[k, lay.KIND] == lay.VIA:
                px, py, pz = node[k, lay.POS] - ox, node[k, lay.POS + 1] - oy, node[k, lay.POS + 2] - oz
            elif node[k, lay.S_MODE] == lay.TOUCHED:
                px, py, pz = node[k, lay.W_P], node[k, lay.W_P + 1], node[k, lay.W_P + 2]
            else:
                continue
        else:
            px, py, pz = ix - ox, iy - oy, iz - oz
        ex, ey, ez = px - x, py - y, pz - z
        size = math.sqrt(ex * ex + ey * ey + ez * ez)
        # a segment without length on a surface: the tangent of the geodesic
        if k < hi and node[k, lay.KIND] != lay.VIA and size <= ON_SURFACE * node[k, lay.SIZE]:
            ex, ey, ez = node[k, lay.W_TP], node[k, lay.W_TP + 1], node[k, lay.W_TP + 2]
        elif near >= lo and node[near, lay.KIND] != lay.VIA and size <= ON_SURFACE * node[near, lay.SIZE]:
            ex, ey, ez = node[near, lay.W_TQ], node[near, lay.W_TQ + 1], node[near, lay.W_TQ + 2]
        elif size > VANISHING:
            ex, ey, ez = ex / size, ey / size, ez / size
        else:
            ex, ey, ez = 0.0, 0.0, 0.0
        seg[count, G_NEAR] = near
        seg[count, G_FAR] = k
        seg[count, G_A] = x + ox
        seg[count, G_A + 1] = y + oy
        seg[count, G_A + 2] = z + oz
        seg[count, G_B] = px + ox
        seg[count, G_B + 1] = py + oy
        seg[count, G_B + 2] = pz + oz
        seg[count, G_E] = ex
        seg[count, G_E + 1] = ey
        seg[count, G_E + 2] = ez
        count += 1
        near = k
        x, y, z = px, py, pz
        if k < hi and node[k, lay.KIND] != lay.VIA:
            x, y, z = node[k, lay.W_Q], node[k, lay.W_Q + 1], node[k, lay.W_Q + 2]
    return count - first


@jit
def _point_rate(px, py, pz, ex, ey, ez, pos, twist, row):
    """Return e . v of the material point p of a body whose frame at pos[row] moves with twist[row]."""
    rx, ry, rz = px - pos[row, 0], py - pos[row, 1], pz - pos[row, 2]
    vx = twist[row, 0] + twist[row, 4] * rz - twist[row, 5] * ry
    vy = twist[row, 1] + twist[row, 5] * rx - twist[row, 3] * rz
    vz = twist[row, 2] + twist[row, 3] * ry - twist[row, 4] * rx
    return ex * vx + ey * vy + ez * vz


@jit
def lengthening_rate(count, seg, pos, twist):
    """Return the lengthening speed (17) [m/s].

    pos (n + 2, 3): positions of origin, obstacles and insertion; twist (n + 2, 6): linear velocity of that position,
    then angular velocity, world frame [m/s, rad/s].
    """
    # (17): Σ e · (v of the far end - v of the near end); the sliding of the contact points has no effect
    rate = 0.0
    for j in range(count):
        ex, ey, ez = seg[j, G_E], seg[j, G_E + 1], seg[j, G_E + 2]
        near, far = int(seg[j, G_NEAR]) + 1, int(seg[j, G_FAR]) + 1
        rate += _point_rate(seg[j, G_B], seg[j, G_B + 1], seg[j, G_B + 2], ex, ey, ez, pos, twist, far)
        rate -= _point_rate(seg[j, G_A], seg[j, G_A + 1], seg[j, G_A + 2], ex, ey, ez, pos, twist, near)
    return rate


@jit
def _add_point_force(wrench, row, px, py, pz, fx, fy, fz):
    """Add force f at point p to wrench[row]: force, then moment about the world origin."""
    wrench[row, 0] += fx
    wrench[row, 1] += fy
    wrench[row, 2] += fz
    wrench[row, 3] += py * fz - pz * fy
    wrench[row, 4] += pz * fx - px * fz
    wrench[row, 5] += px * fy - py * fx


@jit
def add_wrenches(count, seg, tension, wrench):
    """Add to wrench (n + 2, 6) the forces and moments of a path under tension [N] on origin, obstacles and insertion.

    Tension pulls the near end of a segment along +e and its far end along -e. World frame, moments about the world
    origin [N, N m].
    """
    for j in range(count):
        fx, fy, fz = tension * seg[j, G_E], tension * seg[j, G_E + 1], tension * seg[j, G_E + 2]
        near, far = int(seg[j, G_NEAR]) + 1, int(seg[j, G_FAR]) + 1
        _add_point_force(wrench, near, seg[j, G_A], seg[j, G_A + 1], seg[j, G_A + 2], fx, fy, fz)
        _add_point_force(wrench, far, seg[j, G_B], seg[j, G_B + 1], seg[j, G_B + 2], -fx, -fy, -fz)
