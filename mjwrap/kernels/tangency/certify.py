"""Second-order part of the certificate: whether a tangent path is a local minimum of length, and a descent if not.

At a tangent path the second variation of the length depends only on sideways shifts x b_P and y b_Q of the contact
points. Straight segments of length L add |x b_P - y b_Q|²/L, geodesics (a x² - 2xy + r' y²)/r. Elimination from
the origin on gives a Riccati recursion for the stiffness k against a sideways shift of each point, where all points
before it are free to move:

    at the first P    k = 1/L
    along a geodesic  k_Q = (a' + k_P r') / (a + k_P r)
    over a segment    k_P = 1/L - (b_Q·b_P)²/L² / (1/L + k_Q)

The pivots a + k r and 1/L + k are all positive where the path is a minimum (Jacobi's condition for a whole row). See
"The certificate" in docs/derivation.md.
"""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import inlined, jit

S_MODE, TOUCHED, SIZE = lay.S_MODE, lay.TOUCHED, lay.SIZE
W_BP, W_BQ, W_JAC, W_L, W_LQ, W_X, W_Y = lay.W_BP, lay.W_BQ, lay.W_JAC, lay.W_L, lay.W_LQ, lay.W_X, lay.W_Y

# smallest admitted stiffness against a sideways shift, as a share of the stiffness of the segment alone
LEAST_STIFFNESS = -1e-9
LEAST_CURVATURE = -1e-9  # smallest admitted normal curvature times the surface's size
SHORTEST = 1e-12  # segments count as at least this long here [m]


@inlined
def _binormals_cosine(last, k, node):
    """Return b_Q·b_P, with b_Q of obstacle `last` and b_P of obstacle k."""
    return (
        node[last, W_BQ] * node[k, W_BP]
        + node[last, W_BQ + 1] * node[k, W_BP + 1]
        + node[last, W_BQ + 2] * node[k, W_BP + 2]
    )


@jit
def is_local_minimum(lo, hi, node):
    """Return whether the path of the last evaluation is a local minimum of length.

    Besides the condition on sideways shifts, the normal curvature must not be negative anywhere on a geodesic: there
    the string would lift off and become shorter.
    """
    last = -1
    stiffness = 0.0
    for k in range(lo, hi):
        if node[k, S_MODE] != TOUCHED:
            continue
        # over the segment that arrives at P, from the fixed origin or from the obstacle before
        segment = 1.0 / max(node[k, W_L], SHORTEST)
        if last < 0:
            stiffness = segment
        else:
            pivot = segment + stiffness
            if pivot <= LEAST_STIFFNESS * segment:
                return False
            cosine = _binormals_cosine(last, k, node)
            stiffness = segment - cosine * cosine * segment * segment / pivot
        # a conjugate point on the geodesic, or a hollow below it
        if node[k, lay.W_RMIN] <= 0.0 or node[k, lay.W_KMIN] < LEAST_CURVATURE / node[k, SIZE]:
            return False
        # along the geodesic to Q
        field = node[k, W_JAC] + stiffness * node[k, W_JAC + 2]
        if field <= 0.0:
            return False
        stiffness = (node[k, W_JAC + 1] + stiffness * node[k, W_JAC + 3]) / field
        last = k
    if last < 0:
        return True
    # the last segment ends at the insertion, which is fixed
    segment = 1.0 / max(node[last, W_LQ], SHORTEST)
    return segment + stiffness > LEAST_STIFFNESS * segment


@jit
def shift_off_saddle(lo, hi, node, size):
    """Write to W_Y + 1 and W_Y + 2 a variation (δ1, δ2) by which the path of the last evaluation gets shorter.

    The first pivot of `is_local_minimum` that is not positive gives a direction of negative second variation in the
    shifts x, y of P and Q of all obstacles up to its own. The largest shift is `size` times the surface's size. Returns
    that obstacle, or -1 where all pivots are positive.
    """
    last = -1
    stiffness = 0.0
    failed, at_q = -1, False
    # forward: the recursion; W_X is the shift y of `last` for x = 1 here, W_X + 1 the shift x here for y = 1
    for k in range(lo, hi):
        if node[k, S_MODE] != TOUCHED:
            continue
        segment = 1.0 / max(node[k, W_L], SHORTEST)
        node[k, W_X] = 0.0
        if last < 0:
            stiffness = segment
        else:
            cosine = _binormals_cosine(last, k, node)
            pivot = segment + stiffness
            if pivot <= 0.0:
                failed, at_q = last, True
                break
            node[k, W_X] = cosine * segment / pivot
            stiffness = segment - cosine * cosine * segment * segment / pivot
        field = node[k, W_JAC] + stiffness * node[k, W_JAC + 2]
        if field <= 0.0 or node[k, lay.W_RMIN] <= 0.0:
            failed = k
            break
        node[k, W_X + 1] = 1.0 / field
        stiffness = (node[k, W_JAC + 1] + stiffness * node[k, W_JAC + 3]) / field
        last = k
    if failed < 0 and last >= 0 and 1.0 / max(node[last, W_LQ], SHORTEST) + stiffness <= 0.0:
        failed, at_q = last, True
    if failed < 0:
        return -1
    # backward: the shifts that go with a unit shift of the point whose pivot failed
    x, y = 1.0, 0.0
    if at_q:
        x, y = node[failed, W_X + 1], 1.0
    largest = 0.0
    for k in range(failed, lo - 1, -1):
        if node[k, S_MODE] != TOUCHED:
            continue
        # x = δ1 and y = a δ1 + r δ2
        node[k, W_Y + 1] = x
        r = node[k, W_JAC + 2]
        node[k, W_Y + 2] = (y - node[k, W_JAC] * x) / r if abs(r) > SHORTEST else 0.0
        largest = max(largest, max(abs(x), abs(y)) / node[k, SIZE])
        y = node[k, W_X] * x
        x = node[_touched_before(k, lo, node), W_X + 1] * y
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED:
            scale = size / largest if k <= failed else 0.0
            node[k, W_Y + 1] *= scale
            node[k, W_Y + 2] = min(max(node[k, W_Y + 2] * scale, -1.0), 1.0)
    return failed


@jit
def _touched_before(k, lo, node):
    """Return the touched node before k, or k."""
    for j in range(k - 1, lo - 1, -1):
        if node[j, S_MODE] == TOUCHED:
            return j
    return k
