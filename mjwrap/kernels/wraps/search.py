"""Wraps without a closed form: initial guesses in half planes through AB, solved by Newton's method.

A taut string between A and B that touches a surface runs near a plane through A and B. Half planes in all
directions around AB give guesses for every side (`initial_guess.py`). Newton's method solves from each, and the
certificate discards those at which a string would slip off. "Wraps without a closed form" in docs/derivation.md.

On a torus the side is topological, as on a cylinder: it is given by the winding angle about the middle of the tube. On
a bounded convex surface there is no such number: the path stays at the local minimum at which it is.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, jit
from mjwrap.kernels.geometry.dispatch import (
    project,
    segment_clearance,
    segment_winding_angle,
    winding_angle,
)
from mjwrap.kernels.geometry.geodesics import geodesic
from mjwrap.kernels.geometry.stoermer import carray, stack
from mjwrap.kernels.geometry.traits import branched, ellipse_sections, hollow, one_sided, sided
from mjwrap.kernels.geometry.winding import unwrap_angle
from mjwrap.kernels.tangency.newton import GEODESICS_EVALUATED, NOT_EVALUATED
from mjwrap.kernels.wraps.end_on_surface import (
    end_onto_surface,
    low_end_height,
    polish,
    polish_from_low_ends,
    polish_shot,
    shoot_geodesics,
)
from mjwrap.kernels.wraps.ends_from_above import search_from_above
from mjwrap.kernels.wraps.hinted_half import hint_outside, is_there, straight_is_refused
from mjwrap.kernels.wraps.initial_guess import (
    guess_in_half_plane,
    height_of_section,
    perpendicular,
    place_contact,
    place_contact_on_tube,
)
from mjwrap.kernels.wraps.ring import NO_SIDE, asked_side, is_on_side, wrap_on_side
from mjwrap.kernels.wraps.ruled import A_INSIDE, B_INSIDE, INSIDE, set_free
from mjwrap.kernels.wraps.sides import is_hopeless, point_of_side

SIZE, HINT = lay.SIZE, lay.HINT
S_MODE, S_SWEEP, S_P, S_T = lay.S_MODE, lay.S_SWEEP, lay.S_P, lay.S_T
COLD, TOUCHED = lay.COLD, lay.TOUCHED

NEAR_HINT = 5  # half planes within 60 degrees of the hint
DIRECTIONS = 12  # number of half planes around AB
CLEAR_DEPTH = 1e-9  # a segment that goes less deep below a surface, in the surface's size, is clear of it
SAME_BRANCH = 1.0  # winding angles that differ by less belong to the same branch [rad]


@jit
def _on_branch(k, node, known, before):
    """Return whether the path of the last evaluation is on the branch of the winding angle `before`."""
    if not known:
        return True
    angle = winding_angle(k, node)
    return abs(angle - unwrap_angle(angle, before)) < SAME_BRANCH


@jit
def _leave_free(k, node, sweep, low, ax, ay, az, bx, by, bz):
    """Write that the string does not touch the surface, and save the straight segment from A to B, in S.

    After a large move this tells on which side of the surface the string was (`span_solver.py`).
    """
    set_free(node, k, sweep)
    node[k, lay.W_CLEARANCE] = low
    node[k, S_P] = ax
    node[k, S_P + 1] = ay
    node[k, S_P + 2] = az
    node[k, S_T] = bx
    node[k, S_T + 1] = by
    node[k, S_T + 2] = bz


@deferred(types.int64)
def wrap_by_search(k, ends, node, search):
    """Wrap the string from A to B over obstacle k; return the sum of A_INSIDE and B_INSIDE, as they apply.

    ends as for `solve_span`. Without `search` a contact that Newton's method does not find again stays where it was.
    """
    high_a, ax, ay, az, qx, qy, qz = end_onto_surface(k, node, ends, 3, False)
    high_b, bx, by, bz, rx, ry, rz = end_onto_surface(k, node, ends, 6, False)
    low = (INSIDE - 1.0) * node[k, SIZE]
    inside = (A_INSIDE if high_a < low else 0) + (B_INSIDE if high_b < low else 0)
    # the string comes from another contact with the same surface, or goes to one: that end is not a low end
    if node[k, lay.TOUCH] != 0.0:
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
        good, _ = polish(
            k, ends, node, GEODESICS_EVALUATED if node[k, lay.W_WRAP_ERROR] >= 0.0 else NOT_EVALUATED
        )
        if good and _on_branch(k, node, branch, before):
            node[k, S_SWEEP] = winding_angle(k, node) if winds else 0.0
            return inside
    dx, dy, dz = bx - ax, by - ay, bz - az
    size = math.sqrt(dx * dx + dy * dy + dz * dz)
    low, share = segment_clearance(node, k, ax, ay, az, bx, by, bz)
    straight = segment_winding_angle(k, node, ax, ay, az, bx, by, bz) if winds else 0.0
    # hooked: the straight segment is clear of the surface, but on another branch than the string
    hooked = branch and abs(straight - unwrap_angle(straight, before)) > SAME_BRANCH
    clear = low >= -CLEAR_DEPTH * node[k, SIZE]
    held = sided(k, node) and not winds
    hinted = node[k, HINT] > 0.0 and (mode == COLD or (held and not clear))
    side = asked_side(k, node, az, bz) if hinted and winds else NO_SIDE
    if side != NO_SIDE:
        done = clear and is_on_side(k, node, side, straight, ax, ay, az, bx, by, bz)
        fx, fy = ax + share * dx, ay + share * dy
        if wrap_on_side(k, ends, node, side, done, ax, ay, az, bx, by, bz, fx, fy, high_a, high_b):
            node[k, S_SWEEP] = winding_angle(k, node)
            return inside
    if clear and not hooked:
        # on the side of the hint there may be a wrap although the straight segment is clear
        if hinted and side == NO_SIDE and hollow(k, node):
            place_contact(k, node, node[k, HINT + 1], node[k, HINT + 2], node[k, HINT + 3], dx, dy, dz, 0.0)
            good, _ = polish_from_low_ends(k, ends, node, high_a, high_b)
            if good:
                node[k, S_SWEEP] = winding_angle(k, node) if winds else 0.0
                return inside
        elif (
            hinted
            and not hollow(k, node)
            and not one_sided(k, node)
            and straight_is_refused(k, node, held, share, ax, ay, az, dx, dy, dz)
            and _search(
                k, ends, node, ax, ay, az, dx, dy, dz, size, share, True, True, branch, before, False,
                high_a, high_b, NEAR_HINT,
            )
        ):  # fmt: skip
            return inside
        _leave_free(k, node, straight, low, ax, ay, az, bx, by, bz)
        return inside
    # leave the lost contact where it was: Newton's method over the whole row may find it again
    if mode == TOUCHED and not search:
        for i in range(lay.STATE):
            node[k, S_MODE + i] = node[k, lay.W_LAST + i]
        geodesic(k, node, ends[0], ends[1], ends[2])
        return inside
    _search(
        k, ends, node, ax, ay, az, dx, dy, dz, size, share, hinted, mode == COLD, branch, before, clear,
        high_a, high_b, DIRECTIONS,
    )  # fmt: skip
    return inside


@jit
def _search(
    k,
    ends,
    node,
    ax,
    ay,
    az,
    dx,
    dy,
    dz,
    size,
    share,
    hinted,
    cold,
    branch,
    before,
    clear,
    high_a,
    high_b,
    most,
):
    """Try half planes around AB, the most likely first; write the best path, or the first guess if none is found.

    most: number of half planes to try. Returns whether a path was found, with a hint one on its side. With a side that
    holds at every pose the shortest path on its half is the best, else the first one on the side of the hint.
    """
    # u along AB; w perpendicular to it, from AB's lowest point towards the hint or along the normal; v = u x w
    ux, uy, uz = dx / size, dy / size, dz / size
    fx, fy, fz = ax + share * dx, ay + share * dy, az + share * dz
    winds = branched(k, node) and node[k, lay.TOUCH] == 0.0
    held = hinted and sided(k, node) and not winds
    if hinted:
        wx, wy, wz = point_of_side(k, node) if held else hint_outside(k, node)
        wx, wy, wz = wx - fx, wy - fy, wz - fz
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
    # beyond the hint: how far from AB, which is clear of the surface, a section is looked for
    above = 0.0
    if most < DIRECTIONS:
        above = length + node[k, SIZE]
    found, best, fresh = False, 0.0, -1
    guessed, sided_path = False, False
    j = 0
    # the best solution so far, then the first guess
    memory = carray(stack(), (80,))
    for j in range(most):
        # to both sides in turn: 0, 1, -1, 2, -2, ... twelfths of a turn
        turn = (j + 1) // 2 * (2.0 * math.pi / DIRECTIONS)
        c, s = math.cos(turn), math.sin(turn) if j % 2 == 1 else -math.sin(turn)
        # hooked: AB is clear, so that no section lies in its way; guesses all round the tube instead
        if clear:
            place_contact_on_tube(k, node, fx, fy, fz, dx, dy, dz, j * (2.0 * math.pi / DIRECTIONS))
        else:
            gx, gy, gz = c * wx + s * vx, c * wy + s * vy, c * wz + s * vz
            lift = 0.0
            if above > 0.0 and not ellipse_sections(k, node):
                lift = height_of_section(k, node, fx, fy, fz, gx, gy, gz, above)
            if lift < 0.0 or not guess_in_half_plane(
                k, node, ax, ay, az, ux, uy, uz, gx, gy, gz, size, share * size, lift
            ):
                continue
        if not guessed:
            guessed = True
            for i in range(lay.STATE):
                memory[lay.STATE + i] = node[k, S_MODE + i]
        if held and sided_path and is_hopeless(k, ends, node, best):
            continue
        good, total = polish_from_low_ends(k, ends, node, high_a, high_b)
        if not good or not _on_branch(k, node, branch, before):
            continue
        # one on the hint's side is better than one that is not, then the shorter one
        there = not hinted or is_there(k, ends, node, held, fx, fy, fz, wx, wy, wz)
        if (
            found
            and (sided_path or not there)
            and ((sided_path and not there) or total >= best * (1.0 - 1e-12))
        ):
            continue
        found, best, fresh, sided_path = True, total, j, there
        node[k, S_SWEEP] = winding_angle(k, node) if winds else 0.0
        for i in range(lay.STATE):
            memory[i] = node[k, S_MODE + i]
        # the first is nearest to the hint, or to the side that was lost; without either take the shortest
        if ((hinted and there) or not cold) and not held:
            break
    # from low ends: all geodesics whose tangents lead to the other end
    if not found or held or (cold and not hinted):
        ways = carray(stack(), (80,))
        for side in range(2):
            if (high_a if side == 0 else high_b) > low_end_height(k, node):
                continue
            for i in range(shoot_geodesics(k, ends, node, side, ways)):
                good, total = polish_shot(k, ends, node, side, high_a, high_b, ways[2 * i], ways[2 * i + 1])
                if not good or not _on_branch(k, node, branch, before):
                    continue
                there = held and is_there(k, ends, node, held, fx, fy, fz, wx, wy, wz)
                if found and (
                    (sided_path and not there) or (sided_path == there and total >= best * (1.0 - 1e-12))
                ):
                    continue
                j += 1
                found, best, fresh, sided_path = True, total, j, there
                node[k, S_SWEEP] = winding_angle(k, node) if winds else 0.0
                for c in range(lay.STATE):
                    memory[c] = node[k, S_MODE + c]
            j += 1
    low = min(high_a, high_b) <= low_end_height(k, node)
    a, b = (ax, ay, az), (ax + dx, ay + dy, az + dz)
    if not found and low and not winds and search_from_above(k, ends, node, a, b, high_a, high_b, hinted):
        found, fresh = True, -1
        node[k, S_SWEEP] = 0.0
        for i in range(lay.STATE):
            memory[i] = node[k, S_MODE + i]
    node[k, S_MODE] = TOUCHED
    # if the best one was the last that was tried, the row still holds its evaluation
    if found and fresh == j:
        return sided_path or not hinted
    node[k, lay.W_WRAP_ERROR] = -1.0
    if found or guessed:
        start = 0 if found else lay.STATE
        for i in range(lay.STATE):
            node[k, S_MODE + i] = memory[start + i]
    else:
        place_contact(k, node, fx, fy, fz, ux, uy, uz, 0.0)
    geodesic(k, node, ends[0], ends[1], ends[2])
    return found and (sided_path or not hinted)
