"""Vector operations on the columns of a row, used by the geodesics of all surfaces."""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import inlined, jit

ROT = lay.ROT
W_P, W_Q, W_TP, W_TQ, W_NP, W_NQ = lay.W_P, lay.W_Q, lay.W_TP, lay.W_TQ, lay.W_NP, lay.W_NQ
W_KP, W_KQ, W_JAC, W_KMIN, W_RMIN = lay.W_KP, lay.W_KQ, lay.W_JAC, lay.W_KMIN, lay.W_RMIN


@inlined
def rotate(node, k, column, x, y, z):
    """Write the vector (x, y, z) of S, turned into the world, to node[k, column:column + 3]."""
    node[k, column] = node[k, ROT] * x + node[k, ROT + 1] * y + node[k, ROT + 2] * z
    node[k, column + 1] = node[k, ROT + 3] * x + node[k, ROT + 4] * y + node[k, ROT + 5] * z
    node[k, column + 2] = node[k, ROT + 6] * x + node[k, ROT + 7] * y + node[k, ROT + 8] * z


@inlined
def cross(node, k, out, left, right):
    """Write node[left] x node[right] (column triples of row k) to column `out`."""
    ax, ay, az = node[k, left], node[k, left + 1], node[k, left + 2]
    bx, by, bz = node[k, right], node[k, right + 1], node[k, right + 2]
    node[k, out] = ay * bz - az * by
    node[k, out + 1] = az * bx - ax * bz
    node[k, out + 2] = ax * by - ay * bx


@inlined
def put_start(node, k, x, y, z, tx, ty, tz, nx, ny, nz):
    """Write P, t_P, n_P, given in S, to the row in world directions."""
    rotate(node, k, W_P, x, y, z)
    rotate(node, k, W_TP, tx, ty, tz)
    rotate(node, k, W_NP, nx, ny, nz)


@inlined
def put_end(node, k, x, y, z, tx, ty, tz, nx, ny, nz):
    """Write Q, t_Q, n_Q, given in S, to the row in world directions."""
    rotate(node, k, W_Q, x, y, z)
    rotate(node, k, W_TQ, tx, ty, tz)
    rotate(node, k, W_NQ, nx, ny, nz)


@inlined
def put_curvature(node, k, column, kappa, tau, beta):
    """Write kappa, tau, beta of one end to the row."""
    node[k, column] = kappa
    node[k, column + 1] = tau
    node[k, column + 2] = beta


@inlined
def put_fields(node, k, a, da, r, dr, least_curvature, least_field):
    """Write the Jacobi fields at Q to the row, and the columns W_KMIN and W_RMIN."""
    node[k, W_JAC] = a
    node[k, W_JAC + 1] = da
    node[k, W_JAC + 2] = r
    node[k, W_JAC + 3] = dr
    node[k, W_KMIN] = least_curvature
    node[k, W_RMIN] = least_field


@jit
def unit(x, y, z):
    """Return the vector divided by its length."""
    inverse = 1.0 / math.sqrt(x * x + y * y + z * z)
    return x * inverse, y * inverse, z * inverse
