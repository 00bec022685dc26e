"""Closed-form wraps of the surfaces with straight rulings: cylinder, elliptic cylinder, cone.

The side on which a string passes them is topological. It is given by the angle that the string sweeps about the axis
from A to B, a real number that changes continuously with the motion: the pose gives it modulo 2 pi, and the saved value
the number of turns. The string touches if the swept angle is larger than the angles of the straight tangents from A and
B together. An elliptic cylinder is treated in the affine image in which it is circular. A string that slips over the
apex of a cone is free.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, jit
from mjwrap.kernels.geometry.closed_forms import cone_angle
from mjwrap.kernels.geometry.elliptic_cylinder import ellipse_arc
from mjwrap.kernels.geometry.traits import sided
from mjwrap.kernels.geometry.winding import TWO_PI, tangents_sweep, unwrap_angle
from mjwrap.kernels.tangency.tangency_error import ON_SURFACE
from mjwrap.kernels.wraps.sides import side_sweep

DIM, HINT = lay.DIM, lay.HINT
S_MODE, S_SWEEP, S_P, S_T, S_ARC = lay.S_MODE, lay.S_SWEEP, lay.S_P, lay.S_T, lay.S_ARC

INSIDE = 1.0 - 1e-9  # a point is inside if its distance from the axis is less than this share of the radius
LEAST_BEND = 1e-12  # a wrap with a smaller arc angle counts as not touching [rad]

LEAST_TANGENT = (
    ON_SURFACE  # an end whose straight tangent is shorter than this share of the radius is on the surface
)

A_INSIDE = 1
B_INSIDE = 2
SLIPPED = 4  # the string winds about a cone and would slip over its apex


@jit
def set_free(node, k, sweep):
    """Write that the string does not touch row k's surface; sweep: its swept angle [rad]."""
    node[k, S_MODE] = lay.FREE
    node[k, S_SWEEP] = sweep
    node[k, S_ARC] = 0.0


@jit
def _cross_each_other(ax, ay, px, py, bx, by, qx, qy):
    """Return whether the straight segments from A to P and from B to Q cross, seen along the axis."""
    ux, uy, vx, vy = px - ax, py - ay, qx - bx, qy - by
    determinant = vx * uy - vy * ux
    if determinant == 0.0:
        return False
    wx, wy = ax - bx, ay - by
    s = (vy * wx - vx * wy) / determinant
    r = (uy * wx - ux * wy) / determinant
    return 0.0 <= s <= 1.0 and 0.0 <= r <= 1.0


@jit
def asked_sweep(ax, ay, bx, by, principal, alpha_a, alpha_b, hint_x, hint_y, radius):
    """Return the swept angle for which a hint asks: `principal`, that of the shorter way, or that of the other way.

    As `_hinted_sweep`, but whether or not the other way crosses itself.
    """
    size = math.sqrt(hint_x * hint_x + hint_y * hint_y)
    if size < 1e-9 * radius:
        return principal
    dx, dy = bx - ax, by - ay
    square = dx * dx + dy * dy
    share = min(max(-(ax * dx + ay * dy) / square, 0.0), 1.0) if square > 0.0 else 0.0
    cx, cy = ax + share * dx, ay + share * dy
    if cx * cx + cy * cy > radius * radius and cx * hint_x + cy * hint_y >= 0.0:
        return principal
    turn = 1.0 if principal >= 0.0 else -1.0
    # the middle of the arc, as an angle about the axis: the shorter way round, then the other one
    start = math.atan2(ay, ax)
    middle = start + 0.5 * (principal + turn * (alpha_a - alpha_b))
    towards = math.cos(middle) * hint_x + math.sin(middle) * hint_y
    other = principal - turn * TWO_PI
    middle = start + 0.5 * (other - turn * (alpha_a - alpha_b))
    away = math.cos(middle) * hint_x + math.sin(middle) * hint_y
    return principal if towards >= away else other


@jit
def _hinted_sweep(ax, ay, bx, by, principal, alpha_a, alpha_b, hint_x, hint_y, radius):
    """Return the swept angle for a path that passes a cylinder on the hint's side, at a cold start.

    Where the straight string does not enter the cylinder and its point nearest to the axis lies on that side, it stays
    straight. Otherwise the way round whose middle is nearer to the hint is taken, also if it is the longer one, unless
    it crosses itself.
    """
    other = asked_sweep(ax, ay, bx, by, principal, alpha_a, alpha_b, hint_x, hint_y, radius)
    if other == principal:
        return principal
    # contact points of the other way, which is not taken if its straight segments cross
    turn = 1.0 if principal >= 0.0 else -1.0
    start, end = math.atan2(ay, ax) - turn * alpha_a, math.atan2(by, bx) + turn * alpha_b
    px, py = radius * math.cos(start), radius * math.sin(start)
    qx, qy = radius * math.cos(end), radius * math.sin(end)
    return principal if _cross_each_other(ax, ay, px, py, bx, by, qx, qy) else other


@jit
def _hinted(k, node):
    """Return whether a hint chooses the side of row k's surface, which it does at a cold start only."""
    return node[k, S_MODE] == lay.COLD and node[k, HINT] > 0.0 and not sided(k, node)


@jit
def _sweep(k, node, ax, ay, bx, by, a, b):
    """Return the angle that the string sweeps about the axis, on the saved branch, else the shorter way [rad].

    The points are divided by (a, b). At a cold start a side that holds at every pose decides.
    """
    if node[k, S_MODE] == lay.COLD and sided(k, node):
        return side_sweep(k, node, ax, ay, bx, by, a, b)
    sweep = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
    return sweep if node[k, S_MODE] == lay.COLD else unwrap_angle(sweep, node[k, S_SWEEP])


@jit
def tangent_length(square, least):
    """Return the length of the straight tangent to a circle, from its square; 0 below `least`.

    Where the path ends on the surface there is no straight segment (`tangency_error.ends_on_surface`).
    """
    root = math.sqrt(max(square, 0.0))
    return root if root > least else 0.0


@jit
def _tangent_to_ellipse(px, py, square, a, b):
    """Return `tangent_length` in the affine image in which the ellipse is a unit circle, from the point (px, py).

    square: of the point's distance from the centre there.
    """
    root = math.sqrt(max(square - 1.0, 0.0))
    if root <= LEAST_TANGENT and root * math.hypot(a * py, b * px) <= LEAST_TANGENT * min(a, b):
        return 0.0
    return root


@jit
def _contact_normal(ax, ay, radius, root, turn):
    """Return the unit vector at A's polar angle, turned by the angle whose cosine is radius / rho."""
    square = ax * ax + ay * ay
    if root > 0.0:
        return (ax * radius - turn * ay * root) / square, (ay * radius + turn * ax * root) / square
    rho = max(math.sqrt(square), 1e-300)
    return ax / rho, ay / rho


@jit
def wrap_cylinder(k, ax, ay, az, bx, by, bz, node):
    """Wrap a string from A to B over a cylinder about z (obstacle-set method, Garner & Pandy 2000)."""
    radius = node[k, DIM]
    square_a, square_b, square = ax * ax + ay * ay, bx * bx + by * by, radius * radius
    limit = INSIDE * INSIDE * square
    inside = (A_INSIDE if square_a < limit else 0) + (B_INSIDE if square_b < limit else 0)
    least = LEAST_TANGENT * radius
    root_a, root_b = tangent_length(square_a - square, least), tangent_length(square_b - square, least)
    sweep = _sweep(k, node, ax, ay, bx, by, 1.0, 1.0)
    if _hinted(k, node):
        alpha_a, alpha_b = math.atan2(root_a, radius), math.atan2(root_b, radius)
        hint_x, hint_y = node[k, HINT + 1], node[k, HINT + 2]
        if node[k, lay.HINT_TURN] != 0.0:
            sweep = unwrap_angle(sweep, node[k, lay.HINT_TURN])
        else:
            sweep = _hinted_sweep(ax, ay, bx, by, sweep, alpha_a, alpha_b, hint_x, hint_y, radius)
    # angle of the arc: the swept angle minus the angles of the straight tangents
    arc = abs(sweep) - tangents_sweep(root_a, root_b, radius)
    if arc <= LEAST_BEND:
        set_free(node, k, sweep)
        return inside
    turn = 1.0 if sweep >= 0.0 else -1.0
    nx, ny = _contact_normal(ax, ay, radius, root_a, turn)
    flat = root_a + radius * arc + root_b  # the whole path, seen along the axis
    slope = (bz - az) / flat
    cosine = 1.0 / math.sqrt(1.0 + slope * slope)
    # on the unrolled cylinder the path is one straight line: its slope is constant
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


@deferred(types.int64)
def wrap_elliptic_cylinder(k, ax, ay, az, bx, by, bz, node):
    """Wrap a string from A to B over an elliptic cylinder about z."""
    a, b = node[k, DIM], node[k, DIM + 1]
    # in the affine image in which the cross-section is the unit circle, tangents are tangents
    px, py, qx, qy = ax / a, ay / b, bx / a, by / b
    square_a, square_b = px * px + py * py, qx * qx + qy * qy
    limit = INSIDE * INSIDE
    inside = (A_INSIDE if square_a < limit else 0) + (B_INSIDE if square_b < limit else 0)
    root_a = _tangent_to_ellipse(px, py, square_a, a, b)
    root_b = _tangent_to_ellipse(qx, qy, square_b, a, b)
    sweep = _sweep(k, node, px, py, qx, qy, a, b)
    if _hinted(k, node):
        hint_x, hint_y = node[k, HINT + 1] / a, node[k, HINT + 2] / b
        sweep = _hinted_sweep(
            px, py, qx, qy, sweep, math.atan(root_a), math.atan(root_b), hint_x, hint_y, 1.0
        )
    arc = abs(sweep) - tangents_sweep(root_a, root_b, 1.0)
    if arc <= LEAST_BEND:
        set_free(node, k, sweep)
        return inside
    turn = 1.0 if sweep >= 0.0 else -1.0
    nx, ny = _contact_normal(px, py, 1.0, root_a, turn)
    mx, my = _contact_normal(qx, qy, 1.0, root_b, -turn)
    out = math.hypot(a * nx - ax, b * ny - ay)
    round_it = ellipse_arc(a, b, math.atan2(ny, nx), turn * arc)
    # lengths seen along the axis are not those of the affine image
    flat = out + round_it + math.hypot(a * mx - bx, b * my - by)
    slope = (bz - az) / flat
    cosine = 1.0 / math.sqrt(1.0 + slope * slope)
    tx, ty = -turn * a * ny, turn * b * nx
    scale = cosine / math.sqrt(tx * tx + ty * ty)
    node[k, S_MODE] = lay.TOUCHED
    node[k, S_SWEEP] = sweep
    node[k, S_P] = a * nx
    node[k, S_P + 1] = b * ny
    node[k, S_P + 2] = az + slope * out
    node[k, S_T] = scale * tx
    node[k, S_T + 1] = scale * ty
    node[k, S_T + 2] = cosine * slope
    node[k, S_ARC] = round_it / cosine
    return inside


@jit
def _tangent_ruling(rho, radius):
    """Return the angle between A and the rulings at which its tangent planes touch, and its distance from them."""
    # inside the cone, or inside its mirror image beyond the apex, there is no tangent plane
    if rho <= abs(radius):
        return (0.0 if radius > 0.0 else math.pi), 0.0
    root = tangent_length((rho - radius) * (rho + radius), LEAST_TANGENT * abs(radius))
    return math.atan2(root, radius), root


@deferred(types.int64)
def wrap_cone(k, ax, ay, az, bx, by, bz, node):
    """Wrap a string from A to B over a cone about z.

    The tangent planes through A and B unroll with the cone. In this development the path is the straight line between A
    and B, if it passes the apex on the right side. Otherwise the string is free beyond the apex, or it slips.
    """
    slope = node[k, DIM + 1]
    cosine, sine = cone_angle(slope)
    radius_a, radius_b = node[k, DIM] + slope * az, node[k, DIM] + slope * bz
    rho_a, rho_b = math.sqrt(ax * ax + ay * ay), math.sqrt(bx * bx + by * by)
    inside = (A_INSIDE if rho_a < INSIDE * radius_a else 0) + (B_INSIDE if rho_b < INSIDE * radius_b else 0)
    alpha_a, root_a = _tangent_ruling(rho_a, radius_a)
    alpha_b, root_b = _tangent_ruling(rho_b, radius_b)
    principal = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
    sweep = _sweep(k, node, ax, ay, bx, by, 1.0, 1.0)
    if _hinted(k, node):
        hint_x, hint_y = node[k, HINT + 1], node[k, HINT + 2]
        radius = max(radius_a, radius_b)
        sweep = _hinted_sweep(ax, ay, bx, by, sweep, alpha_a, alpha_b, hint_x, hint_y, radius)
    # along the ruling from the apex: m = radius (sine + cosine^2 / sine) = radius / sine on the surface and off it
    along_a = max(radius_a, 0.0) / sine if root_a == 0.0 else radius_a / sine
    along_b = max(radius_b, 0.0) / sine if root_b == 0.0 else radius_b / sine
    delta_a, delta_b = math.atan2(root_a, along_a), math.atan2(root_b, along_b)
    # half a turn or more in the development: the straight line from A to B would pass the apex on the wrong side
    arc = abs(sweep) - alpha_a - alpha_b
    if delta_a + arc * sine + delta_b >= math.pi and abs(sweep) > math.pi:
        if node[k, S_MODE] != lay.COLD and abs(node[k, S_SWEEP]) > math.pi:
            set_free(node, k, sweep)
            return inside | SLIPPED
        sweep = principal  # a free string that passes beyond the apex, or a hint that cannot be followed
        arc = abs(sweep) - alpha_a - alpha_b
    total = delta_a + arc * sine + delta_b
    if arc <= LEAST_BEND or total >= math.pi:
        set_free(node, k, sweep)
        return inside
    turn = 1.0 if sweep >= 0.0 else -1.0
    if root_a > 0.0:
        nx, ny = _contact_normal(ax, ay, radius_a, root_a, turn)
    else:
        nx, ny = ax / max(rho_a, 1e-300), ay / max(rho_a, 1e-300)
    far_a = math.sqrt(along_a * along_a + root_a * root_a)
    far_b = math.sqrt(along_b * along_b + root_b * root_b)
    # the straight line in the development, A at polar angle 0, P at delta_a, Q at delta_a + arc sine, B at `total`
    lx, ly = far_b * math.cos(total) - far_a, far_b * math.sin(total)
    size = math.sqrt(lx * lx + ly * ly)
    lx, ly = lx / size, ly / size
    height = far_a * ly  # distance of the line from the apex
    cd, sd = math.cos(delta_a), math.sin(delta_a)
    ce, se = math.cos(delta_a + arc * sine), math.sin(delta_a + arc * sine)
    m = height / (ly * cd - lx * sd)
    m_q = height / (ly * ce - lx * se)
    along, around = lx * cd + ly * sd, turn * (ly * cd - lx * sd)
    away = 1.0 if slope > 0.0 else -1.0
    out = sine * along
    node[k, S_MODE] = lay.TOUCHED
    node[k, S_SWEEP] = sweep
    node[k, S_P] = m * sine * nx
    node[k, S_P + 1] = m * sine * ny
    node[k, S_P + 2] = away * cosine * m - node[k, DIM] / slope
    node[k, S_T] = out * nx - around * ny
    node[k, S_T + 1] = out * ny + around * nx
    node[k, S_T + 2] = away * cosine * along
    node[k, S_ARC] = math.sqrt((m_q * ce - m * cd) ** 2 + (m_q * se - m * sd) ** 2)
    return inside
