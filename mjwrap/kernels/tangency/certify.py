"""What makes a tangent path a path of a taut string: the way it goes round, and that it cannot slip off sideways."""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit

KIND, DIM = lay.KIND, lay.DIM
S_MODE, S_P, S_T, S_ARC = lay.S_MODE, lay.S_P, lay.S_T, lay.S_ARC
W_P, W_Q, W_BP, W_BQ, W_JAC = lay.W_P, lay.W_Q, lay.W_BP, lay.W_BQ, lay.W_JAC
W_X, W_E, W_L, W_LQ, W_EQ, W_ANGLE = lay.W_X, lay.W_E, lay.W_L, lay.W_LQ, lay.W_EQ, lay.W_ANGLE

STABLE = -1e-9  # smallest admitted stiffness against a sideways shift, as a share of the segment's own
LEAST_PRESSURE = -1e-9  # of the normal curvature times the surface's size
SHORTEST = 1e-12  # segments count as at least this long here [m]


@jit
def minimal(lo, hi, node):
    """Return whether the path of the last evaluation is a local minimum of length.

    At a tangent path the second variation lives in sideways shifts x b_P, y b_Q of the contact points alone:
    straight segments add |x b_P - y b_Q|^2 / L, geodesics (a x^2 - 2 x y + r' y^2) / r. Eliminated from the origin
    on, its pivots are a Riccati recursion in the stiffness c behind each point: the Jacobi field a + c r must stay
    positive along every geodesic, and 1/L + c at every point that a straight segment leaves. Off the surface, the
    string must not gain by lifting off: its normal curvature is nowhere negative.
    """
    last = -1
    c = 0.0
    for k in range(lo, hi):
        if node[k, S_MODE] != lay.TOUCHED:
            continue
        over = 1.0 / max(node[k, W_L], SHORTEST)
        if last < 0:
            c = over
        else:
            pivot = over + c
            if pivot <= STABLE * over:
                return False
            turn = (
                node[last, W_BQ] * node[k, W_BP]
                + node[last, W_BQ + 1] * node[k, W_BP + 1]
                + node[last, W_BQ + 2] * node[k, W_BP + 2]
            )
            c = over - turn * turn * over * over / pivot
        if node[k, lay.W_RMIN] <= 0.0 or node[k, lay.W_KMIN] < LEAST_PRESSURE / node[k, lay.SIZE]:
            return False
        field = node[k, W_JAC] + c * node[k, W_JAC + 2]
        if field <= 0.0:
            return False
        c = (node[k, W_JAC + 1] + c * node[k, W_JAC + 3]) / field
        last = k
    if last < 0:
        return True
    over = 1.0 / max(node[last, W_LQ], SHORTEST)
    return over + c > STABLE * over


@jit
def slip(lo, hi, node, size):
    """Write to columns W_Y + 1, W_Y + 2 a sideways variation (d1, d2) by which the path of the last evaluation
    shortens.

    The second variation's pivots, as in `minimal`, with the shifts x, y of P and Q for unknowns; the first pivot that
    is
    not positive gives a direction of negative curvature, up to that obstacle. Scaled to `size`, in radii. Returns the
    obstacle, or -1 where there is none.
    """
    last = -1
    c, turn = 0.0, 0.0
    failed, far = -1, False
    for k in range(lo, hi):
        if node[k, S_MODE] != lay.TOUCHED:
            continue
        over = 1.0 / max(node[k, W_L], SHORTEST)
        node[k, W_X] = 0.0
        if last < 0:
            c = over
        else:
            turn = (
                node[last, W_BQ] * node[k, W_BP]
                + node[last, W_BQ + 1] * node[k, W_BP + 1]
                + node[last, W_BQ + 2] * node[k, W_BP + 2]
            )
            pivot = over + c
            if pivot <= 0.0:
                failed, far = last, True
                break
            node[k, W_X] = turn * over / pivot  # y of the last one that goes with x = 1 here
            c = over - turn * turn * over * over / pivot
        field = node[k, W_JAC] + c * node[k, W_JAC + 2]
        if field <= 0.0 or node[k, lay.W_RMIN] <= 0.0:
            failed = k
            break
        node[k, W_X + 1] = 1.0 / field  # x that goes with y = 1
        c = (node[k, W_JAC + 1] + c * node[k, W_JAC + 3]) / field
        last = k
    if failed < 0 and last >= 0 and 1.0 / max(node[last, W_LQ], SHORTEST) + c <= 0.0:
        failed, far = last, True
    if failed < 0:
        return -1
    x, y = 1.0, 0.0
    if far:
        x, y = node[failed, W_X + 1], 1.0
    most = 0.0
    for k in range(failed, lo - 1, -1):
        if node[k, S_MODE] != lay.TOUCHED:
            continue
        node[k, lay.W_Y + 1] = x
        r = node[k, W_JAC + 2]
        node[k, lay.W_Y + 2] = (y - node[k, W_JAC] * x) / r if abs(r) > SHORTEST else 0.0
        most = max(most, max(abs(x), abs(y)) / node[k, lay.SIZE])
        y = node[k, W_X] * x
        x = node[_before(k, lo, node), W_X + 1] * y
    for k in range(lo, hi):
        if node[k, S_MODE] == lay.TOUCHED:
            scale = size / most if k <= failed else 0.0
            node[k, lay.W_Y + 1] *= scale
            node[k, lay.W_Y + 2] = min(max(node[k, lay.W_Y + 2] * scale, -1.0), 1.0)
    return failed


@jit
def _before(k, lo, node):
    """Return the touched node before k, or k."""
    for j in range(k - 1, lo - 1, -1):
        if node[j, S_MODE] == lay.TOUCHED:
            return j
    return k
