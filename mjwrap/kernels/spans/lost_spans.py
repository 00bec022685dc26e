"""Spans of which a search has found that they have no path: the next searches near by are left out.

While an end lies deep inside a surface, a string seldom has a path, and a cold start that fails is the most expensive
solve there is. So its rows become LOST and keep the ends at which it failed, each in the frame of its surface. As long
as an end stays deep inside a surface, and both ends near those places, the answer is the same without a search. A path
that comes back is found once no end is deep inside, or an end has moved by LOST_MOVE sizes of some surface. This is
saved state like the rest of a row: the answer follows from the pose and from it.
"""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit, no_inline
from mjwrap.kernels.geometry.projection import into_frame
from mjwrap.kernels.spans.span_ends import explains_no_path

S_MODE, S_P, S_T = lay.S_MODE, lay.S_P, lay.S_T

LOST_MOVE = 0.05  # of a surface's size: the move of an end after which is searched again


@jit
def _moved(k, ends, column, saved, node):
    """Return the square of an end's distance from its saved place in the frame of row k [m^2]."""
    x, y, z = into_frame(
        node, k, ends[0] + ends[column], ends[1] + ends[column + 1], ends[2] + ends[column + 2]
    )
    return (x - node[k, saved]) ** 2 + (y - node[k, saved + 1]) ** 2 + (z - node[k, saved + 2]) ** 2


@no_inline
def is_still_lost(lo, hi, ends, node):
    """Return whether it is known, without a search, that the span has no path near its present pose."""
    for k in range(lo, hi):
        if node[k, S_MODE] != lay.LOST:
            return False
        near = (LOST_MOVE * node[k, lay.SIZE]) ** 2
        if not max(_moved(k, ends, 3, S_P, node), _moved(k, ends, 6, S_T, node)) < near:
            return False
    return explains_no_path(lo, hi, ends, node)


@no_inline
def mark_lost(lo, hi, ends, node):
    """Write to the rows that a search between the present ends has found no path."""
    for k in range(lo, hi):
        for i in range(1, lay.STATE):
            node[k, S_MODE + i] = 0.0
        node[k, S_MODE] = lay.LOST
        for column, saved in ((3, S_P), (6, S_T)):
            x, y, z = into_frame(
                node, k, ends[0] + ends[column], ends[1] + ends[column + 1], ends[2] + ends[column + 2]
            )
            node[k, saved], node[k, saved + 1], node[k, saved + 2] = x, y, z
