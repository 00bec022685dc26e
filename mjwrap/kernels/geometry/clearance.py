"""How deep a straight segment dips below a surface, and how it passes a torus' tube.

Everything in the frame S of the obstacle, between the points A and B.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit
from mjwrap.kernels.geometry.projection import height
from mjwrap.kernels.geometry.quadric import inverse_squares

KIND, DIM, SIZE = lay.KIND, lay.DIM, lay.SIZE

SPACING = 0.4  # of the smallest radius of curvature: between samples of a surface that is not convex
MOST_SAMPLES = 200
DEEP, LOCATED = 1e-3, 1e-3  # a dip that is so deep is located to so much, both in the surface's size
REFINEMENTS = 25  # of a dip between samples, by the golden section
EDGE = 1e-3  # of the spacing: how near to the ends of a segment a dip is looked for
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


@jit
def _clamp(x):
    return min(max(x, 0.0), 1.0)


@jit
def _along(node, k, share, ax, ay, az, dx, dy, dz):
    """Return the height of the point A + share d."""
    return height(node, k, ax + share * dx, ay + share * dy, az + share * dz)


@jit
def _lowest_in_quadric(node, k, ax, ay, az, dx, dy, dz):
    ia, ib, ic = inverse_squares(node, k)
    square = ia * dx * dx + ib * dy * dy + ic * dz * dz
    if square == 0.0:
        return 0.0
    return _clamp(-(ia * ax * dx + ib * ay * dy + ic * az * dz) / square)


@jit
def _lowest_over_axis(half, ax, ay, az, dx, dy, dz):
    """Return where the segment is nearest to the axis between -half and half (half = 0: to the centre)."""
    square = dx * dx + dy * dy + dz * dz
    if square == 0.0:
        return 0.0
    flat = dx * dx + dy * dy
    share = _clamp(-(ax * dx + ay * dy) / flat) if flat > 0.0 else 0.0
    foot = az + share * dz
    if abs(foot) > half:
        foot = min(max(foot, -half), half)
        share = _clamp(-(ax * dx + ay * dy + (az - foot) * dz) / square)
    return share


@jit
def _lowest_over_cone(slope, ax, ay, az, dx, dy, dz):
    """Return where rho - slope z, a convex function along the segment, is smallest."""
    flat = dx * dx + dy * dy
    if flat == 0.0:
        return 1.0 if slope * dz > 0.0 else 0.0
    near = -(ax * dx + ay * dy) / flat
    aside = (ax * dy - ay * dx) ** 2 / flat  # square of the line's distance from the axis
    pull = slope * dz
    if pull * pull >= flat:
        return 1.0 if pull > 0.0 else 0.0
    return _clamp(near + pull * math.sqrt(aside / (flat * (flat - pull * pull))))


@jit
def _lowest_by_samples(node, k, first, last, ax, ay, az, dx, dy, dz):
    """Return the lowest point's share between two shares, from samples at the scale of the curvature, refined."""
    size = math.sqrt(dx * dx + dy * dy + dz * dz)
    count = int(min(math.ceil((last - first) * size / (SPACING * node[k, SIZE])), MOST_SAMPLES)) + 1
    step = (last - first) / count
    best, lowest = first, _along(node, k, first, ax, ay, az, dx, dy, dz)
    before, here = lowest, lowest
    for i in range(1, count + 2):
        share = first + i * step
        after = math.inf  # beyond the ends: a dip may lie next to one
        if i <= count:
            after = _along(node, k, share, ax, ay, az, dx, dy, dz)
        if after < lowest:
            best, lowest = share, after
        beside = (
            i == 1 and after > here and _along(node, k, first + EDGE * step, ax, ay, az, dx, dy, dz) < here
        )
        if i > count and before > here:
            beside = _along(node, k, last - EDGE * step, ax, ay, az, dx, dy, dz) < here
        inner = 1 < i <= count and here <= before and here <= after
        if beside or (inner and here < lowest + step * size):
            lo, hi = max(share - 2.0 * step, first), min(share, last)
            one, two = hi - GOLDEN * (hi - lo), lo + GOLDEN * (hi - lo)
            h_one = _along(node, k, one, ax, ay, az, dx, dy, dz)
            h_two = _along(node, k, two, ax, ay, az, dx, dy, dz)
            for _ in range(REFINEMENTS):
                if min(h_one, h_two) < -DEEP * node[k, SIZE] and (hi - lo) * size < LOCATED * node[k, SIZE]:
                    break
                if h_one < h_two:
                    hi, two, h_two = two, one, h_one
                    one = hi - GOLDEN * (hi - lo)
                    h_one = _along(node, k, one, ax, ay, az, dx, dy, dz)
                else:
                    lo, one, h_one = one, two, h_two
                    two = lo + GOLDEN * (hi - lo)
                    h_two = _along(node, k, two, ax, ay, az, dx, dy, dz)
            if min(h_one, h_two) < lowest:
                best, lowest = (one, h_one) if h_one < h_two else (two, h_two)
        before, here = here, after
    return best


@jit
def bounding_radius(node, k):
    """Return the radius of a sphere about the origin of S that holds the surface; infinite where it is not known
    [m].
    """
    kind = node[k, KIND]
    if kind == lay.SPHERE or kind == lay.CUSTOM:
        return node[k, DIM]
    if kind == lay.ELLIPSOID:
        return max(node[k, DIM], max(node[k, DIM + 1], node[k, DIM + 2]))
    if kind == lay.TORUS or kind == lay.CAPSULE:
        return node[k, DIM] + node[k, DIM + 1]
    return math.inf


@jit
def dip(node, k, ax, ay, az, bx, by, bz):
    """Return the height of the lowest point of the segment from A to B over obstacle k, and its share of the way."""
    dx, dy, dz = bx - ax, by - ay, bz - az
    kind = node[k, KIND]
    share = 0.0
    if kind == lay.ELLIPSOID or kind == lay.ELLIPTIC_CYLINDER:
        share = _lowest_in_quadric(node, k, ax, ay, az, dx, dy, dz)
    elif kind == lay.SPHERE:
        share = _lowest_over_axis(0.0, ax, ay, az, dx, dy, dz)
    elif kind == lay.CYLINDER:
        share = _lowest_over_axis(math.inf, ax, ay, az, dx, dy, dz)
    elif kind == lay.CAPSULE:
        share = _lowest_over_axis(node[k, DIM + 1], ax, ay, az, dx, dy, dz)
    elif kind == lay.CONE:
        share = _lowest_over_cone(node[k, DIM + 1], ax, ay, az, dx, dy, dz)
    else:
        first, last = 0.0, 1.0
        reach = bounding_radius(node, k)
        square = dx * dx + dy * dy + dz * dz
        if reach < math.inf and square > 0.0:  # only what lies in the bounding sphere can be low
            middle = -(ax * dx + ay * dy + az * dz) / square
            gap = reach * reach - (
                (ax + middle * dx) ** 2 + (ay + middle * dy) ** 2 + (az + middle * dz) ** 2
            )
            half = math.sqrt(max(gap, 0.0) / square)
            first, last = _clamp(middle - half), _clamp(middle + half)
        if kind == lay.TORUS and dz != 0.0:  # nor is anything low above or below a ring
            one, two = (-node[k, DIM + 1] - az) / dz, (node[k, DIM + 1] - az) / dz
            first, last = max(first, min(one, two)), min(last, max(one, two))
        share = min(first, 1.0)
        if last > first:
            share = _lowest_by_samples(node, k, first, last, ax, ay, az, dx, dy, dz)
    return _along(node, k, share, ax, ay, az, dx, dy, dz), share


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
