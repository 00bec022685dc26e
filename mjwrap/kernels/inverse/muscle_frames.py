"""Paths, moment arms and forces of muscles at many frames of a motion, in one compiled pass.

Arrays named as in MuJoCo's mjData have their shapes and frames, with the frames of the motion as their first axis. Each
frame starts from the paths of the frame before, so a pass may be split by muscles, never by frames.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import from_python
from mjwrap.kernels.coupling.groups import Dofs, PathPoints, Paths, Poses, Routes, SiteFrames
from mjwrap.kernels.coupling.moments import add_row
from mjwrap.kernels.coupling.muscle_paths import R_MUSCLE, measure_muscle, solve_routes
from mjwrap.kernels.coupling.path_points import (
    U_DOF,
    U_ROUTE,
    add_point_row,
    choose_routes,
    leave_out,
    place_sites,
    slope_of_length,
)
from mjwrap.kernels.musculotendon.tension import force_parts
from mjwrap.kernels.spans.end_inside import has_valid_length


@from_python
def place_points(
    axes, numbers, uses, conditions, ranges, force,
    qpos, xpos, xmat, site_pos,
    site_xpos, slopes, active,
):  # fmt: skip
    """Write moving sites to site_xpos, their derivatives to slopes (T, A, SLOPE), routes that hold to active (T, C).

    The first arguments are fields of `PathPoints`.
    """
    for t in range(qpos.shape[0]):
        points = PathPoints(axes, numbers, uses, conditions, ranges, slopes[t], active[t], force)
        place_sites(points, SiteFrames(qpos[t], qpos[t], xpos[t], xmat[t], site_pos), site_xpos[t])
        choose_routes(points, qpos[t])


@from_python
def measure_frames(
    first_route, end_route,
    rows, weights, links, law, params,
    site_xpos, geom_xpos, geom_xmat, cvel, subtree_com, body_rootid,
    last_dof, parent, cdof, qvel,
    uses, slopes, active,
    tol, node, segments, count, info,
    activation, dofs, followers, starts, heads, elimination,
    row, length, velocity, status,
    all_length, all_velocity, all_arm, all_active, all_passive, all_status,
):  # fmt: skip
    """Evaluate the muscles of routes first_route to end_route - 1 at all frames.

    activation (T, n). dofs (k,): the independent ones; followers: the others, of which number f follows the independent
    ones heads[starts[f] : starts[f + 1]], numbered as in dofs; elimination (T, nv, k): N = dq/dq_ind.
    row (nv,): scratch, zeros before and after. length, velocity, status (n,): of the last frame; a muscle without a
    path keeps them. Results (T, n), and moment arms -(J N) in all_arm (T, n, k).
    """
    routes, paths = Routes(rows, weights, links), Paths(node, segments, count, info)
    for t in range(site_xpos.shape[0]):
        # the bodies' centres of mass are only needed for wrenches
        poses = Poses(
            site_xpos[t], geom_xpos[t], geom_xmat[t], cvel[t], subtree_com[t], subtree_com[t], body_rootid
        )
        tree = Dofs(last_dof, parent, body_rootid, cdof[t], subtree_com[t])
        u = 0
        while u < uses.shape[0] and uses[u, U_ROUTE] < first_route:
            u += 1
        c = first_route
        while c < end_route:
            m, first, use = rows[c, R_MUSCLE], c, u
            while c < end_route and rows[c, R_MUSCLE] == m:
                if active[t, c] != 0:
                    solve_routes(c, c + 1, routes, poses, paths, tol)
                else:
                    leave_out(c, routes, paths)
                while use < uses.shape[0] and uses[use, U_ROUTE] == c:
                    if has_valid_length(info[c, lay.I_STATUS], info[c, lay.I_ERROR]):
                        slope = slope_of_length(use, uses, slopes[t], routes, paths)
                        info[c, lay.I_SPEED] += slope * qvel[t, uses[use, U_DOF]]
                    use += 1
                add_row(c, routes, paths, tree, row)
                c += 1
            measure_muscle(m, first, routes, info, length, velocity, status)
            u = add_point_row(u, m, uses, slopes[t], routes, paths, row)
            for i in range(dofs.shape[0]):
                all_arm[t, m, i] = -row[dofs[i]]
            for f in range(followers.shape[0]):
                slope = row[followers[f]]
                if slope != 0.0:
                    for h in range(starts[f], starts[f + 1]):
                        all_arm[t, m, heads[h]] -= slope * elimination[t, followers[f], heads[h]]
            for i in range(row.shape[0]):
                row[i] = 0.0
            pull, rest = force_parts(law[m], params, m, activation[t, m], length[m], velocity[m])
            code = abs(status[m])
            if not math.isfinite(pull + rest):
                pull, rest, code = 0.0, 0.0, lay.NON_FINITE
            all_length[t, m] = length[m]
            all_velocity[t, m] = velocity[m]
            all_active[t, m] = pull
            all_passive[t, m] = rest
            all_status[t, m] = code
