"""One evaluation of all muscles in one call: crossing from Python costs 0.1 us an array, so it is done once a stage."""

from __future__ import annotations

from mjwrap.kernels._jit import jit
from mjwrap.kernels.coupling import body_wrenches, drive_muscles, solve_routes
from mjwrap.kernels.readiness import gather_activation


@jit
def evaluate(
    routes, weights, links, law, params, source, source_index, ctrl_low, ctrl_high, off, body_rootid,
    site_xpos, geom_xpos, geom_xmat, cvel, subtree_com, xipos, act, ctrl, own, excitation, tol,
    node, seg, seg_count, info, activation, length, velocity, tension, status, wrench,
):  # fmt: skip
    """Find all paths, tensions and body wrenches at the given poses; return whether some muscle has no path.

    Muscles that are `off` (n,) pull with no tension. The other arguments are those of the kernels called here.
    """
    solve_routes(routes, links, site_xpos, geom_xpos, geom_xmat, tol, node, seg, seg_count, info)
    gather_activation(source, source_index, ctrl_low, ctrl_high, act, ctrl, own, excitation, activation)
    drive_muscles(
        routes, weights, links, seg, seg_count, info, cvel, subtree_com, body_rootid, law, params, activation,
        length, velocity, tension, status,
    )  # fmt: skip
    failed = False
    for m in range(status.shape[0]):
        failed = failed or status[m] != 0
        if off[m]:
            tension[m] = 0.0
    body_wrenches(routes, weights, links, seg, seg_count, tension, xipos, wrench)
    return failed
