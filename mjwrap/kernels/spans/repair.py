"""Repairs: other starts for a span whose path was not found from the contacts that it had.

Obstacle after obstacle is wrapped by itself between its neighbours' contact points; each such wrap shortens the path.
The first repair starts from the saved solution, the third from nothing. A saddle is left sideways first, where the path
gets shorter.
"""

from __future__ import annotations

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import deferred, jit
from mjwrap.kernels.geometry.geodesics import displace, geodesic
from mjwrap.kernels.geometry.traits import branched
from mjwrap.kernels.spans.cold_start import wrap_in_turn
from mjwrap.kernels.spans.saved_solutions import restore_solutions
from mjwrap.kernels.tangency.certify import shift_off_saddle

HINT, S_MODE, W_OLD, W_Q, W_Y = lay.HINT, lay.S_MODE, lay.W_OLD, lay.W_Q, lay.W_Y

MAX_REPAIRS = 4
REPAIR_PASSES = 7  # the first repair; further ones take about twice as many each
FORGET_AFTER = 2  # repairs after which the search begins anew
SADDLE_SHIFT = 0.3  # off a saddle, in radii


@jit
def out_of_repairs(lo, hi, repairs):
    """Return whether no repair is left: a lone obstacle has one, as further passes would wrap it the same way."""
    return repairs == MAX_REPAIRS or (hi - lo == 1 and repairs == 1)


@deferred(types.int64)
def repair(lo, hi, ends, node, repairs, saddle, cold):
    """Give the span another start, its repair number `repairs` from 0 on; return the evaluations spent.

    saddle: the rows hold a tangent path that is no minimum of length. cold: the solve began at a cold start.
    """
    if repairs == 0 and not saddle:
        restore_solutions(lo, hi, ends, node, W_OLD)
    if repairs == FORGET_AFTER:
        _forget_solution(lo, hi, cold, node)
    elif saddle:
        # one side first, then the other: which of them is the shorter way down is not known
        _leave_saddle(lo, hi, ends, node, 1.0 if repairs % 2 == 0 else -1.0)
    passes = (REPAIR_PASSES + repairs) << repairs if hi - lo > 1 else 1
    return wrap_in_turn(lo, hi, ends, node, passes, False)


@jit
def _forget_solution(lo, hi, cold, node):
    """Forget what was found and ignore the hints: they may ask for a side on which no string holds.

    A warm start keeps its topological sides; what it loses is a minimum that has ceased to exist.
    """
    for k in range(lo, hi):
        if cold or not branched(k, node):
            node[k, S_MODE] = lay.COLD
            node[k, HINT] = -abs(node[k, HINT])


@jit
def _leave_saddle(lo, hi, ends, node, sign):
    """Move a path that is a saddle of length a little down the side on which a string would slip.

    The obstacles behind the last one moved follow first: wraps in order from the origin on would undo the move.
    """
    failed = shift_off_saddle(lo, hi, node, SADDLE_SHIFT)
    if failed < 0:
        return
    for k in range(lo, failed + 1):
        if node[k, S_MODE] == lay.TOUCHED:
            displace(k, 0.0, sign * node[k, W_Y + 1], sign * node[k, W_Y + 2], 0.0, node)
            geodesic(k, node, ends[0], ends[1], ends[2])
    ends = (
        ends[0], ends[1], ends[2], node[failed, W_Q], node[failed, W_Q + 1], node[failed, W_Q + 2],
        ends[6], ends[7], ends[8],
    )  # fmt: skip
    wrap_in_turn(failed + 1, hi, ends, node, 1, False)
