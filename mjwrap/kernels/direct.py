"""Closed-form wraps of one obstacle between two given points: cold starts, touchdown and the test for it.

Every function works in the frame S of the obstacle, between the points A (before) and B (after), and writes the
obstacle's row of `node`. It returns 0, plus A_INSIDE, plus B_INSIDE where the point lies inside the surface (it is
then taken as on it).

The side on which a string passes a cylinder is a matter of topology. It is held by the angle that the string sweeps
about the axis from A to B, a real number that follows the motion continuously: modulo 2 pi it is known from the pose,
and the saved value says which multiple is meant. The string touches where the swept angle exceeds what straight
tangents from A and B leave free. About a sphere there is no such number: the shorter way is the only stable one.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit

KIND, DIM, POS, ROT, HINT = lay.KIND, lay.DIM, lay.POS, lay.ROT, lay.HINT
S_MODE, S_SWEEP, S_P, S_T, S_ARC = lay.S_MODE, lay.S_SWEEP, lay.S_P, lay.S_T, lay.S_ARC

INSIDE = 1.0 - 1e-9  # a point closer to the axis than this share of the radius is inside
ON_SURFACE = 2e-9  # a straight segment shorter than this share of the radius ends on the surface, no tangent is shorter
CLEAR = 1e-12  # a wrap that would bend the string by less [rad] counts as not touching
TWO_PI = 2.0 * math.pi
SMALL_TURN = 0.5 * math.pi  # a change of the swept angle that can only be a continuous motion [rad]
A_INSIDE = 1
B_INSIDE = 2


@jit
def nearest_turn(angle, reference):
    """Return the angle that equals `angle` modulo 2 pi and lies nearest to `reference` [rad]."""
    return angle + TWO_PI * math.floor((reference - angle) / TWO_PI + 0.5)


@jit
def follow(angle, before):
    """Return the swept angle that equals `angle` modulo 2 pi and continues `before` [rad].

    A string winds beyond one turn only in small steps: after a large jump nobody can tell, and the way within one turn
    is taken.
    """
    angle = nearest_turn(angle, before)
    if abs(angle) > TWO_PI and abs(angle - before) > SMALL_TURN:
        angle -= math.copysign(TWO_PI, angle)
    return angle


@jit
def _free(node, k, sweep):
    node[k, S_MODE] = lay.FREE
    node[k, S_SWEEP] = sweep
    node[k, S_ARC] = 0.0


# ---------------------------------------------------------------------------------------- cylinder


@jit
def _cross_each_other(ax, ay, px, py, bx, by, qx, qy):
    """Return whether the straight segments from A to P and from B to Q meet, seen along the axis."""
    ux, uy, vx, vy = px - ax, py - ay, qx - bx, qy - by
    determinant = vx * uy - vy * ux
    if determinant == 0.0:
        return False
    wx, wy = ax - bx, ay - by
    s = (vy * wx - vx * wy) / determinant
    r = (uy * wx - ux * wy) / determinant
    return 0.0 <= s <= 1.0 and 0.0 <= r <= 1.0


@jit
def _hinted_sweep(ax, ay, bx, by, principal, alpha_a, alpha_b, hint_x, hint_y, radius):
    """Return the swept angle for a path that passes a cylinder on the hint's side, at a cold start.

    The straight string stands where it is free and its point nearest to the axis lies on that side. Otherwise the way
    round whose middle lies nearer to the hint is taken, be it the long one, unless it crosses itself: the rule that
    MuJoCo's side sites follow (`mju_wrap` in engine_util_misc.c).
    """
    size = math.hypot(hint_x, hint_y)
    if size < 1e-9 * radius:
        return principal
    dx, dy = bx - ax, by - ay
    square = dx * dx + dy * dy
    foot = min(max(-(ax * dx + ay * dy) / square, 0.0), 1.0) if square > 0.0 else 0.0
    cx, cy = ax + foot * dx, ay + foot * dy
    if math.hypot(cx, cy) > radius and cx * hint_x + cy * hint_y >= 0.0:
        return principal
    turn = 1.0 if principal >= 0.0 else -1.0
    start, end = math.atan2(ay, ax), math.atan2(by, bx)
    middle = start + 0.5 * (principal + turn * (alpha_a - alpha_b))
    towards = math.cos(middle) * hint_x + math.sin(middle) * hint_y
    other = principal - turn * TWO_PI
    middle = start + 0.5 * (other - turn * (alpha_a - alpha_b))
    away = math.cos(middle) * hint_x + math.sin(middle) * hint_y
    if towards >= away:
        return principal
    start -= turn * alpha_a
    end += turn * alpha_b
    px, py = radius * math.cos(start), radius * math.sin(start)
    qx, qy = radius * math.cos(end), radius * math.sin(end)
    return principal if _cross_each_other(ax, ay, px, py, bx, by, qx, qy) else other


@jit
def _wrap_cylinder(k, radius, ax, ay, az, bx, by, bz, node):
    """Wrap a string from A to B over a cylinder about z, in closed form (obstacle-set method, Garner & Pandy 2000)."""
    square_a, square_b, square = ax * ax + ay * ay, bx * bx + by * by, radius * radius
    limit = INSIDE * INSIDE * square
    inside = (A_INSIDE if square_a < limit else 0) + (B_INSIDE if square_b < limit else 0)
    root_a = math.sqrt(max(square_a - square, 0.0))
    root_b = math.sqrt(max(square_b - square, 0.0))
    alpha_a, alpha_b = math.atan2(root_a, radius), math.atan2(root_b, radius)
    sweep = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
    if node[k, S_MODE] != lay.COLD:
        sweep = follow(sweep, node[k, S_SWEEP])
    elif node[k, HINT] != 0.0:
        sweep = _hinted_sweep(
            ax, ay, bx, by, sweep, alpha_a, alpha_b, node[k, HINT + 1], node[k, HINT + 2], radius
        )
    arc = abs(sweep) - alpha_a - alpha_b
    if arc <= CLEAR:
        _free(node, k, sweep)
        return inside
    turn = 1.0 if sweep >= 0.0 else -1.0
    # unit vector at A's polar angle, turned by alpha_a: cos = R / rho, sin = root / rho
    if square_a > square:
        nx = (ax * radius - turn * ay * root_a) / square_a
        ny = (ay * radius + turn * ax * root_a) / square_a
    else:
        rho = max(math.sqrt(square_a), 1e-300)
        nx, ny = ax / rho, ay / rho
    flat = root_a + radius * arc + root_b  # the whole path, seen along the axis
    slope = (bz - az) / flat
    cosine = 1.0 / math.sqrt(1.0 + slope * slope)
    node[k, S_MODE] = lay.TOUCHED
    node[k, S_SWEEP] = sweep
    node[k, S_P] = radius * nx
    node[k, S_P + 1] = radius * ny
    node[k, S_P + 2] = az + slope * root_a
    node[k, S_T] = -turn * cosine * ny
    node[k, S_T + 1] = turn * cosine * nx
    node[k, S_T + 2] = cosine * slope
    node[k, S_ARC] = radius * arc / cosine
    return inside


# ------------------------------------------------------------------------------------------- sphere


@jit
def _plane_normal(ax, ay, az, bx, by, bz, k, node):
    """Return the unit normal of the plane in which the string passes a sphere's centre.

    Where A, centre and B are in line every plane is as good: the hint's is taken, else the last one, else any.
    """
    wx, wy, wz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    size = math.sqrt(wx * wx + wy * wy + wz * wz)
    scale = math.sqrt((ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz))
    if size > 1e-13 * scale:
        return wx / size, wy / size, wz / size
    hx, hy, hz = 0.0, 0.0, 0.0
    if node[k, HINT] != 0.0:
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


@jit
def _wrap_sphere(k, radius, ax, ay, az, bx, by, bz, node):
    """Wrap a string from A to B over a sphere about the origin, the shorter way, in closed form."""
    square_a, square_b, square = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, radius * radius
    limit = INSIDE * INSIDE * square
    inside = (A_INSIDE if square_a < limit else 0) + (B_INSIDE if square_b < limit else 0)
    root_a = math.sqrt(max(square_a - square, 0.0))
    root_b = math.sqrt(max(square_b - square, 0.0))
    wx, wy, wz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    sweep = math.atan2(math.sqrt(wx * wx + wy * wy + wz * wz), ax * bx + ay * by + az * bz)
    arc = sweep - math.atan2(root_a, radius) - math.atan2(root_b, radius)
    if arc <= CLEAR:
        _free(node, k, sweep)
        return inside
    wx, wy, wz = _plane_normal(ax, ay, az, bx, by, bz, k, node)
    rho = max(math.sqrt(square_a), 1e-300)
    ux, uy, uz = ax / rho, ay / rho, az / rho
    vx, vy, vz = wy * uz - wz * uy, wz * ux - wx * uz, wx * uy - wy * ux
    c, d = min(radius / rho, 1.0), root_a / rho
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


@jit
def wrap(k, node, base_x, base_y, base_z, ax, ay, az, bx, by, bz):
    """Wrap the string from A to B (in world directions, relative to the base point) over obstacle k [m].

    Writes the saved solution: FREE or TOUCHED with its geodesic. Returns A_INSIDE and B_INSIDE summed, or 0.
    """
    x, y, z = node[k, POS] - base_x, node[k, POS + 1] - base_y, node[k, POS + 2] - base_z
    ax, ay, az, bx, by, bz = ax - x, ay - y, az - z, bx - x, by - y, bz - z
    px = node[k, ROT] * ax + node[k, ROT + 3] * ay + node[k, ROT + 6] * az
    py = node[k, ROT + 1] * ax + node[k, ROT + 4] * ay + node[k, ROT + 7] * az
    pz = node[k, ROT + 2] * ax + node[k, ROT + 5] * ay + node[k, ROT + 8] * az
    qx = node[k, ROT] * bx + node[k, ROT + 3] * by + node[k, ROT + 6] * bz
    qy = node[k, ROT + 1] * bx + node[k, ROT + 4] * by + node[k, ROT + 7] * bz
    qz = node[k, ROT + 2] * bx + node[k, ROT + 5] * by + node[k, ROT + 8] * bz
    if node[k, KIND] == lay.CYLINDER:
        return _wrap_cylinder(k, node[k, DIM], px, py, pz, qx, qy, qz, node)
    return _wrap_sphere(k, node[k, DIM], px, py, pz, qx, qy, qz, node)


@jit
def holds(k, node, x, y, z):
    """Return whether the point (x, y, z) of the world lies inside obstacle k."""
    x, y, z = x - node[k, POS], y - node[k, POS + 1], z - node[k, POS + 2]
    px = node[k, ROT] * x + node[k, ROT + 3] * y + node[k, ROT + 6] * z
    py = node[k, ROT + 1] * x + node[k, ROT + 4] * y + node[k, ROT + 7] * z
    square = px * px + py * py
    if node[k, KIND] == lay.SPHERE:
        pz = node[k, ROT + 2] * x + node[k, ROT + 5] * y + node[k, ROT + 8] * z
        square += pz * pz
    limit = INSIDE * node[k, DIM]
    return square < limit * limit
