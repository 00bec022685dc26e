"""Time derivative of the length Jacobian of every muscle, from the Hessians of paths and MuJoCo's kinematics.

dl/dq of a muscle is a sum over its slots (origin, nodes, insertion): the gradient of the length, a force f and a moment
m about the slot's position p, times the Jacobian of that position. By the product rule both factors are differentiated.
Arrays named as in mjData and mjModel have their shapes and frames.
"""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import from_python, jit
from mjwrap.kernels.coupling.muscle_paths import (
    L_BODY,
    R_FROM,
    R_FROM_BODY,
    R_HI,
    R_LO,
    R_MUSCLE,
    R_TO,
    R_TO_BODY,
)
from mjwrap.kernels.coupling.path_points import S_FIRST, S_SECOND, U_AXIS, U_DOF, U_NODE, U_ROUTE
from mjwrap.kernels.solved.hessian import NO_FAULT, add_gradient, add_stiffness_times, list_path_points


@jit
def _slot(c, k, routes, links, site_xpos, node):
    """Return body and position of slot k of route c."""
    lo, hi = routes[c, R_LO], routes[c, R_HI]
    if k == 0 or k == hi - lo + 1:
        site = routes[c, R_FROM] if k == 0 else routes[c, R_TO]
        body = routes[c, R_FROM_BODY] if k == 0 else routes[c, R_TO_BODY]
        return body, site_xpos[site, 0], site_xpos[site, 1], site_xpos[site, 2]
    j = lo + k - 1
    return links[j, L_BODY], node[j, lay.POS], node[j, lay.POS + 1], node[j, lay.POS + 2]


@jit
def _axis_rate(dof, dof_bodyid, dof_is_quat, cvel, cdof, cdof_dot):
    """Return the rate of a column of cdof; the axes of ball and free joints rotate with the body."""
    if not dof_is_quat[dof]:
        return (
            cdof_dot[dof, 0], cdof_dot[dof, 1], cdof_dot[dof, 2],
            cdof_dot[dof, 3], cdof_dot[dof, 4], cdof_dot[dof, 5],
        )  # fmt: skip
    b = dof_bodyid[dof]
    wx, wy, wz = cvel[b, 0], cvel[b, 1], cvel[b, 2]
    vx, vy, vz = cvel[b, 3], cvel[b, 4], cvel[b, 5]
    ax, ay, az = cdof[dof, 0], cdof[dof, 1], cdof[dof, 2]
    lx, ly, lz = cdof[dof, 3], cdof[dof, 4], cdof[dof, 5]
    return (
        wy * az - wz * ay,
        wz * ax - wx * az,
        wx * ay - wy * ax,
        wy * lz - wz * ly + vy * az - vz * ay,
        wz * lx - wx * lz + vz * ax - vx * az,
        wx * ly - wy * lx + vx * ay - vy * ax,
    )


@jit
def _add_row(weight, k, place, body, gradient, rate, twist, kinematics, row, jacobian):
    """Add slot k's part to a row, up the chain of dofs that move its body; place: from the tree's centre of mass."""
    (
        body_dofadr, body_dofnum, dof_parentid, body_parentid, dof_bodyid, dof_is_quat, _,
        cvel, cdof, cdof_dot, _,
    ) = kinematics  # fmt: skip
    rx, ry, rz = place
    while body > 0 and body_dofnum[body] == 0:
        body = body_parentid[body]
    if body == 0:
        return
    vx, vy, vz = twist[k, 0], twist[k, 1], twist[k, 2]
    fx, fy, fz, mx, my, mz = (
        gradient[k, 0], gradient[k, 1], gradient[k, 2], gradient[k, 3], gradient[k, 4], gradient[k, 5]
    )  # fmt: skip
    dof = body_dofadr[body] + body_dofnum[body] - 1
    while dof >= 0:
        ax, ay, az = cdof[dof, 0], cdof[dof, 1], cdof[dof, 2]
        total = (
            rate[k, 0] * (cdof[dof, 3] + ay * rz - az * ry)
            + rate[k, 1] * (cdof[dof, 4] + az * rx - ax * rz)
            + rate[k, 2] * (cdof[dof, 5] + ax * ry - ay * rx)
            + rate[k, 3] * ax
            + rate[k, 4] * ay
            + rate[k, 5] * az
        )
        bx, by, bz, lx, ly, lz = _axis_rate(dof, dof_bodyid, dof_is_quat, cvel, cdof, cdof_dot)
        total += (
            fx * (lx + by * rz - bz * ry + ay * vz - az * vy)
            + fy * (ly + bz * rx - bx * rz + az * vx - ax * vz)
            + fz * (lz + bx * ry - by * rx + ax * vy - ay * vx)
            + mx * bx
            + my * by
            + mz * bz
        )
        jacobian[row, dof] += weight * total
        dof = dof_parentid[dof]


@jit
def _point_rate(use, k, slopes, qvel, twist, gradient, rate):
    """Return the rate of what the moving site in slot k adds to dl/dq of its joint: of gradient . dp/dq."""
    s, speed = slopes[use[U_AXIS]], qvel[use[U_DOF]]
    sx, sy, sz = s[S_FIRST], s[S_FIRST + 1], s[S_FIRST + 2]
    wx, wy, wz = twist[k, 3], twist[k, 4], twist[k, 5]
    return (
        rate[k, 0] * sx
        + rate[k, 1] * sy
        + rate[k, 2] * sz
        + gradient[k, 0] * (s[S_SECOND] * speed + wy * sz - wz * sy)
        + gradient[k, 1] * (s[S_SECOND + 1] * speed + wz * sx - wx * sz)
        + gradient[k, 2] * (s[S_SECOND + 2] * speed + wx * sy - wy * sx)
    )


@from_python
def length_jacobian_rate(
    routes, weights, links, site_xpos, node, seg_count, kinematics, uses, slopes, qvel, twist, gradient, rate, owner,
    stop, jacobian,
):  # fmt: skip
    """Write d(dl/dq)/dt (n, nv) of every muscle along the motion that cvel and cdof_dot belong to.

    kinematics: arrays of mjModel and mjData, see `_add_row`. uses, slopes: of moving points, as in `PathPoints`; qvel
    (nv,): the motion. Routes without segments (seg_count) do not hold at the pose, and are left out. twist, gradient,
    rate (longest chain + 2, 6) and stop (longest chain + 2, POINT_ROW) are scratch; owner: 0, 1, 2 ..., a slot for
    each node. Returns (NO_FAULT, 0, 0), or fault, route and slot where there is no derivative.
    """
    body_rootid, cvel, subtree_com = kinematics[6], kinematics[7], kinematics[10]
    for m in range(jacobian.shape[0]):
        for i in range(jacobian.shape[1]):
            jacobian[m, i] = 0.0
    u, next_use = 0, 0
    for c in range(routes.shape[0]):
        lo, hi = routes[c, R_LO], routes[c, R_HI]
        slots = hi - lo + 2
        u = next_use
        while next_use < uses.shape[0] and uses[next_use, U_ROUTE] == c:
            next_use += 1
        if seg_count[c] == 0:
            continue
        for k in range(slots):
            body, x, y, z = _slot(c, k, routes, links, site_xpos, node)
            com = body_rootid[body]
            x, y, z = x - subtree_com[com, 0], y - subtree_com[com, 1], z - subtree_com[com, 2]
            wx, wy, wz = cvel[body, 0], cvel[body, 1], cvel[body, 2]
            twist[k, 0] = cvel[body, 3] + wy * z - wz * y
            twist[k, 1] = cvel[body, 4] + wz * x - wx * z
            twist[k, 2] = cvel[body, 5] + wx * y - wy * x
            twist[k, 3] = wx
            twist[k, 4] = wy
            twist[k, 5] = wz
            for i in range(6):
                gradient[k, i] = 0.0
                rate[k, i] = 0.0
        for use in range(u, next_use):
            k, a = uses[use, U_NODE] - lo + 1, uses[use, U_AXIS]
            for i in range(3):
                twist[k, i] += slopes[a, S_FIRST + i] * qvel[uses[use, U_DOF]]
        _, ox, oy, oz = _slot(c, 0, routes, links, site_xpos, node)
        _, ix, iy, iz = _slot(c, slots - 1, routes, links, site_xpos, node)
        count, fault, where = list_path_points(lo, hi, ox, oy, oz, ix, iy, iz, node, owner, stop)
        if fault != NO_FAULT:
            return fault, c, where
        add_gradient(count, stop, gradient)
        add_stiffness_times(count, twist, stop, rate)
        for use in range(u, next_use):
            k = uses[use, U_NODE] - lo + 1
            jacobian[routes[c, R_MUSCLE], uses[use, U_DOF]] += weights[c] * _point_rate(
                uses[use], k, slopes, qvel, twist, gradient, rate
            )
        for k in range(slots):
            mx, my, mz = gradient[k, 3], gradient[k, 4], gradient[k, 5]
            wx, wy, wz = twist[k, 3], twist[k, 4], twist[k, 5]
            rate[k, 3] -= 0.5 * (my * wz - mz * wy)
            rate[k, 4] -= 0.5 * (mz * wx - mx * wz)
            rate[k, 5] -= 0.5 * (mx * wy - my * wx)
            body, x, y, z = _slot(c, k, routes, links, site_xpos, node)
            com = body_rootid[body]
            place = (x - subtree_com[com, 0], y - subtree_com[com, 1], z - subtree_com[com, 2])
            _add_row(
                weights[c], k, place, body, gradient, rate, twist, kinematics, routes[c, R_MUSCLE], jacobian
            )
    return NO_FAULT, 0, 0
