"""Wrenches of muscles on bodies, and how they share xfrc_applied with what others put there."""

from __future__ import annotations

from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.coupling.muscle_paths import R_LO, R_MUSCLE, R_SURFACES, moment, segment_bodies
from mjwrap.kernels.solved.segments import G_A, G_B, G_E


@jit
def _add_segment_force(pulled, force, row, mx, my, mz):
    """Add a force along e, and its moment, to a body's row."""
    pulled[0] += force * row[G_E]
    pulled[1] += force * row[G_E + 1]
    pulled[2] += force * row[G_E + 2]
    pulled[3] += force * mx
    pulled[4] += force * my
    pulled[5] += force * mz


@jit
def body_wrenches(routes, poses, paths, tension, wrench):
    """Write to wrench (nbody, 6) what all muscles do to every body, in the convention of `xfrc_applied`.

    Moments are added up about the centre of mass of a body's tree, which both ends of a segment mostly share, and
    moved to the body's own in the end.
    """
    for b in range(wrench.shape[0]):
        for i in range(6):
            wrench[b, i] = 0.0
    subtree_com, body_rootid = poses.subtree_com, poses.body_rootid
    for c in range(routes.rows.shape[0]):
        route = routes.rows[c]
        force = routes.weights[c] * tension[route[R_MUSCLE]]
        if force == 0.0:
            continue
        first = route[R_LO] + c
        curved = route[R_SURFACES] > 0
        for j in range(first, first + paths.count[c]):
            row = paths.segments[j]
            near, far = segment_bodies(c, j, routes, row)
            if near == far:
                continue
            root = body_rootid[far]
            mx, my, mz = moment(row, G_B, subtree_com[root])
            _add_segment_force(wrench[far], -force, row, mx, my, mz)
            if curved or body_rootid[near] != root:
                mx, my, mz = moment(row, G_A, subtree_com[body_rootid[near]])
            _add_segment_force(wrench[near], force, row, mx, my, mz)
    for b in range(wrench.shape[0]):
        pulled, centre, own = wrench[b], subtree_com[body_rootid[b]], poses.xipos[b]
        fx, fy, fz = pulled[0], pulled[1], pulled[2]
        rx, ry, rz = centre[0] - own[0], centre[1] - own[1], centre[2] - own[2]
        pulled[3] += ry * fz - rz * fy
        pulled[4] += rz * fx - rx * fz
        pulled[5] += rx * fy - ry * fx


# ------------------------------------------------------------------ xfrc_applied, shared with others


@jit
def remove_from_xfrc(xfrc, others, mine, total, written):
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
def add_to_xfrc(xfrc, others, mine, total, written, wrench):
    """Take the last contribution back and add the new wrench (nbody, 6) to xfrc_applied."""
    remove_from_xfrc(xfrc, others, mine, total, written)
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
