"""Wrenches of muscles on bodies, added to xfrc_applied beside the forces that others write there."""

from __future__ import annotations

from mjwrap.kernels.compilation.jit import from_python, jit
from mjwrap.kernels.coupling.muscle_paths import R_LO, R_MUSCLE, R_SURFACES, moment, segment_bodies
from mjwrap.kernels.solved.segments import G_A, G_B, G_E


@jit
def _add_segment_force(total, force, row, mx, my, mz):
    """Add a force along e of a segment's row, and its moment, to a body's row (6); m: the moment r x e."""
    total[0] += force * row[G_E]
    total[1] += force * row[G_E + 1]
    total[2] += force * row[G_E + 2]
    total[3] += force * mx
    total[4] += force * my
    total[5] += force * mz


@jit
def body_wrenches(routes, poses, paths, tension, wrench):
    """Write the wrenches of all muscles on every body to wrench (nbody, 6), in the convention of `xfrc_applied`.

    Moments are summed about the centre of mass of a body's tree, which is mostly the same for both ends of a segment,
    and at last moved to the body's own centre of mass.
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
        total, centre, own = wrench[b], subtree_com[body_rootid[b]], poses.xipos[b]
        fx, fy, fz = total[0], total[1], total[2]
        rx, ry, rz = centre[0] - own[0], centre[1] - own[1], centre[2] - own[2]
        total[3] += ry * fz - rz * fy
        total[4] += rz * fx - rx * fz
        total[5] += rx * fy - ry * fx


# ------------------------------------------------------------------ xfrc_applied, shared with others


@from_python
def remove_from_xfrc(xfrc, others, mine, total, written):
    """Remove mjwrap's last contribution from xfrc_applied (nbody, 6), so that only the forces of others remain.

    A row that is as mjwrap left it gets the others' forces back, exactly. Nothing is removed from a row that was set to
    zero since then (by a reset, or by a viewer that clears all rows and writes one), nor from one to which others have
    assigned their own forces again. From a row that others have changed in another way, the contribution is subtracted.

    others, mine, total (nbody, 6): the forces of others, mjwrap's, and their sum, as last written; written (nbody,):
    the rows to which mjwrap has added.
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


@from_python
def add_to_xfrc(xfrc, others, mine, total, written, wrench):
    """Remove the last contribution from xfrc_applied and add wrench (nbody, 6); arrays as of `remove_from_xfrc`."""
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
