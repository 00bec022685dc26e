"""The side on which a string passes a ring: a torus lets it run through its hole, or outside, as the hint asks.

A hint on the inner side of the tube means that the string runs through the hole, one on the outer side that it does
not. That is a choice only where the string runs from one side of the ring's plane to the other. How often the path
passes the disk in the hole is topological: the winding angle about the tube tells it.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.geometry.clearance import tube_angle
from mjwrap.kernels.geometry.winding import TWO_PI, winding_about_tube
from mjwrap.kernels.tangency.certify import is_local_minimum
from mjwrap.kernels.tangency.newton import NOT_EVALUATED, newton
from mjwrap.kernels.wraps.end_on_surface import LOCAL_STEPS, LOCAL_TOL, polish_from_low_ends
from mjwrap.kernels.wraps.initial_guess import place_contact

DIM, HINT = lay.DIM, lay.HINT

NO_SIDE = 0  # both ends are on one side of the ring's plane
THROUGH = 1  # the string passes the disk in the hole
OUTSIDE = 2
PLANES = 9  # in which a string is led round the tube
TURN = math.pi / 8  # between them
LEVEL = 0.1  # a hint is right above or below the middle of the tube if the cosine of its angle is less
HOLE_POINTS = 4  # places in the hole through which a string is led that touches the ring twice


@jit
def asked_side(k, node, az, bz):
    """Return the side of row k, a ring, for which its hint asks; az, bz: heights of A and B over its plane [m]."""
    if not az * bz < 0.0:
        return NO_SIDE
    return THROUGH if math.hypot(node[k, HINT + 1], node[k, HINT + 2]) < node[k, DIM] else OUTSIDE


@jit
def hint_is_level(k, node):
    """Return whether row k's hint is right above or below the middle of the tube, where it asks for no side."""
    angle = tube_angle(node[k, DIM], node[k, HINT + 1], node[k, HINT + 2], node[k, HINT + 3])
    return abs(math.cos(angle)) < LEVEL


@jit
def is_on_side(k, node, side, winding, ax, ay, az, bx, by, bz):
    """Return whether a string from A to B with this winding angle about row k's tube [rad] passes on the given side."""
    major = node[k, DIM]
    plain = tube_angle(major, bx, by, bz) - tube_angle(major, ax, ay, az)
    turns = math.floor((winding - plain) / TWO_PI + 0.5)
    wanted = 0.0
    if side == THROUGH:
        wanted = 1.0 if az >= 0.0 else -1.0
    return turns == wanted


@jit
def wrap_on_side(k, ends, node, side, done, ax, ay, az, bx, by, bz, fx, fy, high_a, high_b):
    """Wrap the string from A to B over row k, a ring, on the given side; return whether such a path was found.

    done: the straight segment from A to B passes on that side already; then only a hint right above or below the
    middle of the tube is followed. (fx, fy): the lowest point of AB.

    Newton's method starts from the hint first, then from circles round the tube in planes through the ring's axis: the
    first is next to AB, the others turn away from it to both sides, and the last is next to the hint.
    """
    level = hint_is_level(k, node)
    if done and not level:
        return False
    hx, hy, hz = node[k, HINT + 1], node[k, HINT + 2], node[k, HINT + 3]
    place_contact(k, node, hx, hy, hz, bx - ax, by - ay, bz - az, 0.0)
    good, _ = polish_from_low_ends(k, ends, node, high_a, high_b)
    if good and (level or is_on_side(k, node, side, winding_about_tube(k, node), ax, ay, az, bx, by, bz)):
        return True
    if done:
        return False
    major, minor = node[k, DIM], node[k, DIM + 1]
    first, last = math.atan2(fy, fx), math.atan2(hy, hx)
    up = 1.0 if bz > az else -1.0
    way = -1.0 if side == THROUGH else 1.0  # round the tube, in the direction of its angle or against it
    for i in range(PLANES + 1):
        turn = (i + 1) // 2 * TURN
        azimuth = last if i == PLANES else first + (turn if i % 2 == 1 else -turn)
        c, s = math.cos(azimuth), math.sin(azimuth)
        # A and B in the plane, from the tube's centre; A below, B above it in coordinates that `up` mirrors
        au, bu = ax * c + ay * s - major, bx * c + by * s - major
        angle_a, angle_b = math.atan2(-abs(az), au), math.atan2(abs(bz), bu)
        # the angles at which the tangents from A and B touch the tube, and the way from one to the other
        reach_a = math.acos(min(minor / math.hypot(au, az), 1.0))
        reach_b = math.acos(min(minor / math.hypot(bu, bz), 1.0))
        start = angle_a + way * reach_a
        arc = way * (angle_b - start) - reach_b + (TWO_PI if side == THROUGH else 0.0)
        _place_circle(k, node, azimuth, start, up, way, arc)
        good, _ = polish_from_low_ends(k, ends, node, high_a, high_b)
        if good and is_on_side(k, node, side, winding_about_tube(k, node), ax, ay, az, bx, by, bz):
            return True
    return side == THROUGH and _touch_twice(k, ends, node, ax, ay, az, bx, by, bz, fx, fy)


@jit
def _touch_twice(k, ends, node, ax, ay, az, bx, by, bz, fx, fy):
    """Lead the string from A to B through the hole of row k so that it touches the ring on both sides of the hole.

    A string that runs nearly in the ring's plane dives through the hole between the near part of the tube and the far
    one. The guesses are circles round the tube to a point M in the hole and from there; M is the ring's centre first,
    then nearer and nearer to (fx, fy), the lowest point of AB. The second contact goes to the surface's second row.
    Returns whether such a path was found.
    """
    if not (k + 1 < node.shape[0] and node[k + 1, lay.TOUCH] > 0.0):
        return False
    major, minor = node[k, DIM], node[k, DIM + 1]
    aside = math.hypot(fx, fy)
    for i in range(HOLE_POINTS):
        share = i / HOLE_POINTS * (major - minor) / aside if aside > 0.0 else 0.0
        x, y = share * fx, share * fy
        # M is inside the hole, so that both contacts exist
        one = _place_arc_to_hole(k, k, node, ax, ay, az, x, y, True)
        two = _place_arc_to_hole(k, k + 1, node, bx, by, bz, x, y, False)
        if not (one or two):
            break
        plain = tube_angle(major, bx, by, bz) - tube_angle(major, ax, ay, az)
        node[k, lay.S_SWEEP], node[k + 1, lay.S_SWEEP] = plain + math.copysign(TWO_PI, az), 0.0
        error, _, _ = newton(k, k + 2, ends, node, LOCAL_TOL, LOCAL_STEPS, NOT_EVALUATED)
        node[k, lay.W_WRAP_ERROR], node[k + 1, lay.W_WRAP_ERROR] = -1.0, -1.0
        good = error <= LOCAL_TOL and node[k, lay.S_ARC] >= 0.0 and node[k + 1, lay.S_ARC] >= 0.0
        if good and is_local_minimum(k, k + 2, node):
            return True
    node[k + 1, lay.S_MODE] = lay.FREE
    for i in range(7):
        node[k + 1, lay.S_P + i] = 0.0
    return False


@jit
def _place_arc_to_hole(k, row, node, x, y, z, mx, my, inwards):
    """Start a row of ring k with a circle over the tube between (x, y, z) and M in the hole; return whether it touches.

    inwards: towards M, else away from it.
    """
    major, minor = node[k, DIM], node[k, DIM + 1]
    # the point of the tube's middle above which the string passes: M + s (dx, dy)
    dx, dy = x - mx, y - my
    far = math.hypot(dx, dy)
    if far == 0.0:
        return False
    dx, dy = dx / far, dy / far
    along = mx * dx + my * dy
    s = math.sqrt(max(along * along + major * major - mx * mx - my * my, 0.0)) - along
    out = far - s
    if s <= minor or math.hypot(out, z) <= minor:
        return False
    # angles about that point: 0 outwards, a quarter turn towards the side of z, half a turn towards M
    last = math.pi - math.acos(minor / s)
    first = math.atan2(abs(z), out) + math.acos(minor / math.hypot(out, z))
    up = math.copysign(1.0, z)
    start, way = (first, 1.0) if inwards else (last, -1.0)
    c, v = math.cos(start), math.sin(start)
    cx, cy = mx + s * dx, my + s * dy
    place_contact(
        row, node, cx + minor * c * dx, cy + minor * c * dy, up * minor * v, -way * v * dx, -way * v * dy, way * up * c,
        minor * max(last - first, 0.0),
    )  # fmt: skip
    return last > first


@jit
def _place_circle(k, node, azimuth, angle, up, way, arc):
    """Start row k's geodesic on a circle round the tube, at an angle of it, upwards of the plane or (up = -1) below.

    way: 1 in the direction of the angle, -1 against it; arc: angle that the geodesic covers [rad].
    """
    c, s = math.cos(azimuth), math.sin(azimuth)
    u, v = math.cos(angle), up * math.sin(angle)
    rho, minor = node[k, DIM] + node[k, DIM + 1] * u, node[k, DIM + 1]
    place_contact(
        k, node, rho * c, rho * s, minor * v, -way * up * v * c, -way * up * v * s, way * up * u,
        minor * max(arc, 0.0),
    )  # fmt: skip
