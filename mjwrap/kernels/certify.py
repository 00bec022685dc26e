"""What makes a tangent path a path of a taut string: the way it goes round, and that it cannot slip off sideways."""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit

KIND, DIM = lay.KIND, lay.DIM
S_MODE, S_P, S_T, S_ARC = lay.S_MODE, lay.S_P, lay.S_T, lay.S_ARC
W_BP, W_BQ, W_JAC, W_L, W_LQ = lay.W_BP, lay.W_BQ, lay.W_JAC, lay.W_L, lay.W_LQ

STABLE = -1e-9  # smallest admitted stiffness against a sideways shift, as a share of the segment's own
SHORTEST = 1e-12  # segments count as at least this long here [m]


@jit
def swept(k, node):
    """Return the angle that the path of the last evaluation sweeps about cylinder k, with sign [rad]."""
    inverse = 1.0 / node[k, DIM]
    t_phi = (node[k, S_P] * node[k, S_T + 1] - node[k, S_P + 1] * node[k, S_T]) * inverse
    rate = t_phi * inverse
    free = math.atan(node[k, W_L] * abs(rate)) + math.atan(node[k, W_LQ] * abs(rate))
    return node[k, S_ARC] * rate + (free if t_phi >= 0.0 else -free)


@jit
def minimal(lo, hi, node):
    """Return whether the path of the last evaluation is a local minimum of length.

    At a tangent path the second variation lives in sideways shifts x b_P, y b_Q of the contact points alone:
    straight segments add |x b_P - y b_Q|^2 / L, geodesics (a x^2 - 2 x y + r' y^2) / r. Eliminated from the origin
    on, its pivots are a Riccati recursion in the stiffness c behind each point: the Jacobi field a + c r must stay
    positive along every geodesic, and 1/L + c at every point that a straight segment leaves.
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
        if node[k, KIND] == lay.SPHERE and node[k, S_ARC] >= math.pi * node[k, DIM]:
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
