"""Evaluation of a row's geodesic in the world frame, and its displacement by natural geodesic variations."""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit, no_inline
from mjwrap.kernels.geometry.dispatch import evaluate_geodesic, project
from mjwrap.kernels.geometry.projection import turn_into_frame
from mjwrap.kernels.geometry.vectors import cross

W_P, W_Q, W_TP, W_TQ, W_NP, W_NQ = lay.W_P, lay.W_Q, lay.W_TP, lay.W_TQ, lay.W_NP, lay.W_NQ
W_BP, W_BQ = lay.W_BP, lay.W_BQ
POS = lay.POS
S_P, S_T, S_ARC = lay.S_P, lay.S_T, lay.S_ARC


@no_inline
def geodesic(k, node, base_x, base_y, base_z):
    """Evaluate obstacle k's geodesic from its saved start (P, t, s) into its row.

    Points are in the world frame relative to (base_x, base_y, base_z) [m], directions in the world frame.
    """
    evaluate_geodesic(k, node)
    x, y, z = node[k, POS] - base_x, node[k, POS + 1] - base_y, node[k, POS + 2] - base_z
    node[k, W_P] += x
    node[k, W_P + 1] += y
    node[k, W_P + 2] += z
    node[k, W_Q] += x
    node[k, W_Q + 1] += y
    node[k, W_Q + 2] += z
    cross(node, k, W_BP, W_TP, W_NP)
    cross(node, k, W_BQ, W_TQ, W_NQ)


@jit
def displace(k, d0, d1, d2, d3, node):
    """Move obstacle k's saved geodesic by its natural geodesic variations (d0, d1, d2, d3).

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


@jit
def move_start_along(k, node, ends, way):
    """Move the start of obstacle k's geodesic along it by `way`, forwards or backwards [m]; its end point stays.

    ends: as for `solve_span`.
    """
    if way == 0.0:
        return
    arc = node[k, S_ARC]
    node[k, S_ARC] = way
    geodesic(k, node, ends[0], ends[1], ends[2])
    x, y, z = (
        node[k, W_Q] - node[k, W_P],
        node[k, W_Q + 1] - node[k, W_P + 1],
        node[k, W_Q + 2] - node[k, W_P + 2],
    )
    x, y, z = turn_into_frame(node, k, x, y, z)
    node[k, S_P] += x
    node[k, S_P + 1] += y
    node[k, S_P + 2] += z
    x, y, z = turn_into_frame(node, k, node[k, W_TQ], node[k, W_TQ + 1], node[k, W_TQ + 2])
    node[k, S_T] = x
    node[k, S_T + 1] = y
    node[k, S_T + 2] = z
    node[k, S_ARC] = arc - way
