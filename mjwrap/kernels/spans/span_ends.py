"""Where the ends of a span lie: inside a surface, or on one."""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit, no_inline
from mjwrap.kernels.geometry.dispatch import height
from mjwrap.kernels.geometry.projection import into_frame
from mjwrap.kernels.tangency.tangency_error import ON_SURFACE
from mjwrap.kernels.wraps.single import contains

S_MODE, TOUCHED = lay.S_MODE, lay.TOUCHED


@jit
def an_end_is_inside(lo, hi, ends, node):
    """Return whether an end of the span lies inside an obstacle."""
    x, y, z = ends[0], ends[1], ends[2]
    for k in range(lo, hi):
        if contains(k, node, x + ends[3], y + ends[4], z + ends[5]):
            return True
        if contains(k, node, x + ends[6], y + ends[7], z + ends[8]):
            return True
    return False


@jit
def _depth_and_rise(k, ends, column, node):
    """Return an end's depth inside obstacle k, in the surface's size, and its distance from the middle along z."""
    x, y, z = into_frame(
        node, k, ends[0] + ends[column], ends[1] + ends[column + 1], ends[2] + ends[column + 2]
    )
    return -height(node, k, x, y, z) / node[k, lay.SIZE], abs(z)


@jit
def _is_deep(k, ends, column, node):
    """Return whether an end lies deeper inside obstacle k than AS_WRITTEN, be it beyond the half length."""
    depth, _ = _depth_and_rise(k, ends, column, node)
    return depth > lay.AS_WRITTEN


@jit
def _is_deep_in_range(k, ends, column, node):
    """Return whether an end lies deeper inside obstacle k than AS_WRITTEN where the surface exists."""
    depth, rise = _depth_and_rise(k, ends, column, node)
    return depth > lay.AS_WRITTEN and rise <= node[k, lay.Z_LIMIT]


@no_inline
def lies_on_surfaces(lo, hi, ends, node):
    """Return whether no end of the span lies deeper inside an obstacle than AS_WRITTEN: on its surface, or outside."""
    for k in range(lo, hi):
        if _is_deep(k, ends, 3, node) or _is_deep(k, ends, 6, node):
            return False
    return True


@no_inline
def explains_no_path(lo, hi, ends, node):
    """Return whether an end lies deep inside an obstacle where the surface exists, so that a path is unlikely.

    An end inside the extension of a cone or a cylinder beyond its half length says nothing: paths that do not touch it
    pass as if it were not there.
    """
    for k in range(lo, hi):
        if _is_deep_in_range(k, ends, 3, node) or _is_deep_in_range(k, ends, 6, node):
            return True
    return False


@no_inline
def has_no_path(lo, hi, ends, node):
    """Return whether an end lies so deep inside the obstacle next to it that no path over the span can exist."""
    if _is_deep(lo, ends, 3, node):
        return True
    last = hi - 1
    while last > lo and node[last, lay.TOUCH] > 0.0:
        last -= 1
    return _is_deep(last, ends, 6, node)


@jit
def ends_in_short_segment(lo, hi, node):
    """Return whether the path's first or last straight segment is so short that the end may lie inside the surface."""
    last = -1
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED:
            if last < 0 and node[k, lay.W_L] <= ON_SURFACE * node[k, lay.SIZE]:
                return True
            last = k
    return last >= 0 and node[last, lay.W_LQ] <= ON_SURFACE * node[last, lay.SIZE]
