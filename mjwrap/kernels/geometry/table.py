"""The table of surfaces: what each kind does for its geodesic, its points, its heights and its windings.

A kind has a line in each function that needs the surface's own mathematics, which stands in a file of its own. The
integrator is chosen here, outside its loop. Nothing falls through to another kind: one that is not listed gives NaN,
and `solve_chain` ends with UNKNOWN_SURFACE before anything is solved. Beside this file only `wraps/single.py`, for
wraps in closed form, compares kinds. Everything in the frame S of the obstacle.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import deferred, jit
from mjwrap.kernels.geometry.clearance import (
    bounded_part,
    lowest_in_quadric,
    lowest_over_axis,
    lowest_over_cone,
    part_between,
)
from mjwrap.kernels.geometry.closed_forms import capsule, cone, cylinder, sphere
from mjwrap.kernels.geometry.projection import (
    height_over_capsule,
    height_over_cone,
    height_over_cylinder,
    height_over_quadric,
    height_over_sphere,
    height_over_torus,
    project_capsule,
    project_cone,
    project_cylinder,
    project_quadric,
    project_sphere,
    project_torus,
)
from mjwrap.kernels.geometry.quadric import nearest_on_quadric, quadric
from mjwrap.kernels.geometry.torus import torus
from mjwrap.kernels.geometry.user_surface import custom_geodesic, custom_height, custom_project
from mjwrap.kernels.geometry.vectors import put_end, put_start
from mjwrap.kernels.geometry.winding import (
    straight_about_tube,
    swept_about_axis,
    swept_about_cylinder,
    swept_about_tube,
)

KIND, DIM, SIZE = lay.KIND, lay.DIM, lay.SIZE
NAN = math.nan

SPACING = 0.4  # of the smallest radius of curvature: between samples of a surface that is not convex
MOST_SAMPLES = 200
DEEP, LOCATED = 1e-3, 1e-3  # a dip that is so deep is located to so much, both in the surface's size
REFINEMENTS = 25  # of a dip between samples, by the golden section
EDGE = 1e-3  # of the spacing: how near to the ends of a segment a dip is looked for
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


@jit
def known(kind):
    """Return whether a kind is that of a surface in the functions below."""
    return lay.VIA < kind < lay.KINDS and kind == math.floor(kind)


# --------------------------------------------------------------------------------- what every kind has


@jit
def evaluate_geodesic(k, node):
    """Evaluate obstacle k's geodesic from its saved start (P, t, s) into its row.

    Points come out in world directions relative to the surface's origin [m]. An unknown kind has NaN for points,
    tangents and normals.
    """
    kind = node[k, KIND]
    if kind == lay.CYLINDER:
        cylinder(k, node)
    elif kind == lay.SPHERE:
        sphere(k, node)
    elif kind == lay.ELLIPSOID or kind == lay.ELLIPTIC_CYLINDER:
        quadric(k, node)
    elif kind == lay.TORUS:
        torus(k, node)
    elif kind == lay.CONE:
        cone(k, node)
    elif kind == lay.CAPSULE:
        capsule(k, node)
    elif kind == lay.CUSTOM:
        custom_geodesic(k, node)
    else:
        put_start(node, k, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN)
        put_end(node, k, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN)


@jit
def project(node, k, x, y, z):
    """Return a point of obstacle k's surface near (x, y, z), and the outward normal there.

    The nearest one but on ellipsoid and elliptic cylinder, where it lies on the ray from the centre or axis.
    """
    kind = node[k, KIND]
    if kind == lay.CYLINDER:
        return project_cylinder(node[k, DIM], x, y, z)
    if kind == lay.SPHERE:
        return project_sphere(node[k, DIM], x, y, z)
    if kind == lay.ELLIPSOID or kind == lay.ELLIPTIC_CYLINDER:
        return project_quadric(node, k, x, y, z)
    if kind == lay.TORUS:
        return project_torus(node[k, DIM], node[k, DIM + 1], x, y, z)
    if kind == lay.CONE:
        return project_cone(node[k, DIM], node[k, DIM + 1], x, y, z)
    if kind == lay.CAPSULE:
        return project_capsule(node[k, DIM], node[k, DIM + 1], x, y, z)
    if kind == lay.CUSTOM:
        return custom_project(k, node, x, y, z)
    return NAN, NAN, NAN, NAN, NAN, NAN


@jit
def height(node, k, x, y, z):
    """Return the signed height of a point of S over obstacle k's surface [m]."""
    kind = node[k, KIND]
    if kind == lay.CYLINDER:
        return height_over_cylinder(node[k, DIM], x, y)
    if kind == lay.SPHERE:
        return height_over_sphere(node[k, DIM], x, y, z)
    if kind == lay.ELLIPSOID or kind == lay.ELLIPTIC_CYLINDER:
        return height_over_quadric(node, k, x, y, z)
    if kind == lay.TORUS:
        return height_over_torus(node[k, DIM], node[k, DIM + 1], x, y, z)
    if kind == lay.CONE:
        return height_over_cone(node[k, DIM], node[k, DIM + 1], x, y, z)
    if kind == lay.CAPSULE:
        return height_over_capsule(node[k, DIM], node[k, DIM + 1], x, y, z)
    if kind == lay.CUSTOM:
        return custom_height(k, node, x, y, z)
    return NAN


# ----------------------------------------------------- what some kinds have better than the general way


@jit
def nearest(node, k, x, y, z):
    """Return the point of obstacle k's surface that is nearest to a point inside it; `project`, unless it is not."""
    kind = node[k, KIND]
    if kind == lay.ELLIPSOID or kind == lay.ELLIPTIC_CYLINDER:
        return nearest_on_quadric(node, k, x, y, z)
    x, y, z, _, _, _ = project(node, k, x, y, z)
    return x, y, z


@jit
def bounding_radius(node, k):
    """Return the radius of a sphere about the origin of S that holds the surface [m]; infinite: not known, or none."""
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
    """Return the height of the lowest point of the segment from A to B over obstacle k, and its share of the way.

    In closed form for some convex kinds, else by samples of the height.
    """
    dx, dy, dz = bx - ax, by - ay, bz - az
    kind = node[k, KIND]
    share = 0.0
    if kind == lay.ELLIPSOID or kind == lay.ELLIPTIC_CYLINDER:
        share = lowest_in_quadric(node, k, ax, ay, az, dx, dy, dz)
    elif kind == lay.SPHERE:
        share = lowest_over_axis(0.0, ax, ay, az, dx, dy, dz)
    elif kind == lay.CYLINDER:
        share = lowest_over_axis(math.inf, ax, ay, az, dx, dy, dz)
    elif kind == lay.CAPSULE:
        share = lowest_over_axis(node[k, DIM + 1], ax, ay, az, dx, dy, dz)
    elif kind == lay.CONE:
        share = lowest_over_cone(node[k, DIM + 1], ax, ay, az, dx, dy, dz)
    else:
        first, last = bounded_part(bounding_radius(node, k), ax, ay, az, dx, dy, dz)
        if kind == lay.TORUS:  # nothing is low above or below a ring
            first, last = part_between(-node[k, DIM + 1], node[k, DIM + 1], az, dz, first, last)
        share = min(first, 1.0)
        if last > first:
            share = lowest_by_samples(node, k, first, last, ax, ay, az, dx, dy, dz)
    return _height_at(node, k, share, ax, ay, az, dx, dy, dz), share


@jit
def _height_at(node, k, share, ax, ay, az, dx, dy, dz):
    """Return the height of the point A + share d."""
    return height(node, k, ax + share * dx, ay + share * dy, az + share * dz)


@deferred(types.float64)
def lowest_by_samples(node, k, first, last, ax, ay, az, dx, dy, dz):
    """Return the lowest point's share between two shares, from samples at the scale of the curvature, refined."""
    size = math.sqrt(dx * dx + dy * dy + dz * dz)
    count = int(min(math.ceil((last - first) * size / (SPACING * node[k, SIZE])), MOST_SAMPLES)) + 1
    step = (last - first) / count
    best, lowest = first, _height_at(node, k, first, ax, ay, az, dx, dy, dz)
    before, here = lowest, lowest
    for i in range(1, count + 2):
        share = first + i * step
        after = math.inf  # beyond the ends: a dip may lie next to one
        if i <= count:
            after = _height_at(node, k, share, ax, ay, az, dx, dy, dz)
        if after < lowest:
            best, lowest = share, after
        beside = (
            i == 1
            and after > here
            and _height_at(node, k, first + EDGE * step, ax, ay, az, dx, dy, dz) < here
        )
        if i > count and before > here:
            beside = _height_at(node, k, last - EDGE * step, ax, ay, az, dx, dy, dz) < here
        inner = 1 < i <= count and here <= before and here <= after
        if beside or (inner and here < lowest + step * size):
            lo, hi = max(share - 2.0 * step, first), min(share, last)
            one, two = hi - GOLDEN * (hi - lo), lo + GOLDEN * (hi - lo)
            h_one = _height_at(node, k, one, ax, ay, az, dx, dy, dz)
            h_two = _height_at(node, k, two, ax, ay, az, dx, dy, dz)
            for _ in range(REFINEMENTS):
                if min(h_one, h_two) < -DEEP * node[k, SIZE] and (hi - lo) * size < LOCATED * node[k, SIZE]:
                    break
                if h_one < h_two:
                    hi, two, h_two = two, one, h_one
                    one = hi - GOLDEN * (hi - lo)
                    h_one = _height_at(node, k, one, ax, ay, az, dx, dy, dz)
                else:
                    lo, one, h_one = one, two, h_two
                    two = lo + GOLDEN * (hi - lo)
                    h_two = _height_at(node, k, two, ax, ay, az, dx, dy, dz)
            if min(h_one, h_two) < lowest:
                best, lowest = (one, h_one) if h_one < h_two else (two, h_two)
        before, here = here, after
    return best


# ----------------------------------------------------------- winding, of the kinds with the trait BRANCHED


@jit
def swept(k, node):
    """Return the angle that the path of the last evaluation sweeps, with sign [rad].

    About the axis of a cylinder or cone (on an elliptic one in the affine image in which it is round), about the
    middle of a torus' tube. NaN for other kinds.
    """
    kind = node[k, KIND]
    if kind == lay.CYLINDER:
        return swept_about_cylinder(k, node)
    if kind == lay.TORUS:
        return swept_about_tube(k, node)
    if kind == lay.ELLIPTIC_CYLINDER:
        return swept_about_axis(k, node, 1.0 / node[k, DIM], 1.0 / node[k, DIM + 1])
    if kind == lay.CONE:
        return swept_about_axis(k, node, 1.0, 1.0)
    return NAN


@jit
def straight_swept(k, node, ax, ay, az, bx, by, bz):
    """Return the angle that the straight segment from A to B sweeps about obstacle k [rad].

    Asked of kinds whose side is topological and whose wraps are searched for; NaN for others.
    """
    if node[k, KIND] == lay.TORUS:
        return straight_about_tube(node[k, DIM], ax, ay, az, bx, by, bz)
    return NAN
