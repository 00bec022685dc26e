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
from mjwrap.kernels.newton import ON_SURFACE

D_SLOT = 0
D_TOUCHED = 1
D_P = 2  # P from the pose's origin (3) [m]
D_Q = 5  # Q from the pose's origin (3) [m]
D_E = 8  # unit vector of the segment that arrives (3)
D_L = 11  # its length [m]
D_NP = 12  # n_P, n_Q, b_P, b_Q (3 each), in the order of the node row
D_NQ = 15
D_BP = 18
D_BQ = 21
D_R = 24  # Jacobi field r at Q [m]
D_KP = 25  # kappa, tau at P
D_KQ = 27  # kappa, tau at Q
D_COS = 29  # b_P . b_Q of the stop before
D_FIELD = 30  # a + c r: the Jacobi field that the path before P allows
D_PIVOT = 31  # 1 + c L of the segment that leaves
D_C = 32  # stiffness c behind Q [1/m]
D_U = 33  # difference of material velocities over the segment that arrives (3)
D_GP = 36  # slope of the energy at P and at Q, the path before eliminated
D_GQ = 37
D_X = 38  # shift of P along b_P, of Q along b_Q
D_Y = 39
D_RATE = 40  # rate of e (3)
D_ROW = 43  # of the node, from the chain's first one
STOP = 44

SOUND = 0
VANISHING = 1  # a segment has no length: its direction has no derivative
MARGINAL = 2  # a sideways shift changes the length by nothing: it has no rate
FLAT = 3  # the surface is flat along the path: contact points slide at any speed

MARGIN = 1e-9  # smallest stiffness against a sideways shift, as a share of the segment's own
FLATTEST = 1e-12  # smallest normal curvature at a contact, in reciprocals of the surface's size
SHORTEST = 1e-150  # [m]


@jit
def _dot(stop, i, left, j, right):
    """Return the dot product of two column triples of two stops."""
    return (
        stop[i, left] * stop[j, right]
        + stop[i, left + 1] * stop[j, right + 1]
        + stop[i, left + 2] * stop[j, right + 2]
    )


@jit
def _arrive(k, node, x, y, z, px, py, pz, i, stop):
    """Enter the segment from (x, y, z) to (px, py, pz) that ends at stop i, node k; return whether it has a length."""
    ex, ey, ez = px - x, py - y, pz - z
    size = math.sqrt(ex * ex + ey * ey + ez * ez)
    near = int(stop[i - 1, D_ROW]) - int(stop[i, D_ROW]) + k
    good = size > SHORTEST
    over = 1.0 / (size + SHORTEST)
    ex, ey, ez = ex * over, ey * over, ez * over
    if stop[i, D_TOUCHED] != 0.0 and size <= ON_SURFACE * node[k, lay.SIZE]:
        good = False
        ex, ey, ez = node[k, lay.W_TP], node[k, lay.W_TP + 1], node[k, lay.W_TP + 2]
    elif stop[i - 1, D_TOUCHED] != 0.0 and size <= ON_SURFACE * node[near, lay.SIZE]:
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
        stop[i, D_TOUCHED] = 1.0 if touched else 0.0
        cx, cy, cz = ix - ox, iy - oy, iz - oz
        if k < hi:
            cx, cy, cz = node[k, lay.POS] - ox, node[k, lay.POS + 1] - oy, node[k, lay.POS + 2] - oz
        px, py, pz = cx, cy, cz
        if touched:
            px, py, pz = node[k, lay.W_P], node[k, lay.W_P + 1], node[k, lay.W_P + 2]
        if not _arrive(k, node, x, y, z, px, py, pz, i, stop) and fault == SOUND:
            fault, where = VANISHING, int(stop[i - 1, D_SLOT])
        if stop[i - 1, D_TOUCHED] != 0.0:
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
    along = _dot(stop, i, binormal, j, D_E)
    for c in range(3):
        stop[i, binormal + c] -= along * stop[j, D_E + c]


@jit
def _eliminate(k, node, i, stop):
    """Carry the stiffness c from Q of the stop before over the segment to P of stop i, and along its geodesic to Q."""
    over = 1.0 / (stop[i, D_L] + SHORTEST)
    c = over
    if stop[i - 1, D_TOUCHED] != 0.0:
        turn = _dot(stop, i, D_BP, i - 1, D_BQ)
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
def _spin(i, column, twist, stop):
    """Return the angular velocity of stop i's body along the vector in `column`."""
    k = int(stop[i, D_SLOT])
    return (
        twist[k, 3] * stop[i, column] + twist[k, 4] * stop[i, column + 1] + twist[k, 5] * stop[i, column + 2]
    )


@jit
def shift(count, twist, stop):
    """Find the shifts x, y of all contact points and the rate of every segment's direction as the poses move."""
    for i in range(1, count):
        _gap(i, twist, stop)
        if stop[i, D_TOUCHED] != 0.0:
            g = _dot(stop, i, D_U, i, D_BP)
            if stop[i - 1, D_TOUCHED] != 0.0:
                along = _dot(stop, i, D_U, i - 1, D_BQ) - stop[i - 1, D_GQ] * stop[i, D_L]
                g -= stop[i, D_COS] * along / stop[i - 1, D_PIVOT]
            g = g / stop[i, D_L] + _spin(i, D_NP, twist, stop)
            stop[i, D_GP] = g
            stop[i, D_GQ] = g / stop[i, D_FIELD] - _spin(i, D_NQ, twist, stop)
    for i in range(count - 1, 0, -1):
        x = stop[i, D_X]
        u = stop[i, D_U] + x * stop[i, D_BP]
        v = stop[i, D_U + 1] + x * stop[i, D_BP + 1]
        w = stop[i, D_U + 2] + x * stop[i, D_BP + 2]
        j = i - 1
        if stop[j, D_TOUCHED] != 0.0:
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
    spin_arm = sign * 0.5 * _spin(i, arm, twist, stop)
    along = sign * _dot(stop, i, arm, j, D_E)
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
        if stop[i, D_TOUCHED] != 0.0:
            k = int(stop[i, D_SLOT])
            _turn(1.0, i, D_P, i, twist, stop, out)
            _turn(-1.0, i, D_Q, i + 1, twist, stop, out)
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
        for c in range(6 if stop[i, D_TOUCHED] != 0.0 else 3):
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
        if stop[i, D_TOUCHED] == 0.0:
            continue
        k = int(stop[i, D_ROW])
        least = FLATTEST / size[k]
        if not (abs(stop[i, D_KP]) > least and abs(stop[i, D_KQ]) > least):
            return FLAT, int(stop[i, D_SLOT])
        slide = _dot(stop, i, D_RATE, i, D_NP) - _spin(i, D_BP, twist, stop)
        slide = -(slide + stop[i, D_KP + 1] * stop[i, D_X]) / stop[i, D_KP]
        _velocity(i, D_P, i, slide, stop[i, D_X], D_BP, twist, stop, out, 0)
        slide_q = _dot(stop, i + 1, D_RATE, i, D_NQ) - _spin(i, D_BQ, twist, stop)
        slide_q = -(slide_q + stop[i, D_KQ + 1] * stop[i, D_Y]) / stop[i, D_KQ]
        _velocity(i, D_Q, i + 1, slide_q, stop[i, D_Y], D_BQ, twist, stop, out, 3)
        out[k, 6] = slide_q - slide
    return SOUND, 0


@jit
def _velocity(i, arm, j, slide, sideways, binormal, twist, stop, out, column):
    """Write the velocity of a contact point of stop i: carried along, sliding along e of stop j, shifting along b."""
    k = int(stop[i, D_SLOT])
    x, y, z = stop[i, arm], stop[i, arm + 1], stop[i, arm + 2]
    row = int(stop[i, D_ROW])
    out[row, column] = twist[k, 0] + twist[k, 4] * z - twist[k, 5] * y
    out[row, column + 1] = twist[k, 1] + twist[k, 5] * x - twist[k, 3] * z
    out[row, column + 2] = twist[k, 2] + twist[k, 3] * y - twist[k, 4] * x
    for c in range(3):
        out[row, column + c] += slide * stop[j, D_E + c] + sideways * stop[i, binormal + c]
