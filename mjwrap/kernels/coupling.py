"""All muscles of a model in one compiled call: poses in, lengths, tensions and wrenches on bodies out.

Arrays named as in MuJoCo's mjData and mjModel have their shapes and frames. A muscle has one or more routes (chains
of nodes); several are joined by pulleys and enter with their weights.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit
from mjwrap.kernels.chain import solve_chain
from mjwrap.kernels.segments import G_A, G_B, G_E, G_FAR, G_NEAR, list_segments

# columns of `links` (N, 4): ids of a node's site, geom, hint site (-1 where none) and body
L_SITE, L_GEOM, L_HINT, L_BODY = 0, 1, 2, 3
# columns of `routes` (C, 7): first node, past the last node, origin and insertion site and their bodies, muscle
R_LO, R_HI, R_FROM, R_TO, R_FROM_BODY, R_TO_BODY, R_MUSCLE = 0, 1, 2, 3, 4, 5, 6
ROUTE = 7


@jit
def _place(lo, hi, links, site_xpos, geom_xpos, geom_xmat, node):
    """Write the present poses, and at a cold start the hints, of nodes lo..hi; return whether one is cold."""
    cold = False
    for k in range(lo, hi):
        site, geom = links[k, L_SITE], links[k, L_GEOM]
        if geom < 0:
            for i in range(3):
                node[k, lay.POS + i] = site_xpos[site, i]
            continue
        for i in range(3):
            node[k, lay.POS + i] = geom_xpos[geom, i]
        for i in range(9):
            node[k, lay.ROT + i] = geom_xmat[geom, i]
        if node[k, lay.S_MODE] != lay.COLD:
            continue
        cold = True
        hint = links[k, L_HINT]
        if hint >= 0:
            x = site_xpos[hint, 0] - geom_xpos[geom, 0]
            y = site_xpos[hint, 1] - geom_xpos[geom, 1]
            z = site_xpos[hint, 2] - geom_xpos[geom, 2]
            node[k, lay.HINT] = 1.0
            for i in range(3):
                node[k, lay.HINT + 1 + i] = (
                    geom_xmat[geom, i] * x + geom_xmat[geom, 3 + i] * y + geom_xmat[geom, 6 + i] * z
                )
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
def solve_routes(routes, links, site_xpos, geom_xpos, geom_xmat, tol, node, seg, seg_count, info):
    """Find the path of every route; info (C, INFO), seg and seg_count keep the last good ones of failed routes."""
    for c in range(routes.shape[0]):
        lo, hi = routes[c, R_LO], routes[c, R_HI]
        a, b = routes[c, R_FROM], routes[c, R_TO]
        cold = _place(lo, hi, links, site_xpos, geom_xpos, geom_xmat, node)
        ox, oy, oz = site_xpos[a, 0], site_xpos[a, 1], site_xpos[a, 2]
        ix, iy, iz = site_xpos[b, 0], site_xpos[b, 1], site_xpos[b, 2]
        solve_chain(lo, hi, ox, oy, oz, ix, iy, iz, node, tol, True, info, c)
        if info[c, lay.I_STATUS] == lay.CONVERGED:
            seg_count[c] = list_segments(lo, hi, ox, oy, oz, ix, iy, iz, node, seg, lo + c)
        else:
            inside = (
                info[c, lay.I_STATUS] == lay.ENDPOINT_INSIDE
            )  # where a string comes out again is anybody's guess
            _roll_back(lo, hi, cold or inside, node)


@jit
def end_body(routes, links, c, index):
    """Return the body that holds a segment's end: a node's, or the origin's or insertion's of route c."""
    if index < routes[c, R_LO]:
        return routes[c, R_FROM_BODY]
    if index >= routes[c, R_HI]:
        return routes[c, R_TO_BODY]
    return links[index, L_BODY]


@jit
def _rate(body, seg, j, column, cvel, subtree_com, body_rootid):
    """Return e . v of the segment end in columns `column` as a point of `body`; cvel refers to the root's subtree."""
    root = body_rootid[body]
    rx = seg[j, column] - subtree_com[root, 0]
    ry = seg[j, column + 1] - subtree_com[root, 1]
    rz = seg[j, column + 2] - subtree_com[root, 2]
    wx, wy, wz = cvel[body, 0], cvel[body, 1], cvel[body, 2]
    vx = cvel[body, 3] + wy * rz - wz * ry
    vy = cvel[body, 4] + wz * rx - wx * rz
    vz = cvel[body, 5] + wx * ry - wy * rx
    return seg[j, G_E] * vx + seg[j, G_E + 1] * vy + seg[j, G_E + 2] * vz


@jit
def route_speed(c, routes, links, seg, seg_count, cvel, subtree_com, body_rootid):
    """Return the lengthening speed of route c (17) [m/s]."""
    total = 0.0
    first = routes[c, R_LO] + c
    for j in range(first, first + seg_count[c]):
        near = end_body(routes, links, c, int(seg[j, G_NEAR]))
        far = end_body(routes, links, c, int(seg[j, G_FAR]))
        if near != far:
            total += _rate(far, seg, j, G_B, cvel, subtree_com, body_rootid)
            total -= _rate(near, seg, j, G_A, cvel, subtree_com, body_rootid)
    return total


@jit
def measure_muscles(
    routes, weights, links, seg, seg_count, info, cvel, subtree_com, body_rootid, length, velocity, status
):
    """Turn solved routes into length [m], velocity [m/s] and status of every muscle, (n,) each.

    A muscle with a route without a path keeps its last values; its status says why.
    """
    c = 0
    for m in range(status.shape[0]):
        first = c
        code = lay.CONVERGED
        total, speed = 0.0, 0.0
        while c < routes.shape[0] and routes[c, R_MUSCLE] == m:
            if code == lay.CONVERGED:
                code = int(info[c, lay.I_STATUS])
            c += 1
        if code == lay.CONVERGED:
            for r in range(first, c):
                total += weights[r] * info[r, lay.I_LENGTH]
                speed += weights[r] * route_speed(
                    r, routes, links, seg, seg_count, cvel, subtree_com, body_rootid
                )
            if math.isfinite(speed):
                length[m] = total
                velocity[m] = speed
            else:
                code = lay.NON_FINITE
        status[m] = code


@jit
def _pull(wrench, body, seg, j, column, xipos, fx, fy, fz):
    """Add a force at a segment end to the body's wrench at its centre of mass; force, then torque, world frame."""
    rx = seg[j, column] - xipos[body, 0]
    ry = seg[j, column + 1] - xipos[body, 1]
    rz = seg[j, column + 2] - xipos[body, 2]
    wrench[body, 0] += fx
    wrench[body, 1] += fy
    wrench[body, 2] += fz
    wrench[body, 3] += ry * fz - rz * fy
    wrench[body, 4] += rz * fx - rx * fz
    wrench[body, 5] += rx * fy - ry * fx


@jit
def body_wrenches(routes, weights, links, seg, seg_count, tension, xipos, wrench):
    """Write to wrench (nbody, 6) what all muscles do to every body, in the convention of `xfrc_applied`."""
    for b in range(wrench.shape[0]):
        for i in range(6):
            wrench[b, i] = 0.0
    for c in range(routes.shape[0]):
        force = weights[c] * tension[routes[c, R_MUSCLE]]
        if force == 0.0:
            continue
        first = routes[c, R_LO] + c
        for j in range(first, first + seg_count[c]):
            near = end_body(routes, links, c, int(seg[j, G_NEAR]))
            far = end_body(routes, links, c, int(seg[j, G_FAR]))
            if near == far:
                continue
            fx, fy, fz = force * seg[j, G_E], force * seg[j, G_E + 1], force * seg[j, G_E + 2]
            _pull(wrench, near, seg, j, G_A, xipos, fx, fy, fz)
            _pull(wrench, far, seg, j, G_B, xipos, -fx, -fy, -fz)


# ------------------------------------------------------------------ xfrc_applied, shared with others


@jit
def take_back(xfrc, others, mine, total, written):
    """Leave in xfrc_applied (nbody, 6) what others put there.

    Rows still as mjwrap wrote them get others' share back to the bit. Where a row was set to zero since then (a reset,
    a viewer that clears all rows and assigns the one that its mouse pulls) there is nothing left to take back, nor
    where others have assigned the same again. From rows that others have changed otherwise, mjwrap's last contribution
    is subtracted.
    """
    cleared, untouched = False, False
    for b in range(xfrc.shape[0]):
        if written[b]:
            zero, same = True, True
            for i in range(6):
                zero = zero and xfrc[b, i] == 0.0
                same = same and xfrc[b, i] == total[b, i]
            cleared = cleared or (zero and not same)
            untouched = untouched or (same and not zero)
    cleared = cleared and not untouched
    for b in range(xfrc.shape[0]):
        if not written[b]:
            continue
        zero, same, assigned = True, True, True
        for i in range(6):
            zero = zero and xfrc[b, i] == 0.0
            same = same and xfrc[b, i] == total[b, i]
            assigned = assigned and xfrc[b, i] == others[b, i]
        for i in range(6):
            if same:
                xfrc[b, i] = others[b, i]
            elif not (zero or cleared or assigned):
                xfrc[b, i] -= mine[b, i]
        written[b] = False


@jit
def put(xfrc, others, mine, total, written, wrench):
    """Take the last contribution back and add the new wrench (nbody, 6) to xfrc_applied."""
    take_back(xfrc, others, mine, total, written)
    for b in range(xfrc.shape[0]):
        loaded = False
        for i in range(6):
            loaded = loaded or wrench[b, i] != 0.0
        if not loaded:
            continue
        written[b] = True
        for i in range(6):
            others[b, i] = xfrc[b, i]
            mine[b, i] = wrench[b, i]
            xfrc[b, i] += wrench[b, i]
            total[b, i] = xfrc[b, i]
