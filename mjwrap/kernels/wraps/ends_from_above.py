"""A wrap between low ends, found from higher ones: the last resort of `search.wrap_by_search` where an end is low.

A string whose end lies a little above the surface leaves it on a straight segment that is shorter than Newton's step,
and guesses in half planes are too inexact for that. From ends that are lifted to the height at which an end counts as
low (`LOW_END`) the wrap is found as any other. It is then a good guess for the ends at their own places.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, jit
from mjwrap.kernels.geometry.dispatch import project, segment_clearance
from mjwrap.kernels.geometry.stoermer import carray, stack
from mjwrap.kernels.geometry.vectors import unit
from mjwrap.kernels.tangency.newton import NOT_EVALUATED
from mjwrap.kernels.wraps.end_on_surface import low_end_height, polish, polish_from_low_ends
from mjwrap.kernels.wraps.initial_guess import guess_in_half_plane, perpendicular

POS, ROT, S_MODE = lay.POS, lay.ROT, lay.S_MODE
DIRECTIONS = 12  # number of half planes around the string


@jit
def _lifted(k, node, x, y, z, high):
    """Return a point of S at height `high`, lifted to the height at which an end is no longer low."""
    lift = low_end_height(k, node) - high
    if lift <= 0.0:
        return x, y, z
    _, _, _, nx, ny, nz = project(node, k, x, y, z)
    return x + lift * nx, y + lift * ny, z + lift * nz


@jit
def _in_world(k, node, ends, x, y, z):
    """Return a point of S relative to the base of `ends`, in world directions."""
    return (
        node[k, POS] - ends[0] + node[k, ROT] * x + node[k, ROT + 1] * y + node[k, ROT + 2] * z,
        node[k, POS + 1] - ends[1] + node[k, ROT + 3] * x + node[k, ROT + 4] * y + node[k, ROT + 5] * z,
        node[k, POS + 2] - ends[2] + node[k, ROT + 6] * x + node[k, ROT + 7] * y + node[k, ROT + 8] * z,
    )


@deferred(types.boolean)
def search_from_above(k, ends, node, a, b, high_a, high_b, first):
    """Find a wrap from A to B by lifting the ends that are low; return whether one was found, left in the row.

    ends: as for `solve_span`; a, b: A and B in S; first: take the first wrap instead of the shortest, as with a hint.
    """
    ax, ay, az = _lifted(k, node, a[0], a[1], a[2], high_a)
    bx, by, bz = _lifted(k, node, b[0], b[1], b[2], high_b)
    px, py, pz = _in_world(k, node, ends, ax, ay, az)
    qx, qy, qz = _in_world(k, node, ends, bx, by, bz)
    above = (ends[0], ends[1], ends[2], px, py, pz, qx, qy, qz)
    dx, dy, dz = bx - ax, by - ay, bz - az
    size = math.sqrt(dx * dx + dy * dy + dz * dz)
    if not size > 0.0:
        return False
    ux, uy, uz = dx / size, dy / size, dz / size
    low, share = segment_clearance(node, k, ax, ay, az, bx, by, bz)
    if low >= 0.0:
        return False
    x, y, z = ax + share * dx, ay + share * dy, az + share * dz
    if first:
        wx, wy, wz = node[k, lay.HINT + 1] - x, node[k, lay.HINT + 2] - y, node[k, lay.HINT + 3] - z
    else:
        _, _, _, wx, wy, wz = project(node, k, x, y, z)
    along = wx * ux + wy * uy + wz * uz
    wx, wy, wz = wx - along * ux, wy - along * uy, wz - along * uz
    if wx * wx + wy * wy + wz * wz > 0.0:
        wx, wy, wz = unit(wx, wy, wz)
    else:
        wx, wy, wz = perpendicular(ux, uy, uz)
    vx, vy, vz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
    found, best = False, 0.0
    memory = carray(stack(), (80,))
    for j in range(DIRECTIONS):
        turn = (j + 1) // 2 * (2.0 * math.pi / DIRECTIONS)
        c, s = math.cos(turn), math.sin(turn) if j % 2 == 1 else -math.sin(turn)
        gx, gy, gz = c * wx + s * vx, c * wy + s * vy, c * wz + s * vz
        if not guess_in_half_plane(k, node, ax, ay, az, ux, uy, uz, gx, gy, gz, size, share * size, 0.0):
            continue
        good, _ = polish(k, above, node, NOT_EVALUATED)
        if not good:
            continue
        good, total = polish_from_low_ends(k, ends, node, high_a, high_b)
        if not good or (found and total >= best * (1.0 - 1e-12)):
            continue
        found, best = True, total
        for i in range(lay.STATE):
            memory[i] = node[k, S_MODE + i]
        if first:
            break
    if found:
        for i in range(lay.STATE):
            node[k, S_MODE + i] = memory[i]
    return found
