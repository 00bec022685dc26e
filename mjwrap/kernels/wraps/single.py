"""The wrap of one obstacle between two given points, for cold starts and touchdown.

In closed form for ruled surfaces (`ruled.py`) and for the sphere (here: the shorter way is the only stable one), else
by a search with Newton's method (`search.py`). Every function takes the points A before and B behind the obstacle and
writes the obstacle's row of `node`: FREE where the straight segment from A to B does not enter the surface. It returns
the sum of A_INSIDE and B_INSIDE, where A or B lies inside the surface and is treated as lying on it, and SLIPPED; else
0.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, jit, no_inline
from mjwrap.kernels.geometry.dispatch import height
from mjwrap.kernels.geometry.geodesics import geodesic
from mjwrap.kernels.geometry.projection import into_frame, turn_into_frame
from mjwrap.kernels.geometry.traits import closed_form, sided
from mjwrap.kernels.geometry.winding import tangents_sweep, unwrap_angle
from mjwrap.kernels.wraps.ruled import (
    A_INSIDE,
    B_INSIDE,
    INSIDE,
    LEAST_BEND,
    LEAST_TANGENT,
    SLIPPED,
    asked_sweep,
    set_free,
    tangent_length,
    wrap_cone,
    wrap_cylinder,
    wrap_elliptic_cylinder,
)
from mjwrap.kernels.wraps.search import wrap_by_search
from mjwrap.kernels.wraps.sides import side_sweep

KIND, DIM, SIZE, POS, HINT = lay.KIND, lay.DIM, lay.SIZE, lay.POS, lay.HINT
S_MODE, S_SWEEP, S_P, S_T, S_ARC = lay.S_MODE, lay.S_SWEEP, lay.S_P, lay.S_T, lay.S_ARC


# ------------------------------------------------------------------------------------------- sphere


@jit
def _plane_normal(ax, ay, az, bx, by, bz, k, node):
    """Return the unit normal of the plane through A, B and a sphere's centre, in which the string lies.

    Where A, centre and B are in line the plane is not unique: the one through the hint is taken, else the last one,
    else any.
    """
    wx, wy, wz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    size = math.sqrt(wx * wx + wy * wy + wz * wz)
    scale = math.sqrt((ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz))
    if size > 1e-13 * scale:
        return wx / size, wy / size, wz / size
    hx, hy, hz = 0.0, 0.0, 0.0
    if node[k, HINT] > 0.0:
        hx, hy, hz = node[k, HINT + 1], node[k, HINT + 2], node[k, HINT + 3]
    elif node[k, S_MODE] == lay.TOUCHED:
        hx, hy, hz = node[k, S_T], node[k, S_T + 1], node[k, S_T + 2]
    wx, wy, wz = ay * hz - az * hy, az * hx - ax * hz, ax * hy - ay * hx
    size = math.sqrt(wx * wx + wy * wy + wz * wz)
    if size <= 1e-9 * math.sqrt((ax * ax + ay * ay + az * az) * (hx * hx + hy * hy + hz * hz)):
        if abs(ax) <= abs(ay) and abs(ax) <= abs(az):
            wx, wy, wz = 0.0, az, -ay
        elif abs(ay) <= abs(az):
            wx, wy, wz = -az, 0.0, ax
        else:
            wx, wy, wz = ay, -ax, 0.0
        size = max(math.sqrt(wx * wx + wy * wy + wz * wz), 1e-300)
    return wx / size, wy / size, wz / size


@deferred(types.int64)
def _wrap_sphere(k, ax, ay, az, bx, by, bz, node):
    """Wrap a string from A to B over a sphere about the origin, the shorter way, in closed form."""
    radius = node[k, DIM]
    square_a, square_b, square = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, radius * radius
    limit = INSIDE * INSIDE * square
    inside = (A_INSIDE if square_a < limit else 0) + (B_INSIDE if square_b < limit else 0)
    least = LEAST_TANGENT * radius
    root_a, root_b = tangent_length(square_a - square, least), tangent_length(square_b - square, least)
    # angle of the arc: the angle between A and B, minus the angles of the straight tangents
    wx, wy, wz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    sweep = math.atan2(math.sqrt(wx * wx + wy * wy + wz * wz), ax * bx + ay * by + az * bz)
    arc = sweep - tangents_sweep(root_a, root_b, radius)
    if arc <= LEAST_BEND:
        set_free(node, k, sweep)
        return inside
    wx, wy, wz = _plane_normal(ax, ay, az, bx, by, bz, k, node)
    # u points to A, v is perpendicular to u in the string's plane, towards B
    rho = max(math.sqrt(square_a), 1e-300)
    ux, uy, uz = ax / rho, ay / rho, az / rho
    vx, vy, vz = wy * uz - wz * uy, wz * ux - wx * uz, wx * uy - wy * ux
    c, d = min(radius / rho, 1.0) if root_a > 0.0 else 1.0, root_a / rho
    node[k, S_MODE] = lay.TOUCHED
    node[k, S_SWEEP] = sweep
    node[k, S_P] = radius * (c * ux + d * vx)
    node[k, S_P + 1] = radius * (c * uy + d * vy)
    node[k, S_P + 2] = radius * (c * uz + d * vz)
    node[k, S_T] = c * vx - d * ux
    node[k, S_T + 1] = c * vy - d * uy
    node[k, S_T + 2] = c * vz - d * uz
    node[k, S_ARC] = radius * arc
    return inside


# ----------------------------------------------------------------------------------------- dispatch


@no_inline
def wrap(k, node, base_x, base_y, base_z, ax, ay, az, bx, by, bz, search):
    """Wrap the string from A to B (in world directions, relative to the base point) over obstacle k [m].

    Writes the saved solution, FREE or TOUCHED, and evaluates its geodesic. Returns the sum of A_INSIDE, B_INSIDE and
    SLIPPED, as they apply. search: on surfaces without a closed form, search for another wrap where a contact is lost.
    """
    if not closed_form(k, node):
        return wrap_by_search(k, (base_x, base_y, base_z, ax, ay, az, bx, by, bz), node, search)
    x, y, z = node[k, POS] - base_x, node[k, POS + 1] - base_y, node[k, POS + 2] - base_z
    px, py, pz = turn_into_frame(node, k, ax - x, ay - y, az - z)
    qx, qy, qz = turn_into_frame(node, k, bx - x, by - y, bz - z)
    kind = node[k, KIND]
    if kind == lay.CYLINDER:
        inside = wrap_cylinder(k, px, py, pz, qx, qy, qz, node)
    elif kind == lay.SPHERE:
        inside = _wrap_sphere(k, px, py, pz, qx, qy, qz, node)
    elif kind == lay.CONE:
        inside = wrap_cone(k, px, py, pz, qx, qy, qz, node)
    elif kind == lay.ELLIPTIC_CYLINDER:
        inside = wrap_elliptic_cylinder(k, px, py, pz, qx, qy, qz, node)
    else:  # the row has the trait CLOSED_FORM, but its kind has no closed form
        inside = SLIPPED
        set_free(node, k, 0.0)
    if node[k, S_MODE] == lay.TOUCHED:
        geodesic(k, node, base_x, base_y, base_z)
    return inside


@jit
def contains(k, node, x, y, z):
    """Return whether the point (x, y, z) of the world lies inside obstacle k."""
    x, y, z = into_frame(node, k, x, y, z)
    return height(node, k, x, y, z) < (INSIDE - 1.0) * node[k, SIZE]


@jit
def sweep_asked_for(k, node, ax, ay, az, bx, by, bz):
    """Return the swept angle for which the hint of row k, which has an axis, asks for a string from A to B in S [rad].

    It differs from the angle that the string sweeps by whole turns.
    """
    a, b, radius, radius_a, radius_b = 1.0, 1.0, node[k, DIM], node[k, DIM], node[k, DIM]
    kind = node[k, KIND]
    if kind == lay.ELLIPTIC_CYLINDER:
        a, b, radius, radius_a, radius_b = node[k, DIM], node[k, DIM + 1], 1.0, 1.0, 1.0
    elif kind == lay.CONE:
        slope = node[k, DIM + 1]
        radius_a, radius_b = node[k, DIM] + slope * az, node[k, DIM] + slope * bz
        radius = max(radius_a, radius_b)
    px, py, qx, qy = ax / a, ay / b, bx / a, by / b
    if sided(k, node):
        return side_sweep(k, node, px, py, qx, qy, a, b)
    root_a = math.sqrt(max(px * px + py * py - radius_a * radius_a, 0.0))
    root_b = math.sqrt(max(qx * qx + qy * qy - radius_b * radius_b, 0.0))
    principal = math.atan2(px * qy - py * qx, px * qx + py * qy)
    if node[k, lay.HINT_TURN] != 0.0:
        return unwrap_angle(principal, node[k, lay.HINT_TURN])
    return asked_sweep(
        px, py, qx, qy, principal, math.atan2(root_a, radius_a), math.atan2(root_b, radius_b),
        node[k, HINT + 1] / a, node[k, HINT + 2] / b, radius,
    )  # fmt: skip
