"""Start of a span whose sides all hold at every pose: the same whatever came before, and from either end of the route.

Every obstacle is wrapped by itself, between places that stand for its neighbours' contacts: on the sides of these,
next to the straight line from A to B. That decides the sides; then the obstacles are wrapped in turn between their
neighbours' contacts, as at any cold start.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, jit
from mjwrap.kernels.geometry.dispatch import segment_clearance
from mjwrap.kernels.geometry.projection import turn_into_frame
from mjwrap.kernels.geometry.traits import branched, closed_form, one_sided, sided
from mjwrap.kernels.spans.cold_start import wrap_in_turn
from mjwrap.kernels.spans.saved_solutions import surface_end
from mjwrap.kernels.wraps.sides import all_sided, forget, point_of_side
from mjwrap.kernels.wraps.single import wrap

HINT, POS, ROT, SIZE = lay.HINT, lay.POS, lay.ROT, lay.SIZE

PASSES = 3  # of wrapping all obstacles in turn, after the first


@jit
def _place_on_side(k, node, ends):
    """Return a place on the side of row k's surface, next to the line from A to B; world, relative to the base [m]."""
    px, py, pz = node[k, POS] - ends[0], node[k, POS + 1] - ends[1], node[k, POS + 2] - ends[2]
    if branched(k, node) and closed_form(k, node):
        ax, ay, az = turn_into_frame(node, k, ends[3] - px, ends[4] - py, ends[5] - pz)
        bx, by, bz = turn_into_frame(node, k, ends[6] - px, ends[7] - py, ends[8] - pz)
        _, share = segment_clearance(node, k, ax, ay, az, bx, by, bz)
        x, y, z = node[k, HINT + 1], node[k, HINT + 2], az + share * (bz - az)
        scale = node[k, SIZE] / max(math.sqrt(x * x + y * y), 1e-300)
        x, y = scale * x, scale * y
    elif branched(k, node):  # a ring: the hint itself says through which part it runs
        x, y, z = node[k, HINT + 1], node[k, HINT + 2], node[k, HINT + 3]
    else:
        x, y, z = point_of_side(k, node)
    return (
        px + node[k, ROT] * x + node[k, ROT + 1] * y + node[k, ROT + 2] * z,
        py + node[k, ROT + 3] * x + node[k, ROT + 4] * y + node[k, ROT + 5] * z,
        pz + node[k, ROT + 6] * x + node[k, ROT + 7] * y + node[k, ROT + 8] * z,
    )


@deferred(types.boolean)
def start_from_sides(lo, hi, ends, node):
    """Forget the solutions of lo..hi if every side follows from the pose; return whether that is so.

    A row of obstacles is then wrapped on its sides; a lone one stays COLD, and is wrapped by what follows.
    """
    if not all_sided(lo, hi, node):
        return False
    forget(lo, hi, node)
    if hi == surface_end(lo, hi, node):
        return True
    for k in range(lo, hi):
        if node[k, lay.TOUCH] > 0.0:
            continue
        ax, ay, az, bx, by, bz = ends[3], ends[4], ends[5], ends[6], ends[7], ends[8]
        for j in range(lo, k):
            if sided(j, node) and not one_sided(j, node):
                ax, ay, az = _place_on_side(j, node, ends)
        for j in range(hi - 1, k, -1):
            if sided(j, node) and not one_sided(j, node):
                bx, by, bz = _place_on_side(j, node, ends)
        node[k, lay.W_WRAP_ERROR] = -1.0
        wrap(k, node, ends[0], ends[1], ends[2], ax, ay, az, bx, by, bz, True)
    for k in range(lo, hi):  # further rows of a surface that nothing has touched
        if node[k, lay.S_MODE] == lay.COLD:
            node[k, lay.S_MODE] = lay.FREE
    wrap_in_turn(lo, hi, ends, node, PASSES, False)
    return True
