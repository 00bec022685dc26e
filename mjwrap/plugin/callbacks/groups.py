"""The kernels' groups of arrays, as views of a block, of mjData and of mjModel."""

from __future__ import annotations

from mjwrap.kernels import layout as lay
from mjwrap.kernels.coupling.groups import Paths, Poses, Routes
from mjwrap.kernels.coupling.muscle_paths import ROUTE
from mjwrap.kernels.musculotendon.dispatch import PARAMS
from mjwrap.kernels.musculotendon.dynamics import TIMES
from mjwrap.kernels.musculotendon.groups import Inputs, Muscles, MuscleStates, StepStart
from mjwrap.kernels.solved import segments as sg
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.callbacks._cache import jit
from mjwrap.plugin.callbacks.memory import bool_array, float64_array, read_int64
from mjwrap.plugin.callbacks.saving import floats, ints, sizes


@jit
def routes_of(block):
    """Return the group of routes."""
    _, nodes, routes, _ = sizes(block)
    return Routes(
        ints(block, bk.A_ROUTES, (routes, ROUTE)),
        floats(block, bk.A_WEIGHTS, (routes,)),
        ints(block, bk.A_LINKS, (nodes, 4)),
    )


@jit
def muscles_of(block):
    """Return the group of muscles."""
    n = read_int64(block + 8 * bk.MUSCLES)
    return Muscles(
        ints(block, bk.A_LAW, (n,)),
        floats(block, bk.A_PARAMS, (n, PARAMS)),
        ints(block, bk.A_SOURCE, (n,)),
        ints(block, bk.A_INDEX, (n,)),
        ints(block, bk.A_CONTROL, (n,)),
        floats(block, bk.A_CTRL_LOW, (n,)),
        floats(block, bk.A_CTRL_HIGH, (n,)),
        ints(block, bk.A_FORM, (n,)),
        floats(block, bk.A_TIMES, (n, TIMES)),
        bool_array(block + read_int64(block + 8 * bk.A_OFF), (n,)),
    )


@jit
def poses_of(block, data):
    """Return the group of poses and velocities in mjData."""
    bodies, sites = read_int64(block + 8 * bk.BODIES), read_int64(block + 8 * bk.SITES)
    geoms = read_int64(block + 8 * bk.GEOMS)
    return Poses(
        float64_array(read_int64(data + read_int64(block + 8 * bk.SITE_XPOS)), (sites, 3)),
        float64_array(read_int64(data + read_int64(block + 8 * bk.GEOM_XPOS)), (geoms, 3)),
        float64_array(read_int64(data + read_int64(block + 8 * bk.GEOM_XMAT)), (geoms, 9)),
        float64_array(read_int64(data + read_int64(block + 8 * bk.CVEL)), (bodies, 6)),
        float64_array(read_int64(data + read_int64(block + 8 * bk.SUBTREE_COM)), (bodies, 3)),
        float64_array(read_int64(data + read_int64(block + 8 * bk.XIPOS)), (bodies, 3)),
        ints(block, bk.A_BODY_ROOTID, (bodies,)),
    )


@jit
def inputs_of(block, data):
    """Return the group of controls and kept states."""
    n = read_int64(block + 8 * bk.MUSCLES)
    return Inputs(
        float64_array(read_int64(data + read_int64(block + 8 * bk.ACT)), (read_int64(block + 8 * bk.ACTS),)),
        float64_array(
            read_int64(data + read_int64(block + 8 * bk.CTRL)), (read_int64(block + 8 * bk.CTRLS),)
        ),
        floats(block, bk.A_OWN, (n, 2)),
        floats(block, bk.A_EXCITATION, (n,)),
    )


@jit
def paths_of(block):
    """Return the group of solved paths."""
    _, nodes, routes, _ = sizes(block)
    return Paths(
        floats(block, bk.A_NODE, (nodes, lay.ROW)),
        floats(block, bk.A_SEG, (nodes + routes, sg.SEGMENT)),
        ints(block, bk.A_COUNT, (routes,)),
        floats(block, bk.A_INFO, (routes, lay.INFO)),
    )


@jit
def start_of(block):
    """Return the group of drives and states at the start of the step."""
    n = read_int64(block + 8 * bk.MUSCLES)
    return StepStart(
        floats(block, bk.A_DRIVE, (n,)),
        floats(block, bk.A_START_ACTIVATION, (n,)),
        floats(block, bk.A_START_FIBER, (n,)),
        floats(block, bk.A_START_LENGTH, (n,)),
    )


@jit
def states_of(block):
    """Return the group of an evaluation's results."""
    n = read_int64(block + 8 * bk.MUSCLES)
    return MuscleStates(
        floats(block, bk.A_ACTIVATION, (n,)),
        floats(block, bk.A_FIBER, (n,)),
        floats(block, bk.A_LENGTH, (n,)),
        floats(block, bk.A_VELOCITY, (n,)),
        floats(block, bk.A_TENSION, (n,)),
        floats(block, bk.A_NEXT_ACTIVATION, (n,)),
        floats(block, bk.A_NEXT_FIBER, (n,)),
        ints(block, bk.A_STATUS, (n,)),
    )
