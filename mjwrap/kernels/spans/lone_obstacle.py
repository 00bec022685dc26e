"""A lone obstacle with a closed-form wrap: the path without Newton's method, certified as any other."""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.geometry.traits import sided
from mjwrap.kernels.spans.cold_start import path_length
from mjwrap.kernels.spans.lift_off_touchdown import follow_branch, in_range
from mjwrap.kernels.spans.saved_solutions import save_solutions
from mjwrap.kernels.spans.span_ends import ends_in_short_segment
from mjwrap.kernels.tangency.certify import is_local_minimum
from mjwrap.kernels.tangency.tangency_error import connect_segments
from mjwrap.kernels.wraps.single import wrap

S_MODE, W_OLD = lay.S_MODE, lay.W_OLD


@jit
def solve_lone_obstacle(k, ends, node, tol):
    """Find the path over obstacle k alone, whose wrap has a closed form, on its saved branch or its side.

    Returns (whether the path passes the checks of `solve_active_set`, length [m], ||f||). Where it does not, the saved
    solution is left as it was.
    """
    hi = k + 1
    save_solutions(k, hi, node, W_OLD)
    if sided(k, node):  # its side follows from the pose, not from the branch
        node[k, S_MODE] = lay.COLD
    good = (
        wrap(k, node, ends[0], ends[1], ends[2], ends[3], ends[4], ends[5], ends[6], ends[7], ends[8], False)
        == 0
    )
    error = 0.0
    if node[k, S_MODE] == lay.TOUCHED:
        error = math.sqrt(connect_segments(k, hi, ends, node))
        # the checks of `active_set_method.solve_active_set`, the cheapest first
        good = good and error <= tol and not ends_in_short_segment(k, hi, node)
        good = good and follow_branch(k, hi, node) and is_local_minimum(k, hi, node)
        good = good and in_range(k, hi, ends, node)
        node[k, lay.S_BEFORE] = node[k, lay.W_L]
        node[k, lay.S_BEFORE + 1] = node[k, lay.W_LQ]
    total = path_length(k, hi, ends, node)
    if not good:
        for i in range(lay.STATE):
            node[k, S_MODE + i] = node[k, W_OLD + i]
    node[k, lay.W_RESTARTS] = 0.0
    return good, total, error
