"""The Newton system of a span, J d = -h, solved by block elimination (Thomas algorithm) in linear time.

h is the path error (31) of Muñoz-Pepi et al. (2023), J its Jacobian in the natural geodesic variations. Block row k
holds h of obstacle k, block column k its variations δ0..δ3. A straight segment couples only neighbours, so that J is
block tridiagonal with 4 x 4 blocks. `path_error.py` has the coefficients n_slide ... b_turn of rows 0 and 1 in δ0, δ1,
δ2, and q_n_slide ... q_b_turn of rows 2 and 3 in σ = δ0 + δ3, y = a δ1 + r δ2 and v = a' δ1 + r' δ2. By the chain rule
the block on the diagonal is

             δ0          δ1                            δ2                            δ3
    row 0    n_slide     n_shift                       0                             0
    row 1    b_slide     b_shift                       b_turn                        0
    row 2    q_n_slide   q_n_shift a                   q_n_shift r                   q_n_slide
    row 3    q_b_slide   q_b_shift a + q_b_turn a'     q_b_shift r + q_b_turn r'     q_b_slide

The block below the diagonal has only rows 0 and 1, in σ and y of the obstacle before; the block above it has only rows
2 and 3, in δ0 and δ1 of the obstacle behind. So each block is eliminated by explicit formulas, not by a general solver.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.tangency.path_error import (
    path_error_jacobian_at_P,
    path_error_jacobian_at_Q,
    path_error_jacobian_of_next,
    path_error_jacobian_of_previous,
)

S_MODE, TOUCHED = lay.S_MODE, lay.TOUCHED
W_CP, W_CQ, W_JAC, W_Y, W_X = lay.W_CP, lay.W_CQ, lay.W_JAC, lay.W_Y, lay.W_X


@jit
def solve_newton_system(lo, hi, node):
    """Solve for the Newton step of every touched obstacle; the step (δ0, δ1, δ2, δ3) is left in W_Y.

    The rows hold the last evaluation. Returns False where a block is singular.
    """
    last = -1
    for k in range(lo, hi):
        if node[k, S_MODE] != TOUCHED:
            continue
        # rows 0 and 1, at P
        n_slide, n_shift, b_slide, b_shift, b_turn = path_error_jacobian_at_P(k, node)
        cosine = -b_turn
        right_n, right_b = -node[k, W_CP + 1], -node[k, W_CP + 2]
        if last >= 0:
            # forward elimination: the step of `last` is Y - X (δ0, δ1), with (δ0, δ1) of k. The parts of its σ and y
            # from Y go to the right-hand side, those from X to the diagonal block
            l_n_slide, l_n_shift, l_b_slide, l_b_shift = path_error_jacobian_of_previous(k, last, node)
            a, r = node[last, W_JAC], node[last, W_JAC + 2]
            sigma = node[last, W_Y] + node[last, W_Y + 3]
            y = a * node[last, W_Y + 1] + r * node[last, W_Y + 2]
            right_n -= l_n_slide * sigma + l_n_shift * y
            right_b -= l_b_slide * sigma + l_b_shift * y
            sigma = node[last, W_X] + node[last, W_X + 3]
            y = a * node[last, W_X + 1] + r * node[last, W_X + 2]
            n_slide -= l_n_slide * sigma + l_n_shift * y
            b_slide -= l_b_slide * sigma + l_b_shift * y
            sigma = node[last, W_X + 4] + node[last, W_X + 7]
            y = a * node[last, W_X + 5] + r * node[last, W_X + 6]
            n_shift -= l_n_slide * sigma + l_n_shift * y
            b_shift -= l_b_slide * sigma + l_b_shift * y
        # rows 2 and 3, at Q
        q_n_slide, q_n_shift, q_b_slide, q_b_shift, q_b_turn = path_error_jacobian_at_Q(k, node)
        q_cosine = -q_b_turn
        h2, h3 = node[k, W_CQ + 1], node[k, W_CQ + 2]
        a, da, r, dr = node[k, W_JAC], node[k, W_JAC + 1], node[k, W_JAC + 2], node[k, W_JAC + 3]
        if n_slide == 0.0 or cosine == 0.0:
            return False
        # Rows 0 and 1 of the diagonal block (top of this file) give δ0 and δ2 as functions of δ1, and so y and v:
        #   δ0 = slide0 + slide1 δ1,   δ2 = turn0 + turn1 δ1,   y = y0 + y1 δ1,   v = v0 + v1 δ1
        slide1 = -n_shift / n_slide
        turn1 = (b_shift + b_slide * slide1) / cosine
        y1 = a + r * turn1
        v1 = da + dr * turn1
        # rows 2 and 3 are left, with σ and δ1 as unknowns:
        #   q_n_slide σ + q_n_shift y1 δ1,   q_b_slide σ + bottom δ1,   bottom = q_b_shift y1 + q_b_turn v1
        bottom = q_b_shift * y1 - q_cosine * v1
        determinant = q_n_slide * bottom - q_b_slide * q_n_shift * y1
        if determinant == 0.0 or not math.isfinite(determinant):
            return False
        over = 1.0 / determinant
        # slide0, turn0, y0, v0 from the right-hand side -h; then Y = (δ0, δ1, δ2, σ - δ0) by Cramer's rule
        slide0 = right_n / n_slide
        turn0 = (b_slide * slide0 - right_b) / cosine
        y0, v0 = r * turn0, dr * turn0
        s2 = -h2 - q_n_shift * y0
        s3 = -h3 - q_b_shift * y0 + q_cosine * v0
        sigma = (s2 * bottom - s3 * q_n_shift * y1) * over
        d1 = (q_n_slide * s3 - q_b_slide * s2) * over
        node[k, W_Y] = slide0 + slide1 * d1
        node[k, W_Y + 1] = d1
        node[k, W_Y + 2] = turn0 + turn1 * d1
        node[k, W_Y + 3] = sigma - node[k, W_Y]
        # X: the same with the two columns of the block above the diagonal, whose rows 0 and 1 are zero
        following = _next_touched(k, hi, node)
        if following >= 0:
            u_n_slide, u_n_shift, u_b_slide, u_b_shift = path_error_jacobian_of_next(k, following, node)
            for column in range(2):
                s2 = u_n_slide if column == 0 else u_n_shift
                s3 = u_b_slide if column == 0 else u_b_shift
                sigma = (s2 * bottom - s3 * q_n_shift * y1) * over
                d1 = (q_n_slide * s3 - q_b_slide * s2) * over
                out = W_X + 4 * column
                node[k, out] = slide1 * d1
                node[k, out + 1] = d1
                node[k, out + 2] = turn1 * d1
                node[k, out + 3] = sigma - node[k, out]
        last = k
    # back substitution, from the insertion to the origin
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
