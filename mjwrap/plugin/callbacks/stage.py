"""Evaluate an instance's muscles inside MuJoCo, and complete a step.

`stage` and `finish` are compiled only in `hooks.py`, as C functions: compiled here too, they would optimise all kernels
a second time.
"""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels.coupling.evaluation import evaluate, evaluate_with_points
from mjwrap.kernels.coupling.path_points import place_sites, write_point_forces
from mjwrap.kernels.coupling.wrenches import add_to_xfrc, body_wrenches, remove_from_xfrc
from mjwrap.kernels.musculotendon.dynamics import write_states
from mjwrap.kernels.musculotendon.groups import Timing
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks._cache import jit
from mjwrap.plugin.callbacks.groups import (
    inputs_of,
    muscles_of,
    paths_of,
    poses_of,
    routes_of,
    start_of,
    states_of,
)
from mjwrap.plugin.callbacks.memory import bool_array, float64_array, read_float64, read_int32, read_int64
from mjwrap.plugin.callbacks.path_points import GIVEN, add_joint_forces, frames_of, points_of
from mjwrap.plugin.callbacks.pieces import update_pieces
from mjwrap.plugin.callbacks.publishing import COUNT, publish_lengths
from mjwrap.plugin.callbacks.saving import floats, ints, load, load_held, save, sizes, state_of
from mjwrap.plugin.callbacks.sync import sync_with_model
from mjwrap.plugin.callbacks.transmission import transmit

TOLERANCE = 1e-10  # largest tangency error of a path, as in MuscleSystem
GROUPS = 31  # actuator groups that options can switch off


@jit
def _forces(block, data):
    """Return xfrc_applied and the arrays that `wrenches.add_to_xfrc` and `remove_from_xfrc` share."""
    bodies = read_int64(block + 8 * bk.BODIES)
    return (
        float64_array(read_int64(data + read_int64(block + 8 * bk.XFRC)), (bodies, 6)),
        floats(block, bk.A_OTHERS, (bodies, 6)),
        floats(block, bk.A_MINE, (bodies, 6)),
        floats(block, bk.A_TOTAL, (bodies, 6)),
        bool_array(block + read_int64(block + 8 * bk.A_WRITTEN), (bodies,)),
    )


@jit
def _remove_wrenches(block, data, state):
    """Remove from xfrc_applied the forces that this instance, or a restored state of it, had added."""
    xfrc, others, mine, total, written = _forces(block, data)
    loaded = ints(block, bk.A_LOADED, (read_int64(block + 8 * bk.LOADED),))
    at = state.shape[0] - 13 * loaded.shape[0]
    for j in range(loaded.shape[0]):
        b = loaded[j]
        same = state[at] != 0.0
        for i in range(6):
            same = same and xfrc[b, i] == state[at + 7 + i]
        if same:
            for i in range(6):
                xfrc[b, i] = state[at + 1 + i]
            written[b] = False
        state[at] = 0.0
        for i in range(12):
            state[at + 1 + i] = 0.0
        at += 13
    remove_from_xfrc(xfrc, others, mine, total, written)


@jit
def _add_wrenches(block, data, state, wrench):
    """Add the wrench to xfrc_applied, and store the sum in plugin_state."""
    xfrc, others, mine, total, written = _forces(block, data)
    add_to_xfrc(xfrc, others, mine, total, written, wrench)
    loaded = ints(block, bk.A_LOADED, (read_int64(block + 8 * bk.LOADED),))
    at = state.shape[0] - 13 * loaded.shape[0]
    for j in range(loaded.shape[0]):
        b = loaded[j]
        if written[b]:
            state[at] = 1.0
            for i in range(6):
                state[at + 1 + i], state[at + 7 + i] = others[b, i], total[b, i]
        at += 13


@jit
def _erase_paths(block):
    """Erase the paths that are drawn; the next evaluation starts from those in plugin_state."""
    count = ints(block, bk.A_COUNT, (read_int64(block + 8 * bk.ROUTES),))
    for c in range(count.shape[0]):
        count[c] = 0


@jit
def _time_since_start(time, step, ended, clock):
    """Return the time since the start of the step of this Runge-Kutta stage [s].

    A stage's time is the start of the step plus half or all of a step, so it can be compared exactly.
    """
    for start in (ended, clock[bk.FIRST]):
        if time == start:
            return 0.0
        if time == start + 0.5 * step:
            return 0.5 * step
        if time == start + step:
            return step
    clock[bk.FIRST] = time
    return 0.0


def stage(block, model, data):
    """Evaluate the instance's muscles at the poses and velocities in mjData, and apply wrenches or transmissions.

    The pieces of couplings of joints are switched, too.
    """
    state = state_of(block, data)
    _remove_wrenches(block, data, state)
    clock = floats(block, bk.A_CLOCK, (bk.CLOCK,))
    part = block + read_int64(block + 8 * bk.A_TRANSMISSION)
    transmits = read_int64(part) != 0
    idle = (
        read_int32(model + read_int64(block + 8 * bk.DISABLEFLAGS)) & read_int64(block + 8 * bk.NO_ACTUATION)
        != 0
    )
    at_points = block + read_int64(block + 8 * bk.A_POINTS)
    has_points = read_int64(at_points + 8 * GIVEN) != 0
    pieces = block + read_int64(block + 8 * bk.A_PIECES)
    if idle and not transmits:
        update_pieces(pieces, model, data)
        if has_points:
            place_sites(
                points_of(at_points, block),
                frames_of(at_points, block, model, data),
                poses_of(block, data).site_xpos,
            )
        clock[bk.ACTED] = 0.0
        _erase_paths(block)
        return
    n, _, _, bodies = sizes(block)
    step, since, ahead = read_float64(model + read_int64(block + 8 * bk.TIMESTEP)), 0.0, 0.0
    if read_int32(model + read_int64(block + 8 * bk.INTEGRATOR)) == read_int64(block + 8 * bk.RUNGE_KUTTA):
        since = _time_since_start(read_float64(data + read_int64(block + 8 * bk.TIME)), step, state[0], clock)
    else:
        ahead = step
    if since == 0.0:
        sync_with_model(block, model)
        load(block, state)
    update_pieces(pieces, model, data)
    off, group = bool_array(block + read_int64(block + 8 * bk.A_OFF), (n,)), ints(block, bk.A_GROUP, (n,))
    switched = read_int32(model + read_int64(block + 8 * bk.DISABLEACTUATOR))
    for m in range(n):
        off[m] = idle or group[m] == bk.SILENT
        off[m] = off[m] or (0 <= group[m] < GROUPS and ((switched >> group[m]) & 1) != 0)
    wrench = floats(block, bk.A_WRENCH, (bodies, 6))
    routes, poses, paths, states = routes_of(block), poses_of(block, data), paths_of(block), states_of(block)
    timing = Timing(since, ahead, step)
    muscles, inputs, start = muscles_of(block), inputs_of(block, data), start_of(block)
    if has_points:
        failed = evaluate_with_points(
            routes, muscles, poses, inputs, timing, TOLERANCE, paths, start, states, wrench,
            points_of(at_points, block), frames_of(at_points, block, model, data),
        )  # fmt: skip
    else:
        failed = evaluate(routes, muscles, poses, inputs, timing, TOLERANCE, paths, start, states, wrench)
    if failed and since == 0.0:
        load_held(block, state)
        body_wrenches(routes, poses, paths, states.tension, wrench)
        if has_points:
            write_point_forces(points_of(at_points, block), routes, paths, states.tension)
    if has_points:
        add_joint_forces(at_points, data)
    lost = bool_array(block + read_int64(block + 8 * bk.A_LOST), (n,))
    for m in range(n):
        lost[m] = states.status[m] != lay.CONVERGED or (since > 0.0 and lost[m])
    _add_wrenches(block, data, state, wrench)
    if transmits:
        transmit(part, block, model, data, since == 0.0, routes, poses, paths, states)
    shown = block + read_int64(block + 8 * bk.A_PUBLISHED)
    if read_int64(shown + 8 * COUNT) != 0:
        publish_lengths(shown, block, model, data, since == 0.0, states.length, states.velocity)
    clock[bk.ACTED] = 1.0


def finish(block, model, data):
    """Complete a step: remove the muscles' forces from xfrc_applied; store states and warm starts in plugin_state."""
    state = state_of(block, data)
    _remove_wrenches(block, data, state)
    clock = floats(block, bk.A_CLOCK, (bk.CLOCK,))
    clock[bk.FIRST] = -1.0
    state[0] = read_float64(data + read_int64(block + 8 * bk.TIME))
    if clock[bk.ACTED] == 0.0:
        return
    clock[bk.ACTED] = 0.0
    n = read_int64(block + 8 * bk.MUSCLES)
    write_states(
        ints(block, bk.A_SOURCE, (n,)),
        ints(block, bk.A_INDEX, (n,)),
        floats(block, bk.A_NEXT_ACTIVATION, (n,)),
        floats(block, bk.A_NEXT_FIBER, (n,)),
        float64_array(read_int64(data + read_int64(block + 8 * bk.ACT)), (read_int64(block + 8 * bk.ACTS),)),
        floats(block, bk.A_OWN, (n, 2)),
    )
    save(block, state)
    lost, failures = (
        bool_array(block + read_int64(block + 8 * bk.A_LOST), (n,)),
        ints(block, bk.A_FAILURES, (n,)),
    )
    for m in range(n):
        if lost[m]:
            failures[m] += 1


@jit
def restart(block, state):
    """Start cold after a reset of mjData, which has cleared xfrc_applied: there are no forces to remove.

    state: address of the instance's numbers in plugin_state, which a reset does not define.
    """
    cold = float64_array(state, (read_int64(block + 8 * bk.NSTATE),))
    for i in range(cold.shape[0]):
        cold[i] = 0.0
    _erase_paths(block)
    n, _, _, bodies = sizes(block)
    failures = ints(block, bk.A_FAILURES, (n,))
    for m in range(n):
        failures[m] = 0
    written = bool_array(block + read_int64(block + 8 * bk.A_WRITTEN), (bodies,))
    for b in range(bodies):
        written[b] = False
    clock = floats(block, bk.A_CLOCK, (bk.CLOCK,))
    clock[bk.FIRST], clock[bk.ACTED] = -1.0, 0.0
