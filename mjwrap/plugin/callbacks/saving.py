"""Read the arrays of a block from an instance's part of plugin_state, and write them there.

Numbers in plugin_state, per instance: the time at which the last step ended; activation and fibre length of muscles
that have them nowhere else (n, 2); excitations (n,); length, velocity and tension (3, n) and the segments of the last
valid paths; the saved solution and the hint of every surface; the forces now in xfrc_applied. Zeros are a cold start,
so that a state made by hand works like one that MuJoCo has reset.
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.coupling.muscle_paths import L_GEOM, R_HI, R_LO, R_SURFACES, ROUTE
from mjwrap.kernels.solved import segments as sg
from mjwrap.kernels.spans.end_inside import has_valid_length
from mjwrap.kernels.spans.saved_solutions import discard_invalid_solutions
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks._cache import jit
from mjwrap.plugin.callbacks.memory import float64_array, int64_array, read_int64

PER_MUSCLE = 6
SAVED = lay.STATE + 4  # numbers per surface: the solution, then the hint


@jit
def floats(block, which, shape):
    return float64_array(block + read_int64(block + 8 * which), shape)


@jit
def ints(block, which, shape):
    return int64_array(block + read_int64(block + 8 * which), shape)


@jit
def field(part, which, owner, shape):
    """Return the array of doubles to which a field of mjData, or mjModel, points."""
    return float64_array(read_int64(owner + read_int64(part + 8 * which)), shape)


@jit
def state_of(block, data):
    """Return the instance's part of plugin_state."""
    start = read_int64(data + read_int64(block + 8 * bk.PLUGIN_STATE)) + 8 * read_int64(
        block + 8 * bk.STATE_ADDRESS
    )
    return float64_array(start, (read_int64(block + 8 * bk.NSTATE),))


@jit
def sizes(block):
    """Return the numbers of muscles, nodes, routes and bodies."""
    n, nodes = read_int64(block + 8 * bk.MUSCLES), read_int64(block + 8 * bk.NODES)
    return n, nodes, read_int64(block + 8 * bk.ROUTES), read_int64(block + 8 * bk.BODIES)


@jit
def load(block, state):
    """Read own states, excitations, last lengths and forces, and the surfaces' warm starts from plugin_state.

    Modes are stored relative to COLD, so that zeros are a cold start.
    """
    n, nodes, routes, _ = sizes(block)
    node, links = floats(block, bk.A_NODE, (nodes, lay.ROW)), ints(block, bk.A_LINKS, (nodes, 4))
    route = ints(block, bk.A_ROUTES, (routes, ROUTE))
    own, excitation = floats(block, bk.A_OWN, (n, 2)), floats(block, bk.A_EXCITATION, (n,))
    length, velocity = floats(block, bk.A_LENGTH, (n,)), floats(block, bk.A_VELOCITY, (n,))
    tension = floats(block, bk.A_TENSION, (n,))
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
            total = state[at]
            node[k, lay.S_MODE] = total + lay.COLD
            for i in range(1, lay.STATE):
                total += state[at + i]
                node[k, lay.S_MODE + i] = state[at + i]
            if not math.isfinite(total):  # the user may have written to plugin_state
                discard_invalid_solutions(k, k + 1, node)
            for i in range(4):
                node[k, lay.HINT + i] = state[at + lay.STATE + i]
            at += SAVED
        at += _segment_numbers(c, route)


@jit
def _segment_numbers(c, route):
    """Return the number of entries of plugin_state for the segments of route c: their count, and a row for each."""
    return 1 + sg.SEGMENT * (route[c, R_HI] - route[c, R_LO] + 1)


@jit
def _copy(count, origin, first, target, place):
    """Copy numbers from origin[first:] to target[place:]; views, because numba tests the sign of every index else."""
    taken, given = origin[first:], target[place:]
    for i in range(count):
        given[i] = taken[i]


@jit
def load_held(block, state):
    """Read the segments of the last valid paths of routes that have no path now."""
    n, nodes, routes, _ = sizes(block)
    route, info = ints(block, bk.A_ROUTES, (routes, ROUTE)), floats(block, bk.A_INFO, (routes, lay.INFO))
    seg, count = (
        floats(block, bk.A_SEG, ((nodes + routes) * sg.SEGMENT,)),
        ints(block, bk.A_COUNT, (routes,)),
    )
    at = 1 + PER_MUSCLE * n
    for c in range(routes):
        if route[c, R_SURFACES] == 0:
            continue
        at += SAVED * route[c, R_SURFACES]
        if not has_valid_length(info[c, lay.I_STATUS], info[c, lay.I_ERROR]):
            most = route[c, R_HI] - route[c, R_LO] + 1
            fits = 0.0 <= state[at] <= most  # the user may have written to plugin_state
            count[c] = int(state[at]) if fits else 0
            _copy(sg.SEGMENT * count[c], state, at + 1, seg, sg.SEGMENT * (route[c, R_LO] + c))
        at += _segment_numbers(c, route)


@jit
def save(block, state):
    """Write what `load` and `load_held` read, except for the excitations, which the user sets."""
    n, nodes, routes, _ = sizes(block)
    node, links = floats(block, bk.A_NODE, (nodes, lay.ROW)), ints(block, bk.A_LINKS, (nodes, 4))
    seg, count = (
        floats(block, bk.A_SEG, ((nodes + routes) * sg.SEGMENT,)),
        ints(block, bk.A_COUNT, (routes,)),
    )
    route, own = ints(block, bk.A_ROUTES, (routes, ROUTE)), floats(block, bk.A_OWN, (n, 2))
    length, velocity = floats(block, bk.A_LENGTH, (n,)), floats(block, bk.A_VELOCITY, (n,))
    tension = floats(block, bk.A_TENSION, (n,))
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
        at += _segment_numbers(c, route)
