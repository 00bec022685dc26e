"""Frames of a recording: drawn data of all muscles at one evaluation, and their sorting by muscle over many frames.

A frame is written right after its evaluation, while the data are in the processor's cache. A store holds the rows of
one kind of data, frame after frame; starts (T, K + 1) holds the first row of each of the K parts of a frame, and at
last the row behind the frame.
"""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import from_python, inlined, jit
from mjwrap.kernels.coupling.drawn_paths import route_contacts, route_points
from mjwrap.kernels.coupling.groups import Dofs, Paths, Routes
from mjwrap.kernels.coupling.moments import length_jacobian
from mjwrap.kernels.coupling.muscle_paths import R_LO, R_MUSCLE
from mjwrap.kernels.coupling.path_points import add_point_columns
from mjwrap.kernels.solved.segments import G_A, G_B, G_E

# columns of a force: a point (3) [m], the force (3) [N], 1 if its arrow ends at the point
F_AT, F_FORCE, F_TIP = 0, 3, 6
FORCE = 7


@inlined
def _force(out, count, x, y, z, fx, fy, fz, tip):
    """Append a force if there is room for it; return the new count."""
    if count < out.shape[0]:
        out[count, 0], out[count, 1], out[count, 2] = x, y, z
        out[count, 3], out[count, 4], out[count, 5] = fx, fy, fz
        out[count, 6] = tip
    return count + 1


@jit
def _route_forces(c, routes, seg, seg_count, size, out, count):
    """Append the forces of route c on bodies, `size` times the unit vectors of its segments; return the new count.

    At origin and insertion the string pulls. The force on a surface or via point between them is the sum of the forces
    of both adjacent segments, placed midway between the contact points.
    """
    if seg_count[c] == 0:
        return count
    first = routes[c, R_LO] + c
    last = first + seg_count[c] - 1
    count = _force(
        out, count, seg[first, G_A], seg[first, G_A + 1], seg[first, G_A + 2],
        size * seg[first, G_E], size * seg[first, G_E + 1], size * seg[first, G_E + 2], 0.0,
    )  # fmt: skip
    for j in range(first, last):
        k = j + 1
        count = _force(
            out, count,
            0.5 * (seg[j, G_B] + seg[k, G_A]),
            0.5 * (seg[j, G_B + 1] + seg[k, G_A + 1]),
            0.5 * (seg[j, G_B + 2] + seg[k, G_A + 2]),
            size * (seg[k, G_E] - seg[j, G_E]),
            size * (seg[k, G_E + 1] - seg[j, G_E + 1]),
            size * (seg[k, G_E + 2] - seg[j, G_E + 2]),
            1.0,
        )  # fmt: skip
    return _force(
        out, count, seg[last, G_B], seg[last, G_B + 1], seg[last, G_B + 2],
        -size * seg[last, G_E], -size * seg[last, G_E + 1], -size * seg[last, G_E + 2], 0.0,
    )  # fmt: skip


@from_python
def put_state(row, numbers, status, info, all_numbers, all_status, all_iterations):
    """Write the numbers (Q, n), status (n,) and iterations (C,) of an evaluation as a row."""
    for m in range(status.shape[0]):
        for q in range(numbers.shape[0]):
            all_numbers[row, q, m] = numbers[q, m]
        all_status[row, m] = status[m]
    for c in range(info.shape[0]):
        all_iterations[row, c] = info[c, lay.I_ITERATIONS]


@from_python
def put_frame(
    routes, weights, links, node, seg, seg_count, info, tension, spacing, last_dof, dof_parentid, body_rootid, cdof,
    subtree_com, xpos, xquat, muscles, columns, jacobian, t, points, strips, contacts, touches, forces, pulls, arms,
    positions, quaternions, uses, slopes,
):  # fmt: skip
    """Write frame t, behind frame t - 1; return whether there was room for all of it.

    strips (T, C + 1): first row of each route in points; touches, pulls (T, n + 1): first rows of each muscle in
    contacts and forces. Rows for which there is no room are counted but not written. arms (T, K): moment arms -dl/dq of
    the pairs (muscles, columns); jacobian (n, nv): scratch. uses, slopes: of moving points, as in `PathPoints`.
    """
    point, contact, force = 0, 0, 0
    if t > 0:
        point, contact, force = strips[t - 1, -1], touches[t - 1, -1], pulls[t - 1, -1]
    strips[t, 0], touches[t, 0], pulls[t, 0] = point, contact, force
    muscle = 0
    for c in range(routes.shape[0]):
        while muscle < routes[c, R_MUSCLE]:
            muscle += 1
            touches[t, muscle], pulls[t, muscle] = contact, force
        point = route_points(c, routes, node, seg, seg_count, info, spacing, points, point)
        strips[t, c + 1] = point
        contact = route_contacts(c, routes, node, seg, seg_count, contacts, contact)
        size = weights[c] * tension[muscle]
        force = _route_forces(c, routes, seg, seg_count, size, forces, force)
    while muscle + 1 < touches.shape[1]:
        muscle += 1
        touches[t, muscle], pulls[t, muscle] = contact, force
    if muscles.shape[0] > 0:
        chains, paths = Routes(routes, weights, links), Paths(node, seg, seg_count, info)
        length_jacobian(
            chains,
            paths,
            Dofs(last_dof, dof_parentid, body_rootid, cdof, subtree_com),
            jacobian,
        )
        add_point_columns(uses, slopes, chains, paths, jacobian)
        for k in range(muscles.shape[0]):
            arms[t, k] = -jacobian[muscles[k], columns[k]]
    for body in range(xpos.shape[0]):
        for i in range(3):
            positions[t, body, i] = xpos[body, i]
        for i in range(4):
            quaternions[t, body, i] = xquat[body, i]
    return point <= points.shape[0] and contact <= contacts.shape[0] and force <= forces.shape[0]


# Frames are read in order and written part by part: where[k] is the next row of part k. This uses the processor's
# caches better than reading part by part.


@jit
def count_rows(starts, counts, where):
    """Write how many rows each part has in each frame to counts (K, T), and its first row to where (K,)."""
    total = 0
    for k in range(counts.shape[0]):
        where[k] = total
        for t in range(counts.shape[1]):
            counts[k, t] = starts[t, k + 1] - starts[t, k]
            total += counts[k, t]


@from_python
def gather(rows, starts, where, out, counts):
    """Copy points from a store's rows (m, 3) to out, sorted by part, then by frame; counts (K, T) is written."""
    count_rows(starts, counts, where)
    for t in range(counts.shape[1]):
        for k in range(counts.shape[0]):
            to = where[k]
            for j in range(starts[t, k], starts[t, k + 1]):
                for axis in range(3):
                    out[to, axis] = rows[j, axis]
                to += 1
            where[k] = to


@from_python
def gather_arrows(rows, starts, where, scale, tails, vectors, counts):
    """Write forces of a store as arrows, in the order of `gather`: tails and vectors (m, 3) [m]; scale [m/N]."""
    count_rows(starts, counts, where)
    for t in range(counts.shape[1]):
        for k in range(counts.shape[0]):
            to = where[k]
            for j in range(starts[t, k], starts[t, k + 1]):
                for axis in range(3):
                    vectors[to, axis] = scale * rows[j, F_FORCE + axis]
                    tails[to, axis] = rows[j, F_AT + axis] - rows[j, F_TIP] * vectors[to, axis]
                to += 1
            where[k] = to


@from_python
def list_strips(starts, routes, sizes, counts):
    """Write the sizes of all strips with points to sizes (C T,), sorted by muscle, frame and route; return how many.

    counts (n, T): number of strips of a muscle in a frame.
    """
    strips = 0
    c = 0
    for m in range(counts.shape[0]):
        lo = c
        while c < routes.shape[0] and routes[c, R_MUSCLE] == m:
            c += 1
        for t in range(counts.shape[1]):
            before = strips
            for r in range(lo, c):
                if starts[t, r + 1] > starts[t, r]:
                    sizes[strips] = starts[t, r + 1] - starts[t, r]
                    strips += 1
            counts[m, t] = strips - before
    return strips
