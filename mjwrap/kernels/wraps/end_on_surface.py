"""A single wrap polished, also where an end of the string lies on the surface or little above it.

There the straight segment between end and contact is as short as the tangent from the end, sqrt(2 h / kappa): a
length that Newton's method oversteps. So the end is moved onto the surface first and the contact to it, which leaves
two unknowns, the geodesic's direction and length; then the contact slides on by the tangent. Which directions lead to
the other end is found by shooting geodesics all round.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit
from mjwrap.kernels.geometry.geodesics import displace, geodesic
from mjwrap.kernels.geometry.projection import turn_into_frame
from mjwrap.kernels.geometry.stoermer import carray, stack
from mjwrap.kernels.geometry.table import height, project
from mjwrap.kernels.geometry.vectors import unit
from mjwrap.kernels.tangency.certify import minimal
from mjwrap.kernels.tangency.newton import UNKNOWN, newton
from mjwrap.kernels.wraps.half_planes import across
from mjwrap.kernels.wraps.ruled import INSIDE

SIZE, POS, ROT = lay.SIZE, lay.POS, lay.ROT
S_MODE, S_P, S_T, S_ARC = lay.S_MODE, lay.S_P, lay.S_T, lay.S_ARC
W_P, W_Q, W_TQ, W_NQ, W_BQ = lay.W_P, lay.W_Q, lay.W_TQ, lay.W_NQ, lay.W_BQ
FROM_A, TO_B = 0, 1

LOCAL_TOL = 1e-5  # tangency error of a single wrap: all of them are polished together
LOCAL_STEPS = 15
BESIDE = 0.01  # an end that lies lower above a surface, in its size, is beside it
NEXT = 0.3  # a contact nearer to such an end, in the surface's size, is next to it
ROUND = 36  # geodesics shot from an end
REFINEMENTS = 4  # between two of them
STRAIGHT = 0.02  # a geodesic that misses the other end by less is polished [rad]
MOST_ASIDE = 0.3  # and one that misses it by more after all refinements is none
MOST_MISS = 2.5  # neighbours that differ by more do not enclose one that hits
MARCH = 0.35  # step along them, in the surface's size
MARCHES = 20
MOST_WAYS = 12


@jit
def beside(k, node):
    """Return below which height an end lies beside the surface [m]."""
    return BESIDE * node[k, SIZE]


@jit
def polish(k, ends, node, known):
    """Run Newton's method on obstacle k alone; return whether a string would hold there, and its length.

    known: what the row holds of its start, UNKNOWN or GEODESICS.
    """
    error, _, _ = newton(k, k + 1, ends, node, LOCAL_TOL, LOCAL_STEPS, known)
    node[k, lay.W_FRESH] = error * error
    if not (error <= LOCAL_TOL and node[k, S_ARC] >= 0.0 and minimal(k, k + 1, node)):
        return False, 0.0
    return True, node[k, lay.W_L] + node[k, S_ARC] + node[k, lay.W_LQ]


@jit
def polish_beside(k, ends, node, high_a, high_b):
    """Polish a guess whose ends lie high_a and high_b above the surface; return what `polish` does [m]."""
    reach = NEXT * node[k, SIZE]
    if high_a > beside(k, node) and high_b > beside(k, node):
        return polish(k, ends, node, UNKNOWN)
    geodesic(k, node, ends[0], ends[1], ends[2])
    before, behind = _gap(k, node, W_P, ends, 3), _gap(k, node, W_Q, ends, 6)
    from_a = high_a <= beside(k, node) and before <= reach
    to_b = high_b <= beside(k, node) and behind <= reach
    if not (from_a or to_b):
        return polish(k, ends, node, UNKNOWN)
    guess = carray(stack(), (80,))
    for i in range(lay.STATE):
        guess[i] = node[k, S_MODE + i]
    if from_a:
        _, px, py, pz, _, _, _ = moved_onto(k, node, ends, 3, True)
        node[k, S_P] = px
        node[k, S_P + 1] = py
        node[k, S_P + 2] = pz
        displace(k, 0.0, 0.0, 0.0, before, node)
    good, total = _land(k, ends, node, from_a, to_b, high_a, high_b)
    if good:
        return good, total
    for i in range(lay.STATE):
        node[k, S_MODE + i] = guess[i]
    return polish(k, ends, node, UNKNOWN)


@jit
def polish_landed(k, ends, node, side, high_a, high_b, angle, arc):
    """Polish a geodesic that `shoot` found from A (side FROM_A) or from B (TO_B); return what `polish` does [m]."""
    _, px, py, pz, _, _, _ = moved_onto(k, node, ends, 3 if side == FROM_A else 6, True)
    _aim(k, node, px, py, pz, angle, arc)
    if side == TO_B:
        _advance(k, node, ends, arc)
        for i in range(3):
            node[k, S_T + i] = -node[k, S_T + i]
        node[k, S_ARC] = arc
    return _land(k, ends, node, side == FROM_A, side == TO_B, high_a, high_b)


@jit
def _land(k, ends, node, from_a, to_b, high_a, high_b):
    """Polish a guess with the ends on the surface that lie beside it, then with the ends where they are."""
    _, _, _, _, ax, ay, az = moved_onto(k, node, ends, 3, from_a)
    _, _, _, _, bx, by, bz = moved_onto(k, node, ends, 6, to_b)
    node[k, lay.W_LAND] = 1.0 if to_b else 0.0
    flat = (ends[0], ends[1], ends[2], ax, ay, az, bx, by, bz)
    error, _, _ = newton(k, k + 1, flat, node, LOCAL_TOL, LOCAL_STEPS, UNKNOWN)
    node[k, lay.W_LAND] = 0.0
    if not (error <= LOCAL_TOL and node[k, S_ARC] > 0.0):
        return False, 0.0
    arc = node[k, S_ARC]
    bend_p, bend_q = node[k, lay.W_KP], node[k, lay.W_KQ]
    if from_a and bend_p > 0.0:
        _advance(k, node, ends, min(math.sqrt(2.0 * max(high_a, 0.0) / bend_p), arc))
    if to_b and bend_q > 0.0:
        node[k, S_ARC] = max(node[k, S_ARC] - math.sqrt(2.0 * max(high_b, 0.0) / bend_q), 0.0)
    return polish(k, ends, node, UNKNOWN)


@jit
def _advance(k, node, ends, way):
    """Move the start of obstacle k's geodesic on along it, its end staying [m]."""
    if not way > 0.0:
        return
    arc = node[k, S_ARC]
    node[k, S_ARC] = way
    geodesic(k, node, ends[0], ends[1], ends[2])
    x, y, z = (
        node[k, W_Q] - node[k, W_P],
        node[k, W_Q + 1] - node[k, W_P + 1],
        node[k, W_Q + 2] - node[k, W_P + 2],
    )
    x, y, z = turn_into_frame(node, k, x, y, z)
    node[k, S_P] += x
    node[k, S_P + 1] += y
    node[k, S_P + 2] += z
    x, y, z = turn_into_frame(node, k, node[k, W_TQ], node[k, W_TQ + 1], node[k, W_TQ + 2])
    node[k, S_T] = x
    node[k, S_T + 1] = y
    node[k, S_T + 2] = z
    node[k, S_ARC] = arc - way


@jit
def _gap(k, node, column, ends, end):
    """Return the distance from a contact to an end of the string [m]."""
    x, y, z = (
        node[k, column] - ends[end],
        node[k, column + 1] - ends[end + 1],
        node[k, column + 2] - ends[end + 2],
    )
    return math.sqrt(x * x + y * y + z * z)


@jit
def moved_onto(k, node, ends, column, moves):
    """Return an end of the string, moved onto the surface where it lies inside or `moves`.

    First its height above the surface before [m], then the point in S, then relative to the base.
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
def _aim(k, node, px, py, pz, angle, arc):
    """Start a geodesic at a surface point, in a direction by its angle about the normal there."""
    px, py, pz, nx, ny, nz = project(node, k, px, py, pz)
    ux, uy, uz = across(nx, ny, nz)
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
def _rise(k, node, ends, end):
    """Return how high the string's end lies above the tangent plane where obstacle k's geodesic ends now [m]."""
    geodesic(k, node, ends[0], ends[1], ends[2])
    return (
        node[k, W_NQ] * (ends[end] - node[k, W_Q])
        + node[k, W_NQ + 1] * (ends[end + 1] - node[k, W_Q + 1])
        + node[k, W_NQ + 2] * (ends[end + 2] - node[k, W_Q + 2])
    )


@jit
def _miss(k, node, px, py, pz, angle, ends, end):
    """Follow the geodesic that leaves a surface point at an angle to where the string's other end comes into sight.

    Returns whether it does, the arc length there [m], and by what angle it lies aside of the geodesic [rad].
    """
    _aim(k, node, px, py, pz, angle, 0.0)
    step = MARCH * node[k, SIZE]
    low = _rise(k, node, ends, end)
    if not low < 0.0:
        return False, 0.0, 0.0
    node[k, S_ARC] = step
    high = 0.0
    way = 0.0
    for _ in range(MARCHES):
        high = _rise(k, node, ends, end)
        if high >= 0.0:
            break
        low = high
        way += step
        _advance(k, node, ends, step)
        node[k, S_ARC] = step
    if high < 0.0:
        return False, 0.0, 0.0
    first, last = 0.0, step
    for _ in range(3):
        middle = (first * high - last * low) / (high - low)
        node[k, S_ARC] = middle
        at = _rise(k, node, ends, end)
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
def shoot(k, ends, node, side, ways):
    """Find the geodesics from A (side FROM_A) or B (TO_B), beside the surface, whose tangents lead to the other end.

    Writes angle and arc length of each to `ways` [rad, m], near enough for Newton's method; returns how many.
    """
    start, end = (3, 6) if side == FROM_A else (6, 3)
    _, px, py, pz, _, _, _ = moved_onto(k, node, ends, start, True)
    count = 0
    seen, before = False, 0.0
    for i in range(ROUND + 1):
        angle = i * (2.0 * math.pi / ROUND)
        sees, _, miss = _miss(k, node, px, py, pz, angle, ends, end)
        if sees and seen and miss * before <= 0.0 and abs(miss - before) < MOST_MISS and count < MOST_WAYS:
            first, last, low, high = angle - 2.0 * math.pi / ROUND, angle, before, miss
            for _ in range(REFINEMENTS):  # regula falsi, the Illinois way
                middle = first + (last - first) * low / (low - high) if low != high else first
                sees, arc, at = _miss(k, node, px, py, pz, middle, ends, end)
                if not sees or abs(at) < STRAIGHT:
                    break
                if at * high > 0.0:
                    last, high = middle, at
                    low *= 0.5
                else:
                    first, low = middle, at
                    high *= 0.5
            if sees and abs(at) < MOST_ASIDE:
                ways[2 * count] = middle
                ways[2 * count + 1] = arc
                count += 1
            sees = True
        seen, before = sees, miss
    return count
