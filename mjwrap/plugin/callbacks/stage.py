"""One evaluation of an instance's muscles inside MuJoCo, and the end of a step.

Numbers in plugin_state, per instance: the time at which the last step ended; activation and fibre length of muscles
that keep them nowhere else (n, 2); excitations (n,); length, velocity and tension (3, n) and the segments of the last
good paths; the saved solution and the hint of every surface; what is in xfrc_applied now. Zeros are a cold start: so a
state made by hand is as good as one that MuJoCo has reset.

`stage` and `finish` are compiled in `hooks.py`, as C functions only: another layer would optimise all kernels again.
"""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels import segments as sg
from mjwrap.kernels.coupling import L_GEOM, R_HI, R_LO, R_SURFACES, ROUTE
from mjwrap.kernels.dynamics import TIMES, write_states
from mjwrap.kernels.evaluation import evaluate
from mjwrap.kernels.muscle import PARAMS
from mjwrap.kernels.wrenches import body_wrenches, put, take_back
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks._cache import jit
from mjwrap.plugin.callbacks.follow import follow
from mjwrap.plugin.callbacks.memory import flags, half, real, reals, word, words
from mjwrap.plugin.callbacks.transmission import transmit

TOLERANCE = 1e-10  # largest tangency error of a path, as in MuscleSystem
GROUPS = 31  # actuator groups that options can switch off
PER_MUSCLE = 6
SAVED = lay.STATE + 4  # of a surface: the solution, then the hint


@jit
def _floats(block, which, shape):
    return reals(block + word(block + 8 * which), shape)


@jit
def _ints(block, which, shape):
    return words(block + word(block + 8 * which), shape)


@jit
def _state(block, data):
    """Return the instance's part of plugin_state."""
    start = word(data + word(block + 8 * bk.PLUGIN_STATE)) + 8 * word(block + 8 * bk.STATE_ADDRESS)
    return reals(start, (word(block + 8 * bk.NSTATE),))


@jit
def _sizes(block):
    """Return the numbers of muscles, nodes, routes and bodies."""
    n, nodes = word(block + 8 * bk.MUSCLES), word(block + 8 * bk.NODES)
    return n, nodes, word(block + 8 * bk.ROUTES), word(block + 8 * bk.BODIES)


@jit
def _load(block, state):
    """Read own states, excitations, last lengths and forces, and the surfaces' warm starts from plugin_state.

    Modes are stored as their distance from COLD, so that zeros are cold.
    """
    n, nodes, routes, _ = _sizes(block)
    node, links = _floats(block, bk.A_NODE, (nodes, lay.ROW)), _ints(block, bk.A_LINKS, (nodes, 4))
    route = _ints(block, bk.A_ROUTES, (routes, ROUTE))
    own, excitation = _floats(block, bk.A_OWN, (n, 2)), _floats(block, bk.A_EXCITATION, (n,))
    length, velocity = _floats(block, bk.A_LENGTH, (n,)), _floats(block, bk.A_VELOCITY, (n,))
    tension = _floats(block, bk.A_TENSION, (n,))
    at = 1
    for m in range(n):
        own[m, 0], own[m, 1], excitation[m] = state[at], state[at + 1], state[at + 2]
        length[m], velocity[m], tension[m] = state[at + 3], state[at + 4], state[at + 5]
        at += PER_MUSCLE
    for c in range(routes):
        if route[c, R_SURFACES] == 0:
            continue  # a path of straight segments is always found
        for k in range(route[c, R_LO], route[c, R_HI]):
            if links[k, L_GEOM] < 0:
                continue
            node[k, lay.S_MODE] = state[at] + lay.COLD
            for i in range(1, lay.STATE):
                node[k, lay.S_MODE + i] = state[at + i]
            for i in range(4):
                node[k, lay.HINT + i] = state[at + lay.STATE + i]
            at += SAVED
        at += _room(c, route)


@jit
def _room(c, route):
    """Return how many numbers of plugin_state the segments of route c have: their count, then a row for each."""
    return 1 + sg.SEGMENT * (route[c, R_HI] - route[c, R_LO] + 1)


@jit
def _copy(count, origin, first, target, place):
    """Copy numbers from origin[first:] to target[place:], through views: else every index is checked for its sign."""
    taken, given = origin[first:], target[place:]
    for i in range(count):
        given[i] = taken[i]


@jit
def _load_held(block, state):
    """Read the segments of the last good paths of the routes that have none now."""
    n, nodes, routes, _ = _sizes(block)
    route, info = _ints(block, bk.A_ROUTES, (routes, ROUTE)), _floats(block, bk.A_INFO, (routes, lay.INFO))
    seg, count = (
        _floats(block, bk.A_SEG, ((nodes + routes) * sg.SEGMENT,)),
        _ints(block, bk.A_COUNT, (routes,)),
    )
    at = 1 + PER_MUSCLE * n
    for c in range(routes):
        if route[c, R_SURFACES] == 0:
            continue
        at += SAVED * route[c, R_SURFACES]
        if info[c, lay.I_STATUS] != lay.CONVERGED:
            most = route[c, R_HI] - route[c, R_LO] + 1
            fits = 0.0 <= state[at] <= most  # anybody may write to plugin_state
            count[c] = int(state[at]) if fits else 0
            _copy(sg.SEGMENT * count[c], state, at + 1, seg, sg.SEGMENT * (route[c, R_LO] + c))
        at += _room(c, route)


@jit
def _save(block, state):
    """Write what `_load` and `_load_held` read, but for the excitations, which are the user's."""
    n, nodes, routes, _ = _sizes(block)
    node, links = _floats(block, bk.A_NODE, (nodes, lay.ROW)), _ints(block, bk.A_LINKS, (nodes, 4))
    seg, count = (
        _floats(block, bk.A_SEG, ((nodes + routes) * sg.SEGMENT,)),
        _ints(block, bk.A_COUNT, (routes,)),
    )
    route, own = _ints(block, bk.A_ROUTES, (routes, ROUTE)), _floats(block, bk.A_OWN, (n, 2))
    length, velocity = _floats(block, bk.A_LENGTH, (n,)), _floats(block, bk.A_VELOCITY, (n,))
    tension = _floats(block, bk.A_TENSION, (n,))
    at = 1
    for m in range(n):
        state[at], state[at + 1] = own[m, 0], own[m, 1]
        state[at + 3], state[at + 4], state[at + 5] = length[m], velocity[m], tension[m]
        at += PER_MUSCLE
    for c in range(routes):
        if route[c, R_SURFACES] == 0:
            continue
        for k in range(route[c, R_LO], route[c, R_HI]):
            if links[k, L_GEOM] < 0:
                continue
            state[at] = node[k, lay.S_MODE] - lay.COLD
            for i in range(1, lay.STATE):
                state[at + i] = node[k, lay.S_MODE + i]
            for i in range(4):
                state[at + lay.STATE + i] = node[k, lay.HINT + i]
            at += SAVED
        state[at] = count[c]
        _copy(sg.SEGMENT * count[c], seg, sg.SEGMENT * (route[c, R_LO] + c), state, at + 1)
        at += _room(c, route)


@jit
def _forces(block, data):
    """Return xfrc_applied and the arrays that `wrenches.put` and `take_back` share."""
    bodies = word(block + 8 * bk.BODIES)
    return (
        reals(word(data + word(block + 8 * bk.XFRC)), (bodies, 6)),
        _floats(block, bk.A_OTHERS, (bodies, 6)),
        _floats(block, bk.A_MINE, (bodies, 6)),
        _floats(block, bk.A_TOTAL, (bodies, 6)),
        flags(block + word(block + 8 * bk.A_WRITTEN), (bodies,)),
    )


@jit
def _retreat(block, data, state):
    """Take out of xfrc_applied what this instance put in, or what a restored state says that it had."""
    xfrc, others, mine, total, written = _forces(block, data)
    loaded = _ints(block, bk.A_LOADED, (word(block + 8 * bk.LOADED),))
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
    take_back(xfrc, others, mine, total, written)


@jit
def _advance_into(block, data, state, wrench):
    """Put the wrench into xfrc_applied and note in plugin_state what is there now."""
    xfrc, others, mine, total, written = _forces(block, data)
    put(xfrc, others, mine, total, written, wrench)
    loaded = _ints(block, bk.A_LOADED, (word(block + 8 * bk.LOADED),))
    at = state.shape[0] - 13 * loaded.shape[0]
    for j in range(loaded.shape[0]):
        b = loaded[j]
        if written[b]:
            state[at] = 1.0
            for i in range(6):
                state[at + 1 + i], state[at + 7 + i] = others[b, i], total[b, i]
        at += 13


@jit
def _erase(block):
    """Leave no path to draw; those that the next evaluation needs are in plugin_state."""
    count = _ints(block, bk.A_COUNT, (word(block + 8 * bk.ROUTES),))
    for c in range(count.shape[0]):
        count[c] = 0


@jit
def _since(time, step, ended, clock):
    """Return how long ago the step began [s] to which this stage of Runge-Kutta belongs.

    A stage's time is computed as the step's start plus half or all of a step, so it is recognised to the bit.
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
    """Evaluate the instance's muscles at the poses and velocities in mjData, and act: by wrenches or transmission."""
    state = _state(block, data)
    _retreat(block, data, state)
    clock = _floats(block, bk.A_CLOCK, (bk.CLOCK,))
    part = block + word(block + 8 * bk.A_TRANSMISSION)
    transmits = word(part) != 0
    idle = half(model + word(block + 8 * bk.DISABLEFLAGS)) & word(block + 8 * bk.NO_ACTUATION) != 0
    if idle and not transmits:
        clock[bk.ACTED] = 0.0
        _erase(block)
        return
    n, nodes, routes, bodies = _sizes(block)
    step, since, ahead = real(model + word(block + 8 * bk.TIMESTEP)), 0.0, 0.0
    if half(model + word(block + 8 * bk.INTEGRATOR)) == word(block + 8 * bk.RUNGE_KUTTA):
        since = _since(real(data + word(block + 8 * bk.TIME)), step, state[0], clock)
    else:
        ahead = step
    if since == 0.0:
        follow(block, model)
        _load(block, state)
    off, group = flags(block + word(block + 8 * bk.A_OFF), (n,)), _ints(block, bk.A_GROUP, (n,))
    switched = half(model + word(block + 8 * bk.DISABLEACTUATOR))
    for m in range(n):
        off[m] = idle or group[m] == bk.SILENT
        off[m] = off[m] or (0 <= group[m] < GROUPS and ((switched >> group[m]) & 1) != 0)
    wrench = _floats(block, bk.A_WRENCH, (bodies, 6))
    failed = evaluate(
        _ints(block, bk.A_ROUTES, (routes, ROUTE)),
        _floats(block, bk.A_WEIGHTS, (routes,)),
        _ints(block, bk.A_LINKS, (nodes, 4)),
        _ints(block, bk.A_LAW, (n,)),
        _floats(block, bk.A_PARAMS, (n, PARAMS)),
        _ints(block, bk.A_SOURCE, (n,)),
        _ints(block, bk.A_INDEX, (n,)),
        _ints(block, bk.A_CONTROL, (n,)),
        _floats(block, bk.A_CTRL_LOW, (n,)),
        _floats(block, bk.A_CTRL_HIGH, (n,)),
        _ints(block, bk.A_FORM, (n,)),
        _floats(block, bk.A_TIMES, (n, TIMES)),
        off,
        _ints(block, bk.A_BODY_ROOTID, (bodies,)),
        reals(word(data + word(block + 8 * bk.SITE_XPOS)), (word(block + 8 * bk.SITES), 3)),
        reals(word(data + word(block + 8 * bk.GEOM_XPOS)), (word(block + 8 * bk.GEOMS), 3)),
        reals(word(data + word(block + 8 * bk.GEOM_XMAT)), (word(block + 8 * bk.GEOMS), 9)),
        reals(word(data + word(block + 8 * bk.CVEL)), (bodies, 6)),
        reals(word(data + word(block + 8 * bk.SUBTREE_COM)), (bodies, 3)),
        reals(word(data + word(block + 8 * bk.XIPOS)), (bodies, 3)),
        reals(word(data + word(block + 8 * bk.ACT)), (word(block + 8 * bk.ACTS),)),
        reals(word(data + word(block + 8 * bk.CTRL)), (word(block + 8 * bk.CTRLS),)),
        _floats(block, bk.A_OWN, (n, 2)),
        _floats(block, bk.A_EXCITATION, (n,)),
        since,
        ahead,
        step,
        TOLERANCE,
        _floats(block, bk.A_NODE, (nodes, lay.ROW)),
        _floats(block, bk.A_SEG, (nodes + routes, sg.SEGMENT)),
        _ints(block, bk.A_COUNT, (routes,)),
        _floats(block, bk.A_INFO, (routes, lay.INFO)),
        _floats(block, bk.A_DRIVE, (n,)),
        _floats(block, bk.A_START_ACTIVATION, (n,)),
        _floats(block, bk.A_START_FIBER, (n,)),
        _floats(block, bk.A_START_LENGTH, (n,)),
        _floats(block, bk.A_ACTIVATION, (n,)),
        _floats(block, bk.A_FIBER, (n,)),
        _floats(block, bk.A_LENGTH, (n,)),
        _floats(block, bk.A_VELOCITY, (n,)),
        _floats(block, bk.A_TENSION, (n,)),
        _floats(block, bk.A_NEXT_ACTIVATION, (n,)),
        _floats(block, bk.A_NEXT_FIBER, (n,)),
        _ints(block, bk.A_STATUS, (n,)),
        wrench,
    )
    if failed and since == 0.0:
        _load_held(block, state)
        body_wrenches(
            _ints(block, bk.A_ROUTES, (routes, ROUTE)),
            _floats(block, bk.A_WEIGHTS, (routes,)),
            _ints(block, bk.A_LINKS, (nodes, 4)),
            _floats(block, bk.A_SEG, (nodes + routes, sg.SEGMENT)),
            _ints(block, bk.A_COUNT, (routes,)),
            _floats(block, bk.A_TENSION, (n,)),
            reals(word(data + word(block + 8 * bk.SUBTREE_COM)), (bodies, 3)),
            _ints(block, bk.A_BODY_ROOTID, (bodies,)),
            reals(word(data + word(block + 8 * bk.XIPOS)), (bodies, 3)),
            wrench,
        )
    status, lost = _ints(block, bk.A_STATUS, (n,)), flags(block + word(block + 8 * bk.A_LOST), (n,))
    for m in range(n):
        lost[m] = status[m] != lay.CONVERGED or (since > 0.0 and lost[m])
    _advance_into(block, data, state, wrench)
    if transmits:
        transmit(
            part,
            block,
            model,
            data,
            since == 0.0,
            _ints(block, bk.A_ROUTES, (routes, ROUTE)),
            _floats(block, bk.A_WEIGHTS, (routes,)),
            _ints(block, bk.A_LINKS, (nodes, 4)),
            _floats(block, bk.A_SEG, (nodes + routes, sg.SEGMENT)),
            _ints(block, bk.A_COUNT, (routes,)),
            _ints(block, bk.A_BODY_ROOTID, (bodies,)),
            reals(word(data + word(block + 8 * bk.SUBTREE_COM)), (bodies, 3)),
            _floats(block, bk.A_LENGTH, (n,)),
            _floats(block, bk.A_VELOCITY, (n,)),
        )
    clock[bk.ACTED] = 1.0


def finish(block, model, data):
    """End a step: leave others' forces in xfrc_applied, keep states and warm starts in plugin_state."""
    state = _state(block, data)
    _retreat(block, data, state)
    clock = _floats(block, bk.A_CLOCK, (bk.CLOCK,))
    clock[bk.FIRST] = -1.0
    state[0] = real(data + word(block + 8 * bk.TIME))
    if clock[bk.ACTED] == 0.0:
        return
    clock[bk.ACTED] = 0.0
    n = word(block + 8 * bk.MUSCLES)
    write_states(
        _ints(block, bk.A_SOURCE, (n,)),
        _ints(block, bk.A_INDEX, (n,)),
        _floats(block, bk.A_NEXT_ACTIVATION, (n,)),
        _floats(block, bk.A_NEXT_FIBER, (n,)),
        reals(word(data + word(block + 8 * bk.ACT)), (word(block + 8 * bk.ACTS),)),
        _floats(block, bk.A_OWN, (n, 2)),
    )
    _save(block, state)
    lost, failures = flags(block + word(block + 8 * bk.A_LOST), (n,)), _ints(block, bk.A_FAILURES, (n,))
    for m in range(n):
        if lost[m]:
            failures[m] += 1


@jit
def forget(block, state):
    """After a reset of mjData, which has cleared xfrc_applied: start cold, with nothing to take back.

    state: address of the instance's numbers in plugin_state, which MuJoCo leaves as they were, or undefined.
    """
    cold = reals(state, (word(block + 8 * bk.NSTATE),))
    for i in range(cold.shape[0]):
        cold[i] = 0.0
    _erase(block)
    n, _, _, bodies = _sizes(block)
    failures = _ints(block, bk.A_FAILURES, (n,))
    for m in range(n):
        failures[m] = 0
    written = flags(block + word(block + 8 * bk.A_WRITTEN), (bodies,))
    for b in range(bodies):
        written[b] = False
    clock = _floats(block, bk.A_CLOCK, (bk.CLOCK,))
    clock[bk.FIRST], clock[bk.ACTED] = -1.0, 0.0
