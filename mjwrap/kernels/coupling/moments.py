"""How the lengths of muscles change with the generalised coordinates: rows of dl/dq, and moments of actuators.

A straight segment of a string is changed only by the degrees of freedom that move one of its ends and not the other,
so both ends' chains of dofs are followed up to where they meet. Arrays named as in MuJoCo's mjData and mjModel have
their shapes and frames; last_dof (nbody,) is the last dof that moves a body, -1 where none does.
"""

from __future__ import annotations

import math

from mjwrap.kernels._jit import jit
from mjwrap.kernels.coupling.muscle_paths import R_LO, R_MUSCLE, ends, moment
from mjwrap.kernels.solved.segments import G_A, G_B, G_E


@jit
def add_row(
    c, weight, routes, links, seg, seg_count, last_dof, dof_parentid, body_rootid, cdof, subtree_com, row
):
    """Add weight dl/dq of route c to row (nv,) [m per unit of the coordinate] (17)."""
    first = routes[c, R_LO] + c
    for j in range(first, first + seg_count[c]):
        near, far = ends(c, j, routes, links, seg[j])
        a, b = last_dof[near], last_dof[far]
        if a == b:
            continue
        ex, ey, ez = seg[j, G_E], seg[j, G_E + 1], seg[j, G_E + 2]
        ax, ay, az = moment(seg[j], G_A, subtree_com[body_rootid[near]])
        bx, by, bz = moment(seg[j], G_B, subtree_com[body_rootid[far]])
        while a != b:
            if a > b:
                row[a] -= weight * (
                    ax * cdof[a, 0] + ay * cdof[a, 1] + az * cdof[a, 2]
                    + ex * cdof[a, 3] + ey * cdof[a, 4] + ez * cdof[a, 5]
                )  # fmt: skip
                a = dof_parentid[a]
            else:
                row[b] += weight * (
                    bx * cdof[b, 0] + by * cdof[b, 1] + bz * cdof[b, 2]
                    + ex * cdof[b, 3] + ey * cdof[b, 4] + ez * cdof[b, 5]
                )  # fmt: skip
                b = dof_parentid[b]


@jit
def length_jacobian(
    routes, weights, links, seg, seg_count, last_dof, dof_parentid, body_rootid, cdof, subtree_com, jacobian
):  # fmt: skip
    """Write dl/dq (n, nv) of every muscle, all coordinates in one pass over the straight segments."""
    for m in range(jacobian.shape[0]):
        for i in range(jacobian.shape[1]):
            jacobian[m, i] = 0.0
    for c in range(routes.shape[0]):
        row = jacobian[routes[c, R_MUSCLE]]
        add_row(
            c, weights[c], routes, links, seg, seg_count, last_dof, dof_parentid, body_rootid, cdof, subtree_com, row
        )  # fmt: skip


@jit
def write_transmissions(
    output, tendon, tendon_row, routes, weights, links, seg, seg_count, length, velocity,
    last_dof, dof_parentid, body_rootid, cdof, subtree_com, row, gear,
    actuator_length, actuator_velocity, rownnz, rowadr, colind, moment, ten_length, ten_velocity, ten_j,
):  # fmt: skip
    """Give the actuators of muscles length [m], velocity [m/s] and moment along mjwrap's paths, times their gear.

    output (n,): index of the actuator's row in rownnz, rowadr and the sparse moment, -1 for a muscle that pulls
    otherwise; its columns have to hold every dof that changes the path. tendon (n,): the tendon that is to show the
    path too, -1 where none, and where its row begins in ten_j. row (nv,): scratch, zeros before and after. A muscle
    without a path has its last good length, velocity and segments, and what is not finite counts as zero.
    """
    c = 0
    for m in range(output.shape[0]):
        first = c
        while c < routes.shape[0] and routes[c, R_MUSCLE] == m:
            c += 1
        out = output[m]
        if out < 0:
            continue
        for r in range(first, c):
            add_row(
                r, weights[r], routes, links, seg, seg_count, last_dof, dof_parentid, body_rootid, cdof,
                subtree_com, row,
            )  # fmt: skip
        factor, shown, start, place = gear[out, 0], tendon[m], rowadr[out], tendon_row[m]
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
        actuator_length[out] = factor * size
        actuator_velocity[out] = factor * speed
        if shown >= 0:
            ten_length[shown] = size
            ten_velocity[shown] = speed
        if not sound:
            for k in range(rownnz[out]):
                moment[start + k] = 0.0
                if shown >= 0:
                    ten_j[place + k] = 0.0
