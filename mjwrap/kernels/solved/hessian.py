"""How a solved path changes when bodies move: sliding of the contact points, and the Hessian of its length.

Implicit function theorem on the tangency conditions h = 0 (method section 2). At a solution, where e = t, its
4 x 4 blocks come apart. Put x for the shift of P along b_P, y for that of Q along b_Q, relative to the surface; the
rows e.b = 0 contain these alone, and are the stationarity of

    sum over segments  |u + x b_P - y b_Q|^2 / L
    + sum over obstacles  (a x^2 - 2 x y + r' y^2) / r + 2 w.(x n_P - y n_Q)

(only components across e count), u the difference of the material velocities at a segment's ends and w the angular
velocity of an obstacle: a symmetric tridiagonal system. The rows e.n = 0 then give the slides along t one by one. As in
`certify.minimal`, shifts are eliminated from the origin on by a Riccati recursion in the stiffness c behind each
point, which divides neither by r, so that it holds at s = 0, nor by the normal curvature. Curvatures do not enter the
Hessian at all: an obstacle's share comes from its frames at P and Q and its Jacobi fields.

A chain over n obstacles and via points has n + 2 slots: origin, obstacles, insertion. Poses move by twists (n + 2, 6):
velocity of the pose's origin, then angular velocity, world frame. `stop` (rows of nodes + 2, STOP) holds the points
that the path runs through, one row each from the origin to the insertion, nodes that are not touched left out.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit
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
    STOP,
    TANGENT,
    dot,
    spin,
)  # fmt: skip
from mjwrap.kernels.tangency.newton import ON_SURFACE

SOUND = 0
VANISHING = 1  # a segment has no length: its direction has no derivative
MARGINAL = 2  # a sideways shift changes the length by nothing: it has no rate
FLAT = 3  # the surface is flat along the path: contact points slide at any speed

MARGIN = 1e-9  # smallest stiffness against a sideways shift, as a share of the segment's own
FLATTEST = 1e-12  # smallest normal curvature at a contact, in reciprocals of the surface's size
SHORTEST = 1e-150  # [m]


@jit
def _arrive(k, node, x, y, z, px, py, pz, i, stop):
    """Enter the segment from (x, y, z) to (px, py, pz) that ends at stop i, node k; return whether it has a length."""
    ex, ey, ez = px - x, py - y, pz - z
    size = math.sqrt(ex * ex + ey * ey + ez * ez)
    near = int(stop[i - 1, D_ROW]) - int(stop[i, D_ROW]) + k
    good = size > SHORTEST
    over = 1.0 / (size + SHORTEST)
    ex, ey, ez = ex * over, ey * over, ez * over
    if stop[i, D_TOUCHED] != FIXED and size <= ON_SURFACE * node[k, lay.SIZE]:
        good = False
        ex, ey, ez = node[k, lay.W_TP], node[k, lay.W_TP + 1], node[k, lay.W_TP + 2]
    elif stop[i - 1, D_TOUCHED] != FIXED and size <= ON_SURFACE * node[near, lay.SIZE]:
        good = False
        ex, ey, ez = node[near, lay.W_TQ], node[near, lay.W_TQ + 1], node[near, lay.W_TQ + 2]
    stop[i, D_E] = ex
    stop[i, D_E + 1] = ey
    stop[i, D_E + 2] = ez
    stop[i, D_L] = size
    return good


@jit
def list_stops(lo, hi, ox, oy, oz, ix, iy, iz, node, owner, stop):
    """Write the stops of the solved chain lo..hi and eliminate its shifts; return (how many, fault, slot at fault).

    owner (hi - lo,): to which obstacle, counted from the first one, each node belongs, two where a surface may be
    touched twice. Reads of a touched node only what its last evaluation left in the W_ columns. Where the fault is
    VANISHING or MARGINAL the gradient is sound all the same, a vanishing segment having its geodesic's direction.
    """
    fault, where = SOUND, 0
    x, y, z = 0.0, 0.0, 0.0
    for column in range(STOP):
        stop[0, column] = 0.0
    i = 0
    for k in range(lo, hi + 1):
        touched = k < hi and node[k, lay.KIND] != lay.VIA
        if touched and node[k, lay.S_MODE] != lay.TOUCHED:
            continue
        i += 1
        for column in range(STOP):
            stop[i, column] = 0.0
        stop[i, D_ROW] = k - lo
        if k < hi:
            stop[i, D_SLOT] = owner[k - lo] + 1
        else:
            stop[i, D_SLOT] = owner[k - 1 - lo] + 2 if hi > lo else 1
        stop[i, D_TOUCHED] = FIXED
        if touched:
            stop[i, D_TOUCHED] = CORNER if node[k, lay.INSIDE] > 0.0 else TANGENT
        cx, cy, cz = ix - ox, iy - oy, iz - oz
        if k < hi:
            cx, cy, cz = node[k, lay.POS] - ox, node[k, lay.POS + 1] - oy, node[k, lay.POS + 2] - oz
        px, py, pz = cx, cy, cz
        if touched:
            px, py, pz = node[k, lay.W_P], node[k, lay.W_P + 1], node[k, lay.W_P + 2]
        if not _arrive(k, node, x, y, z, px, py, pz, i, stop) and fault == SOUND:
            fault, where = VANISHING, int(stop[i - 1, D_SLOT])
        if stop[i - 1, D_TOUCHED] == CORNER:
            if not stiffen_corner(i - 1, stop) > MARGIN and fault == SOUND:
                fault, where = MARGINAL, int(stop[i - 1, D_SLOT])
        elif stop[i - 1, D_TOUCHED] == TANGENT:
            _square(i - 1, D_BQ, i, stop)
            stop[i - 1, D_PIVOT] = 1.0 + stop[i - 1, D_C] * stop[i, D_L]
            if not stop[i - 1, D_PIVOT] > MARGIN and fault == SOUND:
                fault, where = MARGINAL, int(stop[i - 1, D_SLOT])
        x, y, z = px, py, pz
        if touched:
            stop[i, D_P] = px - cx
            stop[i, D_P + 1] = py - cy
            stop[i, D_P + 2] = pz - cz
            x, y, z = node[k, lay.W_Q], node[k, lay.W_Q + 1], node[k, lay.W_Q + 2]
            stop[i, D_Q] = x - cx
            stop[i, D_Q + 1] = y - cy
            stop[i, D_Q + 2] = z - cz
            if stop[i, D_TOUCHED] == CORNER:
                list_corner(k, node, i, stop)
                continue
            for column in range(12):
                stop[i, D_NP + column] = node[k, lay.W_NP + column]
            stop[i, D_R] = node[k, lay.W_JAC + 2]
            for column in range(2):
                stop[i, D_KP + column] = node[k, lay.W_KP + column]
                stop[i, D_KQ + column] = node[k, lay.W_KQ + column]
            _square(i, D_BP, i, stop)
            _eliminate(k, node, i, stop)
            if not stop[i, D_FIELD] > MARGIN and fault == SOUND:
                fault, where = MARGINAL, int(stop[i, D_SLOT])
    return i + 1, fault, where


@jit
def _square(i, binormal, j, stop):
    """Take from a binormal of stop i what the tangency error leaves along the direction that arrives at stop j.

    With that the Hessian is symmetric to rounding, not to the tangency error.
    """
    along = dot(stop, i, binormal, j, D_E)
    for c in range(3):
        stop[i, binormal + c] -= along * stop[j, D_E + c]


@jit
def _eliminate(k, node, i, stop):
    """Carry the stiffness c from Q of the stop before over the segment to P of stop i, and along its geodesic to Q."""
    over = 1.0 / (stop[i, D_L] + SHORTEST)
    c = over
    if stop[i - 1, D_TOUCHED] == TANGENT:
        turn = dot(stop, i, D_BP, i - 1, D_BQ)
        stop[i, D_COS] = turn
        c = (1.0 - turn * turn + stop[i - 1, D_C] * stop[i, D_L]) * over / stop[i - 1, D_PIVOT]
    a, da = node[k, lay.W_JAC], node[k, lay.W_JAC + 1]
    r, dr = node[k, lay.W_JAC + 2], node[k, lay.W_JAC + 3]
    field = a + c * r
    stop[i, D_FIELD] = field
    stop[i, D_C] = (da + c * dr) / field


@jit
def _gap(i, twist, stop):
    """Write the material velocity at P of stop i less that at Q of the stop before."""
    near, far = int(stop[i - 1, D_SLOT]), int(stop[i, D_SLOT])
    x, y, z = stop[i, D_P], stop[i, D_P + 1], stop[i, D_P + 2]
    u = twist[far, 0] - twist[near, 0] + twist[far, 4] * z - twist[far, 5] * y
    v = twist[far, 1] - twist[near, 1] + twist[far, 5] * x - twist[far, 3] * z
    w = twist[far, 2] - twist[near, 2] + twist[far, 3] * y - twist[far, 4] * x
    x, y, z = stop[i - 1, D_Q], stop[i - 1, D_Q + 1], stop[i - 1, D_Q + 2]
    stop[i, D_U] = u - twist[near, 4] * z + twist[near, 5] * y
    stop[i, D_U + 1] = v - twist[near, 5] * x + twist[near, 3] * z
    stop[i, D_U + 2] = w - twist[near, 3] * y + twist[near, 4] * x


@jit
def shift(count, twist, stop):
    """Find the shifts x, y of all contact points and the rate of every segment's direction as the poses move."""
    for i in range(1, count):
        _gap(i, twist, stop)
        if stop[i, D_TOUCHED] == TANGENT:
            g = dot(stop, i, D_U, i, D_BP)
            if stop[i - 1, D_TOUCHED] == TANGENT:
                along = dot(stop, i, D_U, i - 1, D_BQ) - stop[i - 1, D_GQ] * stop[i, D_L]
                g -= stop[i, D_COS] * along / stop[i - 1, D_PIVOT]
            g = g / stop[i, D_L] + spin(i, D_NP, twist, stop)
            stop[i, D_GP] = g
            stop[i, D_GQ] = g / stop[i, D_FIELD] - spin(i, D_NQ, twist, stop)
    for i in range(count - 1, 0, -1):
        u, v, w = stop[i, D_U], stop[i, D_U + 1], stop[i, D_U + 2]
        j = i - 1
        if stop[i, D_TOUCHED] == CORNER:
            u, v, w = u + stop[i, D_SLIDE], v + stop[i, D_SLIDE + 1], w + stop[i, D_SLIDE + 2]
        else:
            x = stop[i, D_X]
            u, v, w = u + x * stop[i, D_BP], v + x * stop[i, D_BP + 1], w + x * stop[i, D_BP + 2]
        if stop[j, D_TOUCHED] == CORNER:
            slide_corner(j, twist, stop)
            u, v, w = u - stop[j, D_SLIDE], v - stop[j, D_SLIDE + 1], w - stop[j, D_SLIDE + 2]
        elif stop[j, D_TOUCHED] == TANGENT:
            y = u * stop[j, D_BQ] + v * stop[j, D_BQ + 1] + w * stop[j, D_BQ + 2]
            y = (y - stop[j, D_GQ] * stop[i, D_L]) / stop[j, D_PIVOT]
            stop[j, D_Y] = y
            stop[j, D_X] = (y - stop[j, D_GP] * stop[j, D_R]) / stop[j, D_FIELD]
            u -= y * stop[j, D_BQ]
            v -= y * stop[j, D_BQ + 1]
            w -= y * stop[j, D_BQ + 2]
        along = u * stop[i, D_E] + v * stop[i, D_E + 1] + w * stop[i, D_E + 2]
        over = 1.0 / stop[i, D_L]
        stop[i, D_RATE] = (u - along * stop[i, D_E]) * over
        stop[i, D_RATE + 1] = (v - along * stop[i, D_E + 1]) * over
        stop[i, D_RATE + 2] = (w - along * stop[i, D_E + 2]) * over


@jit
def _pull(sign, i, arm, j, column, stop, out):
    """Add to out[slot of stop i] the vector in `column` of stop j and its moment at the end of `arm`, with a sign."""
    k = int(stop[i, D_SLOT])
    fx, fy, fz = sign * stop[j, column], sign * stop[j, column + 1], sign * stop[j, column + 2]
    x, y, z = stop[i, arm], stop[i, arm + 1], stop[i, arm + 2]
    out[k, 0] += fx
    out[k, 1] += fy
    out[k, 2] += fz
    out[k, 3] += y * fz - z * fy
    out[k, 4] += z * fx - x * fz
    out[k, 5] += x * fy - y * fx


@jit
def add_gradient(count, stop, out):
    """Add dl/dx (n + 2, 6) to out: what tension one asks of every pose, force and moment about its origin."""
    for i in range(1, count):
        _pull(1.0, i, D_P, i, D_E, stop, out)
        _pull(-1.0, i - 1, D_Q, i, D_E, stop, out)


@jit
def _turn(sign, i, arm, j, twist, stop, out):
    """Add the symmetric part of d((w x arm) x e) of a rotating body, e the direction that arrives at stop j."""
    k = int(stop[i, D_SLOT])
    spin_e = sign * 0.5 * (
        twist[k, 3] * stop[j, D_E] + twist[k, 4] * stop[j, D_E + 1] + twist[k, 5] * stop[j, D_E + 2]
    )  # fmt: skip
    spin_arm = sign * 0.5 * spin(i, arm, twist, stop)
    along = sign * dot(stop, i, arm, j, D_E)
    for c in range(3):
        out[k, 3 + c] += spin_e * stop[i, arm + c] + spin_arm * stop[j, D_E + c] - along * twist[k, 3 + c]


@jit
def add_stiffness_times(count, twist, stop, out):
    """Add to out (n + 2, 6) the Hessian of the length times a motion of the poses.

    The coordinates of a pose are the translation of its origin and the rotation vector from where it is, so the Hessian
    is symmetric. The gradient's own rate, as add_gradient has it, differs by the moment m: rate = this - m x w / 2.
    """
    shift(count, twist, stop)
    for i in range(1, count):
        _pull(1.0, i, D_P, i, D_RATE, stop, out)
        _pull(-1.0, i - 1, D_Q, i, D_RATE, stop, out)
        if stop[i, D_TOUCHED] == FIXED:
            continue
        k = int(stop[i, D_SLOT])
        _turn(1.0, i, D_P, i, twist, stop, out)
        _turn(-1.0, i, D_Q, i + 1, twist, stop, out)
        if stop[i, D_TOUCHED] == CORNER:
            turn_corner(i, stop, out)
        else:
            for c in range(3):
                out[k, 3 + c] += stop[i, D_X] * stop[i, D_NP + c] - stop[i, D_Y] * stop[i, D_NQ + c]


@jit
def stiffness(count, stop, twist, out, matrix):
    """Write the Hessian (6 (n + 2), 6 (n + 2)); twist and out (n + 2, 6) are scratch."""
    slots = twist.shape[0]
    for k in range(slots):
        for c in range(6):
            twist[k, c] = 0.0
            for j in range(6 * slots):
                matrix[6 * k + c, j] = 0.0
    for i in range(count):
        k = int(stop[i, D_SLOT])
        for c in range(6 if stop[i, D_TOUCHED] != FIXED else 3):
            for j in range(count):
                for d in range(6):
                    out[int(stop[j, D_SLOT]), d] = 0.0
            twist[k, c] = 1.0
            add_stiffness_times(count, twist, stop, out)
            twist[k, c] = 0.0
            for j in range(count):
                row = int(stop[j, D_SLOT])
                for d in range(6):
                    matrix[6 * k + c, 6 * row + d] = out[row, d]  # symmetric: rows lie together in memory


@jit
def contact_rates(count, twist, size, stop, out):
    """Write velocity of P (3), of Q (3) and rate of s of every touched node to out (nodes, 7); return (fault, slot).

    Velocities of the geometric points, what the bodies carry along and what slides; world frame [m/s]. size (nodes,):
    of the surfaces [m], against which FLAT is judged.
    """
    shift(count, twist, stop)
    for i in range(1, count):
        if stop[i, D_TOUCHED] == FIXED:
            continue
        k = int(stop[i, D_ROW])
        if stop[i, D_TOUCHED] == CORNER:
            for column in (0, 3):
                _carry(i, D_P, twist, stop, out, column)
                for c in range(3):
                    out[k, column + c] += stop[i, D_SLIDE + c]
            out[k, 6] = 0.0
            continue
        least = FLATTEST / size[k]
        if not (abs(stop[i, D_KP]) > least and abs(stop[i, D_KQ]) > least):
            return FLAT, int(stop[i, D_SLOT])
        slide = dot(stop, i, D_RATE, i, D_NP) - spin(i, D_BP, twist, stop)
        slide = -(slide + stop[i, D_KP + 1] * stop[i, D_X]) / stop[i, D_KP]
        _velocity(i, D_P, i, slide, stop[i, D_X], D_BP, twist, stop, out, 0)
        slide_q = dot(stop, i + 1, D_RATE, i, D_NQ) - spin(i, D_BQ, twist, stop)
        slide_q = -(slide_q + stop[i, D_KQ + 1] * stop[i, D_Y]) / stop[i, D_KQ]
        _velocity(i, D_Q, i + 1, slide_q, stop[i, D_Y], D_BQ, twist, stop, out, 3)
        out[k, 6] = slide_q - slide
    return SOUND, 0


@jit
def _carry(i, arm, twist, stop, out, column):
    """Write the velocity of the point at the end of `arm` that the body of stop i carries along."""
    k = int(stop[i, D_SLOT])
    x, y, z = stop[i, arm], stop[i, arm + 1], stop[i, arm + 2]
    row = int(stop[i, D_ROW])
    out[row, column] = twist[k, 0] + twist[k, 4] * z - twist[k, 5] * y
    out[row, column + 1] = twist[k, 1] + twist[k, 5] * x - twist[k, 3] * z
    out[row, column + 2] = twist[k, 2] + twist[k, 3] * y - twist[k, 4] * x


@jit
def _velocity(i, arm, j, slide, sideways, binormal, twist, stop, out, column):
    """Write the velocity of a contact point of stop i: carried along, sliding along e of stop j, shifting along b."""
    row = int(stop[i, D_ROW])
    _carry(i, arm, twist, stop, out, column)
    for c in range(3):
        out[row, column + c] += slide * stop[j, D_E + c] + sideways * stop[i, binormal + c]
