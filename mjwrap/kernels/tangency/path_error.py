"""The path error h of one obstacle and its Jacobian, with which Newton's method computes its steps.

The path error has four numbers for each touched obstacle (Muñoz-Pepi et al. 2023, (31), after Scholz et al. 2016),

    h = [e·n_P, e·b_P, e'·n_Q, e'·b_Q],

with e the unit vector of the straight segment that arrives at P, e' of the one that leaves Q. The geodesic moves by
four natural geodesic variations: δ0 slides it along t, δ1 shifts its start along b, δ2 turns it from t towards b, δ3
lengthens it. With the shape operator's κ = t·Wt, τ = t·Wb, β = b·Wb at P and at Q, and Jacobi fields a, a', r, r' at Q,

    dP = t δ0 + b δ1                              dQ = t σ + b y,    σ = δ0 + δ3,  y = a δ1 + r δ2
    dn_P = (κt + τb) δ0 + (τt + βb) δ1            dn_Q = (κt + τb) σ + (τt + βb) y
    db_P = -τn δ0 - βn δ1 - t δ2                  db_Q = -τn σ - βn y - t v,      v = a' δ1 + r' δ2

A segment of length L turns by D = (I - e eᵀ)/L times the motion of its far end less that of its near end. So

    d(e·n_P) = n·D dP + e·dn_P,  d(e'·n_Q) = -n·D' dQ + e'·dn_Q,  and the same with b;

where a segment's other end is on a touched obstacle too, that end enters with the opposite sign. Derivation: "How a
geodesic moves" and "Newton's step" in docs/derivation.md.

Where the path ends on the surface itself, at Q, there is no segment e'. Rows 2 and 3 of h are then the components of
Q - B along t_Q and b_Q (`path_error_at_end_on_surface`).
"""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import inlined

W_TP, W_TQ, W_NP, W_NQ, W_BP, W_BQ = lay.W_TP, lay.W_TQ, lay.W_NP, lay.W_NQ, lay.W_BP, lay.W_BQ
W_KP, W_KQ = lay.W_KP, lay.W_KQ
W_E, W_EQ, W_L, W_LQ, W_CP, W_CQ = lay.W_E, lay.W_EQ, lay.W_L, lay.W_LQ, lay.W_CP, lay.W_CQ
W_END_ON_SURFACE = lay.W_END_ON_SURFACE

SHORTEST = 1e-150  # keeps the reciprocal of a vanishing segment finite [m]


@inlined
def dot_columns(node, j, left, k, right):
    """Return the dot product of two column triples of two rows."""
    return (
        node[j, left] * node[k, right]
        + node[j, left + 1] * node[k, right + 1]
        + node[j, left + 2] * node[k, right + 2]
    )


@inlined
def path_error_at_P(k, node):
    """Return e·t, e·n and e·b at P of obstacle k; the last two are rows 0 and 1 of h."""
    return (
        dot_columns(node, k, W_E, k, W_TP),
        dot_columns(node, k, W_E, k, W_NP),
        dot_columns(node, k, W_E, k, W_BP),
    )


@inlined
def path_error_jacobian_at_P(k, node):
    """Return (n_slide, n_shift, b_slide, b_shift, b_turn), the derivatives of rows 0 and 1 of h in δ0, δ1, δ2.

    d(e·n_P) = n_slide δ0 + n_shift δ1,  d(e·b_P) = b_slide δ0 + b_shift δ1 + b_turn δ2.
    """
    kappa, tau, beta = node[k, W_KP], node[k, W_KP + 1], node[k, W_KP + 2]
    along, normal, binormal = node[k, W_CP], node[k, W_CP + 1], node[k, W_CP + 2]  # e·t, e·n, e·b
    over = 1.0 / (node[k, W_L] + SHORTEST)
    # row e·n, slide: n·D t + e·(κt + τb), with n·t = 0 and so n·D t = -(e·n)(e·t)/L
    n_slide = kappa * along + tau * binormal - normal * along * over
    # row e·n, shift: n·D b + e·(τt + βb)
    n_shift = tau * along + beta * binormal - normal * binormal * over
    # row e·b, slide: b·D t - τ e·n
    b_slide = -tau * normal - binormal * along * over
    # row e·b, shift: b·D b - β e·n, with b·D b = (1 - (e·b)²)/L
    b_shift = (1.0 - binormal * binormal) * over - beta * normal
    # row e·b, turn: -e·t; P itself stays
    return n_slide, n_shift, b_slide, b_shift, -along


@inlined
def path_error_at_Q(k, node):
    """Return e'·t, e'·n and e'·b at Q of obstacle k; the last two are rows 2 and 3 of h."""
    return (
        dot_columns(node, k, W_EQ, k, W_TQ),
        dot_columns(node, k, W_EQ, k, W_NQ),
        dot_columns(node, k, W_EQ, k, W_BQ),
    )


@inlined
def path_error_jacobian_at_Q(k, node):
    """Return (n_slide, n_shift, b_slide, b_shift, b_turn), the derivatives of rows 2 and 3 of h in σ, y, v.

    d(e'·n_Q) = n_slide σ + n_shift y,  d(e'·b_Q) = b_slide σ + b_shift y + b_turn v. Where the path ends at Q on the
    surface (W_END_ON_SURFACE): `path_error_jacobian_at_end_on_surface`.
    """
    kappa, tau, beta = node[k, W_KQ], node[k, W_KQ + 1], node[k, W_KQ + 2]
    along, normal, binormal = node[k, W_CQ], node[k, W_CQ + 1], node[k, W_CQ + 2]  # e'·t, e'·n, e'·b
    over = 1.0 / (node[k, W_LQ] + SHORTEST)
    # row e'·n, slide: -n·D' t + e'·(κt + τb): the segment's near end moves, hence the other sign of D'
    n_slide = kappa * along + tau * binormal + normal * along * over
    # row e'·n, shift: -n·D' b + e'·(τt + βb)
    n_shift = tau * along + beta * binormal + normal * binormal * over
    # row e'·b, slide: -b·D' t - τ e'·n
    b_slide = -tau * normal + binormal * along * over
    # row e'·b, shift: -b·D' b - β e'·n
    b_shift = -beta * normal - (1.0 - binormal * binormal) * over
    if node[k, W_END_ON_SURFACE] != 0.0:
        n_slide, n_shift, b_slide, b_shift = path_error_jacobian_at_end_on_surface()
    return n_slide, n_shift, b_slide, b_shift, -along


@inlined
def path_error_at_end_on_surface(along, binormal, size):
    """Return (Q - B)·t_Q and (Q - B)·b_Q [m], rows 2 and 3 of h where the path ends on the surface, at Q.

    along, binormal: e'·t_Q and e'·b_Q of the segment from Q to the end B, `size` long [m], so that Q - B = -size e'.
    """
    return -size * along, -size * binormal


@inlined
def path_error_jacobian_at_end_on_surface():
    """Return (n_slide, n_shift, b_slide, b_shift), the derivatives of `path_error_at_end_on_surface` in σ and y.

    dQ = t σ + b y, and t and b turn by terms in Q - B, which vanishes at the solution: the rows are σ and y themselves.
    """
    return 1.0, 0.0, 0.0, 1.0


@inlined
def path_error_jacobian_of_previous(k, last, node):
    """Return (n_slide, n_shift, b_slide, b_shift): rows 0 and 1 of obstacle k's h in σ and y of obstacle `last`.

    The near end of the segment that arrives at k moves by dQ = t σ + b y of the obstacle before: -n·D dQ, -b·D dQ.
    """
    normal, binormal = node[k, W_CP + 1], node[k, W_CP + 2]
    along_t, along_b = node[last, W_CQ], node[last, W_CQ + 2]  # e·t_Q and e·b_Q of `last`, whose e' this e is
    over = 1.0 / (node[k, W_L] + SHORTEST)
    n_slide = -(dot_columns(node, k, W_NP, last, W_TQ) - normal * along_t) * over
    n_shift = -(dot_columns(node, k, W_NP, last, W_BQ) - normal * along_b) * over
    b_slide = -(dot_columns(node, k, W_BP, last, W_TQ) - binormal * along_t) * over
    b_shift = -(dot_columns(node, k, W_BP, last, W_BQ) - binormal * along_b) * over
    return n_slide, n_shift, b_slide, b_shift


@inlined
def path_error_jacobian_of_next(k, following, node):
    """Return (n_slide, n_shift, b_slide, b_shift): rows 2 and 3 of obstacle k's h in δ0 and δ1 of `following`.

    The far end of the segment that leaves k moves by dP = t δ0 + b δ1 of that obstacle: n·D' dP, b·D' dP.
    """
    normal, binormal = node[k, W_CQ + 1], node[k, W_CQ + 2]
    along_t, along_b = node[following, W_CP], node[following, W_CP + 2]  # e'·t_P, e'·b_P of `following`
    over = 1.0 / (node[k, W_LQ] + SHORTEST)
    n_slide = (dot_columns(node, k, W_NQ, following, W_TP) - normal * along_t) * over
    b_slide = (dot_columns(node, k, W_BQ, following, W_TP) - binormal * along_t) * over
    n_shift = (dot_columns(node, k, W_NQ, following, W_BP) - normal * along_b) * over
    b_shift = (dot_columns(node, k, W_BQ, following, W_BP) - binormal * along_b) * over
    return n_slide, n_shift, b_slide, b_shift
