"""Derivatives of a solved path as bodies move: sliding of the contact points, and the Hessian of the path's length.

The implicit function theorem is applied to the tangency conditions h = 0, whose Jacobian is in
`tangency/path_error.py`. At a solution, where e = t, its 4 x 4 blocks decouple. Let x be the shift of P along b_P and y
that of Q along b_Q, relative to the surface. The rows e.b = 0 contain only these, and are the stationarity of

    sum over segments  |u + x b_P - y b_Q|^2 / L
    + sum over obstacles  (a x^2 - 2 x y + r' y^2) / r + 2 w.(x n_P - y n_Q)

with only the components perpendicular to e, u the difference of the material velocities at a segment's ends, and w the
angular velocity of an obstacle: a symmetric tridiagonal system. The rows e.n = 0 then give the slides along t, one by
one. As in `certify.is_local_minimum`, the shifts are eliminated from the origin on by a Riccati recursion for the
stiffness c behind each point. It divides neither by r, so that it holds at s = 0, nor by the normal curvature. The
Hessian does not contain curvatures: an obstacle enters with its frames at P and Q and its Jacobi fields. See "Stiffness
and sliding contacts" in docs/derivation.md.

A chain over n obstacles and via points has n + 2 slots: origin, obstacles, insertion. Poses move by twists (n + 2, 6):
velocity of the pose's origin, then angular velocity, world frame. `points` (nodes + 2, POINT_ROW) has a row for each
point on the path, from the origin to the insertion, without the nodes that are not touched (`path_points.py`).
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import from_python, jit
from mjwrap.kernels.solved.inside_corners import list_corner, slide_corner, stiffen_corner, turn_corner
from mjwrap.kernels.solved.path_points import (
    CORNER,
    D_BP,
    D_BQ,
    D_C,
    D_COS,
    D_E,
    D_FIELD,
    D_GP,
    D_GQ,
    D_KP,
    D_KQ,
    D_L,
    D_NP,
    D_NQ,
    D_P,
    D_PIVOT,
    D_Q,
    D_R,
    D_RATE,
    D_ROW,
    D_SLIDE,
    D_SLOT,
    D_TOUCHED,
    D_U,
    D_X,
    D_Y,
    FIXED,
    POINT_ROW,
    TANGENT,
    angular_velocity_along,
    dot,
)  # fmt: skip
from mjwrap.kernels.tangency.tangency_error import ON_SURFACE

# Reasons why a path, or one of its quantities, has no derivative.
NO_FAULT = 0
VANISHING = 1  # a segment has no length: its direction has no derivative
MARGINAL = 2  # a sideways shift does not change the length: the rate of the shift is not determined
FLAT = 3  # the surface is flat along the path: the sliding speed of the contact point is not determined

MARGIN = 1e-9  # smallest stiffness against a sideways shift, as a share of the segment's own
SHORTEST = 1e-150  # [m]


@jit
def _shortest(k, node, normal, ex, ey, ez):
    """Return the length below which a segment at row k is none [m]; e: its direction, away from its other end.

    One that rises steeply to the surface begins at an end that a rounded number has put below it.
    """
    rise = ex * node[k, normal] + ey * node[k, normal + 1] + ez * node[k, normal + 2]
    return (lay.AS_WRITTEN if rise > 0.5 else ON_SURFACE) * node[k, lay.SIZE]


@jit
def _write_arriving_segment(k, node, x, y, z, px, py, pz, i, points):
    """Write the segment from (x, y, z) to (px, py, pz), at point i and node k; return whether it has a length."""
    ex, ey, ez = px - x, py - y, pz - z
    size = math.sqrt(ex * ex + ey * ey + ez * ez)
    near = int(points[i - 1, D_ROW]) - int(points[i, D_ROW]) + k
    # a segment without length on a surface has the direction of the geodesic
    good = size > SHORTEST
    over = 1.0 / (size + SHORTEST)
    ex, ey, ez = ex * over, ey * over, ez * over
    if points[i, D_TOUCHED] != FIXED and size <= _shortest(k, node, lay.W_NP, ex, ey, ez):
        good = False
        ex, ey, ez = node[k, lay.W_TP], node[k, lay.W_TP + 1], node[k, lay.W_TP + 2]
    elif points[i - 1, D_TOUCHED] != FIXED and size <= _shortest(near, node, lay.W_NQ, -ex, -ey, -ez):
        good = False
        ex, ey, ez = node[near, lay.W_TQ], node[near, lay.W_TQ + 1], node[near, lay.W_TQ + 2]
    points[i, D_E] = ex
    points[i, D_E + 1] = ey
    points[i, D_E + 2] = ez
    points[i, D_L] = size
    return good


@from_python
def list_path_points(lo, hi, ox, oy, oz, ix, iy, iz, node, owner, points):
    """Write the points of the solved chain lo..hi and eliminate its shifts; return (how many, fault, slot at fault).

    owner (hi - lo,): number of the obstacle to which each node belongs; a surface that may be touched twice has two
    nodes. Of a touched node only the W_ columns of its last evaluation are read. With the faults VANISHING and MARGINAL
    the gradient is valid nevertheless: a segment without length has the direction of its geodesic.
    """
    fault, where = NO_FAULT, 0
    x, y, z = 0.0, 0.0, 0.0
    for column in range(POINT_ROW):
        points[0, column] = 0.0
    i = 0
    for k in range(lo, hi + 1):
        touched = k < hi and node[k, lay.KIND] != lay.VIA
        if touched and node[k, lay.S_MODE] != lay.TOUCHED:
            continue
        i += 1
        for column in range(POINT_ROW):
            points[i, column] = 0.0
        points[i, D_ROW] = k - lo
        if k < hi:
            points[i, D_SLOT] = owner[k - lo] + 1
        else:
            points[i, D_SLOT] = owner[k - 1 - lo] + 2 if hi > lo else 1
        points[i, D_TOUCHED] = FIXED
        if touched:
            points[i, D_TOUCHED] = CORNER if node[k, lay.INSIDE] > 0.0 else TANGENT
        cx, cy, cz = ix - ox, iy - oy, iz - oz
        if k < hi:
            cx, cy, cz = node[k, lay.POS] - ox, node[k, lay.POS + 1] - oy, node[k, lay.POS + 2] - oz
        px, py, pz = cx, cy, cz
        if touched:
            px, py, pz = node[k, lay.W_P], node[k, lay.W_P + 1], node[k, lay.W_P + 2]
        if not _write_arriving_segment(k, node, x, y, z, px, py, pz, i, points) and fault == NO_FAULT:
            fault, where = VANISHING, int(points[i - 1, D_SLOT])
        if points[i - 1, D_TOUCHED] == CORNER:
            if not stiffen_corner(i - 1, points) > MARGIN and fault == NO_FAULT:
                fault, where = MARGINAL, int(points[i - 1, D_SLOT])
        elif points[i - 1, D_TOUCHED] == TANGENT:
            _remove_part_along_segment(i - 1, D_BQ, i, points)
            points[i - 1, D_PIVOT] = 1.0 + points[i - 1, D_C] * points[i, D_L]
            if not points[i - 1, D_PIVOT] > MARGIN and fault == NO_FAULT:
                fault, where = MARGINAL, int(points[i - 1, D_SLOT])
        x, y, z = px, py, pz
        if touched:
            points[i, D_P] = px - cx
            points[i, D_P + 1] = py - cy
            points[i, D_P + 2] = pz - cz
            x, y, z = node[k, lay.W_Q], node[k, lay.W_Q + 1], node[k, lay.W_Q + 2]
            points[i, D_Q] = x - cx
            points[i, D_Q + 1] = y - cy
            points[i, D_Q + 2] = z - cz
            if points[i, D_TOUCHED] == CORNER:
                list_corner(k, node, i, points)
                continue
            for column in range(12):
                points[i, D_NP + column] = node[k, lay.W_NP + column]
            points[i, D_R] = node[k, lay.W_JAC + 2]
            for column in range(2):
                points[i, D_KP + column] = node[k, lay.W_KP + column]
                points[i, D_KQ + column] = node[k, lay.W_KQ + column]
            _remove_part_along_segment(i, D_BP, i, points)
            _carry_stiffness(k, node, i, points)
            if not points[i, D_FIELD] > MARGIN and fault == NO_FAULT:
                fault, where = MARGINAL, int(points[i, D_SLOT])
    return i + 1, fault, where


@jit
def _remove_part_along_segment(i, binormal, j, points):
    """Remove from a binormal of point i its component along the segment that arrives at point j.

    The tangency error leaves a small one. Without it the Hessian is symmetric up to rounding errors.
    """
    along = dot(points, i, binormal, j, D_E)
    for c in range(3):
        points[i, binormal + c] -= along * points[j, D_E + c]


@jit
def _carry_stiffness(k, node, i, points):
    """Carry the stiffness c from Q of the point before over the segment to P of point i, and on to its Q."""
    # over the segment: c = 1/L - (b_Q·b_P)²/L² / (1/L + c), in a form without cancellation; from a fixed point 1/L
    over = 1.0 / (points[i, D_L] + SHORTEST)
    c = over
    if points[i - 1, D_TOUCHED] == TANGENT:
        turn = dot(points, i, D_BP, i - 1, D_BQ)
        points[i, D_COS] = turn
        c = (1.0 - turn * turn + points[i - 1, D_C] * points[i, D_L]) * over / points[i - 1, D_PIVOT]
    # along the geodesic: c = (a' + c r') / (a + c r)
    a, da = node[k, lay.W_JAC], node[k, lay.W_JAC + 1]
    r, dr = node[k, lay.W_JAC + 2], node[k, lay.W_JAC + 3]
    field = a + c * r
    points[i, D_FIELD] = field
    points[i, D_C] = (da + c * dr) / field


@jit
def _velocity_difference(i, twist, points):
    """Write the material velocity at P of point i minus that at Q of the point before."""
    near, far = int(points[i - 1, D_SLOT]), int(points[i, D_SLOT])
    x, y, z = points[i, D_P], points[i, D_P + 1], points[i, D_P + 2]
    u = twist[far, 0] - twist[near, 0] + twist[far, 4] * z - twist[far, 5] * y
    v = twist[far, 1] - twist[near, 1] + twist[far, 5] * x - twist[far, 3] * z
    w = twist[far, 2] - twist[near, 2] + twist[far, 3] * y - twist[far, 4] * x
    x, y, z = points[i - 1, D_Q], points[i - 1, D_Q + 1], points[i - 1, D_Q + 2]
    points[i, D_U] = u - twist[near, 4] * z + twist[near, 5] * y
    points[i, D_U + 1] = v - twist[near, 5] * x + twist[near, 3] * z
    points[i, D_U + 2] = w - twist[near, 3] * y + twist[near, 4] * x


@jit
def sideways_shifts(count, twist, points):
    """Find the shifts x, y of all contact points and the rate of every segment's direction as the poses move."""
    # forward elimination: slopes of the energy at P and Q, where all points before them are free to move
    for i in range(1, count):
        _velocity_difference(i, twist, points)
        if points[i, D_TOUCHED] == TANGENT:
            g = dot(points, i, D_U, i, D_BP)
            if points[i - 1, D_TOUCHED] == TANGENT:
                along = dot(points, i, D_U, i - 1, D_BQ) - points[i - 1, D_GQ] * points[i, D_L]
                g -= points[i, D_COS] * along / points[i - 1, D_PIVOT]
            g = g / points[i, D_L] + angular_velocity_along(i, D_NP, twist, points)
            points[i, D_GP] = g
            points[i, D_GQ] = g / points[i, D_FIELD] - angular_velocity_along(i, D_NQ, twist, points)
    # back substitution: x of point i is known, y and x of the one before follow, and with both the rate of e
    for i in range(count - 1, 0, -1):
        u, v, w = points[i, D_U], points[i, D_U + 1], points[i, D_U + 2]
        j = i - 1
        if points[i, D_TOUCHED] == CORNER:
            u, v, w = u + points[i, D_SLIDE], v + points[i, D_SLIDE + 1], w + points[i, D_SLIDE + 2]
        else:
            x = points[i, D_X]
            u, v, w = u + x * points[i, D_BP], v + x * points[i, D_BP + 1], w + x * points[i, D_BP + 2]
        if points[j, D_TOUCHED] == CORNER:
            slide_corner(j, twist, points)
            u, v, w = u - points[j, D_SLIDE], v - points[j, D_SLIDE + 1], w - points[j, D_SLIDE + 2]
        elif points[j, D_TOUCHED] == TANGENT:
            y = u * points[j, D_BQ] + v * points[j, D_BQ + 1] + w * points[j, D_BQ + 2]
            y = (y - points[j, D_GQ] * points[i, D_L]) / points[j, D_PIVOT]
            points[j, D_Y] = y
            points[j, D_X] = (y - points[j, D_GP] * points[j, D_R]) / points[j, D_FIELD]
            u -= y * points[j, D_BQ]
            v -= y * points[j, D_BQ + 1]
            w -= y * points[j, D_BQ + 2]
        # de = (I - e eᵀ)/L times the difference of the velocities at both ends
        along = u * points[i, D_E] + v * points[i, D_E + 1] + w * points[i, D_E + 2]
        over = 1.0 / points[i, D_L]
        points[i, D_RATE] = (u - along * points[i, D_E]) * over
        points[i, D_RATE + 1] = (v - along * points[i, D_E + 1]) * over
        points[i, D_RATE + 2] = (w - along * points[i, D_E + 2]) * over


@jit
def _add_force_and_moment(sign, i, arm, j, column, points, out):
    """Add to out[slot of point i] the vector in `column` of point j and its moment at the end of `arm`, with a sign."""
    k = int(points[i, D_SLOT])
    fx, fy, fz = sign * points[j, column], sign * points[j, column + 1], sign * points[j, column + 2]
    x, y, z = points[i, arm], points[i, arm + 1], points[i, arm + 2]
    out[k, 0] += fx
    out[k, 1] += fy
    out[k, 2] += fz
    out[k, 3] += y * fz - z * fy
    out[k, 4] += z * fx - x * fz
    out[k, 5] += x * fy - y * fx


@from_python
def add_gradient(count, points, out):
    """Add dl/dx (n + 2, 6) to out: the derivatives of the length in translation and rotation of every pose."""
    for i in range(1, count):
        _add_force_and_moment(1.0, i, D_P, i, D_E, points, out)
        _add_force_and_moment(-1.0, i - 1, D_Q, i, D_E, points, out)


@jit
def _add_rotation_part(sign, i, arm, j, twist, points, out):
    """Add the symmetric part of (w x arm) x e of a rotating body; e: unit vector of the segment that arrives at j."""
    k = int(points[i, D_SLOT])
    spin_e = sign * 0.5 * (
        twist[k, 3] * points[j, D_E] + twist[k, 4] * points[j, D_E + 1] + twist[k, 5] * points[j, D_E + 2]
    )  # fmt: skip
    spin_arm = sign * 0.5 * angular_velocity_along(i, arm, twist, points)
    along = sign * dot(points, i, arm, j, D_E)
    for c in range(3):
        out[k, 3 + c] += spin_e * points[i, arm + c] + spin_arm * points[j, D_E + c] - along * twist[k, 3 + c]


@from_python
def add_stiffness_times(count, twist, points, out):
    """Add to out (n + 2, 6) the Hessian of the length times a motion of the poses.

    The coordinates of a pose are the translation of its origin and the rotation vector from its present orientation, so
    that the Hessian is symmetric. The rate of the gradient that `add_gradient` computes differs in the moment m:
    rate = this - m x w / 2.
    """
    sideways_shifts(count, twist, points)
    for i in range(1, count):
        _add_force_and_moment(1.0, i, D_P, i, D_RATE, points, out)
        _add_force_and_moment(-1.0, i - 1, D_Q, i, D_RATE, points, out)
        if points[i, D_TOUCHED] == FIXED:
            continue
        k = int(points[i, D_SLOT])
        _add_rotation_part(1.0, i, D_P, i, twist, points, out)
        _add_rotation_part(-1.0, i, D_Q, i + 1, twist, points, out)
        if points[i, D_TOUCHED] == CORNER:
            turn_corner(i, points, out)
        else:
            for c in range(3):
                out[k, 3 + c] += points[i, D_X] * points[i, D_NP + c] - points[i, D_Y] * points[i, D_NQ + c]


@from_python
def stiffness(count, points, twist, out, matrix):
    """Write the Hessian (6 (n + 2), 6 (n + 2)); twist and out (n + 2, 6) are scratch."""
    slots = twist.shape[0]
    for k in range(slots):
        for c in range(6):
            twist[k, c] = 0.0
            for j in range(6 * slots):
                matrix[6 * k + c, j] = 0.0
    # column after column: the Hessian times each unit motion; a fixed point has no rotation
    for i in range(count):
        k = int(points[i, D_SLOT])
        for c in range(6 if points[i, D_TOUCHED] != FIXED else 3):
            for j in range(count):
                for d in range(6):
                    out[int(points[j, D_SLOT]), d] = 0.0
            twist[k, c] = 1.0
            add_stiffness_times(count, twist, points, out)
            twist[k, c] = 0.0
            for j in range(count):
                row = int(points[j, D_SLOT])
                for d in range(6):
                    matrix[6 * k + c, 6 * row + d] = out[row, d]  # symmetric: rows lie together in memory
