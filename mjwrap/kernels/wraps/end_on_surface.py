"""A single wrap solved by Newton's method, also where an end of the string lies on the surface or a little above it.

An end at height h has a straight segment only sqrt(2 h / kappa) long before the contact, shorter than a Newton step. So
such a low end is first moved onto the surface, with the contact at it. Two unknowns are left, direction and length of
the geodesic. Then the contact is moved along the geodesic by sqrt(2 h / kappa). The directions that lead to the other
end are found by shooting geodesics in all directions. "Low ends" in docs/derivation.md.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import jit
from mjwrap.kernels.geometry.dispatch import height, project
from mjwrap.kernels.geometry.geodesics import displace, geodesic, move_start_along
from mjwrap.kernels.geometry.projection import turn_into_frame
from mjwrap.kernels.geometry.stoermer import carray, stack
from mjwrap.kernels.geometry.vectors import unit
from mjwrap.kernels.tangency.certify import is_local_minimum
from mjwrap.kernels.tangency.newton import NOT_EVALUATED, newton
from mjwrap.kernels.wraps.initial_guess import perpendicular
from mjwrap.kernels.wraps.ruled import INSIDE

SIZE, POS, ROT = lay.SIZE, lay.POS, lay.ROT
S_MODE, S_P, S_T, S_ARC = lay.S_MODE, lay.S_P, lay.S_T, lay.S_ARC
W_P, W_Q, W_TQ, W_NQ, W_BQ = lay.W_P, lay.W_Q, lay.W_TQ, lay.W_NQ, lay.W_BQ
FROM_A, TO_B = 0, 1

# Lengths are shares of the surface's size.
LOCAL_TOL = 1e-5  # tangency error to which a single wrap is solved; later the whole span is solved exactly
LOCAL_STEPS = 15  # largest number of steps of Newton's method for a single wrap
LOW_END = 0.01  # an end that lies less high above the surface is a low end
NEAR_END = 0.3  # a contact nearer to a low end than this is moved to the end
SHOTS = 36  # number of directions in which geodesics are shot from an end
REFINEMENTS = 4  # largest number of refinements of a direction between two of them
SMALL_MISS = 0.02  # a geodesic that misses the other end by a smaller angle needs no further refinement [rad]
# a geodesic that misses the other end by a larger angle after all refinements is discarded [rad]
MAX_MISS = 0.3
MAX_MISS_CHANGE = 2.5  # neighbouring misses that differ by more do not enclose a zero [rad]
MARCH_STEP = 0.35  # step along a geodesic that is shot
MAX_MARCH_STEPS = 20  # largest number of such steps
MAX_SHOT_WAYS = 12  # largest number of geodesics that are returned


@jit
def low_end_height(k, node):
    """Return the height over obstacle k's surface below which an end is low [m]."""
    return LOW_END * node[k, SIZE]


@jit
def polish(k, ends, node, known):
    """Run Newton's method on obstacle k alone; return (whether the wrap is certified, its length [m]).

    known: `square` of `newton`, NOT_EVALUATED or GEODESICS_EVALUATED.
    """
    error, _, _ = newton(k, k + 1, ends, node, LOCAL_TOL, LOCAL_STEPS, known)
    # a solve that follows need not repeat this evaluation if the row still holds it
    node[k, lay.W_WRAP_ERROR] = error * error
    if not (error <= LOCAL_TOL and node[k, S_ARC] >= 0.0 and is_local_minimum(k, k + 1, node)):
        return False, 0.0
    return True, node[k, lay.W_L] + node[k, S_ARC] + node[k, lay.W_LQ]


@jit
def polish_from_low_ends(k, ends, node, high_a, high_b):
    """Solve from a guess, with ends at heights high_a and high_b over the surface [m]; return what `polish` returns."""
    near = NEAR_END * node[k, SIZE]
    if high_a > low_end_height(k, node) and high_b > low_end_height(k, node):
        return polish(k, ends, node, NOT_EVALUATED)
    geodesic(k, node, ends[0], ends[1], ends[2])
    before, behind = _distance_to_end(k, node, W_P, ends, 3), _distance_to_end(k, node, W_Q, ends, 6)
    from_a = high_a <= low_end_height(k, node) and before <= near
    to_b = high_b <= low_end_height(k, node) and behind <= near
    if not (from_a or to_b):
        return polish(k, ends, node, NOT_EVALUATED)
    # the guess is used again if Newton's method fails with the ends on the surface
    guess = carray(stack(), (80,))
    for i in range(lay.STATE):
        guess[i] = node[k, S_MODE + i]
    if from_a:
        _, px, py, pz, _, _, _ = end_onto_surface(k, node, ends, 3, True)
        node[k, S_P] = px
        node[k, S_P + 1] = py
        node[k, S_P + 2] = pz
        displace(k, 0.0, 0.0, 0.0, before, node)
    good, total = _polish_on_surface(k, ends, node, from_a, to_b, high_a, high_b)
    if good:
        return good, total
    for i in range(lay.STATE):
        node[k, S_MODE + i] = guess[i]
    return polish(k, ends, node, NOT_EVALUATED)


@jit
def polish_shot(k, ends, node, side, high_a, high_b, angle, arc):
    """Solve from a geodesic that `shoot_geodesics` found from side FROM_A or TO_B; return what `polish` returns."""
    _, px, py, pz, _, _, _ = end_onto_surface(k, node, ends, 3 if side == FROM_A else 6, True)
    _start_geodesic(k, node, px, py, pz, angle, arc)
    # a geodesic shot from B is the path backwards: reverse it
    if side == TO_B:
        move_start_along(k, node, ends, arc)
        for i in range(3):
            node[k, S_T + i] = -node[k, S_T + i]
        node[k, S_ARC] = arc
    # the other end may be low, too
    return polish_from_low_ends(k, ends, node, high_a, high_b)


@jit
def _polish_on_surface(k, ends, node, from_a, to_b, high_a, high_b):
    """Solve from a guess, first with the low ends moved onto the surface, then with the ends at their own places.

    from_a, to_b: whether A and B are such ends. Returns what `polish` returns.
    """
    _, _, _, _, ax, ay, az = end_onto_surface(k, node, ends, 3, from_a)
    _, _, _, _, bx, by, bz = end_onto_surface(k, node, ends, 6, to_b)
    node[k, lay.W_END_TARGET] = 1.0 if to_b else 0.0
    flat = (ends[0], ends[1], ends[2], ax, ay, az, bx, by, bz)
    error, _, _ = newton(k, k + 1, flat, node, LOCAL_TOL, LOCAL_STEPS, NOT_EVALUATED)
    node[k, lay.W_END_TARGET] = 0.0
    if not (error <= LOCAL_TOL and node[k, S_ARC] > 0.0):
        return False, 0.0
    # an end h above the surface leaves a straight segment about sqrt(2 h / κ) long before the contact
    arc = node[k, S_ARC]
    bend_p, bend_q = node[k, lay.W_KP], node[k, lay.W_KQ]
    if from_a and bend_p > 0.0:
        move_start_along(k, node, ends, min(math.sqrt(2.0 * max(high_a, 0.0) / bend_p), arc))
    if to_b and bend_q > 0.0:
        node[k, S_ARC] = max(node[k, S_ARC] - math.sqrt(2.0 * max(high_b, 0.0) / bend_q), 0.0)
    return polish(k, ends, node, NOT_EVALUATED)


@jit
def _distance_to_end(k, node, column, ends, end):
    """Return the distance from a contact to an end of the string [m]."""
    x, y, z = (
        node[k, column] - ends[end],
        node[k, column + 1] - ends[end + 1],
        node[k, column + 2] - ends[end + 2],
    )
    return math.sqrt(x * x + y * y + z * z)


@jit
def end_onto_surface(k, node, ends, column, moves):
    """Return an end of the string, moved onto the surface if it lies inside or if `moves` is true.

    Returns its height above the surface before [m], then the point in S (3), then relative to the base (3).
    """
    x, y, z = node[k, POS] - ends[0], node[k, POS + 1] - ends[1], node[k, POS + 2] - ends[2]
    px, py, pz = turn_into_frame(node, k, ends[column] - x, ends[column + 1] - y, ends[column + 2] - z)
    high = height(node, k, px, py, pz)
    if high >= (INSIDE - 1.0) * node[k, SIZE] and not moves:
        return high, px, py, pz, ends[column], ends[column + 1], ends[column + 2]
    px, py, pz, _, _, _ = project(node, k, px, py, pz)
    return (
        high, px, py, pz,
        x + node[k, ROT] * px + node[k, ROT + 1] * py + node[k, ROT + 2] * pz,
        y + node[k, ROT + 3] * px + node[k, ROT + 4] * py + node[k, ROT + 5] * pz,
        z + node[k, ROT + 6] * px + node[k, ROT + 7] * py + node[k, ROT + 8] * pz,
    )  # fmt: skip


@jit
def _start_geodesic(k, node, px, py, pz, angle, arc):
    """Start a geodesic at a surface point, in a direction given by its angle about the normal there [rad]."""
    px, py, pz, nx, ny, nz = project(node, k, px, py, pz)
    ux, uy, uz = perpendicular(nx, ny, nz)
    c, s = math.cos(angle), math.sin(angle)
    tx, ty, tz = unit(
        c * ux + s * (ny * uz - nz * uy), c * uy + s * (nz * ux - nx * uz), c * uz + s * (nx * uy - ny * ux)
    )
    node[k, S_MODE] = lay.TOUCHED
    node[k, S_P] = px
    node[k, S_P + 1] = py
    node[k, S_P + 2] = pz
    node[k, S_T] = tx
    node[k, S_T + 1] = ty
    node[k, S_T + 2] = tz
    node[k, S_ARC] = arc


@jit
def _height_over_tangent_plane(k, node, ends, end):
    """Return the height of the string's end over the tangent plane at the end of obstacle k's geodesic [m]."""
    geodesic(k, node, ends[0], ends[1], ends[2])
    return (
        node[k, W_NQ] * (ends[end] - node[k, W_Q])
        + node[k, W_NQ + 1] * (ends[end + 1] - node[k, W_Q + 1])
        + node[k, W_NQ + 2] * (ends[end + 2] - node[k, W_Q + 2])
    )


@jit
def _march_into_sight(k, node, px, py, pz, angle, ends, end):
    """March along the geodesic that leaves a surface point at an angle until the string's other end is in sight.

    In sight means above the tangent plane. Returns (whether this happens, arc length there [m], angle between the
    geodesic's tangent and the direction to that end, seen along the normal [rad]).
    """
    _start_geodesic(k, node, px, py, pz, angle, 0.0)
    step = MARCH_STEP * node[k, SIZE]
    low = _height_over_tangent_plane(k, node, ends, end)
    if not low < 0.0:
        return False, 0.0, 0.0
    node[k, S_ARC] = step
    high = 0.0
    way = 0.0
    for _ in range(MAX_MARCH_STEPS):
        high = _height_over_tangent_plane(k, node, ends, end)
        if high >= 0.0:
            break
        low = high
        way += step
        move_start_along(k, node, ends, step)
        node[k, S_ARC] = step
    if high < 0.0:
        return False, 0.0, 0.0
    # within the last step: the Illinois method (modified regula falsi)
    first, last = 0.0, step
    for _ in range(3):
        middle = (first * high - last * low) / (high - low)
        node[k, S_ARC] = middle
        at = _height_over_tangent_plane(k, node, ends, end)
        if at >= 0.0:
            last, high = middle, at
            low *= 0.5
        else:
            first, low = middle, at
            high *= 0.5
    along, aside = 0.0, 0.0
    for i in range(3):
        d = ends[end + i] - node[k, W_Q + i]
        along += d * node[k, W_TQ + i]
        aside += d * node[k, W_BQ + i]
    return True, way + node[k, S_ARC], math.atan2(aside, along)


@jit
def shoot_geodesics(k, ends, node, side, ways):
    """Find the geodesics from a low end A (side FROM_A) or B (TO_B) whose tangents lead to the other end.

    Writes angle and arc length of each to `ways` [rad, m], as starts for Newton's method; returns how many.
    """
    start, end = (3, 6) if side == FROM_A else (6, 3)
    _, px, py, pz, _, _, _ = end_onto_surface(k, node, ends, start, True)
    count = 0
    seen, before = False, 0.0
    for i in range(SHOTS + 1):
        angle = i * (2.0 * math.pi / SHOTS)
        in_sight, _, miss = _march_into_sight(k, node, px, py, pz, angle, ends, end)
        # the miss changes sign between this direction and the one before: a direction without a miss is enclosed
        if (
            in_sight
            and seen
            and miss * before <= 0.0
            and abs(miss - before) < MAX_MISS_CHANGE
            and count < MAX_SHOT_WAYS
        ):
            first, last, low, high = angle - 2.0 * math.pi / SHOTS, angle, before, miss
            for _ in range(REFINEMENTS):  # the Illinois method (modified regula falsi)
                middle = first + (last - first) * low / (low - high) if low != high else first
                in_sight, arc, at = _march_into_sight(k, node, px, py, pz, middle, ends, end)
                if not in_sight or abs(at) < SMALL_MISS:
                    break
                if at * high > 0.0:
                    last, high = middle, at
                    low *= 0.5
                else:
                    first, low = middle, at
                    high *= 0.5
            if in_sight and abs(at) < MAX_MISS:
                ways[2 * count] = middle
                ways[2 * count + 1] = arc
                count += 1
            in_sight = True
        seen, before = in_sight, miss
    return count
