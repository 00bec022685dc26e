"""Polylines and contact points of all muscles in one call each, for pictures and recordings."""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import from_python, inlined, jit
from mjwrap.kernels.coupling.muscle_paths import R_HI, R_LO, R_MUSCLE
from mjwrap.kernels.solved.polyline import polyline
from mjwrap.kernels.solved.segments import G_A, G_B, G_FAR
from mjwrap.kernels.spans.end_inside import has_valid_length


@inlined
def _append(out, count, x, y, z):
    """Append a point if there is room for it; return the new count."""
    if count < out.shape[0]:
        out[count, 0], out[count, 1], out[count, 2] = x, y, z
    return count + 1


@jit
def route_points(c, routes, node, seg, seg_count, info, spacing, out, count):
    """Write the points of one route's path to out from row `count` on; return the new count, as `polylines` does."""
    if seg_count[c] == 0:
        return count
    lo, hi = routes[c, R_LO], routes[c, R_HI]
    first, last = lo + c, lo + c + seg_count[c] - 1
    if has_valid_length(info[c, lay.I_STATUS], info[c, lay.I_ERROR]):
        return count + polyline(
            lo, hi, seg[first, G_A], seg[first, G_A + 1], seg[first, G_A + 2],
            seg[last, G_B], seg[last, G_B + 1], seg[last, G_B + 2], node, spacing, out, count,
        )  # fmt: skip
    for j in range(first, last + 1):
        count = _append(out, count, seg[j, G_A], seg[j, G_A + 1], seg[j, G_A + 2])
        count = _append(out, count, seg[j, G_B], seg[j, G_B + 1], seg[j, G_B + 2])
    return count


@jit
def route_contacts(c, routes, node, seg, seg_count, out, count):
    """Write P and Q of each obstacle that a route touches to out, from row `count` on; return the new count."""
    first = routes[c, R_LO] + c
    for j in range(first, first + seg_count[c] - 1):
        k = int(seg[j, G_FAR])
        if k < routes[c, R_HI] and node[k, lay.KIND] != lay.VIA:
            count = _append(out, count, seg[j, G_B], seg[j, G_B + 1], seg[j, G_B + 2])
            count = _append(out, count, seg[j + 1, G_A], seg[j + 1, G_A + 1], seg[j + 1, G_A + 2])
    return count


@jit
def _begin(muscle, last, count, starts):
    """Write `count` to starts for the muscles after `muscle` up to `last`; return the last one."""
    while muscle < last:
        muscle += 1
        starts[muscle] = count
    return muscle


@from_python
def polylines(routes, node, seg, seg_count, info, spacing, only, out, starts):
    """Write the points of all paths to out, and each muscle's first row to starts (n + 1,); return how many points.

    only: one muscle's index, or -1 for all. Routes that pulleys join are separated by a row of NaN. Routes that had no
    path at the last evaluation are drawn along their last segments. Points for which `out` is too short are counted but
    not written. World frame [m].
    """
    count = 0
    muscle = -1
    for c in range(routes.shape[0]):
        muscle = _begin(muscle, routes[c, R_MUSCLE], count, starts)
        if only < 0 or only == muscle:
            if count > starts[muscle] and seg_count[c] > 0:
                count = _append(out, count, math.nan, math.nan, math.nan)
            count = route_points(c, routes, node, seg, seg_count, info, spacing, out, count)
    _begin(muscle, starts.shape[0] - 1, count, starts)
    return count


@from_python
def contacts(routes, node, seg, seg_count, only, out, starts):
    """Write P and Q of every touched obstacle to out, two rows each, and starts (n + 1,); return how many rows."""
    count = 0
    muscle = -1
    for c in range(routes.shape[0]):
        muscle = _begin(muscle, routes[c, R_MUSCLE], count, starts)
        if only < 0 or only == muscle:
            count = route_contacts(c, routes, node, seg, seg_count, out, count)
    _begin(muscle, starts.shape[0] - 1, count, starts)
    return count
