"""Velocity and forces of a solved path, from its straight segments alone ("Velocity and force" in docs/derivation.md).

At any instant each end of a straight segment is a material point of some body. The list `seg` has a row for each
segment: its near and far node (lo - 1 is the chain's origin, hi its insertion), near point, far point, and the unit
vector e from near to far, in the world frame. Where a segment on a surface has no length, e is the geodesic's tangent.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import from_python, jit
from mjwrap.kernels.tangency.tangency_error import ON_SURFACE
from mjwrap.kernels.wraps.ruled import INSIDE

G_NEAR = 0
G_FAR = 1
G_A = 2  # near point (3) [m]
G_B = 5  # far point (3) [m]
G_E = 8  # unit vector (3)
SEGMENT = 11

VANISHING = 1e-200  # a segment that is not longer has no direction [m]


@jit
def _height_over_contact(k, at_p, x, y, z, node):
    """Return the height of a point, relative to the base, over the tangent plane at P or Q of row k [m]."""
    point, normal = (lay.W_P, lay.W_NP) if at_p else (lay.W_Q, lay.W_NQ)
    return (
        node[k, normal] * (x - node[k, point])
        + node[k, normal + 1] * (y - node[k, point + 1])
        + node[k, normal + 2] * (z - node[k, point + 2])
    )


@jit
def is_below_contact(k, at_p, x, y, z, node):
    """Return whether an end next to P or Q of row k, relative to the base, lies inside a surface that keeps it out."""
    return (
        node[k, lay.INSIDE] == 0.0
        and _height_over_contact(k, at_p, x, y, z, node) < (INSIDE - 1.0) * node[k, lay.SIZE]
    )


@jit
def set_pull_at_end(j, k, at_p, node, base, seg):
    """Make segment j the force between row k's surface and an end inside it, acting at the end: e = (I + h W)^-1 t.

    at_p: the end is the string's first point, next to P, else its last one, next to Q. e is not a unit vector but minus
    the gradient of the length with respect to the end; see `spans/end_inside.py`.
    """
    end, other = (G_A, G_B) if at_p else (G_B, G_A)
    tangent, binormal = (lay.W_TP, lay.W_BP) if at_p else (lay.W_TQ, lay.W_BQ)
    curvature = lay.W_KP if at_p else lay.W_KQ
    x, y, z = seg[j, end] - base[0], seg[j, end + 1] - base[1], seg[j, end + 2] - base[2]
    h = _height_over_contact(k, at_p, x, y, z, node)
    kappa, tau, beta = node[k, curvature], node[k, curvature + 1], node[k, curvature + 2]
    # the inverse of [[1 + h κ, h τ], [h τ, 1 + h β]] in the frame (t, b), times t
    over = 1.0 / ((1.0 + h * kappa) * (1.0 + h * beta) - h * h * tau * tau)
    along, aside = (1.0 + h * beta) * over, -h * tau * over
    for i in range(3):
        seg[j, G_E + i] = along * node[k, tangent + i] + aside * node[k, binormal + i]
        # both points of the segment are the end: the force acts there on the surface's body, too
        seg[j, other + i] = seg[j, end + i]


@from_python
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
        # an end that a rounded number has put below the surface on which it lies
        to_surface = k < hi and node[k, lay.KIND] != lay.VIA
        from_surface = near >= lo and node[near, lay.KIND] != lay.VIA
        if to_surface and not from_surface:
            if size <= lay.AS_WRITTEN * node[k, lay.SIZE] and is_below_contact(k, True, x, y, z, node):
                set_pull_at_end(count, k, True, node, (ox, oy, oz), seg)
        elif from_surface and not to_surface and size <= lay.AS_WRITTEN * node[near, lay.SIZE]:  # noqa: SIM102
            if is_below_contact(near, False, px, py, pz, node):
                set_pull_at_end(count, near, False, node, (ox, oy, oz), seg)
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


@from_python
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


@from_python
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
