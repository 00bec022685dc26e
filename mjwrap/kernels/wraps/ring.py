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
from mjwrap.kernels.wraps.end_on_surface import polish_from_low_ends
from mjwrap.kernels.wraps.initial_guess import place_contact

DIM, HINT = lay.DIM, lay.HINT

NO_SIDE = 0  # both ends are on one side of the ring's plane
THROUGH = 1
OUTSIDE = 2
PLANES = 9  # in which a string is led round the tube
TURN = math.pi / 8  # between them


@jit
def asked_side(k, node, az, bz):
    """Return the side of row k, a ring, for which its hint asks; az, bz: heights of A and B over its plane [m]."""
    if not az * bz < 0.0:
        return NO_SIDE
    return THROUGH if math.hypot(node[k, HINT + 1], node[k, HINT + 2]) < node[k, DIM] else OUTSIDE


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
def wrap_on_side(k, ends, node, side, ax, ay, az, bx, by, bz, fx, fy, high_a, high_b):
    """Wrap the string from A to B over row k, a ring, on the given side; return whether such a path was found.

    (fx, fy): the lowest point of AB. Newton's method starts from the hint first, then from circles round the tube in
    planes through the ring's axis: the first is next to AB, the others turn away from it to both sides, and the last
    is next to the hint.
    """
    hx, hy, hz = node[k, HINT + 1], node[k, HINT + 2], node[k, HINT + 3]
    place_contact(k, node, hx, hy, hz, bx - ax, by - ay, bz - az, 0.0)
    good, _ = polish_from_low_ends(k, ends, node, high_a, high_b)
    if good and is_on_side(k, node, side, winding_about_tube(k, node), ax, ay, az, bx, by, bz):
        return True
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
        u, v = math.cos(start), up * math.sin(start)
        rho = major + minor * u
        place_contact(
            k, node, rho * c, rho * s, minor * v, -way * up * v * c, -way * up * v * s, way * up * u,
            minor * max(arc, 0.0),
        )  # fmt: skip
        good, _ = polish_from_low_ends(k, ends, node, high_a, high_b)
        if good and is_on_side(k, node, side, winding_about_tube(k, node), ax, ay, az, bx, by, bz):
            return True
    return False
