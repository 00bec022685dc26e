"""Choice of the formulas by the kind of surface: geodesic, nearest points, heights, clearance and winding.

Each function has a line for each kind that has its own formula, which stands in the file of the surface. A kind that is
not listed gives NaN; `solve_chain` returns UNKNOWN_SURFACE for it before anything is solved. Apart from this file only
`wraps/single.py`, for wraps in closed form, compares kinds. Everything in the frame S of the obstacle.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, from_python, jit
from mjwrap.kernels.geometry.capsule_seams import slide_over_seam, way_over_shaft
from mjwrap.kernels.geometry.clearance import (
    bounded_part,
    lowest_in_quadric,
    lowest_over_axis,
    lowest_over_cone,
    part_between,
)
from mjwrap.kernels.geometry.closed_forms import capsule, cone, cylinder, sphere
from mjwrap.kernels.geometry.elliptic_cylinder import elliptic_cylinder
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
    segment_winding_about_tube,
    winding_about_axis,
    winding_about_cylinder,
    winding_about_tube,
)

KIND, DIM, SIZE, POS, ROT = lay.KIND, lay.DIM, lay.SIZE, lay.POS, lay.ROT
NAN = math.nan

# `lowest_by_samples`, for surfaces that are not convex; lengths are shares of the surface's size.
SAMPLE_SPACING = 0.4  # distance between two samples of the height along the segment
MAX_SAMPLES = 200  # most samples of one segment
DEEP_ENTRY = 1e-3  # a segment that enters deeper than this has its lowest point located less exactly, ...
DEEP_ENTRY_WIDTH = 1e-3  # ... to this length
REFINEMENTS = 25  # most golden-section steps to a lowest point between samples
END_PROBE = 1e-3  # distance of the extra samples at the segment's ends, as a share of the sample spacing
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


@from_python
def is_surface_kind(kind):
    """Return whether a number is a kind of surface that the functions below know."""
    return lay.VIA < kind < lay.KINDS and kind == math.floor(kind)


# --------------------------------------------------------------------------------- what every kind has


@jit
def evaluate_geodesic(k, node):
    """Evaluate obstacle k's geodesic from its saved start (P, t, s) into its row.

    Points are in world directions relative to the surface's origin [m]. For an unknown kind, points, tangents and
    normals are NaN.
    """
    kind = node[k, KIND]
    if kind == lay.CYLINDER:
        cylinder(k, node)
    elif kind == lay.SPHERE:
        sphere(k, node)
    elif kind == lay.ELLIPSOID:
        quadric(k, node)
    elif kind == lay.ELLIPTIC_CYLINDER:
        elliptic_cylinder(k, node)
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

    It is the nearest point, except on ellipsoid and elliptic cylinder, where it lies on the ray from centre or axis.
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


@from_python
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


# --------------------------------------- functions with a general method, and better ones for some kinds


@jit
def nearest(node, k, x, y, z):
    """Return the point of obstacle k's surface that is nearest to a point inside it."""
    kind = node[k, KIND]
    if kind == lay.ELLIPSOID or kind == lay.ELLIPTIC_CYLINDER:
        return nearest_on_quadric(node, k, x, y, z)
    x, y, z, _, _, _ = project(node, k, x, y, z)
    return x, y, z


@jit
def bounding_radius(node, k):
    """Return the radius of a sphere about the origin of S that contains the surface [m]; infinite if there is none."""
    kind = node[k, KIND]
    if kind == lay.SPHERE or kind == lay.CUSTOM:
        return node[k, DIM]
    if kind == lay.ELLIPSOID:
        return max(node[k, DIM], max(node[k, DIM + 1], node[k, DIM + 2]))
    if kind == lay.TORUS or kind == lay.CAPSULE:
        return node[k, DIM] + node[k, DIM + 1]
    return math.inf


@jit
def segment_clearance(node, k, ax, ay, az, bx, by, bz):
    """Return the height over obstacle k of the lowest point of the segment from A to B [m], and its share of AB.

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
        if kind == lay.TORUS:  # the part within the height of the ring along z
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
    """Return the share of AB of the lowest point between two shares: samples of the height, then golden sections."""
    size = math.sqrt(dx * dx + dy * dy + dz * dz)
    count = int(min(math.ceil((last - first) * size / (SAMPLE_SPACING * node[k, SIZE])), MAX_SAMPLES)) + 1
    step = (last - first) / count
    best, lowest = first, _height_at(node, k, first, ax, ay, az, dx, dy, dz)
    before, here = lowest, lowest
    for i in range(1, count + 2):
        share = first + i * step
        after = math.inf  # beyond the last sample
        if i <= count:
            after = _height_at(node, k, share, ax, ay, az, dx, dy, dz)
        if after < lowest:
            best, lowest = share, after
        near_an_end = (
            i == 1
            and after > here
            and _height_at(node, k, first + END_PROBE * step, ax, ay, az, dx, dy, dz) < here
        )
        if i > count and before > here:
            near_an_end = _height_at(node, k, last - END_PROBE * step, ax, ay, az, dx, dy, dz) < here
        inner = 1 < i <= count and here <= before and here <= after
        if near_an_end or (inner and here < lowest + step * size):
            lo, hi = max(share - 2.0 * step, first), min(share, last)
            one, two = hi - GOLDEN * (hi - lo), lo + GOLDEN * (hi - lo)
            h_one = _height_at(node, k, one, ax, ay, az, dx, dy, dz)
            h_two = _height_at(node, k, two, ax, ay, az, dx, dy, dz)
            for _ in range(REFINEMENTS):
                deep = min(h_one, h_two) < -DEEP_ENTRY * node[k, SIZE]
                if deep and (hi - lo) * size < DEEP_ENTRY_WIDTH * node[k, SIZE]:
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


# ------------------------------------------------------- seams, over which the curvature of a surface jumps


@jit
def has_seams(k, node):
    """Return whether the curvature of obstacle k's surface jumps somewhere."""
    return node[k, KIND] == lay.CAPSULE


@jit
def slide_past_seam(k, node, ends, point, tangent, binormal, slide, shift, share, bend, slope):
    """Return the slide of a contact along its tangent [m], changed where a share of it leads over a seam of row k.

    ends: as for `solve_span`; point, tangent, binormal: columns of the contact; shift: its move along its binormal;
    bend, slope: normal curvature, and rate of the error with the slide.
    """
    z, along = _along_axis(k, node, ends, point, tangent)
    aside = shift * (
        node[k, ROT + 2] * node[k, binormal]
        + node[k, ROT + 5] * node[k, binormal + 1]
        + node[k, ROT + 8] * node[k, binormal + 2]
    )
    return slide_over_seam(node[k, DIM], node[k, DIM + 1], z, along, aside, slide, share, bend, slope)


@jit
def way_to_seam(k, node, ends, point, tangent, bend, deviation):
    """Return the way along its tangent by which a contact gets behind the next seam of row k, signed [m].

    0 where there is no seam that way, or where the surface turns by as much as the deviation [rad] before it; the sign
    of the deviation is that of the way. bend: normal curvature at the contact.
    """
    z, along = _along_axis(k, node, ends, point, tangent)
    return way_over_shaft(node[k, DIM], node[k, DIM + 1], z, along, bend, deviation)


@jit
def _along_axis(k, node, ends, point, tangent):
    """Return the height of a contact along row k's local z [m], and the rise of its tangent."""
    ux, uy, uz = node[k, ROT + 2], node[k, ROT + 5], node[k, ROT + 8]
    z = (
        ux * (node[k, point] + ends[0] - node[k, POS])
        + uy * (node[k, point + 1] + ends[1] - node[k, POS + 1])
        + uz * (node[k, point + 2] + ends[2] - node[k, POS + 2])
    )
    return z, ux * node[k, tangent] + uy * node[k, tangent + 1] + uz * node[k, tangent + 2]


# -------------------------------------------------- winding angle, for the kinds with the trait BRANCHED


@jit
def winding_angle(k, node):
    """Return the angle by which the path of the last evaluation winds about obstacle k, with sign [rad].

    About the axis of a cylinder or cone (for an elliptic cylinder in the affine image in which it is circular), about
    the middle of a torus' tube. NaN for other kinds.
    """
    kind = node[k, KIND]
    if kind == lay.CYLINDER:
        return winding_about_cylinder(k, node)
    if kind == lay.TORUS:
        return winding_about_tube(k, node)
    if kind == lay.ELLIPTIC_CYLINDER:
        return winding_about_axis(k, node, 1.0 / node[k, DIM], 1.0 / node[k, DIM + 1])
    if kind == lay.CONE:
        return winding_about_axis(k, node, 1.0, 1.0)
    return NAN


@jit
def segment_winding_angle(k, node, ax, ay, az, bx, by, bz):
    """Return the angle by which the straight segment from A to B winds about obstacle k [rad].

    For kinds whose side is topological and whose wraps are searched for; NaN for others.
    """
    if node[k, KIND] == lay.TORUS:
        return segment_winding_about_tube(node[k, DIM], ax, ay, az, bx, by, bz)
    return NAN
