"""One evaluation of all muscles of a model: paths, activations, tensions and wrenches on bodies."""

from __future__ import annotations

from mjwrap.kernels.compilation.jit import inlined, no_inline
from mjwrap.kernels.coupling.muscle_paths import measure_muscles, solve_routes
from mjwrap.kernels.coupling.path_points import (
    add_point_speeds,
    choose_routes,
    place_sites,
    solve_active_routes,
    write_point_forces,
)
from mjwrap.kernels.coupling.wrenches import body_wrenches
from mjwrap.kernels.musculotendon.dynamics import drive_muscles, read_states


@inlined
def _pull(routes, muscles, poses, inputs, timing, paths, start, states, wrench):
    """Compute tensions and body wrenches along solved paths; return whether some muscle has no path."""
    read_states(muscles, inputs, timing, start)
    measure_muscles(routes, paths.info, states)
    drive_muscles(muscles, timing, start, states)
    failed = False
    for m in range(states.status.shape[0]):
        failed = failed or states.status[m] != 0
    body_wrenches(routes, poses, paths, states.tension, wrench)
    return failed


@no_inline
def evaluate(routes, muscles, poses, inputs, timing, tol, paths, start, states, wrench):
    """Compute paths, tensions and body wrenches of all muscles; return whether some muscle has no path.

    Groups: `Routes`, `Muscles`, `Poses`, `Inputs`, `Timing`, `Paths`, `StepStart`, `MuscleStates`. tol: largest
    tangency error of a path. wrench (nbody, 6): in the convention of `xfrc_applied`.
    """
    solve_routes(0, routes.rows.shape[0], routes, poses, paths, tol)
    return _pull(routes, muscles, poses, inputs, timing, paths, start, states, wrench)


@no_inline
def evaluate_with_points(
    routes, muscles, poses, inputs, timing, tol, paths, start, states, wrench, points, frames
):
    """Do the same for a model with moving or conditional points; groups: also `PathPoints` and `SiteFrames`.

    Writes the moving sites to poses.site_xpos, and generalised forces to points.force.
    """
    place_sites(points, frames, poses.site_xpos)
    choose_routes(points, frames.qpos)
    solve_active_routes(points, routes, poses, paths, tol)
    add_point_speeds(points, routes, frames.qvel, paths)
    failed = _pull(routes, muscles, poses, inputs, timing, paths, start, states, wrench)
    write_point_forces(points, routes, paths, states.tension)
    return failed
