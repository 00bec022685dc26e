"""Search for the sides on which a path passes its obstacles, at cold starts without hints.

A local search over sides. In every trial the obstacles are wrapped one after the other. If the trial is at most a
little longer than the present path, Newton's method makes it tangent, and it is kept if it is shorter then. A path that
leaves the range of a surface counts as longer than any that does not. "Sides and windings" in docs/derivation.md.
"""

from __future__ import annotations

import math

from numba.core import types

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import deferred, jit, no_inline
from mjwrap.kernels.geometry.traits import branched, closed_form, random_starts
from mjwrap.kernels.geometry.winding import TWO_PI
from mjwrap.kernels.spans.cold_start import ends_of_part, path_length, wrap_in_turn
from mjwrap.kernels.spans.lift_off_touchdown import (
    MERGE_DISTANCE,
    follow_branch,
    in_range,
    lift_off,
    merge_contacts,
    remove_contact,
    split_at_hollow,
    touchdown,
)
from mjwrap.kernels.spans.saved_solutions import restore_solutions, save_solutions
from mjwrap.kernels.spans.span_ends import explains_no_path
from mjwrap.kernels.tangency.certify import is_local_minimum
from mjwrap.kernels.tangency.newton import NOT_EVALUATED, newton

KIND, SIZE, HINT = lay.KIND, lay.SIZE, lay.HINT
S_MODE, S_SWEEP, S_ARC = lay.S_MODE, lay.S_SWEEP, lay.S_ARC
W_Q, W_OLD = lay.W_Q, lay.W_OLD
COLD, TOUCHED = lay.COLD, lay.TOUCHED
RANDOM_HINT = lay.RANDOM_HINT

# a winding angle below which a string is on the shorter side already [rad]
LEAST_FLIPPED_SWEEP = 0.5 * math.pi
MAX_FLIPS = 3  # largest number of neighbours that change sides together
FLIP_NEIGHBOURS = 4  # obstacles on each side of them that are wrapped again, too
MAX_SWEEPS = 4  # largest number of sweeps of side changes over the whole row
PENALTY = 1e3  # added to the length of a path that is out of range or not found [m]
# a trial that is longer than the present path by at most this share is made tangent before it is compared
TRIAL_MARGIN = 0.05
TRIAL_TOL = 1e-6  # tangency error to which a trial is solved
MAX_CHANGES = 6  # largest number of changes of the active set while a trial is made tangent
MAX_NEWTON = 15  # largest number of steps of Newton's method between two changes
GROUP = 5  # number of neighbours that get random hints at once
GROUP_STEP = 3  # number of obstacles from the start of one group to the start of the next
GROUP_NEIGHBOURS = 2  # obstacles on each side of a group that are wrapped again, too
PATTERNS = 12  # number of random patterns of hints where the row is a single group
PATTERNS_PER_GROUP = 8  # number of random patterns for each group of a longer row
EXTRA_PATTERNS = (
    4  # factor on these numbers while there is no path, or none in range, and no end inside a surface
)
UNTOUCHED_CHANCE = 0.25  # probability that a pattern leaves an obstacle untouched


@jit
def make_tangent(lo, hi, ends, node):
    """Make the path over lo..hi tangent, from its present contacts; return (whether it is certified, evaluations).

    As `active_set_method.solve_active_set`, but without restarts and to a larger tolerance: a failed trial is given up.
    """
    spent = 0
    for _ in range(MAX_CHANGES):
        error, _, e = newton(lo, hi, ends, node, TRIAL_TOL, MAX_NEWTON, NOT_EVALUATED)
        spent += e
        if not error <= TRIAL_TOL or not follow_branch(lo, hi, node):
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
    """Solve a trial over first..last; return (whether its path is shorter than `before` [m], evaluations)."""
    spent = wrap_in_turn(first, last, part, node, passes, False)
    # after wrapping in turn the path is still a little too long; much longer trials are given up
    if not path_length(first, last, part, node) < before * (1.0 + TRIAL_MARGIN):
        return False, spent
    good, e = make_tangent(first, last, part, node)
    return good and _penalised_length(first, last, part, node) < before * (1.0 - 1e-9), spent + e


@jit
def _can_change_side(k, node):
    """Return whether obstacle k may be passed on its other side.

    True where the side is topological, the wrap has a closed form, no hint chooses the side, and the other side could
    be better: the winding angle is large, or the contact is out of range.
    """
    if not (branched(k, node) and closed_form(k, node)) or node[k, HINT] > 0.0:
        return False
    if node[k, S_MODE] != TOUCHED:
        return False
    return abs(node[k, S_SWEEP]) >= LEAST_FLIPPED_SWEEP or not in_range(k, k + 1, (0.0,) * 9, node)


@jit
def _can_be_searched(k, node):
    """Return whether another wrap of obstacle k may be searched for: it is touched, and no hint chooses its side."""
    if closed_form(k, node) or node[k, HINT] > 0.0 or node[k, lay.TOUCH] > 0.0:
        return False
    return node[k, S_MODE] == TOUCHED


@jit
def _remove_further_contacts(k, node):
    """Remove the contacts of all rows but the first, k, of a surface."""
    k += 1
    while k < node.shape[0] and node[k, lay.TOUCH] > 0.0:
        remove_contact(k, node)
        k += 1


@jit
def _change_sides(first, last, node):
    """Change the sides of the obstacles first..last, or mark them to be searched for anew."""
    for j in range(first, last):
        if _can_change_side(j, node):
            # on the other side the winding angle differs by a whole turn
            node[j, S_SWEEP] -= math.copysign(TWO_PI, node[j, S_SWEEP])
        elif _can_be_searched(j, node):
            node[j, S_MODE] = COLD
            _remove_further_contacts(j, node)


@jit
def _whole_surfaces(lo, hi, first, last, node):
    """Return first and last, limited to lo..hi and moved so that no surface has rows on both sides of a limit."""
    first, last = max(lo, first), min(hi, last)
    while node[first, lay.TOUCH] > 0.0:
        first -= 1
    while last < hi and node[last, lay.TOUCH] > 0.0:
        last += 1
    return first, last


@deferred(types.int64)
def try_other_sides(lo, hi, ends, node, passes):
    """Try other sides for all obstacles without a hint, and keep shorter paths; return the number of evaluations.

    Sides that have a closed form are changed for up to MAX_FLIPS neighbours together; other obstacles are searched for
    anew, one at a time, between the present contacts of their neighbours. FLIP_NEIGHBOURS obstacles on both sides are
    solved with them. Ends when nothing gets shorter: a local search, at cold starts only.
    """
    spent = 0
    for _ in range(MAX_SWEEPS):
        changed = False
        for run in range(1, MAX_FLIPS + 1):
            for k in range(lo, hi - run + 1):
                # obstacles inside a run may keep their side, those at its ends may not
                whole = _can_change_side(k, node) and _can_change_side(k + run - 1, node)
                if not (whole or (run == 1 and _can_be_searched(k, node))):
                    continue
                first, last = _whole_surfaces(lo, hi, k - FLIP_NEIGHBOURS, k + run + FLIP_NEIGHBOURS, node)
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
    """Return a pseudo-random number in [0, 1), a fixed function of its arguments: equal poses give equal paths."""
    z = (pattern + 1) * 73856093 + (k + 1) * 19349663 + (of + 1) * 83492791
    for _ in range(2):
        z &= 0xFFFFFFFF
        z = ((z >> 16) ^ z) * 0x45D9F3B
    z &= 0xFFFFFFFF
    return ((z >> 16) ^ z) / 4294967296.0


@jit
def _draw_hint(k, node, pattern, place_in_row):
    """Start obstacle k cold with a random hint, or leave it untouched."""
    # contacts in further rows belong to the old path
    _remove_further_contacts(k, node)
    if _pseudo_random(pattern, place_in_row, 0) < UNTOUCHED_CHANCE:
        remove_contact(k, node)
        if closed_form(k, node):
            node[k, S_MODE] = COLD
        return
    node[k, S_MODE] = COLD
    node[k, S_ARC] = 0.0
    # a direction uniformly distributed on the sphere: z and the angle about it are uniform
    z = 2.0 * _pseudo_random(pattern, place_in_row, 1) - 1.0
    angle = TWO_PI * _pseudo_random(pattern, place_in_row, 2)
    radius = node[k, SIZE]
    flat = radius * math.sqrt(1.0 - z * z)
    node[k, HINT] = RANDOM_HINT
    node[k, HINT + 1] = flat * math.cos(angle)
    node[k, HINT + 2] = flat * math.sin(angle)
    node[k, HINT + 3] = radius * z


@jit
def _may_be_hinted(k, node):
    """Return whether obstacle k may get a random hint: it has no hint, and its class allows it."""
    return node[k, HINT] == 0.0 and node[k, lay.TOUCH] == 0.0 and random_starts(k, node)


@jit
def _next_surface(k, hi, node):
    """Return the row of the next surface after row k."""
    k += 1
    while k < hi and node[k, lay.TOUCH] > 0.0:
        k += 1
    return min(k, hi)


@no_inline
def try_random_hints(lo, hi, ends, node, sound):
    """Try random hints for a few neighbours at a time, and keep shorter paths; return the number of evaluations.

    The neighbours of the group are wrapped again, too. sound: the present path is certified.
    """
    spent = 0
    # an end inside a surface explains why there is no path
    if not sound and explains_no_path(lo, hi, ends, node):
        return spent
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
            first, last = _whole_surfaces(lo, hi, k - GROUP_NEIGHBOURS, end + GROUP_NEIGHBOURS, node)
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
            # only the first wrap uses the hints; afterwards the path keeps its sides without them
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
        for _ in range(GROUP_STEP):
            k = _next_surface(k, hi, node)
    if changed:
        spent += try_other_sides(lo, hi, ends, node, 1)
    return spent


@deferred(types.int64)
def search_sides(lo, hi, ends, node, passes):
    """Find the sides of a row without hints; return the number of evaluations.

    There are three starts: wraps between the span's ends, wraps along the obstacles' centres, and the other sides of
    the shorter of these two. The best result is made tangent, then random hints are tried.
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
    good, e = make_tangent(lo, hi, ends, node)
    if not good:
        restore_solutions(lo, hi, ends, node, lay.W_BEST)
    return spent + e + try_random_hints(lo, hi, ends, node, good)
