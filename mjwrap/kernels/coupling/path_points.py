"""Path points that move within their bodies, and routes that hold only while joints are within ranges.

A moving site's coordinates in its body are piecewise polynomials in joint positions. Beside its body's motion it has a
velocity of its own, (dp/dq) q̇, and the joint gets a share of the muscle's force, −F (∂l/∂p) · (dp/dq). Both need
nothing but the segments that end at the site, so they are added after paths and tensions have been found.
"""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import from_python, jit
from mjwrap.kernels.coupling.muscle_paths import R_HI, R_LO, R_MUSCLE, solve_routes
from mjwrap.kernels.solved.segments import G_E, G_FAR, G_NEAR
from mjwrap.kernels.spans.end_inside import has_valid_length

# columns of `axes`, one row for every axis along which a site moves, sorted by site: site, body, axis of the body, the
# joint's place in qpos and in qvel, the first of its numbers, number of pieces, coefficients of each. The numbers are
# the breaks between the pieces, the pieces' origins, and their coefficients, the constant first.
X_SITE, X_BODY, X_AXIS, X_QPOS, X_DOF, X_FIRST, X_PIECES, X_TERMS, AXIS = range(9)
# columns of `uses`, sorted by route: route, node (lo - 1: the origin, hi: the insertion), row of `axes`, its dof
U_ROUTE, U_NODE, U_AXIS, U_DOF, USE = range(5)
# columns of `conditions`, sorted by route and point: route, conditional point, whether it is present on this route, and
# the place in qpos of a joint whose range, in `ranges`, must hold for that
C_ROUTE, C_POINT, C_PRESENT, C_QPOS, CONDITION = range(5)
# columns of `slopes`, vectors in the world: dp/dq, then the second derivative within the body
S_FIRST, S_SECOND, SLOPE = 0, 3, 6


@jit
def _piecewise(numbers, first, pieces, terms, q):
    """Return value, slope and second derivative of a piecewise polynomial; its numbers start at `first`."""
    piece = 0
    while piece < pieces - 1 and q >= numbers[first + piece]:
        piece += 1
    x = q - numbers[first + pieces - 1 + piece]
    at = first + 2 * pieces - 1 + piece * terms
    value, slope, curve = 0.0, 0.0, 0.0
    for k in range(at + terms - 1, at - 1, -1):
        curve = curve * x + 2.0 * slope
        slope = slope * x + value
        value = value * x + numbers[k]
    return value, slope, curve


@jit
def place_sites(points, frames, site_xpos):
    """Write the positions of all moving sites to site_xpos (nsite, 3), and their derivatives to points.slopes."""
    axes, slopes = points.axes, points.slopes
    last = axes.shape[0] - 1
    x, y, z = 0.0, 0.0, 0.0
    for a in range(axes.shape[0]):
        site, body, axis = axes[a, X_SITE], axes[a, X_BODY], axes[a, X_AXIS]
        if a == 0 or axes[a - 1, X_SITE] != site:
            x, y, z = frames.site_pos[site, 0], frames.site_pos[site, 1], frames.site_pos[site, 2]
        value, slope, curve = _piecewise(
            points.numbers,
            axes[a, X_FIRST],
            axes[a, X_PIECES],
            axes[a, X_TERMS],
            frames.qpos[axes[a, X_QPOS]],
        )
        if axis == 0:
            x = value
        elif axis == 1:
            y = value
        else:
            z = value
        rot = frames.xmat[body]
        for i in range(3):
            slopes[a, S_FIRST + i] = rot[3 * i + axis] * slope
            slopes[a, S_SECOND + i] = rot[3 * i + axis] * curve
        if a == last or axes[a + 1, X_SITE] != site:
            for i in range(3):
                site_xpos[site, i] = frames.xpos[body, i] + (
                    rot[3 * i] * x + rot[3 * i + 1] * y + rot[3 * i + 2] * z
                )


@jit
def choose_routes(points, qpos):
    """Write to points.active which routes hold at a pose: those all of whose points are present or absent as told."""
    conditions, ranges, active = points.conditions, points.ranges, points.active
    for c in range(active.shape[0]):
        active[c] = 1
    k = 0
    while k < conditions.shape[0]:
        c, point, wanted = conditions[k, C_ROUTE], conditions[k, C_POINT], conditions[k, C_PRESENT]
        present = True
        while k < conditions.shape[0] and conditions[k, C_ROUTE] == c and conditions[k, C_POINT] == point:
            q = qpos[conditions[k, C_QPOS]]
            present = present and ranges[k, 0] <= q <= ranges[k, 1]
            k += 1
        if present != (wanted != 0):
            active[c] = 0


@jit
def leave_out(c, routes, paths):
    """Give route c no path and no length; when it holds again it starts cold."""
    for k in range(routes.rows[c, R_LO], routes.rows[c, R_HI]):
        paths.node[k, lay.S_MODE] = lay.COLD
    paths.count[c] = 0
    for i in range(lay.INFO):
        paths.info[c, i] = 0.0
    paths.info[c, lay.I_STATUS] = lay.CONVERGED


@jit
def solve_active_routes(points, routes, poses, paths, tol):
    """Find path and speed of the routes that hold, as `solve_routes` does; the others get no path and no length."""
    active = points.active
    c = 0
    while c < active.shape[0]:
        first = c
        while c < active.shape[0] and active[c] != 0:
            c += 1
        solve_routes(first, c, routes, poses, paths, tol)
        while c < active.shape[0] and active[c] == 0:
            leave_out(c, routes, paths)
            c += 1


@jit
def slope_of_length(u, uses, slopes, routes, paths):
    """Return the derivative of a route's length with respect to the joint of use u, as far as the site moves by it."""
    c, node, a = uses[u, U_ROUTE], uses[u, U_NODE], uses[u, U_AXIS]
    x, y, z = slopes[a, S_FIRST], slopes[a, S_FIRST + 1], slopes[a, S_FIRST + 2]
    first = routes.rows[c, R_LO] + c
    total = 0.0
    for j in range(first, first + paths.count[c]):
        row = paths.segments[j]
        along = row[G_E] * x + row[G_E + 1] * y + row[G_E + 2] * z
        if row[G_FAR] == node:
            total += along
        elif row[G_NEAR] == node:
            total -= along
    return total


@jit
def add_point_speeds(points, routes, qvel, paths):
    """Add to the speed of every solved route what its moving sites move by themselves [m/s]."""
    info, uses = paths.info, points.uses
    for u in range(uses.shape[0]):
        c = uses[u, U_ROUTE]
        if has_valid_length(info[c, lay.I_STATUS], info[c, lay.I_ERROR]):
            slope = slope_of_length(u, uses, points.slopes, routes, paths)
            info[c, lay.I_SPEED] += slope * qvel[uses[u, U_DOF]]


@jit
def write_point_forces(points, routes, paths, tension):
    """Write the muscles' generalised forces on the joints that move their points to points.force (nv,)."""
    force, uses = points.force, points.uses
    for i in range(force.shape[0]):
        force[i] = 0.0
    for u in range(uses.shape[0]):
        c = uses[u, U_ROUTE]
        pull = routes.weights[c] * tension[routes.rows[c, R_MUSCLE]]
        if pull != 0.0:
            force[uses[u, U_DOF]] -= pull * slope_of_length(u, uses, points.slopes, routes, paths)


@jit
def add_point_row(u, muscle, uses, slopes, routes, paths, row):
    """Add to dl/dq of a muscle, row (nv,), what its moving sites add; u: its first use. Return the next muscle's."""
    while u < uses.shape[0] and routes.rows[uses[u, U_ROUTE], R_MUSCLE] == muscle:
        row[uses[u, U_DOF]] += routes.weights[uses[u, U_ROUTE]] * slope_of_length(
            u, uses, slopes, routes, paths
        )
        u += 1
    return u


@jit
def add_point_columns(uses, slopes, routes, paths, jacobian):
    """Add to dl/dq (n, nv) of all muscles what their moving sites add."""
    u = 0
    for m in range(jacobian.shape[0]):
        u = add_point_row(u, m, uses, slopes, routes, paths, jacobian[m])


# ------------------------------------------------------------------ qfrc_applied, shared with others


@from_python
def remove_from_qfrc(qfrc, others, mine, total, written):
    """Remove mjwrap's last contribution from qfrc_applied (nv,), as `wrenches.remove_from_xfrc` does from a row."""
    cleared, untouched = False, False
    for i in range(qfrc.shape[0]):
        if written[i]:
            cleared = cleared or (qfrc[i] == 0.0 and qfrc[i] != total[i])
            untouched = untouched or (qfrc[i] == total[i] and qfrc[i] != 0.0)
    cleared = cleared and not untouched
    for i in range(qfrc.shape[0]):
        if not written[i]:
            continue
        if qfrc[i] == total[i]:
            qfrc[i] = others[i]
        elif not (qfrc[i] == 0.0 or cleared or qfrc[i] == others[i]):
            qfrc[i] -= mine[i]
        written[i] = False


@from_python
def add_to_qfrc(qfrc, others, mine, total, written, force):
    """Remove the last contribution from qfrc_applied and add force (nv,); arrays as of `remove_from_qfrc`."""
    remove_from_qfrc(qfrc, others, mine, total, written)
    for i in range(qfrc.shape[0]):
        if force[i] != 0.0:
            written[i] = True
            others[i] = qfrc[i]
            mine[i] = force[i]
            qfrc[i] += force[i]
            total[i] = qfrc[i]
