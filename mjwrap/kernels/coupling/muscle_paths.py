"""Paths of all muscles of a model in one compiled call: from poses and velocities to paths, lengths and speeds.

`groups.py` has the groups of arrays. A muscle has one route (a chain of nodes), or several that pulleys join; then each
counts with its weight.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import from_python, jit
from mjwrap.kernels.geometry.traits import sided
from mjwrap.kernels.solved.segments import G_A, G_B, G_E, G_FAR, G_NEAR, VANISHING, list_segments
from mjwrap.kernels.spans.chain import solve_chain
from mjwrap.kernels.spans.end_inside import has_valid_length, list_pulling_segments

# columns of `links` (N, 4): ids of a node's site, geom, hint site (-1 where none) and body
L_SITE, L_GEOM, L_HINT, L_BODY = 0, 1, 2, 3
# columns of a row of routes (C, 8): first node, one behind the last node, origin and insertion site, their bodies, the
# muscle, and the number of nodes that are rows of surfaces
R_LO, R_HI, R_FROM, R_TO, R_FROM_BODY, R_TO_BODY, R_MUSCLE, R_SURFACES = 0, 1, 2, 3, 4, 5, 6, 7
ROUTE = 8


@jit
def _write_poses(lo, hi, links, poses, node):
    """Write the present poses of nodes lo..hi, and their hints at a cold start; return whether one is cold.

    A side that holds at every pose is written at every pose.
    """
    cold = False
    for k in range(lo, hi):
        row = node[k]
        site, geom = links[k, L_SITE], links[k, L_GEOM]
        if geom < 0:
            pos = poses.site_xpos[site]
            for i in range(3):
                row[lay.POS + i] = pos[i]
            continue
        pos, rot = poses.geom_xpos[geom], poses.geom_xmat[geom]
        for i in range(3):
            row[lay.POS + i] = pos[i]
        for i in range(9):
            row[lay.ROT + i] = rot[i]
        if row[lay.S_MODE] <= lay.COLD:
            cold = True
        elif not sided(k, node):
            continue
        hint = links[k, L_HINT]
        if hint >= 0:
            x = poses.site_xpos[hint, 0] - pos[0]
            y = poses.site_xpos[hint, 1] - pos[1]
            z = poses.site_xpos[hint, 2] - pos[2]
            row[lay.HINT] = 1.0
            for i in range(3):
                row[lay.HINT + 1 + i] = rot[i] * x + rot[3 + i] * y + rot[6 + i] * z
    return cold


@jit
def _roll_back(lo, hi, cold, node):
    """Restore the last solution after a pose without a path; cold: make the next start a cold one, unless LOST."""
    for k in range(lo, hi):
        if node[k, lay.S_MODE] == lay.LOST:
            continue
        if cold:
            node[k, lay.S_MODE] = lay.COLD
        elif node[k, lay.KIND] != lay.VIA and node[k, lay.INSIDE] == 0.0:
            for i in range(lay.STATE):
                node[k, lay.S_MODE + i] = node[k, lay.W_OLD + i]


@from_python
def end_body(rows, links, c, index):
    """Return the body of a segment's end: that of a node, or of the origin or insertion of route c."""
    if index < rows[c, R_LO]:
        return rows[c, R_FROM_BODY]
    if index >= rows[c, R_HI]:
        return rows[c, R_TO_BODY]
    return links[index, L_BODY]


@jit
def segment_bodies(c, j, routes, row):
    """Return the bodies of the near and the far end of segment j of route c; row: the segment's row."""
    near, far = j - c - 1, j - c
    if routes.rows[c, R_SURFACES] > 0:
        near, far = int(row[G_NEAR]), int(row[G_FAR])
    return end_body(routes.rows, routes.links, c, near), end_body(routes.rows, routes.links, c, far)


@jit
def moment(row, column, centre):
    """Return r x e of a segment; r: from a tree's centre of mass to the end in columns `column` [m]."""
    rx, ry, rz = row[column] - centre[0], row[column + 1] - centre[1], row[column + 2] - centre[2]
    ex, ey, ez = row[G_E], row[G_E + 1], row[G_E + 2]
    return ry * ez - rz * ey, rz * ex - rx * ez, rx * ey - ry * ex


@jit
def _end_speed(velocity, row, mx, my, mz):
    """Return e . v of a segment's end; velocity: its body's row of cvel, m: the moment r x e of `moment`."""
    return (row[G_E] * velocity[3] + row[G_E + 1] * velocity[4] + row[G_E + 2] * velocity[5]) + (
        mx * velocity[0] + my * velocity[1] + mz * velocity[2]
    )


@jit
def _segment_speed(row, near, far, curved, poses):
    """Return the lengthening speed of a segment between bodies near and far [m/s].

    curved: its ends may lie on surfaces; then e need not be parallel to the segment, if it has no length.
    """
    root = poses.body_rootid[far]
    mx, my, mz = moment(row, G_B, poses.subtree_com[root])
    rate = _end_speed(poses.cvel[far], row, mx, my, mz)
    if curved or poses.body_rootid[near] != root:
        mx, my, mz = moment(row, G_A, poses.subtree_com[poses.body_rootid[near]])
    return rate - _end_speed(poses.cvel[near], row, mx, my, mz)


@jit
def _curved_speed(c, routes, poses, paths):
    """Return the lengthening speed of route c over surfaces (17) [m/s]."""
    total = 0.0
    first = routes.rows[c, R_LO] + c
    for j in range(first, first + paths.count[c]):
        row = paths.segments[j]
        near, far = segment_bodies(c, j, routes, row)
        if near != far:
            total += _segment_speed(row, near, far, True, poses)
    return total


@jit
def _solve_straight(c, routes, poses, paths):
    """Find the path of route c, which has only via points; if a point is not finite it has no segments."""
    route, links, site_xpos, info = routes.rows[c], routes.links, poses.site_xpos, paths.info
    lo, hi, site, near = route[R_LO], route[R_HI], route[R_FROM], route[R_FROM_BODY]
    x, y, z = site_xpos[site, 0], site_xpos[site, 1], site_xpos[site, 2]
    total, speed = 0.0, 0.0
    for k in range(lo, hi + 1):
        site = links[k, L_SITE] if k < hi else route[R_TO]
        far = links[k, L_BODY] if k < hi else route[R_TO_BODY]
        point = site_xpos[site]
        px, py, pz = point[0], point[1], point[2]
        ex, ey, ez = px - x, py - y, pz - z
        size = math.sqrt(ex * ex + ey * ey + ez * ez)
        scale = 1.0 / size if size > VANISHING else 0.0
        total += size
        row = paths.segments[k + c]
        row[G_NEAR] = k - 1
        row[G_FAR] = k
        row[G_A] = x
        row[G_A + 1] = y
        row[G_A + 2] = z
        row[G_B] = px
        row[G_B + 1] = py
        row[G_B + 2] = pz
        row[G_E] = ex * scale
        row[G_E + 1] = ey * scale
        row[G_E + 2] = ez * scale
        if k < hi:
            paths.node[k, lay.POS] = px
            paths.node[k, lay.POS + 1] = py
            paths.node[k, lay.POS + 2] = pz
        if near != far:
            speed += _segment_speed(row, near, far, False, poses)
        near = far
        x, y, z = px, py, pz
    good = math.isfinite(total)
    paths.count[c] = hi - lo + 1 if good else 0
    info[c, lay.I_LENGTH] = total if good else 0.0
    info[c, lay.I_STATUS] = lay.CONVERGED if good else lay.NON_FINITE
    info[c, lay.I_ERROR] = 0.0
    info[c, lay.I_ITERATIONS] = 0
    info[c, lay.I_EVALUATIONS] = 0
    info[c, lay.I_SPEED] = speed


@jit
def solve_routes(first, end, routes, poses, paths, tol):
    """Find path and speed of routes first to end - 1; one that fails keeps its segments and speed in `paths`."""
    node, seg, info, site_xpos = paths.node, paths.segments, paths.info, poses.site_xpos
    for c in range(first, end):
        route = routes.rows[c]
        if route[R_SURFACES] == 0:
            _solve_straight(c, routes, poses, paths)
            continue
        lo, hi = route[R_LO], route[R_HI]
        a, b = route[R_FROM], route[R_TO]
        cold = _write_poses(lo, hi, routes.links, poses, node)
        ox, oy, oz = site_xpos[a, 0], site_xpos[a, 1], site_xpos[a, 2]
        ix, iy, iz = site_xpos[b, 0], site_xpos[b, 1], site_xpos[b, 2]
        solve_chain(lo, hi, ox, oy, oz, ix, iy, iz, node, tol, True, info, c)
        status = info[c, lay.I_STATUS]
        if status == lay.CONVERGED:
            paths.count[c] = list_segments(lo, hi, ox, oy, oz, ix, iy, iz, node, seg, lo + c)
        elif has_valid_length(status, info[c, lay.I_ERROR]):
            paths.count[c] = list_pulling_segments(lo, hi, ox, oy, oz, ix, iy, iz, node, seg, lo + c)
        else:  # no path: where the string will touch again is not known
            _roll_back(lo, hi, cold or status == lay.ENDPOINT_INSIDE, node)
            continue
        info[c, lay.I_SPEED] = _curved_speed(c, routes, poses, paths)


@jit
def measure_muscle(m, first, routes, info, length, velocity, status):
    """Do what `measure_muscles` does for muscle m, whose first route is given; return the next muscle's first route."""
    c = first
    code, known = lay.CONVERGED, True
    total, speed = 0.0, 0.0
    while c < routes.rows.shape[0] and routes.rows[c, R_MUSCLE] == m:
        here = int(info[c, lay.I_STATUS])
        if not has_valid_length(here, info[c, lay.I_ERROR]):
            code, known = here if known else code, False
        elif code == lay.CONVERGED:
            code = here
        c += 1
    if known:
        code = -code
        for r in range(first, c):
            total += routes.weights[r] * info[r, lay.I_LENGTH]
            speed += routes.weights[r] * info[r, lay.I_SPEED]
        if math.isfinite(speed):
            length[m] = total
            velocity[m] = speed
        else:
            code = lay.NON_FINITE
    status[m] = code
    return c


@jit
def measure_muscles(routes, info, states):
    """Turn solved routes into length [m], velocity [m/s] and status of every muscle.

    A muscle with a route without a path keeps its last values; its status says why. If all its missing paths have a
    substitute (`end_inside.py`), the muscle has values, and its status a minus sign.
    """
    c = 0
    for m in range(states.status.shape[0]):
        c = measure_muscle(m, c, routes, info, states.length, states.velocity, states.status)
