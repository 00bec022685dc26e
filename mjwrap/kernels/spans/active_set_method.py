"""Active-set method for one span: the path between two fixed points over a row of obstacles, found and certified.

The obstacles that the path touches are unknown at first; they are the active set ("Touching or not" in
docs/derivation.md). The method has the parts init, rounds and terminate. A round has four phases:

1. Newton's method makes the path over the touched obstacles tangent (`_find_tangent_path`);
2. the certificate says whether it is a local minimum of length (`certify.is_local_minimum`);
3. lift-off and touchdown change which obstacles are touched (`_update_active_set`, `_split_or_merge_contacts`);
4. where neither helps, a restart gives another starting point (`restarts.restart`).

The method ends when a certified path needs no change, or when no restart is left.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import inlined, jit, no_inline
from mjwrap.kernels.geometry.traits import closed_form, one_sided
from mjwrap.kernels.spans.cold_start import path_length, wrap_in_turn
from mjwrap.kernels.spans.lift_off_touchdown import (
    MERGE_DISTANCE,
    MERGE_DISTANCE_ON_FAILURE,
    follow_branch,
    in_range,
    lift_off,
    merge_contacts,
    split_at_hollow,
    touchdown,
)
from mjwrap.kernels.spans.restarts import out_of_restarts, restart
from mjwrap.kernels.spans.saved_solutions import any_in_mode, save_solutions
from mjwrap.kernels.spans.side_search import search_sides, try_other_sides
from mjwrap.kernels.spans.span_ends import (
    an_end_is_inside,
    ends_in_short_segment,
    explains_no_path,
    has_no_path,
)
from mjwrap.kernels.tangency.certify import is_local_minimum
from mjwrap.kernels.tangency.newton import GEODESICS_EVALUATED, NOT_EVALUATED, newton

HINT, S_MODE, W_OLD, W_WRAP_ERROR = lay.HINT, lay.S_MODE, lay.W_OLD, lay.W_WRAP_ERROR
COLD, TOUCHED = lay.COLD, lay.TOUCHED

MAX_NEWTON = 25  # steps of Newton's method in a round
MAX_ROUNDS = 50  # changes of the set of touched obstacles, restarts included
COLD_PASSES = 3  # passes of wrapping obstacle by obstacle before Newton's method is tried
EXTRA_CHANGES = 4  # changes of the active set, beyond one for each obstacle, after which it counts as cycling


@no_inline
def solve_active_set(lo, hi, ends, node, tol, direct):
    """Find the path from the saved solution alone; as `solve_span`, but for ends outside of every surface only."""
    # nothing is searched for where no path can be
    if any_in_mode(lo, hi, node, COLD) and has_no_path(lo, hi, ends, node):
        node[lo, lay.W_RESTARTS] = 0.0
        return lay.ENDPOINT_INSIDE, path_length(lo, hi, ends, node), 0.0, 0, 0
    cold, known, evaluations = _init(lo, hi, ends, node, direct)
    iterations, restarts, changes = 0, 0, 0
    error = 0.0
    status = lay.CONVERGED
    final = False
    for _ in range(MAX_ROUNDS):
        tangent, error, known, i, e = _find_tangent_path(lo, hi, ends, node, tol, known)
        iterations += i
        evaluations += e
        if tangent and is_local_minimum(lo, hi, node):
            changed, status = _update_active_set(lo, hi, ends, node)
            if changed == 0:
                final = True
                break
        else:
            changed = _split_or_merge_contacts(lo, hi, ends, node, tangent)
        if changed > 0:
            changes += 1
            # without this bound an obstacle could be touched and lifted off again without end
            if changes <= hi - lo + EXTRA_CHANGES:
                continue
        saddle = tangent and changes == 0
        # an end inside a surface explains why there is no path: restarts seldom find one then
        if out_of_restarts(lo, hi, restarts) or explains_no_path(lo, hi, ends, node):
            status = lay.NOT_MINIMAL if saddle else lay.NOT_CONVERGED
            break
        evaluations += restart(lo, hi, ends, node, restarts, saddle, cold)
        restarts += 1
        changes = 0
    status = _terminate(lo, hi, ends, node, final, status)
    _store(lo, hi, node, final, restarts)
    if not math.isfinite(error):
        status = lay.NOT_CONVERGED
    return status, path_length(lo, hi, ends, node), error, iterations, evaluations


# The phases below have one caller; not inlined, they would cost 4 % of the warm solve of a lone obstacle.
# --------------------------------------------------------------------------------------------- init


@inlined
def _init(lo, hi, ends, node, direct):
    """Prepare the start; return (whether it is a cold start, `square` for `newton`, evaluations).

    A warm start is left as it is, except that with `direct` a lone obstacle is wrapped anew on its saved branch. W_OLD
    then holds the start, to which restarts return.
    """
    lone = hi - lo == 1
    evaluations = 0
    cold = any_in_mode(lo, hi, node, COLD)
    if not cold:
        save_solutions(lo, hi, node, W_OLD)
    if cold and not lone and not _all_hinted(lo, hi, node):
        evaluations += search_sides(lo, hi, ends, node, COLD_PASSES)
    elif cold or (direct and lone):
        evaluations += wrap_in_turn(lo, hi, ends, node, _cold_start_passes(lo, hi, node), False)
        if cold and lone and closed_form(lo, node) and node[lo, HINT] <= 0.0:
            evaluations += try_other_sides(lo, hi, ends, node, 1)
    if cold:
        save_solutions(lo, hi, node, W_OLD)
    known = GEODESICS_EVALUATED if cold or (direct and lone) else NOT_EVALUATED
    # a wrap that was searched for ends with Newton's method, so that the path is evaluated already
    if cold and lone and node[lo, W_WRAP_ERROR] >= 0.0 and not closed_form(lo, node):
        known = node[lo, W_WRAP_ERROR]
    return cold, known, evaluations


@jit
def _cold_start_passes(lo, hi, node):
    """Return how many times a cold start wraps all obstacles in turn: one pass less where a wrap is a search.

    From there Newton's method takes as many steps as after one pass more, and the pass costs more than a step.
    """
    if hi - lo == 1:
        return 1
    for k in range(lo, hi):
        if not closed_form(k, node):
            return COLD_PASSES - 1
    return COLD_PASSES


@jit
def _all_hinted(lo, hi, node):
    """Return whether the side of every obstacle is given, by a hint or because there is only one."""
    for k in range(lo, hi):
        if node[k, HINT] <= 0.0 and node[k, lay.TOUCH] == 0.0 and not one_sided(k, node):
            return False
    return True


# --------------------------------------------------------------------------------- phases of a round


@inlined
def _find_tangent_path(lo, hi, ends, node, tol, known):
    """Run Newton's method; return (whether the path is tangent, ||f||, known, iterations, evaluations).

    Tangent means ||f|| <= tol, on the branch on which the path was before. known: `square` of `newton` for this run,
    and for the next one: whatever changes contacts evaluates their geodesics.
    """
    if not any_in_mode(lo, hi, node, TOUCHED):
        return True, 0.0, known, 0, 0
    error, iterations, evaluations = newton(lo, hi, ends, node, tol, MAX_NEWTON, known)
    tangent = error <= tol and follow_branch(lo, hi, node)
    return tangent, error, GEODESICS_EVALUATED, iterations, evaluations


@inlined
def _update_active_set(lo, hi, ends, node):
    """Update the contacts of a certified path; return how many changed, and a status.

    Lift-off of obstacles whose arc is negative, merging of contacts that have met, and touchdown of obstacles that a
    straight segment enters. The status is CONVERGED unless some obstacle makes a path impossible.
    """
    removed = lift_off(lo, hi, node) + merge_contacts(lo, hi, ends, node, MERGE_DISTANCE)
    added, status = touchdown(lo, hi, ends, node)
    return removed + added, status


@jit
def _split_or_merge_contacts(lo, hi, ends, node, tangent):
    """Split or merge contacts of a path that is not a minimum; return how many.

    A tangent path may run through a hollow, which a string would bridge. Where Newton's method has failed, the segment
    that bridges a hollow may be about to vanish.
    """
    if tangent:
        return split_at_hollow(lo, hi, ends, node)
    return merge_contacts(lo, hi, ends, node, MERGE_DISTANCE_ON_FAILURE)


# ---------------------------------------------------------------------------------------- terminate


@inlined
def _terminate(lo, hi, ends, node, final, status):
    """Return the status of the last iterate; final: it is certified and needs no change."""
    if not final:
        if an_end_is_inside(lo, hi, ends, node):
            return lay.ENDPOINT_INSIDE
        if status == lay.NOT_MINIMAL:
            return status
        # a surface that cannot be wrapped is a more precise reason than NOT_CONVERGED
        _, status = touchdown(lo, hi, ends, node)
        return lay.NOT_CONVERGED if status == lay.CONVERGED else status
    # an end inside a surface is rare and costly to find: it is tested only where the path gives a sign of it
    suspect = status == lay.PENETRATING or (status == lay.CONVERGED and ends_in_short_segment(lo, hi, node))
    if suspect and an_end_is_inside(lo, hi, ends, node):
        return lay.ENDPOINT_INSIDE
    if status == lay.CONVERGED and not in_range(lo, hi, ends, node):
        return lay.OUT_OF_RANGE
    return status


@inlined
def _store(lo, hi, node, final, restarts):
    """Write to the rows what the next solve needs; hints that a restart has ignored are valid again."""
    node[lo, lay.W_RESTARTS] = restarts
    for k in range(lo, hi):
        node[k, HINT] = abs(node[k, HINT])
        if final and node[k, S_MODE] == TOUCHED:
            node[k, lay.S_BEFORE] = node[k, lay.W_L]
            node[k, lay.S_BEFORE + 1] = node[k, lay.W_LQ]
