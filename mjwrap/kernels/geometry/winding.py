"""Winding angles: by how much a string winds about an axis or a tube, unwrapped from pose to pose.

The side on which a string passes a cylinder, a cone or a torus is topological. The winding angle holds it: a real
number that changes continuously with the motion. The pose alone gives it modulo 2 pi.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.geometry.clearance import tube_angle, tube_crossing
from mjwrap.kernels.geometry.projection import turn_into_frame

DIM = lay.DIM
S_P, S_T, S_ARC = lay.S_P, lay.S_T, lay.S_ARC
W_P, W_Q, W_E, W_L, W_LQ, W_EQ, W_ANGLE = lay.W_P, lay.W_Q, lay.W_E, lay.W_L, lay.W_LQ, lay.W_EQ, lay.W_ANGLE

TWO_PI = 2.0 * math.pi
SMALL_TURN = 0.5 * math.pi  # largest change of the winding angle that counts as a continuous motion [rad]


@jit
def nearest_turn(angle, reference):
    """Return the angle that equals `angle` modulo 2 pi and lies nearest to `reference` [rad]."""
    return angle + TWO_PI * math.floor((reference - angle) / TWO_PI + 0.5)


@jit
def unwrap_angle(angle, before):
    """Return the winding angle that equals `angle` modulo 2 pi and continues `before` [rad].

    Beyond one turn this holds for small changes only. After a large change the number of turns is not known, and the
    angle within one turn is taken.
    """
    angle = nearest_turn(angle, before)
    if abs(angle) > TWO_PI and abs(angle - before) > SMALL_TURN:
        angle -= math.copysign(TWO_PI, angle)
    return angle


@jit
def tangents_sweep(root_a, root_b, radius):
    """Return the sum of the angles that straight tangents of these lengths from A and B cover about a circle [rad].

    Each of them is the arc tangent of root / radius, less than a quarter turn.
    """
    return math.atan2(radius * (root_a + root_b), radius * radius - root_a * root_b)


@jit
def winding_about_cylinder(k, node):
    """Return the angle by which the path of the last evaluation winds about a cylinder's axis, with sign [rad]."""
    inverse = 1.0 / node[k, DIM]
    t_phi = (node[k, S_P] * node[k, S_T + 1] - node[k, S_P + 1] * node[k, S_T]) * inverse
    rate = t_phi * inverse
    free = tangents_sweep(node[k, W_L] * abs(rate), node[k, W_LQ] * abs(rate), 1.0)
    return node[k, S_ARC] * rate + (free if t_phi >= 0.0 else -free)


@jit
def _points_of_path(k, node):
    """Return A, P, Q and B of the last evaluation in the frame S; A and B are the points before P and behind Q."""
    px, py, pz = node[k, S_P], node[k, S_P + 1], node[k, S_P + 2]
    size = -node[k, W_L]
    ex, ey, ez = turn_into_frame(
        node, k, size * node[k, W_E], size * node[k, W_E + 1], size * node[k, W_E + 2]
    )
    ax, ay, az = px + ex, py + ey, pz + ez
    dx, dy, dz = (
        node[k, W_Q] - node[k, W_P],
        node[k, W_Q + 1] - node[k, W_P + 1],
        node[k, W_Q + 2] - node[k, W_P + 2],
    )
    dx, dy, dz = turn_into_frame(node, k, dx, dy, dz)
    qx, qy, qz = px + dx, py + dy, pz + dz
    size = node[k, W_LQ]
    ex, ey, ez = turn_into_frame(
        node, k, size * node[k, W_EQ], size * node[k, W_EQ + 1], size * node[k, W_EQ + 2]
    )
    return ax, ay, az, px, py, pz, qx, qy, qz, qx + ex, qy + ey, qz + ez


@jit
def winding_about_tube(k, node):
    """Return the angle by which the path of the last evaluation winds about the middle of a torus' tube [rad]."""
    ax, ay, az, px, py, pz, qx, qy, qz, bx, by, bz = _points_of_path(k, node)
    major = node[k, DIM]
    turns = tube_crossing(major, ax, ay, az, px, py, pz) + tube_crossing(major, qx, qy, qz, bx, by, bz)
    return (
        tube_angle(major, bx, by, bz)
        - tube_angle(major, ax, ay, az)
        + 2.0 * math.pi * (turns + node[k, W_ANGLE])
    )


@jit
def segment_winding_about_tube(major, ax, ay, az, bx, by, bz):
    """Return the angle by which the straight segment from A to B winds about the middle of a torus' tube [rad]."""
    turns = tube_crossing(major, ax, ay, az, bx, by, bz)
    return tube_angle(major, bx, by, bz) - tube_angle(major, ax, ay, az) + 2.0 * math.pi * turns


@jit
def winding_about_axis(k, node, ia, ib):
    """Return the angle by which the path of the last evaluation winds about z, with x scaled by ia and y by ib [rad].

    W_ANGLE is the part of the geodesic, in the same scaled coordinates.
    """
    ax, ay, _, px, py, _, qx, qy, _, bx, by, _ = _points_of_path(k, node)
    ax, ay, px, py, qx, qy, bx, by = ia * ax, ib * ay, ia * px, ib * py, ia * qx, ib * qy, ia * bx, ib * by
    return (
        math.atan2(ax * py - ay * px, ax * px + ay * py)
        + node[k, W_ANGLE]
        + math.atan2(qx * by - qy * bx, qx * bx + qy * by)
    )
