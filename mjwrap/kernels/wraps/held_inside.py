"""Strings that are held inside a sphere or cylinder: the shortest string that meets the solid (MuJoCo's inside wrap).

The string is straight where the straight line meets the solid, also if an end is inside it. Else it has one corner, at
the point P of the surface where |A - P| + |P - B| is smallest: both segments make the same angle with the normal there,
on opposite sides. The problem is convex, so that every pose has one solution, which is continuous. P lies in the plane
of A, B and the sphere's centre; for a cylinder the problem is that of the cross-section, with z in proportion to the
length there.

In the plane, with lengths in radii and P = (cos phi, sin phi) between the directions of A and B, let a and b be the
angles of the two segments with the normal. a - b has one root, because its derivative is
1 + (|A|^2 - 1) / 2 |A - P|^2 + (|B|^2 - 1) / 2 |B - P|^2 >= 1. Newton's method finds it. Where a and b differ much it
solves tan a - tan b = 0, because tan b is linear near a point that is close to the surface. A step that would leave the
bracket is replaced by bisection.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, jit
from mjwrap.kernels.geometry.projection import turn_into_frame
from mjwrap.kernels.geometry.vectors import rotate
from mjwrap.kernels.tangency.tangency_error import ON_SURFACE

POS, S_P, W_P, W_Q, W_TP, W_TQ = lay.POS, lay.S_P, lay.W_P, lay.W_Q, lay.W_TP, lay.W_TQ
LAST_STEP_SQUARE = 1e-28  # square of the last step [rad^2], for segments as long as the radius or longer
LEAST_STEP_SQUARE = 1e-32  # square of the smallest step that changes a unit vector [rad^2]
SMALL_STEP = 1e-3  # a step below which unit vectors are normalised by a series [rad]
ROUNDING = 4e-16  # rounding error of a height over the surface, in radii
MAX_STEPS = 60  # largest number of steps; four are normal, bisection alone takes fifty
SHORT_SEGMENT = 1e-4  # a shorter segment's angle has rounding errors and is judged as for this length [radii]


@jit
def _meets_disc(ax, ay, bx, by):
    """Return whether the straight line from (ax, ay) to (bx, by) meets the unit disc."""
    if ax * ax + ay * ay <= 1.0 or bx * bx + by * by <= 1.0:
        return True
    x, y = bx - ax, by - ay
    area = ax * by - ay * bx
    return area * area <= x * x + y * y and ax * x + ay * y < 0.0 and bx * x + by * y > 0.0


@jit
def _reflection_point(ax, ay, bx, by):
    """Return P on the unit circle (2), |A - P|, |P - B|, the error of the angles [rad] and the number of steps.

    The line from A to B must not meet the disc.
    """
    distance_a, distance_b = math.sqrt(ax * ax + ay * ay), math.sqrt(bx * bx + by * by)
    # P as an unnormalised direction; (lx, ly) and (hx, hy) are the bracket's two ends, A and B at equal distance
    way = 1.0 if ax * by - ay * bx >= 0.0 else -1.0
    lx, ly, hx, hy = distance_b * ax, distance_b * ay, distance_a * bx, distance_a * by
    x = (distance_b - 1.0) * ax + (distance_a - 1.0) * bx  # exact where A and B are close in direction
    y = (distance_b - 1.0) * ay + (distance_a - 1.0) * by
    if x == 0.0 and y == 0.0:
        x, y = lx, ly
    least_a, least_b = (
        0.5 * (distance_a - 1.0) * (distance_a + 1.0),
        0.5 * (distance_b - 1.0) * (distance_b + 1.0),
    )
    steps = 0
    turn = 1.0
    while True:
        steps += 1
        if abs(turn) < SMALL_STEP:  # |P|^2 is 1 + turn^2: the root's series is exact to rounding
            over = 1.0 - turn * turn * (0.5 - 0.375 * turn * turn)
        else:
            over = 1.0 / math.sqrt(x * x + y * y)
        x, y = x * over, y * over
        # components of A - P and B - P along the normal and along the circle
        up_a, up_b = ax * x + ay * y - 1.0, bx * x + by * y - 1.0
        along_a, along_b = way * (ax * y - ay * x), way * (x * by - y * bx)
        square_a, square_b = up_a * up_a + along_a * along_a, up_b * up_b + along_b * along_b
        # sine and cosine of a - b, times both lengths
        sine, cosine = along_a * up_b - along_b * up_a, up_a * up_b + along_a * along_b
        if sine > 0.0:
            hx, hy = x, y
        else:
            lx, ly = x, y
        noise = distance_b * (abs(along_a) + abs(up_a)) + distance_a * (abs(along_b) + abs(up_b))
        if abs(sine) <= ROUNDING * noise or steps == MAX_STEPS:
            break
        turn = 0.0
        rate_a, rate_b = 0.5 * square_a + least_a, 0.5 * square_b + least_b
        if cosine > abs(sine):
            turn = -sine * square_a * square_b / (cosine * (rate_a * square_b + rate_b * square_a))
            if turn * turn <= max(LAST_STEP_SQUARE * min(square_a, square_b, 1.0), LEAST_STEP_SQUARE):
                break
        elif up_a > 0.0 and up_b > 0.0:
            turn = -sine * up_a * up_b / (rate_a * up_b * up_b + rate_b * up_a * up_a)
        # Newton's step where it stays within the bracket, else bisection
        nx, ny = x - way * turn * y, y + way * turn * x
        if turn != 0.0 and way * (lx * ny - ly * nx) > 0.0 and way * (nx * hy - ny * hx) > 0.0:
            x, y = nx, ny
        else:
            x, y, turn = lx + hx, ly + hy, 1.0
    size_a, size_b = math.sqrt(square_a), math.sqrt(square_b)
    error = abs(sine) / (max(size_a, SHORT_SEGMENT) * max(size_b, SHORT_SEGMENT))
    return x, y, size_a, size_b, error, steps


@jit
def _leave_straight(k, ax, ay, az, bx, by, bz, node):
    """Write that the string is straight; return its length [m]."""
    node[k, lay.S_MODE] = lay.FREE
    for i in range(1, lay.STATE):
        node[k, lay.S_MODE + i] = 0.0
    x, y, z = bx - ax, by - ay, bz - az
    return math.sqrt(x * x + y * y + z * z)


@jit
def _write_corner(k, px, py, pz, length_a, length_b, ends, node):
    """Write the corner P, given in world directions from the surface's origin."""
    node[k, lay.S_MODE] = lay.TOUCHED
    for i in range(1, lay.STATE):
        node[k, lay.S_MODE + i] = 0.0
    node[k, S_P], node[k, S_P + 1], node[k, S_P + 2] = turn_into_frame(node, k, px, py, pz)
    node[k, lay.S_BEFORE], node[k, lay.S_BEFORE + 1] = length_a, length_b
    x, y, z = px + node[k, POS] - ends[0], py + node[k, POS + 1] - ends[1], pz + node[k, POS + 2] - ends[2]
    node[k, W_P], node[k, W_P + 1], node[k, W_P + 2] = x, y, z
    node[k, W_Q], node[k, W_Q + 1], node[k, W_Q + 2] = x, y, z
    least = ON_SURFACE * node[k, lay.SIZE]
    if min(length_a, length_b) <= least:
        _write_directions(k, px, py, pz, length_a > least, length_b > least, ends, node)


@jit
def _write_directions(k, px, py, pz, known_a, known_b, ends, node):
    """Write the directions of both segments where one has no length; its direction is the limit at length zero."""
    nx, ny, nz = normal(k, px, py, pz, node)
    x, y, z = node[k, W_P], node[k, W_P + 1], node[k, W_P + 2]
    ex, ey, ez = x - ends[3], y - ends[4], z - ends[5]
    gx, gy, gz = ends[6] - x, ends[7] - y, ends[8] - z
    near = 1.0 / max(math.sqrt(ex * ex + ey * ey + ez * ez), 1e-300)
    far = 1.0 / max(math.sqrt(gx * gx + gy * gy + gz * gz), 1e-300)
    ex, ey, ez, gx, gy, gz = ex * near, ey * near, ez * near, gx * far, gy * far, gz * far
    if known_b and not known_a:
        up = 2.0 * (gx * nx + gy * ny + gz * nz)
        ex, ey, ez = gx - up * nx, gy - up * ny, gz - up * nz
    elif known_a and not known_b:
        up = 2.0 * (ex * nx + ey * ny + ez * nz)
        gx, gy, gz = ex - up * nx, ey - up * ny, ez - up * nz
    node[k, W_TP], node[k, W_TP + 1], node[k, W_TP + 2] = ex, ey, ez
    node[k, W_TQ], node[k, W_TQ + 1], node[k, W_TQ + 2] = gx, gy, gz


@jit
def normal(k, x, y, z, node):
    """Return the outward unit normal at a point of the surface given from its origin, both in world directions."""
    along = 0.0
    ux, uy, uz = node[k, lay.ROT + 2], node[k, lay.ROT + 5], node[k, lay.ROT + 8]
    if node[k, lay.INSIDE] == lay.ABOUT_AXIS:
        along = ux * x + uy * y + uz * z
    over = 1.0 / node[k, lay.DIM]
    return (x - along * ux) * over, (y - along * uy) * over, (z - along * uz) * over


@deferred(types.int64, types.float64, types.float64, types.int64)
def solve_held_inside(k, ends, node, tol):
    """Find the shortest string from A to B that meets obstacle k's solid; return (status, length, error, steps).

    ends as in `span_solver.solve_span`. Writes the saved solution and, where there is a corner, what `segments` reads:
    P = Q and the directions of the segments that meet there.
    """
    x, y, z = node[k, POS] - ends[0], node[k, POS + 1] - ends[1], node[k, POS + 2] - ends[2]
    ax, ay, az = ends[3] - x, ends[4] - y, ends[5] - z
    bx, by, bz = ends[6] - x, ends[7] - y, ends[8] - z
    radius = node[k, lay.DIM]
    over = 1.0 / radius
    # a sphere: the plane of A, B and the centre, with axes u towards A and w at right angles
    if node[k, lay.INSIDE] == lay.ABOUT_POINT:
        distance = math.sqrt(ax * ax + ay * ay + az * az)
        unit = 1.0 / max(distance, 1e-300)
        ux, uy, uz = ax * unit, ay * unit, az * unit
        along = bx * ux + by * uy + bz * uz
        wx, wy, wz = bx - along * ux, by - along * uy, bz - along * uz
        across = math.sqrt(wx * wx + wy * wy + wz * wz)
        if _meets_disc(distance * over, 0.0, along * over, across * over):
            return lay.CONVERGED, _leave_straight(k, ax, ay, az, bx, by, bz, node), 0.0, 0
        c, s, near, far, error, steps = _reflection_point(distance * over, 0.0, along * over, across * over)
        c, s = radius * c, radius * s / max(across, 1e-300)
        length_a, length_b = radius * near, radius * far
        px, py, pz = c * ux + s * wx, c * uy + s * wy, c * uz + s * wz
        _write_corner(k, px, py, pz, length_a, length_b, ends, node)
        return lay.CONVERGED if error <= tol else lay.NOT_CONVERGED, length_a + length_b, error, steps
    # a cylinder: its cross-section, and z in proportion to the length there
    rx, ry, rz = turn_into_frame(node, k, ax, ay, az)
    qx, qy, qz = turn_into_frame(node, k, bx, by, bz)
    if _meets_disc(rx * over, ry * over, qx * over, qy * over):
        return lay.CONVERGED, _leave_straight(k, ax, ay, az, bx, by, bz, node), 0.0, 0
    c, s, near, far, error, steps = _reflection_point(rx * over, ry * over, qx * over, qy * over)
    rise = qz - rz
    level = radius * (near + far)
    length = math.sqrt(level * level + rise * rise)
    share = near / (near + far)
    rotate(node, k, W_P, radius * c, radius * s, rz + share * rise)
    px, py, pz = node[k, W_P], node[k, W_P + 1], node[k, W_P + 2]
    _write_corner(k, px, py, pz, share * length, (1.0 - share) * length, ends, node)
    return lay.CONVERGED if error <= tol else lay.NOT_CONVERGED, length, error, steps
