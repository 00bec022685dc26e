"""Length Jacobian dl/dq of muscles, and length, velocity and moment for MuJoCo's own actuators (native transmission).

Only degrees of freedom that move one end of a straight segment and not the other change its length. So the chains of
dofs of both ends are followed up to the dof at which they meet. Arrays named as in MuJoCo's mjData and mjModel have
their shapes and frames; `groups.py` has the groups of arrays.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.coupling.muscle_paths import R_LO, R_MUSCLE, moment, segment_bodies
from mjwrap.kernels.coupling.path_points import U_ROUTE, add_point_row
from mjwrap.kernels.solved.segments import G_A, G_B, G_E


@jit
def add_row(c, routes, paths, dofs, row):
    """Add dl/dq of route c, times its weight, to row (nv,) [m per unit of the coordinate] (17)."""
    weight, seg, cdof = routes.weights[c], paths.segments, dofs.cdof
    first = routes.rows[c, R_LO] + c
    for j in range(first, first + paths.count[c]):
        near, far = segment_bodies(c, j, routes, seg[j])
        a, b = dofs.last_dof[near], dofs.last_dof[far]
        if a == b:
            continue
        ex, ey, ez = seg[j, G_E], seg[j, G_E + 1], seg[j, G_E + 2]
        ax, ay, az = moment(seg[j], G_A, dofs.subtree_com[dofs.body_rootid[near]])
        bx, by, bz = moment(seg[j], G_B, dofs.subtree_com[dofs.body_rootid[far]])
        while a != b:
            if a > b:
                row[a] -= weight * (
                    ax * cdof[a, 0] + ay * cdof[a, 1] + az * cdof[a, 2]
                    + ex * cdof[a, 3] + ey * cdof[a, 4] + ez * cdof[a, 5]
                )  # fmt: skip
                a = dofs.parent[a]
            else:
                row[b] += weight * (
                    bx * cdof[b, 0] + by * cdof[b, 1] + bz * cdof[b, 2]
                    + ex * cdof[b, 3] + ey * cdof[b, 4] + ez * cdof[b, 5]
                )  # fmt: skip
                b = dofs.parent[b]


@jit
def length_jacobian(routes, paths, dofs, jacobian):
    """Write dl/dq (n, nv) of every muscle, in one pass over the straight segments."""
    for m in range(jacobian.shape[0]):
        for i in range(jacobian.shape[1]):
            jacobian[m, i] = 0.0
    for c in range(routes.rows.shape[0]):
        add_row(c, routes, paths, dofs, jacobian[routes.rows[c, R_MUSCLE]])


@jit
def write_transmissions(routes, paths, dofs, uses, slopes, length, velocity, targets, row):
    """Write length [m], velocity [m/s] and moment of mjwrap's paths, times the gear, to MuJoCo's own actuators.

    uses, slopes: as in `PathPoints`. length, velocity (n,): those of the muscles. row (nv,): scratch, zeros before and
    after. A muscle without a path has its last valid length, velocity and segments. Where some number is not finite,
    all of the actuator's are zero.
    """
    rownnz, colind, moment, ten_j = targets.rownnz, targets.colind, targets.moment, targets.ten_j
    c, u = 0, 0
    for m in range(targets.output.shape[0]):
        first = c
        while c < routes.rows.shape[0] and routes.rows[c, R_MUSCLE] == m:
            c += 1
        out = targets.output[m]
        if out < 0:
            while u < uses.shape[0] and uses[u, U_ROUTE] < c:
                u += 1
            continue
        for r in range(first, c):
            add_row(r, routes, paths, dofs, row)
        u = add_point_row(u, m, uses, slopes, routes, paths, row)
        factor, shown = targets.gear[out, 0], targets.tendon[m]
        start, place = targets.rowadr[out], targets.tendon_row[m]
        sound = math.isfinite(length[m]) and math.isfinite(velocity[m])
        for k in range(rownnz[out]):
            dof = colind[start + k]
            value = row[dof]
            row[dof] = 0.0
            if not math.isfinite(value):
                sound = False
            moment[start + k] = factor * value
            if shown >= 0:
                ten_j[place + k] = value
        size, speed = (length[m], velocity[m]) if sound else (0.0, 0.0)
        targets.actuator_length[out] = factor * size
        targets.actuator_velocity[out] = factor * speed
        if shown >= 0:
            targets.ten_length[shown] = size
            targets.ten_velocity[shown] = speed
        if not sound:
            for k in range(rownnz[out]):
                moment[start + k] = 0.0
                if shown >= 0:
                    ten_j[place + k] = 0.0
