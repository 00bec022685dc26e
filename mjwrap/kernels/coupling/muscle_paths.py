"""All muscles of a model in one compiled call: poses and velocities in, paths, lengths and their rates out.

Arrays named as in MuJoCo's mjData and mjModel have their shapes and frames. A muscle has one or more routes (chains
of nodes); several are joined by pulleys and enter with their weights.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit
from mjwrap.kernels.solved.segments import G_A, G_B, G_E, G_FAR, G_NEAR, VANISHING, list_segments
from mjwrap.kernels.spans.chain import solve_chain
from mjwrap.kernels.spans.end_inside import has_valid_length, list_pulling_segments

# columns of `links` (N, 4): ids of a node's site, geom, hint site (-1 where none) and body
L_SITE, L_GEOM, L_HINT, L_BODY = 0, 1, 2, 3
# columns of `routes` (C, 8): first node, past the last node, origin and insertion site and their bodies, muscle, and
# how many nodes are surfaces' rows
R_LO, R_HI, R_FROM, R_TO, R_FROM_BODY, R_TO_BODY, R_MUSCLE, R_SURFACES = 0, 1, 2, 3, 4, 5, 6, 7
ROUTE = 8


@jit
def _place(lo, hi, links, site_xpos, geom_xpos, geom_xmat, node):
    """Write the present poses, and at a cold start the hints, of nodes lo..hi; return whether one is cold."""
    cold = False
    for k in range(lo, hi):
        row = node[k]
        site, geom = links[k, L_SITE], links[k, L_GEOM]
        if geom < 0:
            pos = site_xpos[site]
            for i in range(3):
                row[lay.POS + i] = pos[i]
            continue
        pos, rot = geom_xpos[geom], geom_xmat[geom]
        for i in range(3):
            row[lay.POS + i] = pos[i]
        for i in range(9):
            row[lay.ROT + i] = rot[i]
        if row[lay.S_MODE] != lay.COLD:
            continue
        cold = True
        hint = links[k, L_HINT]
        if hint >= 0:
            x = site_xpos[hint, 0] - pos[0]
            y = site_xpos[hint, 1] - pos[1]
            z = site_xpos[hint, 2] - pos[2]
            row[lay.HINT] = 1.0
            for i in range(3):
                row[lay.HINT + 1 + i] = rot[i] * x + rot[3 + i] * y + rot[6 + i] * z
    return cold


@jit
def _roll_back(lo, hi, cold, node):
    """After a pose without a path: go on from the last solution, or start cold where there is none to go on from."""
    for k in range(lo, hi):
        if cold:
            node[k, lay.S_MODE] = lay.COLD
        elif node[k, lay.KIND] != lay.VIA and node[k, lay.INSIDE] == 0.0:
            for i in range(lay.STATE):
                node[k, lay.S_MODE + i] = node[k, lay.W_OLD + i]


@jit
def end_body(routes, links, c, index):
    """Return the body that holds a segment's end: a node's, or the origin's or insertion's of route c."""
    if index < routes[c, R_LO]:
        return routes[c, R_FROM_BODY]
    if index >= routes[c, R_HI]:
        return routes[c, R_TO_BODY]
    return links[index, L_BODY]


@jit
def ends(c, j, routes, links, row):
    """Return the bodies that hold the near and the far end of segment j of route c, whose row is given."""
    near, far = j - c - 1, j - c
    if routes[c, R_SURFACES] > 0:
        near, far = int(row[G_NEAR]), int(row[G_FAR])
    return end_body(routes, links, c, near), end_body(routes, links, c, far)


@jit
def moment(row, column, centre):
    """Return r x e of a segment, where r is its end in columns `column` from a tree's centre of mass [m]."""
    rx, ry, rz = row[column] - centre[0], row[column + 1] - centre[1], row[column + 2] - centre[2]
    ex, ey, ez = row[G_E], row[G_E + 1], row[G_E + 2]
    return ry * ez - rz * ey, rz * ex - rx * ez, rx * ey - ry * ex


@jit
def _rate(velocity, row, mx, my, mz):
    """Return e . v of a body's point, about which e has the moment m; velocity: the body's row of cvel."""
    return (row[G_E] * velocity[3] + row[G_E + 1] * velocity[4] + row[G_E + 2] * velocity[5]) + (
        mx * velocity[0] + my * velocity[1] + mz * velocity[2]
    )


@jit
def _rates(row, near, far, curved, cvel, subtree_com, body_rootid):
    """Return how fast the segment in a row lengthens, whose ends two bodies hold [m/s].

    curved: its ends may lie on surfaces, where e need not be along a segment that vanishes.
    """
    root = body_rootid[far]
    mx, my, mz = moment(row, G_B, subtree_com[root])
    rate = _rate(cvel[far], row, mx, my, mz)
    if curved or body_rootid[near] != root:
        mx, my, mz = moment(row, G_A, subtree_com[body_rootid[near]])
    return rate - _rate(cvel[near], row, mx, my, mz)


@jit
def _curved_speed(c, routes, links, seg, seg_count, cvel, subtree_com, body_rootid):
    """Return the lengthening speed of route c over surfaces (17) [m/s]."""
    total = 0.0
    first = routes[c, R_LO] + c
    for j in range(first, first + seg_count[c]):
        near, far = ends(c, j, routes, links, seg[j])
        if near != far:
            total += _rates(seg[j], near, far, True, cvel, subtree_com, body_rootid)
    return total


@jit
def _solve_straight(
    c, routes, links, site_xpos, cvel, subtree_com, body_rootid, node, seg, seg_count, info
):  # fmt: skip
    """Find the path of route c over via points alone; one whose points are not finite has no segments."""
    lo, hi, site = routes[c, R_LO], routes[c, R_HI], routes[c, R_FROM]
    near = routes[c, R_FROM_BODY]
    x, y, z = site_xpos[site, 0], site_xpos[site, 1], site_xpos[site, 2]
    total, speed = 0.0, 0.0
    for k in range(lo, hi + 1):
        site = links[k, L_SITE] if k < hi else routes[c, R_TO]
        far = links[k, L_BODY] if k < hi else routes[c, R_TO_BODY]
        point = site_xpos[site]
        px, py, pz = point[0], point[1], point[2]
        ex, ey, ez = px - x, py - y, pz - z
        size = math.sqrt(ex * ex + ey * ey + ez * ez)
        scale = 1.0 / size if size > VANISHING else 0.0
        total += size
        row = seg[k + c]
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
            node[k, lay.POS] = px
            node[k, lay.POS + 1] = py
            node[k, lay.POS + 2] = pz
        if near != far:
            speed += _rates(row, near, far, False, cvel, subtree_com, body_rootid)
        near = far
        x, y, z = px, py, pz
    good = math.isfinite(total)
    seg_count[c] = hi - lo + 1 if good else 0
    info[c, lay.I_LENGTH] = total if good else 0.0
    info[c, lay.I_STATUS] = lay.CONVERGED if good else lay.NON_FINITE
    info[c, lay.I_ERROR] = 0.0
    info[c, lay.I_ITERATIONS] = 0
    info[c, lay.I_EVALUATIONS] = 0
    info[c, lay.I_SPEED] = speed


@jit
def solve_routes(
    routes, links, site_xpos, geom_xpos, geom_xmat, cvel, subtree_com, body_rootid, tol,
    node, seg, seg_count, info,
):  # fmt: skip
    """Find path and speed of every route; info (C, INFO), seg and seg_count keep what failed routes had."""
    for c in range(routes.shape[0]):
        if routes[c, R_SURFACES] == 0:
            _solve_straight(
                c, routes, links, site_xpos, cvel, subtree_com, body_rootid, node, seg, seg_count, info
            )
            continue
        lo, hi = routes[c, R_LO], routes[c, R_HI]
        a, b = routes[c, R_FROM], routes[c, R_TO]
        cold = _place(lo, hi, links, site_xpos, geom_xpos, geom_xmat, node)
        ox, oy, oz = site_xpos[a, 0], site_xpos[a, 1], site_xpos[a, 2]
        ix, iy, iz = site_xpos[b, 0], site_xpos[b, 1], site_xpos[b, 2]
        solve_chain(lo, hi, ox, oy, oz, ix, iy, iz, node, tol, True, info, c)
        status = info[c, lay.I_STATUS]
        if status == lay.CONVERGED:
            seg_count[c] = list_segments(lo, hi, ox, oy, oz, ix, iy, iz, node, seg, lo + c)
        elif has_valid_length(status, info[c, lay.I_ERROR]):
            seg_count[c] = list_pulling_segments(lo, hi, ox, oy, oz, ix, iy, iz, node, seg, lo + c)
        else:  # where a string comes out again is anybody's guess
            _roll_back(lo, hi, cold or status == lay.ENDPOINT_INSIDE, node)
            continue
        info[c, lay.I_SPEED] = _curved_speed(c, routes, links, seg, seg_count, cvel, subtree_com, body_rootid)


@jit
def measure_muscles(routes, weights, info, length, velocity, status):
    """Turn solved routes into length [m], velocity [m/s] and status of every muscle, (n,) each.

    A muscle with a route without a path keeps its last values; its status says why. Where something stands in for every
    path that is missing (`end_inside.py`), the muscle has values, and the status a minus sign.
    """
    c = 0
    for m in range(status.shape[0]):
        first = c
        code, known = lay.CONVERGED, True
        total, speed = 0.0, 0.0
        while c < routes.shape[0] and routes[c, R_MUSCLE] == m:
            here = int(info[c, lay.I_STATUS])
            if not has_valid_length(here, info[c, lay.I_ERROR]):
                code, known = here if known else code, False
            elif code == lay.CONVERGED:
                code = here
            c += 1
        if known:
            code = -code
            for r in range(first, c):
                total += weights[r] * info[r, lay.I_LENGTH]
                speed += weights[r] * info[r, lay.I_SPEED]
            if math.isfinite(speed):
                length[m] = total
                velocity[m] = speed
            else:
                code = lay.NON_FINITE
        status[m] = code
