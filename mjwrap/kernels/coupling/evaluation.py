"""One evaluation of all muscles of a model: paths, activations, tensions and wrenches on bodies."""

from __future__ import annotations

from mjwrap.kernels.compilation.jit import no_inline
from mjwrap.kernels.coupling.muscle_paths import measure_muscles, solve_routes
from mjwrap.kernels.coupling.wrenches import body_wrenches
from mjwrap.kernels.musculotendon.dynamics import drive_muscles, read_states


@no_inline
def evaluate(routes, muscles, poses, inputs, timing, tol, paths, start, states, wrench):
    """Compute paths, tensions and body wrenches of all muscles; return whether some muscle has no path.

    Groups: `Routes`, `Muscles`, `Poses`, `Inputs`, `Timing`, `Paths`, `StepStart`, `MuscleStates`. tol: largest
    tangency error of a path. wrench (nbody, 6): in the convention of `xfrc_applied`.
    """
    solve_routes(routes, poses, paths, tol)
    read_states(muscles, inputs, timing, start)
    measure_muscles(routes, paths.info, states)
    drive_muscles(muscles, timing, start, states)
    failed = False
    for m in range(states.status.shape[0]):
        failed = failed or states.status[m] != 0
    body_wrenches(routes, poses, paths, states.tension, wrench)
    return failed
