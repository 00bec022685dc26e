"""Newton's method on the Darboux-frame residuals of all touched obstacles of a span.

Residual h = [e.n_P, e.b_P, e'.n_Q, e'.b_Q] per obstacle (Scholz; (31)), its analytic Jacobian in the natural geodesic
variations (method section 2) is block tridiagonal with 4 x 4 blocks. Steps are taken with h and judged by the
tangency error ||f||, f = [e - t_P, e' - t_Q] (18), which the folded path e = -t does not satisfy.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import apart, inlined, jit
from mjwrap.kernels.geometry.geodesics import displace, geodesic
from mjwrap.kernels.geometry.projection import into_frame
from mjwrap.kernels.geometry.table import project

S_MODE, S_P, S_ARC = lay.S_MODE, lay.S_P, lay.S_ARC
W_P, W_Q, W_TP, W_TQ, W_NP, W_NQ = lay.W_P, lay.W_Q, lay.W_TP, lay.W_TQ, lay.W_NP, lay.W_NQ
W_BP, W_BQ, W_KP, W_KQ, W_JAC = lay.W_BP, lay.W_BQ, lay.W_KP, lay.W_KQ, lay.W_JAC
W_E, W_L, W_CP, W_CQ, W_LQ, W_EQ = lay.W_E, lay.W_L, lay.W_CP, lay.W_CQ, lay.W_LQ, lay.W_EQ
W_PIN, W_LAND = lay.W_PIN, lay.W_LAND
SIZE = lay.SIZE
W_Y, W_X, W_SAVE = lay.W_Y, lay.W_X, lay.W_SAVE
TOUCHED = lay.TOUCHED

ON_SURFACE = 1e-6  # a straight segment shorter than this share of the size ends on the surface
SUNK = 2e-12  # an end point lower above the surface than this share of the size lies on it
LANDED = 0.01  # Q so far off an end point on the surface, in its size, counts like a direction that is off by 1 rad
PINNED = 1e-11  # a contact nearer than this share of the size to an end on the surface is at it
CORNER = 1e-6  # half the angle between two contacts that meet, beyond which they do not go on into each other [rad]
NOISE = 4e-16  # rounding of a point [m]: over a segment's length it bounds what its direction can say
MAX_TURN = 0.5  # largest change of direction in one step [rad]
MAX_SHIFT = 0.5  # largest shift of a contact point in one step, in radii
MAX_STRETCH = 1.0  # largest lengthening of a geodesic in one step, in radii
MAX_HALVINGS = 6
UNKNOWN, GEODESICS = (
    -1.0,
    -2.0,
)  # what the rows hold of their start, in the place of ||f||^2: nothing, or geodesics
SHORTEST = 1e-150  # keeps the reciprocal of a vanishing segment finite [m]


@inlined
def _dot(node, j, left, k, right):
    """Return the dot product of two column triples of two rows."""
    return (
        node[j, left] * node[k, right]
        + node[j, left + 1] * node[k, right + 1]
        + node[j, left + 2] * node[k, right + 2]
    )


@jit
def _leave(j, ex, ey, ez, size, last, node):
    """Enter the straight segment that leaves obstacle j, the path's last one or not; return its share of ||f||^2.

    Where the path ends on the surface its share is that of the way from Q to its end.
    """
    node[j, W_EQ] = ex
    node[j, W_EQ + 1] = ey
    node[j, W_EQ + 2] = ez
    node[j, W_LQ] = size
    node[j, W_PIN] = 0.0
    along = _dot(node, j, W_EQ, j, W_TQ)
    normal = _dot(node, j, W_EQ, j, W_NQ)
    binormal = _dot(node, j, W_EQ, j, W_BQ)
    if last and (node[j, W_LAND] != 0.0 or _on_surface(j, normal, size, node)):
        node[j, W_PIN] = 1.0
        node[j, W_CQ] = 0.0
        node[j, W_CQ + 1] = -size * along
        node[j, W_CQ + 2] = -size * binormal
        share = size / (LANDED * node[j, SIZE])
        return share * share * (along * along + binormal * binormal)
    node[j, W_CQ] = along
    node[j, W_CQ + 1] = normal
    node[j, W_CQ + 2] = binormal
    return _share(along, normal, binormal, size)


@inlined
def _on_surface(k, rise, size, node):
    """Return whether a straight segment, `size` long, is none because the path ends there on obstacle k's surface.

    rise: the component along the surface's normal of the direction from the contact to the end; negative where the end
    lies below, by no more than the share of the size from which on it counts as inside.
    """
    return size <= ON_SURFACE * node[k, SIZE] and size * rise <= SUNK * node[k, SIZE]


@inlined
def _share(along, normal, binormal, size):
    """Return one end's share of ||f||^2; nothing where the segment is so short that its direction says no more."""
    share = (1.0 - along) ** 2 + normal * normal + binormal * binormal
    return share if share * size * size > NOISE * NOISE else 0.0


@jit
def evaluate(lo, hi, ends, node):
    """Evaluate all touched obstacles of nodes lo..hi and the straight segments between; return ||f||^2.

    ends = (base x, y, z, A x, y, z, B x, y, z): A and B relative to the base point [m].
    """
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED:
            geodesic(k, node, ends[0], ends[1], ends[2])
    return connect(lo, hi, ends, node)


@jit
def connect(lo, hi, ends, node):
    """Put straight segments between the geodesics that the rows hold; return ||f||^2.

    Where an end point lies on a surface there is no straight segment whose direction could differ from t.
    """
    _, _, _, x, y, z, bx, by, bz = ends
    total = 0.0
    last = -1
    for k in range(lo, hi):
        if node[k, S_MODE] != TOUCHED:
            continue
        dx, dy, dz = node[k, W_P] - x, node[k, W_P + 1] - y, node[k, W_P + 2] - z
        size = math.sqrt(dx * dx + dy * dy + dz * dz)
        meets = last >= 0 and size <= ON_SURFACE * node[k, SIZE]
        if meets:
            # two contacts meet: where they do not go on into each other there is a corner
            dx, dy, dz = (
                node[last, W_TQ] + node[k, W_TP],
                node[last, W_TQ + 1] + node[k, W_TP + 1],
                node[last, W_TQ + 2] + node[k, W_TP + 2],
            )
            inverse = 1.0 / (math.sqrt(dx * dx + dy * dy + dz * dz) + SHORTEST)
        else:
            inverse = 1.0 / (size + SHORTEST)
        dx, dy, dz = dx * inverse, dy * inverse, dz * inverse
        node[k, W_E] = dx
        node[k, W_E + 1] = dy
        node[k, W_E + 2] = dz
        node[k, W_L] = size
        along = _dot(node, k, W_E, k, W_TP)
        normal = _dot(node, k, W_E, k, W_NP)
        binormal = _dot(node, k, W_E, k, W_BP)
        if last < 0 and _on_surface(k, -normal, size, node):
            along, normal, binormal = 1.0, 0.0, 0.0
        node[k, W_CP] = along
        node[k, W_CP + 1] = normal
        node[k, W_CP + 2] = binormal
        corner = meets and (1.0 - along) ** 2 + normal * normal + binormal * binormal > CORNER**2
        total += _share(along, normal, binormal, 1.0 if corner else size)
        if last >= 0:
            total += _leave(last, dx, dy, dz, size, False, node)
        x, y, z = node[k, W_Q], node[k, W_Q + 1], node[k, W_Q + 2]
        last = k
    if last >= 0:
        dx, dy, dz = bx - x, by - y, bz - z
        size = math.sqrt(dx * dx + dy * dy + dz * dz)
        inverse = 1.0 / (size + SHORTEST)
        total += _leave(last, dx * inverse, dy * inverse, dz * inverse, size, True, node)
    return total


@jit
def step(lo, hi, node):
    """Solve for the Newton step of every touched obstacle by a block Thomas sweep; the step is left in W_Y.

    Rows of a block: e.n_P, e.b_P, e'.n_Q, e'.b_Q; columns: the variations d0..d3. The lower coupling fills only the
    first two rows, the upper one only the last two rows and first two columns, so each block is eliminated by hand.
    Returns False where a block is singular.
    """
    last = -1
    for k in range(lo, hi):
        if node[k, S_MODE] != TOUCHED:
            continue
        kappa, tau, beta = node[k, W_KP], node[k, W_KP + 1], node[k, W_KP + 2]
        c, h0, h1 = node[k, W_CP], node[k, W_CP + 1], node[k, W_CP + 2]
        over = 1.0 / (node[k, W_L] + SHORTEST)
        m00 = kappa * c + tau * h1 - h0 * c * over
        m01 = tau * c + beta * h1 - h0 * h1 * over
        m10 = -tau * h0 - h1 * c * over
        m11 = (1.0 - h1 * h1) * over - beta * h0
        r0, r1 = -h0, -h1
        if last >= 0:  # lower coupling: the segment's near end moves with obstacle `last`
            ct, cb = node[last, W_CQ], node[last, W_CQ + 2]
            a, r = node[last, W_JAC], node[last, W_JAC + 2]
            nt = -(_dot(node, k, W_NP, last, W_TQ) - h0 * ct) * over
            nb = -(_dot(node, k, W_NP, last, W_BQ) - h0 * cb) * over
            bt = -(_dot(node, k, W_BP, last, W_TQ) - h1 * ct) * over
            bb = -(_dot(node, k, W_BP, last, W_BQ) - h1 * cb) * over
            y = node[last, W_Y] + node[last, W_Y + 3]
            w = a * node[last, W_Y + 1] + r * node[last, W_Y + 2]
            r0 -= nt * y + nb * w
            r1 -= bt * y + bb * w
            y = node[last, W_X] + node[last, W_X + 3]
            w = a * node[last, W_X + 1] + r * node[last, W_X + 2]
            m00 -= nt * y + nb * w
            m10 -= bt * y + bb * w
            y = node[last, W_X + 4] + node[last, W_X + 7]
            w = a * node[last, W_X + 5] + r * node[last, W_X + 6]
            m01 -= nt * y + nb * w
            m11 -= bt * y + bb * w
        kappa, tau, beta = node[k, W_KQ], node[k, W_KQ + 1], node[k, W_KQ + 2]
        cq, h2, h3 = node[k, W_CQ], node[k, W_CQ + 1], node[k, W_CQ + 2]
        a, da, r, dr = node[k, W_JAC], node[k, W_JAC + 1], node[k, W_JAC + 2], node[k, W_JAC + 3]
        over = 1.0 / (node[k, W_LQ] + SHORTEST)
        tn = kappa * cq + tau * h3 + h2 * cq * over  # rows n, b of Q: moved along t, along b
        bn = tau * cq + beta * h3 + h2 * h3 * over
        tb = -tau * h2 + h3 * cq * over
        bb = -beta * h2 - (1.0 - h3 * h3) * over
        if node[k, W_PIN] != 0.0:  # h2, h3: how far Q is beyond the path's end, along t and b
            tn, bn, tb, bb = 1.0, 0.0, 0.0, 1.0
        if m00 == 0.0 or c == 0.0:
            return False
        # eliminate: d0 = p0 + p1 d1, d2 = g0 + g1 d1, shift of Q along b = w0 + w1 d1, its rate = v0 + v1 d1
        p1 = -m01 / m00
        g1 = (m11 + m10 * p1) / c
        w1 = a + r * g1
        v1 = da + dr * g1
        q1 = bb * w1 - cq * v1
        determinant = tn * q1 - tb * bn * w1
        if determinant == 0.0 or not math.isfinite(determinant):
            return False
        over = 1.0 / determinant
        p0 = r0 / m00
        g0 = (m10 * p0 - r1) / c
        w0, v0 = r * g0, dr * g0
        s2 = -h2 - bn * w0
        s3 = -h3 - bb * w0 + cq * v0
        y = (s2 * q1 - s3 * bn * w1) * over
        d1 = (tn * s3 - tb * s2) * over
        node[k, W_Y] = p0 + p1 * d1
        node[k, W_Y + 1] = d1
        node[k, W_Y + 2] = g0 + g1 * d1
        node[k, W_Y + 3] = y - node[k, W_Y]
        # the same for the columns of the upper coupling, whose first two rows are zero
        nxt = _next_touched(k, hi, node)
        if nxt >= 0:
            over_l = 1.0 / (node[k, W_LQ] + SHORTEST)
            for column in range(2):
                tangent = W_TP if column == 0 else W_BP
                along = node[nxt, W_CP] if column == 0 else node[nxt, W_CP + 2]
                s2 = (_dot(node, k, W_NQ, nxt, tangent) - h2 * along) * over_l
                s3 = (_dot(node, k, W_BQ, nxt, tangent) - h3 * along) * over_l
                y = (s2 * q1 - s3 * bn * w1) * over
                d1 = (tn * s3 - tb * s2) * over
                out = W_X + 4 * column
                node[k, out] = p1 * d1
                node[k, out + 1] = d1
                node[k, out + 2] = g1 * d1
                node[k, out + 3] = y - node[k, out]
        last = k
    following = -1
    for k in range(hi - 1, lo - 1, -1):
        if node[k, S_MODE] != TOUCHED:
            continue
        if following >= 0:
            d0, d1 = node[following, W_Y], node[following, W_Y + 1]
            for row in range(4):
                node[k, W_Y + row] -= node[k, W_X + row] * d0 + node[k, W_X + 4 + row] * d1
        following = k
    return True


@jit
def _next_touched(k, hi, node):
    """Return the next touched node after k, or -1."""
    for j in range(k + 1, hi):
        if node[j, S_MODE] == TOUCHED:
            return j
    return -1


@jit
def _step_limit(lo, hi, node):
    """Return the share of the Newton step that keeps every obstacle's change moderate."""
    worst = 1.0
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED:
            inverse = 1.0 / node[k, SIZE]
            worst = max(worst, abs(node[k, W_Y]) * inverse / MAX_SHIFT)
            worst = max(worst, abs(node[k, W_Y + 1]) * inverse / MAX_SHIFT)
            worst = max(worst, abs(node[k, W_Y + 2]) / MAX_TURN)
            stretch = MAX_STRETCH * node[k, SIZE] + 0.5 * abs(node[k, S_ARC])
            worst = max(worst, abs(node[k, W_Y + 3]) / stretch)
    return 1.0 / worst


@jit
def _save(lo, hi, node):
    for k in range(lo, hi):
        for i in range(7):
            node[k, W_SAVE + i] = node[k, S_P + i]


@jit
def _move(lo, hi, share, node):
    """Set every touched obstacle to its saved geodesic moved by a share of the step."""
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED:
            for i in range(7):
                node[k, S_P + i] = node[k, W_SAVE + i]
            displace(
                k,
                share * node[k, W_Y],
                share * node[k, W_Y + 1],
                share * node[k, W_Y + 2],
                share * node[k, W_Y + 3],
                node,
            )


@jit
def _pin(lo, hi, ends, node):
    """Where the path starts on the surface that it meets first, start the geodesic there; return whether it did.

    The straight segment has no direction then: the contact stays, and what is left to solve for is the other end.
    """
    for k in range(lo, hi):
        if node[k, S_MODE] != TOUCHED:
            continue
        normal = _dot(node, k, W_E, k, W_NP)
        if node[k, W_L] <= PINNED * node[k, SIZE] or not _on_surface(k, -normal, node[k, W_L], node):
            return False
        x, y, z = into_frame(node, k, ends[0] + ends[3], ends[1] + ends[4], ends[2] + ends[5])
        x, y, z, _, _, _ = project(node, k, x, y, z)
        node[k, S_P] = x
        node[k, S_P + 1] = y
        node[k, S_P + 2] = z
        displace(k, 0.0, 0.0, 0.0, 0.0, node)
        return True
    return False


@apart
def newton(lo, hi, ends, node, tol, max_iterations, square=UNKNOWN):
    """Iterate until ||f|| <= tol; return (||f||, iterations, evaluations), the last state left in `state`.

    square: ||f||^2 where the rows hold the evaluation of their start, else GEODESICS or UNKNOWN. A step that does not
    reduce ||f|| is halved; the iteration stops where halving does not help.
    """
    evaluations = 0
    if square < 0.0:
        square = connect(lo, hi, ends, node) if square == GEODESICS else evaluate(lo, hi, ends, node)
        evaluations = 1
    if node[lo, lay.W_FIRST] < 0.0:
        node[lo, lay.W_FIRST] = square
    iterations = 0
    if _pin(lo, hi, ends, node):
        square = evaluate(lo, hi, ends, node)
        evaluations += 1
    while square > tol * tol and iterations < max_iterations and math.isfinite(square):
        if not step(lo, hi, node):
            break
        iterations += 1
        share = _step_limit(lo, hi, node)
        if not math.isfinite(share) or share <= 0.0:
            break
        _save(lo, hi, node)
        for _ in range(MAX_HALVINGS):
            _move(lo, hi, share, node)
            trial = evaluate(lo, hi, ends, node)
            evaluations += 1
            if trial < square:
                break
            share *= 0.5
        if not trial < square:
            break
        square = trial
        if _pin(lo, hi, ends, node):
            square = evaluate(lo, hi, ends, node)
            evaluations += 1
    return math.sqrt(square), iterations, evaluations
