"""Evaluation of a span: geodesics, segments, tangency error, path error h; h's Jacobian is in `path_error.py`.

The tangency error is ||f||, f = [e - t_P, e' - t_Q] for every touched obstacle (18), over the whole span (30). Newton's
method computes its steps from h and accepts them by f, because h is zero on a path that folds back (e = -t) as well.
Numbers in parentheses: Muñoz-Pepi et al. (2023).
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import inlined, jit
from mjwrap.kernels.geometry.geodesics import geodesic
from mjwrap.kernels.tangency.path_error import (
    SHORTEST,
    path_error_at_end_on_surface,
    path_error_at_P,
    path_error_at_Q,
)

S_MODE, SIZE, TOUCHED = lay.S_MODE, lay.SIZE, lay.TOUCHED
W_P, W_Q, W_TP, W_TQ = lay.W_P, lay.W_Q, lay.W_TP, lay.W_TQ
W_E, W_L, W_CP, W_CQ, W_LQ, W_EQ = lay.W_E, lay.W_L, lay.W_CP, lay.W_CQ, lay.W_LQ, lay.W_EQ
W_KP, W_KQ = lay.W_KP, lay.W_KQ
W_END_ON_SURFACE, W_END_TARGET = lay.W_END_ON_SURFACE, lay.W_END_TARGET

ON_SURFACE = 1e-6  # a straight segment shorter than this share of the size ends on the surface
LEAST_HEIGHT = 2e-12  # an end point less high above the surface than this share of the size lies on it
# distance of Q from an end on the surface, as a share of the size, that counts as a direction error of 1 rad
END_DISTANCE_SCALE = 0.01
CORNER = 1e-6  # two contacts that meet form a corner if half the angle between them is larger [rad]
# rounding error of a point [m]; divided by a segment's length, that of its direction; times a curvature, of the normal
POINT_ROUNDING = 2e-15


@jit
def evaluate(lo, hi, ends, node):
    """Evaluate all touched obstacles of nodes lo..hi and the straight segments between; return ||f||^2.

    ends = (base x, y, z, A x, y, z, B x, y, z): A and B relative to the base point [m].
    """
    for k in range(lo, hi):
        if node[k, S_MODE] == TOUCHED:
            geodesic(k, node, ends[0], ends[1], ends[2])
    return connect_segments(lo, hi, ends, node)


@jit
def connect_segments(lo, hi, ends, node):
    """Put straight segments between the geodesics that the rows hold; write e, e' and h, and return ||f||^2.

    Where an end point of the span lies on the surface there is no straight segment, and no error there.
    """
    _, _, _, x, y, z, bx, by, bz = ends
    total = 0.0
    last = -1
    for k in range(lo, hi):
        if node[k, S_MODE] != TOUCHED:
            continue
        # the segment from (x, y, z), which is A or Q of the obstacle before, to P
        dx, dy, dz = node[k, W_P] - x, node[k, W_P + 1] - y, node[k, W_P + 2] - z
        size = math.sqrt(dx * dx + dy * dy + dz * dz)
        meets = last >= 0 and size <= ON_SURFACE * node[k, SIZE]
        if meets:
            # two contacts meet: e is the mean of both tangents, and where these differ there is a corner
            dx, dy, dz = (
                node[last, W_TQ] + node[k, W_TP],
                node[last, W_TQ + 1] + node[k, W_TP + 1],
                node[last, W_TQ + 2] + node[k, W_TP + 2],
            )
            inverse = 1.0 / (math.sqrt(dx * dx + dy * dy + dz * dz) + SHORTEST)
        else:
            inverse = 1.0 / (size + SHORTEST)
        dx, dy, dz = dx * inverse, dy * inverse, dz * inverse
        node[k, W_E] = dx
        node[k, W_E + 1] = dy
        node[k, W_E + 2] = dz
        node[k, W_L] = size
        along, normal, binormal = path_error_at_P(k, node)
        if last < 0 and ends_on_surface(k, -normal, size, node[k, W_KP], node):
            along, normal, binormal = 1.0, 0.0, 0.0
        node[k, W_CP] = along
        node[k, W_CP + 1] = normal
        node[k, W_CP + 2] = binormal
        corner = meets and (1.0 - along) ** 2 + normal * normal + binormal * binormal > CORNER**2
        # a corner counts in full, also where the segment is short
        total += _error_share(along, normal, binormal, 1.0 if corner else size, node[k, W_KP])
        if last >= 0:
            total += _enter_leaving_segment(last, dx, dy, dz, size, False, node)
        x, y, z = node[k, W_Q], node[k, W_Q + 1], node[k, W_Q + 2]
        last = k
    if last >= 0:
        dx, dy, dz = bx - x, by - y, bz - z
        size = math.sqrt(dx * dx + dy * dy + dz * dz)
        inverse = 1.0 / (size + SHORTEST)
        total += _enter_leaving_segment(last, dx * inverse, dy * inverse, dz * inverse, size, True, node)
    return total


@jit
def _enter_leaving_segment(j, ex, ey, ez, size, last, node):
    """Write the straight segment that leaves obstacle j; return its share of ||f||^2.

    last: j is the last touched obstacle. Where the path ends on its surface, the share measures the distance from Q to
    the end B instead.
    """
    node[j, W_EQ] = ex
    node[j, W_EQ + 1] = ey
    node[j, W_EQ + 2] = ez
    node[j, W_LQ] = size
    node[j, W_END_ON_SURFACE] = 0.0
    along, normal, binormal = path_error_at_Q(j, node)
    if last and (node[j, W_END_TARGET] != 0.0 or ends_on_surface(j, normal, size, node[j, W_KQ], node)):
        # a vanishing segment has no direction: rows 2 and 3 of h are components of Q - B
        node[j, W_END_ON_SURFACE] = 1.0
        node[j, W_CQ] = 0.0
        node[j, W_CQ + 1], node[j, W_CQ + 2] = path_error_at_end_on_surface(along, binormal, size)
        share = size / (END_DISTANCE_SCALE * node[j, SIZE])
        return share * share * (along * along + binormal * binormal)
    node[j, W_CQ] = along
    node[j, W_CQ + 1] = normal
    node[j, W_CQ + 2] = binormal
    return _error_share(along, normal, binormal, size, node[j, W_KQ])


@inlined
def ends_on_surface(k, rise, size, bend, node):
    """Return whether the path ends on obstacle k's surface, so that there is no straight segment at that end.

    size: distance from the contact to the end [m]; rise: component of the unit vector to the end along the surface's
    normal. It may be negative: an end counts as inside the surface only beyond a certain depth. bend: normal curvature
    at the contact, by which a tangent as short as that rises.
    """
    least = node[k, SIZE]
    return size <= ON_SURFACE * least and size * rise <= LEAST_HEIGHT * least * (1.0 + least * abs(bend))


@inlined
def _error_share(along, normal, binormal, size, bend):
    """Return the share |e - t|^2 of one contact point in ||f||^2 (18); zero where it is within rounding errors.

    A point rounded by δ turns a segment by δ / size, and the surface's normal by δ bend.
    """
    share = (1.0 - along) ** 2 + normal * normal + binormal * binormal
    least = POINT_ROUNDING * (1.0 + size * abs(bend))
    return share if share * size * size > least * least else 0.0
