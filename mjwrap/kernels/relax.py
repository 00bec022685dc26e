"""Finding a start: obstacle after obstacle wrapped in closed form, and the choice of sides where no hint makes it."""

from __future__ import annotations

import math

import numpy as np

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit
from mjwrap.kernels.certify import branched
from mjwrap.kernels.direct import wrap
from mjwrap.kernels.geodesics import geodesic
from mjwrap.kernels.ruled import TWO_PI

KIND, POS, ROT, HINT = lay.KIND, lay.POS, lay.ROT, lay.HINT
S_MODE, S_SWEEP, S_ARC = lay.S_MODE, lay.S_SWEEP, lay.S_ARC
W_P, W_Q, W_L, W_LQ = lay.W_P, lay.W_Q, lay.W_L, lay.W_LQ
COLD, TOUCHED = lay.COLD, lay.TOUCHED
SEARCH_EVERY = 6  # passes: a search costs as much as fifty wraps


@jit
def _following(k, hi, ends, node):
    """Return the point at which the path meets what comes next after node k, relative to the base.

    Before the first pass the hints of obstacles further on stand for their contact points.
    """
    for j in range(k + 1, hi):
        if node[j, S_MODE] == TOUCHED:
            return node[j, W_P], node[j, W_P + 1], node[j, W_P + 2]
        if node[j, S_MODE] == COLD and node[j, HINT] > 0.0:
            hx, hy, hz = node[j, HINT + 1], node[j, HINT + 2], node[j, HINT + 3]
            return (
                node[j, ROT] * hx + node[j, ROT + 1] * hy + node[j, ROT + 2] * hz + node[j, POS] - ends[0],
                node[j, ROT + 3] * hx
                + node[j, ROT + 4] * hy
                + node[j, ROT + 5] * hz
                + node[j, POS + 1]
                - ends[1],
                node[j, ROT + 6] * hx
                + node[j, ROT + 7] * hy
                + node[j, ROT + 8] * hz
                + node[j, POS + 2]
                - ends[2],
            )
    return ends[6], ends[7], ends[8]


@jit
def relax(lo, hi, ends, node, passes):
    """Wrap every obstacle in turn between its neighbours' contact points, `passes` times; return `passes`.

    Lost contacts are searched for in some of the passes.
    """
    for i in range(passes):
        x, y, z = ends[3], ends[4], ends[5]
        for k in range(lo, hi):
            qx, qy, qz = _following(k, hi, ends, node)
            wrap(k, node, ends[0], ends[1], ends[2], x, y, z, qx, qy, qz, i % SEARCH_EVERY == 0)
            if node[k, S_MODE] == TOUCHED:
                geodesic(k, node, ends[0], ends[1], ends[2])
                x, y, z = node[k, W_Q], node[k, W_Q + 1], node[k, W_Q + 2]
    return passes


@jit
def path_length(lo, hi, ends, node):
    """Return the length of the path through the present contact points: straight segments and geodesics (1) [m]."""
    total = 0.0
    x, y, z = ends[3], ends[4], ends[5]
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED:
            dx, dy, dz = node[k, W_P] - x, node[k, W_P + 1] - y, node[k, W_P + 2] - z
            total += math.sqrt(dx * dx + dy * dy + dz * dz) + node[k, S_ARC]
            x, y, z = node[k, W_Q], node[k, W_Q + 1], node[k, W_Q + 2]
    dx, dy, dz = ends[6] - x, ends[7] - y, ends[8] - z
    return total + math.sqrt(dx * dx + dy * dy + dz * dz)


@jit
def shorten(lo, hi, ends, node, passes):
    """Try the other side of every cylinder without a hint and keep what is shorter; return the evaluations spent.

    A greedy search from the sides on which the straight string passes. It runs at cold starts only.
    """
    spent = 0
    saved = np.empty((hi - lo, lay.STATE))
    best = path_length(lo, hi, ends, node)
    for k in range(lo, hi):
        if not branched(node[k, KIND]) or node[k, HINT] > 0.0 or node[k, S_MODE] != TOUCHED:
            continue
        if abs(node[k, S_SWEEP]) < 0.5 * math.pi:
            continue
        for j in range(lo, hi):
            for i in range(lay.STATE):
                saved[j - lo, i] = node[j, S_MODE + i]
        node[k, S_SWEEP] -= math.copysign(TWO_PI, node[k, S_SWEEP])
        spent += relax(lo, hi, ends, node, passes)
        trial = path_length(lo, hi, ends, node)
        if trial < best * (1.0 - 1e-9):
            best = trial
        else:
            for j in range(lo, hi):
                for i in range(lay.STATE):
                    node[j, S_MODE + i] = saved[j - lo, i]
                if node[j, S_MODE] == TOUCHED:
                    geodesic(j, node, ends[0], ends[1], ends[2])
    return spent
