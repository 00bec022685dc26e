"""Restarts: other starting points for a span whose path was not found from the contacts that it had.

Each obstacle is wrapped by itself between its neighbours' contact points, one after the other; every such wrap shortens
the path. The first restart begins with the saved solution, the third with no contacts. A path that is a saddle of
length is first moved sideways, in a direction in which it gets shorter.
"""

from __future__ import annotations

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, jit
from mjwrap.kernels.geometry.geodesics import displace, geodesic
from mjwrap.kernels.geometry.traits import branched
from mjwrap.kernels.spans.cold_start import wrap_in_turn
from mjwrap.kernels.spans.saved_solutions import restore_solutions
from mjwrap.kernels.tangency.certify import shift_off_saddle

HINT, S_MODE, W_OLD, W_Q, W_Y = lay.HINT, lay.S_MODE, lay.W_OLD, lay.W_Q, lay.W_Y

MAX_RESTARTS = 4
# passes over the obstacles in the first restart; each further one takes about twice as many
RESTART_PASSES = 7
COLD_RESTART = 2  # number of the restart that forgets all contacts, counted from 0
SADDLE_SHIFT = 0.3  # how far a path is moved off a saddle, in the surface's size


@jit
def out_of_restarts(lo, hi, restarts):
    """Return whether no restart is left: a lone obstacle has one, because further passes would wrap it the same way."""
    return restarts == MAX_RESTARTS or (hi - lo == 1 and restarts == 1)


@deferred(types.int64)
def restart(lo, hi, ends, node, restarts, saddle, cold):
    """Give the span another starting point; return the number of evaluations.

    restarts: how many restarts there were before. saddle: the rows hold a tangent path that is not a minimum of length.
    cold: the solve began at a cold start.
    """
    if restarts == 0 and not saddle:
        restore_solutions(lo, hi, ends, node, W_OLD)
    if restarts == COLD_RESTART:
        _start_cold(lo, hi, cold, node)
    elif saddle:
        # to one side first, the next time to the other: which of them leads to the shorter path is not known
        _leave_saddle(lo, hi, ends, node, 1.0 if restarts % 2 == 0 else -1.0)
    passes = (RESTART_PASSES + restarts) << restarts if hi - lo > 1 else 1
    return wrap_in_turn(lo, hi, ends, node, passes, False)


@jit
def _start_cold(lo, hi, cold, node):
    """Remove all contacts and ignore the hints, which may ask for a side on which no string can stay.

    A warm start keeps the sides that are topological. Its other contacts belong to a minimum that no longer exists.
    """
    for k in range(lo, hi):
        if cold or not branched(k, node):
            node[k, S_MODE] = lay.COLD
            node[k, HINT] = -abs(node[k, HINT])


@jit
def _leave_saddle(lo, hi, ends, node, sign):
    """Move a path that is a saddle of length a little to the side to which a string would slip.

    Then the obstacles behind the last one that was moved are wrapped: wrapping from the origin on would undo the move.
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
