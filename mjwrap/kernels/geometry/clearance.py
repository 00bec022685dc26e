"""The lowest point of a straight segment over a surface, in closed form; the way a segment passes a torus' tube.

Everything in the frame S of the obstacle. The segment runs from A to B, with d = B - A; a point of it is given by its
share of AB. `dispatch.segment_clearance` chooses the formula, and takes samples where there is none.
"""

from __future__ import annotations

import math

from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.geometry.quadric import inverse_squares


@jit
def clamp(x):
    """Return x, held in [0, 1]."""
    return min(max(x, 0.0), 1.0)


@jit
def lowest_in_quadric(node, k, ax, ay, az, dx, dy, dz):
    """Return the share of AB at which x^2/a^2 + y^2/b^2 + z^2/c^2 is smallest."""
    ia, ib, ic = inverse_squares(node, k)
    square = ia * dx * dx + ib * dy * dy + ic * dz * dz
    if square == 0.0:
        return 0.0
    return clamp(-(ia * ax * dx + ib * ay * dy + ic * az * dz) / square)


@jit
def lowest_over_axis(half, ax, ay, az, dx, dy, dz):
    """Return the share of AB that is nearest to the axis between -half and half (half = 0: to the centre)."""
    square = dx * dx + dy * dy + dz * dz
    if square == 0.0:
        return 0.0
    flat = dx * dx + dy * dy
    share = clamp(-(ax * dx + ay * dy) / flat) if flat > 0.0 else 0.0
    nearest_z = az + share * dz
    if abs(nearest_z) > half:
        nearest_z = min(max(nearest_z, -half), half)
        share = clamp(-(ax * dx + ay * dy + (az - nearest_z) * dz) / square)
    return share


@jit
def lowest_over_cone(slope, ax, ay, az, dx, dy, dz):
    """Return the share of AB at which rho - slope z, a convex function along the segment, is smallest."""
    flat = dx * dx + dy * dy
    if flat == 0.0:
        return 1.0 if slope * dz > 0.0 else 0.0
    near = -(ax * dx + ay * dy) / flat
    aside = (ax * dy - ay * dx) ** 2 / flat  # square of the line's distance from the axis
    rise = slope * dz
    if rise * rise >= flat:
        return 1.0 if rise > 0.0 else 0.0
    return clamp(near + rise * math.sqrt(aside / (flat * (flat - rise * rise))))


@jit
def tube_crossing(major, ax, ay, az, bx, by, bz):
    """Return +1 or -1 where the segment passes through the hole's disk, downwards or upwards, else 0."""
    if (az >= 0.0) == (bz >= 0.0):
        return 0.0
    share = az / (az - bz)
    x, y = ax + share * (bx - ax), ay + share * (by - ay)
    if x * x + y * y >= major * major:
        return 0.0
    return 1.0 if az >= 0.0 else -1.0


@jit
def tube_angle(major, x, y, z):
    """Return the angle v of a point about the middle of the tube, 0 outside, pi in the hole [rad]."""
    return math.atan2(z, math.sqrt(x * x + y * y) - major)


@jit
def bounded_part(radius, ax, ay, az, dx, dy, dz):
    """Return the shares of AB between which the segment is inside a sphere about the origin; radius in [m]."""
    square = dx * dx + dy * dy + dz * dz
    if not (radius < math.inf and square > 0.0):
        return 0.0, 1.0
    middle = -(ax * dx + ay * dy + az * dz) / square
    gap = radius * radius - ((ax + middle * dx) ** 2 + (ay + middle * dy) ** 2 + (az + middle * dz) ** 2)
    half = math.sqrt(max(gap, 0.0) / square)
    return clamp(middle - half), clamp(middle + half)


@jit
def part_between(low, high, az, dz, first, last):
    """Return the shares first..last of AB without the parts that are not between two heights z."""
    if dz == 0.0:
        return first, last
    one, two = (low - az) / dz, (high - az) / dz
    return max(first, min(one, two)), min(last, max(one, two))
