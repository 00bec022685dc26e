"""One evaluation of all muscles in one call: crossing from Python costs 0.1 us an array, so it is done once a stage."""

from __future__ import annotations

from mjwrap.kernels._jit import jit
from mjwrap.kernels.coupling.muscle_paths import measure_muscles, solve_routes
from mjwrap.kernels.coupling.wrenches import body_wrenches
from mjwrap.kernels.musculotendon.dynamics import drive_muscles, read_states


@jit
def evaluate(
    routes, weights, links, law, params, source, index, control, ctrl_low, ctrl_high, form, times, off, body_rootid,
    site_xpos, geom_xpos, geom_xmat, cvel, subtree_com, xipos, act, ctrl, own, excitation, since, ahead, timestep, tol,
    node, seg, seg_count, info, drive, start_activation, start_fiber, start_length,
    activation, fiber, length, velocity, tension, next_activation, next_fiber, status, wrench,
):  # fmt: skip
    """Find all paths, tensions and body wrenches at the given poses; return whether some muscle has no path.

    Muscles that are `off` (n,) pull with no tension and keep their states. The other arguments are those of the
    kernels called.
    """
    solve_routes(
        routes, links, site_xpos, geom_xpos, geom_xmat, cvel, subtree_com, body_rootid, tol,
        node, seg, seg_count, info,
    )  # fmt: skip
    read_states(
        source, index, control, ctrl_low, ctrl_high, form, times, act, ctrl, own, excitation, since, timestep,
        start_activation, start_fiber, drive,
    )  # fmt: skip
    measure_muscles(routes, weights, info, length, velocity, status)
    drive_muscles(
        law, params, source, form, times, off, since, ahead, drive, start_activation, start_fiber, start_length,
        length, velocity, activation, fiber, tension, next_activation, next_fiber, status,
    )  # fmt: skip
    failed = False
    for m in range(status.shape[0]):
        failed = failed or status[m] != 0
    body_wrenches(routes, weights, links, seg, seg_count, tension, subtree_com, body_rootid, xipos, wrench)
    return failed
