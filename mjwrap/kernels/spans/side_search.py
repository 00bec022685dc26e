"""Search for the sides on which a path passes its obstacles: cold starts without hints.

A local search over sides. Every trial is wrapped obstacle after obstacle; where it comes near the present path it is
pulled tight by Newton's method, and it is kept if it is shorter then. Paths that leave the surfaces' ranges cost more
than any that does not. "Sides and windings" in docs/derivation.md.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels._jit import apart, deferred, jit
from mjwrap.kernels.geometry.traits import branched, closed_form, drawn_hints
from mjwrap.kernels.geometry.winding import TWO_PI
from mjwrap.kernels.spans.active_set import (
    MERGE_DISTANCE,
    follow_branch,
    in_range,
    lift_off,
    merge_contacts,
    remove_contact,
    split_at_hollow,
    touchdown,
)
from mjwrap.kernels.spans.cold_start import ends_of_part, path_length, wrap_in_turn
from mjwrap.kernels.spans.saved_solutions import restore_solutions, save_solutions
from mjwrap.kernels.tangency.certify import is_local_minimum
from mjwrap.kernels.tangency.newton import NOT_EVALUATED, newton

KIND, SIZE, HINT = lay.KIND, lay.SIZE, lay.HINT
S_MODE, S_SWEEP, S_ARC = lay.S_MODE, lay.S_SWEEP, lay.S_ARC
W_Q, W_OLD = lay.W_Q, lay.W_OLD
COLD, TOUCHED = lay.COLD, lay.TOUCHED

LEAST_SWEEP = 0.5 * math.pi  # a string that sweeps less passes on its shorter side [rad]
MOST_FLIPS = 3  # neighbours that change sides together
WINDOW = 4  # obstacles to both sides of those that change sides that are free to follow
MOST_SWEEPS = 4  # over the whole row
PENALTY = 1e3  # is added to the length of a path that is out of range or not found [m]
PROMISING = 0.05  # another way that is longer by less, relatively, is pulled tight before it is given up
PULL_TOL = 1e-6  # tangency error at which its length is known
MAX_CHANGES = 6  # of the set of touched obstacles while a path is pulled tight
MAX_NEWTON = 15  # steps of Newton's method between two changes
GROUP = 5  # neighbours that get random hints at once
GROUP_STRIDE = 3  # obstacles from one such group to the next
NEIGHBOURS = 2  # obstacles to both sides of a group that are free to follow
PATTERNS = 12  # of hints that are tried where the row is one group
PATTERNS_PER_GROUP = 8  # for each group of a longer row
EXTRA_PATTERNS = 4  # times as many while there is no path, or none in range
RANDOM_HINT = 2.0  # flag of a random hint, so that it can be taken back
UNTOUCHED_CHANCE = 0.25  # that a pattern leaves an obstacle untouched


@jit
def pull_tight(lo, hi, ends, node):
    """Make the path over lo..hi tangent, from what it touches now; return whether it is certified, and the evaluations.

    What `span.solve_active_set` does, without its repairs and to a lower tolerance: a trial that fails is given up.
    """
    spent = 0
    for _ in range(MAX_CHANGES):
        error, _, e = newton(lo, hi, ends, node, PULL_TOL, MAX_NEWTON, NOT_EVALUATED)
        spent += e
        if not error <= PULL_TOL or not follow_branch(lo, hi, node):
            return False, spent
        if not is_local_minimum(lo, hi, node):
            if split_at_hollow(lo, hi, ends, node) == 0:
                return False, spent
            continue
        dropped = lift_off(lo, hi, node) + merge_contacts(lo, hi, ends, node, MERGE_DISTANCE)
        added, status = touchdown(lo, hi, ends, node)
        if dropped + added == 0:
            return status == lay.CONVERGED, spent
    return False, spent


@jit
def _penalised_length(first, last, part, node):
    """Return the length of the path over first..last, with a penalty where a contact is out of range [m]."""
    length = path_length(first, last, part, node)
    return length if in_range(first, last, part, node) else length + PENALTY


@jit
def _try_part(first, last, part, node, before, passes):
    """Try a start over first..last: return whether its path is shorter than `before` [m], and the evaluations spent."""
    spent = wrap_in_turn(first, last, part, node, passes, False)
    # wraps in turn leave it a little too long; only what is nearly as short is worth Newton's method
    if not path_length(first, last, part, node) < before * (1.0 + PROMISING):
        return False, spent
    good, e = pull_tight(first, last, part, node)
    return good and _penalised_length(first, last, part, node) < before * (1.0 - 1e-9), spent + e


@jit
def _can_change_side(k, node):
    """Return whether obstacle k may be passed on its other side.

    A topological side, known in closed form, that no hint chooses, on an obstacle that is swept by so much that the
    other way can be shorter, or touched beyond its end.
    """
    if not (branched(k, node) and closed_form(k, node)) or node[k, HINT] > 0.0:
        return False
    if node[k, S_MODE] != TOUCHED:
        return False
    return abs(node[k, S_SWEEP]) >= LEAST_SWEEP or not in_range(k, k + 1, (0.0,) * 9, node)


@jit
def _can_be_searched(k, node):
    """Return whether another wrap of obstacle k can be looked for: it is touched, and no hint chooses its side."""
    if closed_form(k, node) or node[k, HINT] > 0.0 or node[k, lay.TOUCH] > 0.0:
        return False
    return node[k, S_MODE] == TOUCHED


@jit
def _remove_further_contacts(k, node):
    """Remove the further contacts of the surface whose first row is k."""
    k += 1
    while k < node.shape[0] and node[k, lay.TOUCH] > 0.0:
        remove_contact(k, node)
        k += 1


@jit
def _change_sides(first, last, node):
    """Change the sides of the obstacles first..last, or have them searched for anew."""
    for j in range(first, last):
        if _can_change_side(j, node):
            # the other way round is a whole turn less, or more
            node[j, S_SWEEP] -= math.copysign(TWO_PI, node[j, S_SWEEP])
        elif _can_be_searched(j, node):
            node[j, S_MODE] = COLD
            _remove_further_contacts(j, node)


@jit
def _whole_surfaces(lo, hi, first, last, node):
    """Return first and last, kept within lo..hi and moved so that all rows of a surface are in or out."""
    first, last = max(lo, first), min(hi, last)
    while node[first, lay.TOUCH] > 0.0:
        first -= 1
    while last < hi and node[last, lay.TOUCH] > 0.0:
        last += 1
    return first, last


@deferred(types.int64)
def try_other_sides(lo, hi, ends, node, passes):
    """Try other sides for all obstacles without a hint, and keep what is shorter; return the evaluations spent.

    Sides known in closed form change in runs of up to MOST_FLIPS neighbours together; others are searched for anew,
    one at a time, between the contacts that their neighbours have now. The path WINDOW obstacles to both sides is free
    to follow. Ends when nothing gets shorter: a local search, at cold starts only.
    """
    spent = 0
    for _ in range(MOST_SWEEPS):
        changed = False
        for run in range(1, MOST_FLIPS + 1):
            for k in range(lo, hi - run + 1):
                # a run may hold obstacles that stay as they are, but not at its ends
                whole = _can_change_side(k, node) and _can_change_side(k + run - 1, node)
                if not (whole or (run == 1 and _can_be_searched(k, node))):
                    continue
                first, last = _whole_surfaces(lo, hi, k - WINDOW, k + run + WINDOW, node)
                part = ends_of_part(lo, hi, first, last, ends, node)
                before = _penalised_length(first, last, part, node)
                save_solutions(first, last, node, W_OLD)
                _change_sides(k, k + run, node)
                shorter, e = _try_part(first, last, part, node, before, passes)
                spent += e
                if shorter:
                    changed = True
                else:
                    restore_solutions(first, last, ends, node, W_OLD)
        if not changed or hi - lo == 1:
            break
        spent += wrap_in_turn(lo, hi, ends, node, passes, False)
    return spent


@jit
def _pseudo_random(pattern, k, of):
    """Return a number in [0, 1) that looks random and is the same every time: paths are functions of the pose."""
    z = (pattern + 1) * 73856093 + (k + 1) * 19349663 + (of + 1) * 83492791
    for _ in range(2):
        z &= 0xFFFFFFFF
        z = ((z >> 16) ^ z) * 0x45D9F3B
    z &= 0xFFFFFFFF
    return ((z >> 16) ^ z) / 4294967296.0


@jit
def _draw_hint(k, node, pattern, place_in_row):
    """Start obstacle k cold with a random hint, or leave it untouched."""
    # further contacts, behind hollows that are bridged, belong to the old path
    _remove_further_contacts(k, node)
    if _pseudo_random(pattern, place_in_row, 0) < UNTOUCHED_CHANCE:
        remove_contact(k, node)
        if closed_form(k, node):
            node[k, S_MODE] = COLD
        return
    node[k, S_MODE] = COLD
    node[k, S_ARC] = 0.0
    # a direction evenly distributed on the sphere: z and the angle about it are
    z = 2.0 * _pseudo_random(pattern, place_in_row, 1) - 1.0
    angle = TWO_PI * _pseudo_random(pattern, place_in_row, 2)
    reach = node[k, SIZE]
    flat = reach * math.sqrt(1.0 - z * z)
    node[k, HINT] = RANDOM_HINT
    node[k, HINT + 1] = flat * math.cos(angle)
    node[k, HINT + 2] = flat * math.sin(angle)
    node[k, HINT + 3] = reach * z


@jit
def _may_be_hinted(k, node):
    """Return whether obstacle k may get a random hint: it has none of its own."""
    return node[k, HINT] == 0.0 and node[k, lay.TOUCH] == 0.0 and drawn_hints(k, node)


@jit
def _next_surface(k, hi, node):
    """Return the row of the next surface after row k."""
    k += 1
    while k < hi and node[k, lay.TOUCH] > 0.0:
        k += 1
    return min(k, hi)


@apart
def try_random_hints(lo, hi, ends, node, sound):
    """Try random hints for a few neighbours at a time, and keep what is shorter; return the evaluations spent.

    Their neighbours follow. sound: the present path is certified.
    """
    spent = 0
    changed = False
    first_group = True
    k, end = lo, lo
    while end < hi:
        end = k
        for _ in range(GROUP):
            end = _next_surface(end, hi, node)
        # more patterns as long as there is no path, or none in range
        most = PATTERNS if first_group and end == hi else PATTERNS_PER_GROUP
        for pattern in range(EXTRA_PATTERNS * most):
            first, last = _whole_surfaces(lo, hi, k - NEIGHBOURS, end + NEIGHBOURS, node)
            part = ends_of_part(lo, hi, first, last, ends, node)
            before = _penalised_length(first, last, part, node)
            if not sound and first == lo and last == hi:
                before += PENALTY
            if pattern >= most and before < PENALTY:
                break
            save_solutions(first, last, node, W_OLD)
            # all of the group in every other pattern, about half of it in the others
            hinted = False
            for j in range(k, end):
                if _may_be_hinted(j, node) and (pattern % 2 == 0 or _pseudo_random(pattern, j - k, 3) < 0.5):
                    _draw_hint(j, node, pattern, j - k)
                    hinted = True
            if not hinted:
                continue
            # the first wrap uses the hints; from there on the path keeps its sides without them
            spent += wrap_in_turn(first, last, part, node, 1, False)
            for j in range(k, end):
                if node[j, HINT] == RANDOM_HINT:
                    node[j, HINT] = 0.0
            shorter, e = _try_part(first, last, part, node, before, 1)
            spent += e
            if shorter:
                changed = True
                sound = True
            else:
                restore_solutions(first, last, ends, node, W_OLD)
        first_group = False
        for _ in range(GROUP_STRIDE):
            k = _next_surface(k, hi, node)
    if changed:
        spent += try_other_sides(lo, hi, ends, node, 1)
    return spent


@deferred(types.int64)
def search_sides(lo, hi, ends, node, passes):
    """Find the sides of a row without hints; return the evaluations spent.

    Three starts are shortened: wraps between the span's ends, wraps along the obstacles' centres, and the other side of
    everything that the shorter of these has. The shortest is pulled tight, then random hints are tried.
    """
    spent = 0
    best = math.inf
    for start in range(3):
        if start == 1:
            for k in range(lo, hi):
                node[k, S_MODE] = COLD
        elif start == 2:
            _change_sides(lo, hi, node)
        spent += wrap_in_turn(lo, hi, ends, node, passes, start == 1)
        spent += try_other_sides(lo, hi, ends, node, passes)
        total = _penalised_length(lo, hi, ends, node)
        if total < best * (1.0 - 1e-9):
            best = total
            save_solutions(lo, hi, node, lay.W_BEST)
        else:
            restore_solutions(lo, hi, ends, node, lay.W_BEST)
    save_solutions(lo, hi, node, lay.W_BEST)
    good, e = pull_tight(lo, hi, ends, node)
    if not good:
        restore_solutions(lo, hi, ends, node, lay.W_BEST)
    return spent + e + try_random_hints(lo, hi, ends, node, good)
