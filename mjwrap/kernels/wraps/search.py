"""Wraps without a closed form: a search among guesses in half planes through A and B, polished by Newton's method.

A taut string between A and B that touches a surface runs near a plane through A and B. Half planes all round AB
give guesses for every side (`half_planes.py`); Newton's method makes paths of them, and the certificate discards those
on which no string would hold. "Wraps without a closed form" in docs/derivation.md.

Around a torus the side is topological, as around a cylinder: the angle that the string sweeps about the middle of the
tube. Bounded convex surfaces have no such number: there the path keeps to the minimum that it is on.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import deferred, jit
from mjwrap.kernels.geometry.geodesics import geodesic
from mjwrap.kernels.geometry.stoermer import carray, stack
from mjwrap.kernels.geometry.table import dip, project, straight_swept, swept
from mjwrap.kernels.geometry.traits import branched, hollow
from mjwrap.kernels.geometry.winding import follow
from mjwrap.kernels.tangency.newton import GEODESICS_EVALUATED, NOT_EVALUATED
from mjwrap.kernels.wraps.end_on_surface import (
    end_onto_surface,
    low_end_height,
    polish,
    polish_from_low_ends,
    polish_shot,
    shoot_geodesics,
)
from mjwrap.kernels.wraps.half_planes import (
    guess_in_half_plane,
    perpendicular,
    place_contact,
    place_contact_on_tube,
)
from mjwrap.kernels.wraps.ruled import A_INSIDE, B_INSIDE, INSIDE, set_free

SIZE, HINT = lay.SIZE, lay.HINT
S_MODE, S_SWEEP, S_P, S_T = lay.S_MODE, lay.S_SWEEP, lay.S_P, lay.S_T
COLD, TOUCHED = lay.COLD, lay.TOUCHED

DIRECTIONS = 12  # half planes around AB
LEAST_DEPTH = 1e-10  # a segment that dips less below a surface, in its size, is clear of it
SAME_BRANCH = 1.0  # difference of swept angles [rad] that is no whole turn


@jit
def _on_branch(k, node, known, before):
    """Return whether the path of the last evaluation goes round the tube as it did before."""
    if not known:
        return True
    angle = swept(k, node)
    return abs(angle - follow(angle, before)) < SAME_BRANCH


@jit
def _leave_free(k, node, sweep, low, ax, ay, az, bx, by, bz):
    """Leave the surface untouched by the straight segment from A to B, and save where that runs, in S.

    A large move needs it, to tell on which side of the surface the string was (`large_moves.py`).
    """
    set_free(node, k, sweep)
    node[k, lay.W_LOW] = low
    node[k, S_P] = ax
    node[k, S_P + 1] = ay
    node[k, S_P + 2] = az
    node[k, S_T] = bx
    node[k, S_T + 1] = by
    node[k, S_T + 2] = bz


@deferred(types.int64)
def wrap_by_search(k, ends, node, search):
    """Wrap the string from A to B over obstacle k; `ends` as for `solve_span`. Returns A_INSIDE and B_INSIDE summed.

    Without `search` a contact that Newton's method does not find again stays where it was.
    """
    high_a, ax, ay, az, qx, qy, qz = end_onto_surface(k, node, ends, 3, False)
    high_b, bx, by, bz, rx, ry, rz = end_onto_surface(k, node, ends, 6, False)
    low = (INSIDE - 1.0) * node[k, SIZE]
    inside = (A_INSIDE if high_a < low else 0) + (B_INSIDE if high_b < low else 0)
    if node[k, lay.TOUCH] != 0.0:  # the string comes from the surface itself
        high_a = math.inf
    elif k + 1 < node.shape[0] and node[k + 1, lay.TOUCH] != 0.0 and node[k + 1, S_MODE] == TOUCHED:
        high_b = math.inf
    ends = (ends[0], ends[1], ends[2], qx, qy, qz, rx, ry, rz)
    mode, before = node[k, S_MODE], node[k, S_SWEEP]
    winds = branched(k, node) and node[k, lay.TOUCH] == 0.0
    branch = winds and mode != COLD
    # a warm start: Newton's method from the last contact, on the last branch
    if mode == TOUCHED:
        for i in range(lay.STATE):
            node[k, lay.W_LAST + i] = node[k, S_MODE + i]
        good, _ = polish(k, ends, node, GEODESICS_EVALUATED if node[k, lay.W_FRESH] >= 0.0 else NOT_EVALUATED)
        if good and _on_branch(k, node, branch, before):
            node[k, S_SWEEP] = swept(k, node) if winds else 0.0
            return inside
    dx, dy, dz = bx - ax, by - ay, bz - az
    size = math.sqrt(dx * dx + dy * dy + dz * dz)
    low, share = dip(node, k, ax, ay, az, bx, by, bz)
    straight = straight_swept(k, node, ax, ay, az, bx, by, bz) if winds else 0.0
    # hooked: clear of the surface in this pose, but wound about the tube by another number of turns
    hooked = branch and abs(straight - follow(straight, before)) > SAME_BRANCH
    hinted = mode == COLD and node[k, HINT] > 0.0
    if low >= -LEAST_DEPTH * node[k, SIZE] and not hooked:
        # a hinted side may hold a string that the straight one does not show
        if hinted and hollow(k, node):
            place_contact(k, node, node[k, HINT + 1], node[k, HINT + 2], node[k, HINT + 3], dx, dy, dz, 0.0)
            good, _ = polish_from_low_ends(k, ends, node, high_a, high_b)
            if good:
                node[k, S_SWEEP] = swept(k, node) if winds else 0.0
                return inside
        _leave_free(k, node, straight, low, ax, ay, az, bx, by, bz)
        return inside
    # leave the lost contact where it was: Newton's method over the whole row may find it again
    if mode == TOUCHED and not search:
        for i in range(lay.STATE):
            node[k, S_MODE + i] = node[k, lay.W_LAST + i]
        geodesic(k, node, ends[0], ends[1], ends[2])
        return inside
    clear = low >= -LEAST_DEPTH * node[k, SIZE]
    _search(
        k, ends, node, ax, ay, az, dx, dy, dz, size, share, hinted, mode == COLD, branch, before, clear,
        high_a, high_b,
    )  # fmt: skip
    return inside


@jit
def _search(
    k, ends, node, ax, ay, az, dx, dy, dz, size, share, hinted, cold, branch, before, clear, high_a, high_b
):
    """Try half planes all round AB, the likeliest first; leave the best path, or the first guess where none holds."""
    # u along AB; w at right angles to it, from AB's lowest point towards the hint or along the normal; v = u x w
    ux, uy, uz = dx / size, dy / size, dz / size
    fx, fy, fz = ax + share * dx, ay + share * dy, az + share * dz
    if hinted:
        wx, wy, wz = node[k, HINT + 1] - fx, node[k, HINT + 2] - fy, node[k, HINT + 3] - fz
    else:
        _, _, _, wx, wy, wz = project(node, k, fx, fy, fz)
    along = wx * ux + wy * uy + wz * uz
    wx, wy, wz = wx - along * ux, wy - along * uy, wz - along * uz
    length = math.sqrt(wx * wx + wy * wy + wz * wz)
    if length <= 1e-9 * node[k, SIZE] or not math.isfinite(length):
        wx, wy, wz = perpendicular(ux, uy, uz)
    else:
        wx, wy, wz = wx / length, wy / length, wz / length
    vx, vy, vz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
    winds = branched(k, node) and node[k, lay.TOUCH] == 0.0
    found, best, fresh = False, 0.0, -1
    guessed = False
    j = 0
    # the best solution so far, then the first guess
    memory = carray(stack(), (80,))
    for j in range(DIRECTIONS):
        # to both sides in turn: 0, 1, -1, 2, -2, ... twelfths of a turn
        turn = (j + 1) // 2 * (2.0 * math.pi / DIRECTIONS)
        c, s = math.cos(turn), math.sin(turn) if j % 2 == 1 else -math.sin(turn)
        if (
            clear
        ):  # the string is hooked: no half plane's section blocks it, but it is round the tube somewhere near
            place_contact_on_tube(k, node, fx, fy, fz, dx, dy, dz, j * (2.0 * math.pi / DIRECTIONS))
        elif not guess_in_half_plane(
            k,
            node,
            ax,
            ay,
            az,
            ux,
            uy,
            uz,
            c * wx + s * vx,
            c * wy + s * vy,
            c * wz + s * vz,
            size,
            share * size,
        ):
            continue
        if not guessed:
            guessed = True
            for i in range(lay.STATE):
                memory[lay.STATE + i] = node[k, S_MODE + i]
        good, total = polish_from_low_ends(k, ends, node, high_a, high_b)
        if not good or not _on_branch(k, node, branch, before) or (found and total >= best * (1.0 - 1e-12)):
            continue
        found, best, fresh = True, total, j
        node[k, S_SWEEP] = swept(k, node) if winds else 0.0
        for i in range(lay.STATE):
            memory[i] = node[k, S_MODE + i]
        # the nearest to the hint, or to the side that was lost, will do; else the shortest of all
        if hinted or not cold:
            break
    # from low ends, all geodesics that lead to the other end
    if not found or (cold and not hinted):
        ways = carray(stack(), (80,))
        for side in range(2):
            if (high_a if side == 0 else high_b) > low_end_height(k, node):
                continue
            for i in range(shoot_geodesics(k, ends, node, side, ways)):
                good, total = polish_shot(k, ends, node, side, high_a, high_b, ways[2 * i], ways[2 * i + 1])
                if (
                    not good
                    or not _on_branch(k, node, branch, before)
                    or (found and total >= best * (1.0 - 1e-12))
                ):
                    continue
                j += 1
                found, best, fresh = True, total, j
                node[k, S_SWEEP] = swept(k, node) if winds else 0.0
                for c in range(lay.STATE):
                    memory[c] = node[k, S_MODE + c]
            j += 1
    node[k, S_MODE] = TOUCHED
    # the row still holds the evaluation of the best one where that was the last one tried
    if found and fresh == j:
        return
    node[k, lay.W_FRESH] = -1.0
    if found or guessed:
        start = 0 if found else lay.STATE
        for i in range(lay.STATE):
            node[k, S_MODE + i] = memory[start + i]
    else:
        place_contact(k, node, fx, fy, fz, ux, uy, uz, 0.0)
    geodesic(k, node, ends[0], ends[1], ends[2])
