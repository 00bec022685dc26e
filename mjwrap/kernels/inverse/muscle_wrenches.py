"""Wrenches of muscles with given tensions on bodies, at many frames of a motion.

Arrays named as in MuJoCo's mjData have their shapes and frames, with the frames of the motion as their first axis.
"""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import from_python
from mjwrap.kernels.coupling.groups import Paths, Poses, Routes
from mjwrap.kernels.coupling.muscle_paths import R_MUSCLE, solve_routes
from mjwrap.kernels.coupling.path_points import leave_out
from mjwrap.kernels.coupling.wrenches import body_wrenches
from mjwrap.kernels.spans.end_inside import has_valid_length


@from_python
def wrench_frames(
    rows, weights, links,
    site_xpos, geom_xpos, geom_xmat, cvel, subtree_com, xipos, body_rootid,
    active, tol, node, segments, count, info,
    tension, wrench, status,
):  # fmt: skip
    """Write wrenches (T, nbody, 6) as of `xfrc_applied` for tensions (T, n); status (T, n): codes of paths.

    A muscle without a path gives its code; its wrenches mean nothing.
    """
    routes, paths = Routes(rows, weights, links), Paths(node, segments, count, info)
    for t in range(site_xpos.shape[0]):
        poses = Poses(
            site_xpos[t], geom_xpos[t], geom_xmat[t], cvel[t], subtree_com[t], xipos[t], body_rootid
        )
        for c in range(rows.shape[0]):
            if active[t, c] != 0:
                solve_routes(c, c + 1, routes, poses, paths, tol)
            else:
                leave_out(c, routes, paths)
            if not has_valid_length(info[c, lay.I_STATUS], info[c, lay.I_ERROR]):
                status[t, rows[c, R_MUSCLE]] = int(info[c, lay.I_STATUS])
        body_wrenches(routes, poses, paths, tension[t], wrench[t])
