"""Closed-form geodesics with their Jacobi fields, one section per surface and one row each in the dispatch.

A surface's section holds: its geodesic from P along t over the arc length s, and its projection.
Darboux frame (t, n, b = t x n); kappa = t.Wt, tau = t.Wb, beta = b.Wb with the shape operator W, dn = W dp.
a, r are the Jacobi fields of method equation 2: a'' = -K a, a(0) = 1, a'(0) = 0; r(0) = 0, r'(0) = 1.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit

W_P, W_Q, W_TP, W_TQ, W_NP, W_NQ = lay.W_P, lay.W_Q, lay.W_TP, lay.W_TQ, lay.W_NP, lay.W_NQ
W_BP, W_BQ, W_KP, W_KQ, W_JAC = lay.W_BP, lay.W_BQ, lay.W_KP, lay.W_KQ, lay.W_JAC
KIND, DIM, POS, ROT = lay.KIND, lay.DIM, lay.POS, lay.ROT
S_P, S_T, S_ARC = lay.S_P, lay.S_T, lay.S_ARC


@jit
def _rotate(node, k, column, x, y, z):
    """Write the vector (x, y, z) of S, turned into the world, to node[k, column:column + 3]."""
    node[k, column] = node[k, ROT] * x + node[k, ROT + 1] * y + node[k, ROT + 2] * z
    node[k, column + 1] = node[k, ROT + 3] * x + node[k, ROT + 4] * y + node[k, ROT + 5] * z
    node[k, column + 2] = node[k, ROT + 6] * x + node[k, ROT + 7] * y + node[k, ROT + 8] * z


@jit
def _cross(node, k, out, left, right):
    """Write node[left] x node[right] (column triples of row k) to column `out`."""
    ax, ay, az = node[k, left], node[k, left + 1], node[k, left + 2]
    bx, by, bz = node[k, right], node[k, right + 1], node[k, right + 2]
    node[k, out] = ay * bz - az * by
    node[k, out + 1] = az * bx - ax * bz
    node[k, out + 2] = ax * by - ay * bx


# ----------------------------------------------------------------------------------- cylinder, axis z


@jit
def _cylinder(k, radius, node):
    """Helix on the unrolled cylinder (K = 0): a = 1, r = s."""
    inverse = 1.0 / radius
    nx, ny = node[k, S_P] * inverse, node[k, S_P + 1] * inverse
    tx, ty, tz = node[k, S_T], node[k, S_T + 1], node[k, S_T + 2]
    s = node[k, S_ARC]
    t_phi = nx * ty - ny * tx
    angle = s * t_phi * inverse
    c, d = math.cos(angle), math.sin(angle)
    mx, my = c * nx - d * ny, d * nx + c * ny
    ux, uy = c * tx - d * ty, d * tx + c * ty
    z = node[k, S_P + 2]
    _rotate(node, k, W_P, radius * nx, radius * ny, z)
    _rotate(node, k, W_Q, radius * mx, radius * my, z + s * tz)
    _rotate(node, k, W_TP, tx, ty, tz)
    _rotate(node, k, W_TQ, ux, uy, tz)
    _rotate(node, k, W_NP, nx, ny, 0.0)
    _rotate(node, k, W_NQ, mx, my, 0.0)
    kappa, tau, beta = t_phi * t_phi * inverse, t_phi * tz * inverse, tz * tz * inverse
    node[k, W_KP] = kappa
    node[k, W_KP + 1] = tau
    node[k, W_KP + 2] = beta
    node[k, W_KQ] = kappa
    node[k, W_KQ + 1] = tau
    node[k, W_KQ + 2] = beta
    node[k, W_JAC] = 1.0
    node[k, W_JAC + 1] = 0.0
    node[k, W_JAC + 2] = s
    node[k, W_JAC + 3] = 1.0


@jit
def _project_cylinder(radius, x, y, z):
    """Return the nearest point of the cylinder and its outward normal."""
    rho = math.hypot(x, y)
    nx, ny = x / rho, y / rho
    return radius * nx, radius * ny, z, nx, ny, 0.0


# ------------------------------------------------------------------------------------------- sphere


@jit
def _sphere(k, radius, node):
    """Great circle (K = 1/R^2): a = cos(s/R), r = R sin(s/R)."""
    inverse = 1.0 / radius
    nx, ny, nz = node[k, S_P] * inverse, node[k, S_P + 1] * inverse, node[k, S_P + 2] * inverse
    tx, ty, tz = node[k, S_T], node[k, S_T + 1], node[k, S_T + 2]
    angle = node[k, S_ARC] * inverse
    c, d = math.cos(angle), math.sin(angle)
    mx, my, mz = c * nx + d * tx, c * ny + d * ty, c * nz + d * tz
    _rotate(node, k, W_P, radius * nx, radius * ny, radius * nz)
    _rotate(node, k, W_Q, radius * mx, radius * my, radius * mz)
    _rotate(node, k, W_TP, tx, ty, tz)
    _rotate(node, k, W_TQ, c * tx - d * nx, c * ty - d * ny, c * tz - d * nz)
    _rotate(node, k, W_NP, nx, ny, nz)
    _rotate(node, k, W_NQ, mx, my, mz)
    node[k, W_KP] = inverse
    node[k, W_KP + 1] = 0.0
    node[k, W_KP + 2] = inverse
    node[k, W_KQ] = inverse
    node[k, W_KQ + 1] = 0.0
    node[k, W_KQ + 2] = inverse
    node[k, W_JAC] = c
    node[k, W_JAC + 1] = -d * inverse
    node[k, W_JAC + 2] = radius * d
    node[k, W_JAC + 3] = c


@jit
def _project_sphere(radius, x, y, z):
    """Return the nearest point of the sphere and its outward normal."""
    rho = math.sqrt(x * x + y * y + z * z)
    nx, ny, nz = x / rho, y / rho, z / rho
    return radius * nx, radius * ny, radius * nz, nx, ny, nz


# ----------------------------------------------------------------------------------------- dispatch


@jit
def geodesic(k, node, base_x, base_y, base_z):
    """Evaluate obstacle k's geodesic from its saved start (P, t, s) into its row.

    Points come out in the world frame relative to (base_x, base_y, base_z) [m], directions in the world frame.
    """
    if node[k, KIND] == lay.CYLINDER:
        _cylinder(k, node[k, DIM], node)
    else:
        _sphere(k, node[k, DIM], node)
    x, y, z = node[k, POS] - base_x, node[k, POS + 1] - base_y, node[k, POS + 2] - base_z
    node[k, W_P] += x
    node[k, W_P + 1] += y
    node[k, W_P + 2] += z
    node[k, W_Q] += x
    node[k, W_Q + 1] += y
    node[k, W_Q + 2] += z
    _cross(node, k, W_BP, W_TP, W_NP)
    _cross(node, k, W_BQ, W_TQ, W_NQ)


@jit
def project(node, k, x, y, z):
    """Return the nearest point of obstacle k's surface to (x, y, z), and the outward normal there; frame S."""
    if node[k, KIND] == lay.CYLINDER:
        return _project_cylinder(node[k, DIM], x, y, z)
    return _project_sphere(node[k, DIM], x, y, z)


@jit
def displace(k, d0, d1, d2, d3, node):
    """Move obstacle k's saved geodesic by the natural variations (d0, d1, d2, d3) of method section 2.

    d0 slides it along t, d1 shifts its start along b, d2 turns t towards b, d3 lengthens it [m, m, rad, m].
    """
    px, py, pz = node[k, S_P], node[k, S_P + 1], node[k, S_P + 2]
    tx, ty, tz = node[k, S_T], node[k, S_T + 1], node[k, S_T + 2]
    px, py, pz, nx, ny, nz = project(node, k, px, py, pz)
    bx, by, bz = ty * nz - tz * ny, tz * nx - tx * nz, tx * ny - ty * nx
    px, py, pz, nx, ny, nz = project(
        node, k, px + d0 * tx + d1 * bx, py + d0 * ty + d1 * by, pz + d0 * tz + d1 * bz
    )
    tx, ty, tz = tx + d2 * bx, ty + d2 * by, tz + d2 * bz
    along = tx * nx + ty * ny + tz * nz
    tx, ty, tz = tx - along * nx, ty - along * ny, tz - along * nz
    inverse = 1.0 / math.sqrt(tx * tx + ty * ty + tz * tz)
    node[k, S_P] = px
    node[k, S_P + 1] = py
    node[k, S_P + 2] = pz
    node[k, S_T] = tx * inverse
    node[k, S_T + 1] = ty * inverse
    node[k, S_T + 2] = tz * inverse
    node[k, S_ARC] += d3
