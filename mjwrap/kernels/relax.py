"""Finding a start: obstacle after obstacle wrapped in closed form, and the choice of sides where no hint makes it."""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit
from mjwrap.kernels.certify import branched
from mjwrap.kernels.direct import closed_form, wrap
from mjwrap.kernels.geodesics import geodesic
from mjwrap.kernels.ruled import TWO_PI

KIND, POS, ROT, HINT = lay.KIND, lay.POS, lay.ROT, lay.HINT
S_MODE, S_SWEEP, S_ARC = lay.S_MODE, lay.S_SWEEP, lay.S_ARC
W_P, W_Q, W_OLD = lay.W_P, lay.W_Q, lay.W_OLD
COLD, FREE, TOUCHED = lay.COLD, lay.FREE, lay.TOUCHED
LEAST_SWEEP = 0.5 * math.pi  # a string that sweeps less passes on its shorter side [rad]
MOST_FLIPS = 3
WINDOW = 4
SWEEPS = 4
SEARCH_EVERY = 6  # passes: a search costs as much as fifty wraps


@jit
def _following(k, hi, ends, node, centred):
    """Return the point at which the path meets what comes next after node k, relative to the base.

    Before the first pass the hints of obstacles further on stand for their contact points; `centred`: so does the
    centre of the next one.
    """
    for j in range(k + 1, hi):
        if centred and node[j, S_MODE] == COLD and node[j, HINT] <= 0.0:
            return node[j, POS] - ends[0], node[j, POS + 1] - ends[1], node[j, POS + 2] - ends[2]
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
def relax(lo, hi, ends, node, passes, centred):
    """Wrap every obstacle in turn between its neighbours' contact points, `passes` times; return `passes`.

    Lost contacts are searched for in some of the passes.
    """
    for i in range(passes):
        x, y, z = ends[3], ends[4], ends[5]
        for k in range(lo, hi):
            qx, qy, qz = _following(k, hi, ends, node, centred)
            if i == 0:
                node[k, lay.W_FRESH] = -1.0
            wrap(k, node, ends[0], ends[1], ends[2], x, y, z, qx, qy, qz, i % SEARCH_EVERY == 0)
            if node[k, S_MODE] == TOUCHED:
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
def _flips(k, node):
    """Return whether obstacle k may be passed on its other side: a topological one, known in closed form, that no hint
    chooses, and that is swept by so much that the other way can be shorter."""
    if not (branched(node[k, KIND]) and closed_form(node[k, KIND])) or node[k, HINT] > 0.0:
        return False
    return node[k, S_MODE] == TOUCHED and abs(node[k, S_SWEEP]) >= LEAST_SWEEP


@jit
def _searchable(k, node):
    """Return whether another wrap of obstacle k can be looked for: it is touched, and no hint chooses its side."""
    if closed_form(node[k, KIND]) or node[k, HINT] > 0.0 or node[k, lay.TWIN] > 0.0:
        return False
    return node[k, S_MODE] == TOUCHED


@jit
def _other_way(first, last, node):
    """Change the sides of the obstacles first..last, or have them searched for anew."""
    for j in range(first, last):
        if _flips(j, node):
            node[j, S_SWEEP] -= math.copysign(TWO_PI, node[j, S_SWEEP])
        elif _searchable(j, node):
            node[j, S_MODE] = COLD
            if j + 1 < node.shape[0] and node[j + 1, lay.TWIN] > 0.0:
                node[j + 1, S_MODE] = FREE


@jit
def keep(lo, hi, node, out, back):
    """Copy the saved solutions of lo..hi to the columns `out`, or back from there."""
    for j in range(lo, hi):
        for i in range(lay.STATE):
            if back:
                node[j, S_MODE + i] = node[j, out + i]
            else:
                node[j, out + i] = node[j, S_MODE + i]


@jit
def between(lo, hi, first, last, ends, node):
    """Return the ends of the part first..last of the path over lo..hi, from the contacts on both sides of it."""
    ax, ay, az = ends[3], ends[4], ends[5]
    for j in range(first - 1, lo - 1, -1):
        if node[j, S_MODE] == TOUCHED:
            ax, ay, az = node[j, W_Q], node[j, W_Q + 1], node[j, W_Q + 2]
            break
    bx, by, bz = _following(last - 1, hi, ends, node, False)
    return (ends[0], ends[1], ends[2], ax, ay, az, bx, by, bz)


@jit
def shorten(lo, hi, ends, node, passes):
    """Try other sides for all obstacles without a hint; keep what is shorter.

    Sides known in closed form change in runs of up to MOST_FLIPS neighbours together; others are searched for anew,
    one at a
    time, between the contacts that their neighbours have now. The path WINDOW obstacles to both sides is free to
    follow. Until nothing gets shorter: a local search, at cold starts only. Returns the evaluations spent.
    """
    spent = 0
    for _ in range(SWEEPS):
        shorter = False
        for run in range(1, MOST_FLIPS + 1):
            for k in range(lo, hi - run + 1):
                whole = _flips(k, node) and _flips(k + run - 1, node)
                if not (whole or (run == 1 and _searchable(k, node))):
                    continue
                first, last = max(lo, k - WINDOW), min(hi, k + run + WINDOW)
                part = between(lo, hi, first, last, ends, node)
                before = path_length(first, last, part, node)
                keep(first, last, node, W_OLD, False)
                _other_way(k, k + run, node)
                spent += relax(first, last, part, node, passes, False)
                if path_length(first, last, part, node) < before * (1.0 - 1e-9):
                    shorter = True
                    continue
                keep(first, last, node, W_OLD, True)
                for j in range(first, last):
                    if node[j, S_MODE] == TOUCHED:
                        geodesic(j, node, ends[0], ends[1], ends[2])
        if not shorter or hi - lo == 1:
            break
        spent += relax(lo, hi, ends, node, passes, False)
    return spent


@jit
def search_rows(lo, hi, ends, node, passes):
    """Start a row without hints in three ways, shorten each, and leave the shortest; return the evaluations spent.

    Between the ends, along the centres, and with the other side of everything that the first two have found.
    """
    spent = 0
    best = math.inf
    for start in range(3):
        if start == 1:
            for k in range(lo, hi):
                node[k, S_MODE] = COLD
        elif start == 2:
            _other_way(lo, hi, node)
        spent += relax(lo, hi, ends, node, passes, start == 1)
        spent += shorten(lo, hi, ends, node, passes)
        total = path_length(lo, hi, ends, node)
        if total < best * (1.0 - 1e-9):
            best = total
            keep(lo, hi, node, lay.W_BEST, False)
        else:
            keep(lo, hi, node, lay.W_BEST, True)
            for j in range(lo, hi):
                if node[j, S_MODE] == TOUCHED:
                    geodesic(j, node, ends[0], ends[1], ends[2])
    return spent
