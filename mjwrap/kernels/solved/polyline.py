"""Points along a solved path, for drawing."""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import from_python, jit
from mjwrap.kernels.geometry.geodesics import geodesic

W_P, W_Q, W_TP, S_ARC, S_MODE = lay.W_P, lay.W_Q, lay.W_TP, lay.S_ARC, lay.S_MODE
DRAWN_TURN = 0.1  # angle by which a geodesic turns between two points, where no spacing is given [rad]


@jit
def _straight(x, y, z, px, py, pz, spacing, out, count):
    """Append the points of a straight segment after its first one; return the new count."""
    size = math.sqrt((px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2)
    pieces = max(int(math.ceil(size / spacing)), 1) if spacing > 0.0 else 1
    for i in range(1, pieces + 1):
        share = i / pieces
        if count < out.shape[0]:
            out[count, 0] = x + share * (px - x)
            out[count, 1] = y + share * (py - y)
            out[count, 2] = z + share * (pz - z)
        count += 1
    return count


@from_python
def polyline(lo, hi, ox, oy, oz, ix, iy, iz, node, spacing, out, first):
    """Write points along the solved chain lo..hi to out[first:], at most `spacing` apart; return how many.

    With spacing <= 0 straight segments have only their end points, and geodesics a point for each DRAWN_TURN. World
    frame [m]. Points for which `out` is too short are counted but not written.
    """
    count = first
    if count < out.shape[0]:
        out[count, 0], out[count, 1], out[count, 2] = ox, oy, oz
    count += 1
    x, y, z = ox, oy, oz
    for k in range(lo, hi):
        if node[k, lay.KIND] == lay.VIA:
            px, py, pz = node[k, lay.POS], node[k, lay.POS + 1], node[k, lay.POS + 2]
            count = _straight(x, y, z, px, py, pz, spacing, out, count)
            x, y, z = px, py, pz
        elif node[k, S_MODE] == lay.TOUCHED and node[k, lay.INSIDE] > 0.0:
            px, py, pz = node[k, W_P] + ox, node[k, W_P + 1] + oy, node[k, W_P + 2] + oz
            count = _straight(x, y, z, px, py, pz, spacing, out, count)
            x, y, z = px, py, pz
        elif node[k, S_MODE] == lay.TOUCHED:
            arc = node[k, S_ARC]
            # how far the normal turns along the arc: |dn/ds| = sqrt(κ² + τ²)
            turn = arc * math.sqrt(node[k, lay.W_KP] ** 2 + node[k, lay.W_KP + 1] ** 2)
            pieces = max(int(math.ceil(arc / spacing if spacing > 0.0 else turn / DRAWN_TURN)), 1)
            px, py, pz = node[k, W_P] + ox, node[k, W_P + 1] + oy, node[k, W_P + 2] + oz
            count = _straight(x, y, z, px, py, pz, spacing, out, count)
            for i in range(1, pieces + 1):  # the last one leaves the row as it was
                node[k, S_ARC] = arc if i == pieces else arc * i / pieces
                geodesic(k, node, ox, oy, oz)
                x, y, z = node[k, W_Q] + ox, node[k, W_Q + 1] + oy, node[k, W_Q + 2] + oz
                if count < out.shape[0]:
                    out[count, 0], out[count, 1], out[count, 2] = x, y, z
                count += 1
    return _straight(x, y, z, ix, iy, iz, spacing, out, count) - first
