"""Which side: other ways round the surfaces of a row where no hint chooses them, at cold starts.

A local search: another way is relaxed, where it comes near the present one it is pulled tight by Newton's method, and
it is kept if it is shorter then. Ways that leave the surfaces' ranges cost more than any that does not.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import jit
from mjwrap.kernels.geometry.geodesics import geodesic
from mjwrap.kernels.geometry.traits import branched, closed_form, drawn_hints
from mjwrap.kernels.geometry.winding import TWO_PI
from mjwrap.kernels.spans.active_set import (
    MET,
    drop,
    follow_branch,
    in_range,
    join,
    release,
    split,
    take_in,
)
from mjwrap.kernels.spans.cold_start import between, keep, path_length, relax
from mjwrap.kernels.tangency.certify import minimal
from mjwrap.kernels.tangency.newton import UNKNOWN, newton

KIND, SIZE, HINT = lay.KIND, lay.SIZE, lay.HINT
S_MODE, S_SWEEP, S_ARC = lay.S_MODE, lay.S_SWEEP, lay.S_ARC
W_Q, W_OLD = lay.W_Q, lay.W_OLD
COLD, TOUCHED = lay.COLD, lay.TOUCHED

LEAST_SWEEP = 0.5 * math.pi  # a string that sweeps less passes on its shorter side [rad]
MOST_FLIPS = 3
WINDOW = 4  # obstacles on both sides of those that change sides which follow
SWEEPS = 4
AVOIDED = 1e3  # is added to the length of a path that is none [m]
CLOSE = 0.05  # another way that is longer by less, relatively, is pulled tight before it is given up
TIGHT = 1e-6  # tangency error at which its length is known
ROUNDS = 6  # changes of the set of touched obstacles on the way
STEPS = 15  # of Newton's method
TOGETHER = 5  # obstacles over which the string is thrown at once
ONWARD = 3  # obstacles from one such group to the next
BESIDE = 2  # obstacles on both sides that follow
PATTERNS = 12  # of hints, where these are all
FEWER = 8  # for each group of a longer row
MORE = 4  # times as many while there is no path, or none in range
DRAWN = 2.0  # flag of such a hint
PASSED_BY = 0.25  # chance that an obstacle is passed by


@jit
def settle(lo, hi, ends, node):
    """Pull the path over lo..hi tight, from what it touches now; return whether it is one, and the evaluations."""
    spent = 0
    for _ in range(ROUNDS):
        error, _, e = newton(lo, hi, ends, node, TIGHT, STEPS, UNKNOWN)
        spent += e
        if not error <= TIGHT or not follow_branch(lo, hi, node):
            return False, spent
        if not minimal(lo, hi, node):
            if split(lo, hi, ends, node) == 0:
                return False, spent
            continue
        dropped = drop(lo, hi, node) + join(lo, hi, ends, node, MET)
        added, status = take_in(lo, hi, ends, node)
        if dropped + added == 0:
            return status == lay.CONVERGED, spent
    return False, spent


@jit
def _cost(first, last, part, node):
    """Return the length of the path over first..last, and what keeps it off contacts where a surface has ended [m]."""
    length = path_length(first, last, part, node)
    return length if in_range(first, last, part, node) else length + AVOIDED


@jit
def _shorter(first, last, part, node, before, passes):
    """Relax another way over first..last, pull it tight if it comes near; return if it is shorter, and evaluations."""
    spent = relax(first, last, part, node, passes, False)
    if not path_length(first, last, part, node) < before * (1.0 + CLOSE):
        return False, spent
    good, e = settle(first, last, part, node)
    return good and _cost(first, last, part, node) < before * (1.0 - 1e-9), spent + e


@jit
def _take_back(first, last, ends, node, column):
    """Restore the saved solutions of first..last from the columns `column`."""
    keep(first, last, node, column, True)
    for j in range(first, last):
        if node[j, S_MODE] == TOUCHED:
            geodesic(j, node, ends[0], ends[1], ends[2])


@jit
def _flips(k, node):
    """Return whether obstacle k may be passed on its other side: a topological one, known in closed form, that no hint
    chooses, and that is swept by so much that the other way can be shorter, or touched beyond its end."""
    if not (branched(k, node) and closed_form(k, node)) or node[k, HINT] > 0.0:
        return False
    if node[k, S_MODE] != TOUCHED:
        return False
    return abs(node[k, S_SWEEP]) >= LEAST_SWEEP or not in_range(k, k + 1, (0.0,) * 9, node)


@jit
def _searchable(k, node):
    """Return whether another wrap of obstacle k can be looked for: it is touched, and no hint chooses its side."""
    if closed_form(k, node) or node[k, HINT] > 0.0 or node[k, lay.TOUCH] > 0.0:
        return False
    return node[k, S_MODE] == TOUCHED


@jit
def _release_further(k, node):
    """Let go of the further touches of the surface whose first row is k."""
    k += 1
    while k < node.shape[0] and node[k, lay.TOUCH] > 0.0:
        release(k, node)
        k += 1


@jit
def _other_way(first, last, node):
    """Change the sides of the obstacles first..last, or have them searched for anew."""
    for j in range(first, last):
        if _flips(j, node):
            node[j, S_SWEEP] -= math.copysign(TWO_PI, node[j, S_SWEEP])
        elif _searchable(j, node):
            node[j, S_MODE] = COLD
            _release_further(j, node)


@jit
def _whole(lo, hi, first, last, node):
    """Return the rows first..last within lo..hi, and those that belong to the same surfaces."""
    first, last = max(lo, first), min(hi, last)
    while node[first, lay.TOUCH] > 0.0:
        first -= 1
    while last < hi and node[last, lay.TOUCH] > 0.0:
        last += 1
    return first, last


@jit
def shorten(lo, hi, ends, node, passes):
    """Try other sides for all obstacles without a hint; keep what is shorter.

    Sides known in closed form change in runs of up to MOST_FLIPS neighbours together; others are searched for anew,
    one at a time, between the contacts that their neighbours have now. The path WINDOW obstacles to both sides is free
    to follow. Until nothing gets shorter: a local search, at cold starts only. Returns the evaluations spent.
    """
    spent = 0
    for _ in range(SWEEPS):
        changed = False
        for run in range(1, MOST_FLIPS + 1):
            for k in range(lo, hi - run + 1):
                whole = _flips(k, node) and _flips(k + run - 1, node)
                if not (whole or (run == 1 and _searchable(k, node))):
                    continue
                first, last = _whole(lo, hi, k - WINDOW, k + run + WINDOW, node)
                part = between(lo, hi, first, last, ends, node)
                before = _cost(first, last, part, node)
                keep(first, last, node, W_OLD, False)
                _other_way(k, k + run, node)
                shorter, e = _shorter(first, last, part, node, before, passes)
                spent += e
                if shorter:
                    changed = True
                else:
                    _take_back(first, last, ends, node, W_OLD)
        if not changed or hi - lo == 1:
            break
        spent += relax(lo, hi, ends, node, passes, False)
    return spent


@jit
def _chance(pattern, k, of):
    """Return a number in [0, 1) that looks random and is the same every time."""
    z = (pattern + 1) * 73856093 + (k + 1) * 19349663 + (of + 1) * 83492791
    for _ in range(2):
        z &= 0xFFFFFFFF
        z = ((z >> 16) ^ z) * 0x45D9F3B
    z &= 0xFFFFFFFF
    return ((z >> 16) ^ z) / 4294967296.0


@jit
def _draw_hint(k, node, pattern, place_in_row):
    """Start obstacle k from nothing with a hint drawn by chance, or leave it untouched."""
    _release_further(k, node)
    if _chance(pattern, place_in_row, 0) < PASSED_BY:
        release(k, node)
        if closed_form(k, node):
            node[k, S_MODE] = COLD
        return
    node[k, S_MODE] = COLD
    node[k, S_ARC] = 0.0
    z = 2.0 * _chance(pattern, place_in_row, 1) - 1.0
    angle = TWO_PI * _chance(pattern, place_in_row, 2)
    reach = node[k, SIZE]
    flat = reach * math.sqrt(1.0 - z * z)
    node[k, HINT] = DRAWN
    node[k, HINT + 1] = flat * math.cos(angle)
    node[k, HINT + 2] = flat * math.sin(angle)
    node[k, HINT + 3] = reach * z


@jit
def _throwable(k, node):
    """Return whether a string may be thrown over obstacle k: no hint chooses its side."""
    return node[k, HINT] == 0.0 and node[k, lay.TOUCH] == 0.0 and drawn_hints(k, node)


@jit
def _past(k, hi, node):
    """Return the row of the next surface after row k."""
    k += 1
    while k < hi and node[k, lay.TOUCH] > 0.0:
        k += 1
    return min(k, hi)


@jit
def throw_over(lo, hi, ends, node, sound):
    """Throw the string over a few neighbours at a time, along hints drawn by chance; keep what is shorter.

    What lies beside them follows. sound: the present one is a path. Returns the evaluations spent.
    """
    spent = 0
    changed = False
    first_group = True
    k, end = lo, lo
    while end < hi:
        end = k
        for _ in range(TOGETHER):
            end = _past(end, hi, node)
        most = PATTERNS if first_group and end == hi else FEWER
        for pattern in range(MORE * most):
            first, last = _whole(lo, hi, k - BESIDE, end + BESIDE, node)
            part = between(lo, hi, first, last, ends, node)
            before = _cost(first, last, part, node)
            if not sound and first == lo and last == hi:
                before += AVOIDED
            if pattern >= most and before < AVOIDED:
                break
            keep(first, last, node, W_OLD, False)
            thrown = False
            for j in range(k, end):
                if _throwable(j, node) and (pattern % 2 == 0 or _chance(pattern, j - k, 3) < 0.5):
                    _draw_hint(j, node, pattern, j - k)
                    thrown = True
            if not thrown:
                continue
            spent += relax(first, last, part, node, 1, False)
            for j in range(k, end):
                if node[j, HINT] == DRAWN:
                    node[j, HINT] = 0.0
            shorter, e = _shorter(first, last, part, node, before, 1)
            spent += e
            if shorter:
                changed = True
                sound = True
            else:
                _take_back(first, last, ends, node, W_OLD)
        first_group = False
        for _ in range(ONWARD):
            k = _past(k, hi, node)
    if changed:
        spent += shorten(lo, hi, ends, node, 1)
    return spent


@jit
def search_rows(lo, hi, ends, node, passes):
    """Start a row without hints in three ways, shorten each, throw the shortest over; return the evaluations spent.

    Between the ends, along the centres, and with the other side of everything that the first two have found.
    """
    spent = 0
    best = math.inf
    for start in range(3):
        if start == 1:
            for k in range(lo, hi):
                node[k, S_MODE] = COLD
        elif start == 2:
            _other_way(lo, hi, node)
        spent += relax(lo, hi, ends, node, passes, start == 1)
        spent += shorten(lo, hi, ends, node, passes)
        total = _cost(lo, hi, ends, node)
        if total < best * (1.0 - 1e-9):
            best = total
            keep(lo, hi, node, lay.W_BEST, False)
        else:
            _take_back(lo, hi, ends, node, lay.W_BEST)
    keep(lo, hi, node, lay.W_BEST, False)
    good, e = settle(lo, hi, ends, node)
    if not good:
        _take_back(lo, hi, ends, node, lay.W_BEST)
    return spent + e + throw_over(lo, hi, ends, node, good)
