"""From excitations, states and path lengths to tensions and the states at the end of a step, for all muscles.

A muscle's state is its activation and, where its tendon is elastic, its fibre length [m]. MuJoCo integrates the
activations of its own muscles. States that mjwrap integrates stand in two entries of `act` (STATE_IN_ACT), which MuJoCo
saves and restores, or, for muscles without an actuator, in an array of mjwrap's own (STATE_IN_MJWRAP).
"""

from __future__ import annotations

import math

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import from_python, jit
from mjwrap.kernels.musculotendon.actearly import next_activation
from mjwrap.kernels.musculotendon.activation_dynamics import advance_above, rate_above
from mjwrap.kernels.musculotendon.dispatch import has_fiber
from mjwrap.kernels.musculotendon.fiber import (
    ELASTIC,
    LEAST,
    MIN_ACTIVATION,
    equilibrium,
    rigid_fiber,
    step_fiber,
    tendon_force,
)
from mjwrap.kernels.musculotendon.tension import tension as law_tension

# Where a muscle's activation comes from, and its fibre length, if mjwrap integrates them.
FROM_ACT = 0  # activation: MuJoCo's `act`
FROM_CTRL = 1  # activation: the control
STATE_IN_MJWRAP = 2  # activation and fibre length: integrated by mjwrap, in its own array; no actuator
FROM_EXCITATION = 3  # activation: the excitation; no actuator
STATE_IN_ACT = 4  # activation and fibre length: integrated by mjwrap, in two entries of `act`
FROM_NEXT_ACT = 5  # activation: `act` at the end of the step, for actuators with `actearly`
TIMES = 5  # columns of `times`: two time constants [s] and smoothness; for FROM_NEXT_ACT see `actearly.next_activation`
NO_FIBER = 0.0  # a fibre length that is not known: the muscle starts at static equilibrium


@jit
def read_states(muscles, inputs, timing, start):
    """Write activation, fibre length [m] and excitation of every muscle at the step's start into `start`.

    What mjwrap integrates is read at the start only: a later stage of Runge-Kutta goes on from there. Activations:

        FROM_ACT          act[index]
        FROM_NEXT_ACT     what act[index] will be a timestep later
        FROM_CTRL         the drive
        FROM_EXCITATION   the drive
        STATE_IN_MJWRAP   own[m, 0]; the fibre length is own[m, 1]
        STATE_IN_ACT      act[index]; the fibre length is act[index + 1]

    The drive is the excitation for STATE_IN_MJWRAP and FROM_EXCITATION, else ctrl[control] held within its limits.
    """
    source, index, act, own = muscles.source, muscles.index, inputs.act, inputs.own
    activation, fiber, drive = start.activation, start.fiber, start.drive
    for m in range(source.shape[0]):
        own_drive = source[m] == STATE_IN_MJWRAP or source[m] == FROM_EXCITATION
        if own_drive:
            drive[m] = inputs.excitation[m]
        else:
            wanted = inputs.ctrl[muscles.control[m]]
            drive[m] = min(max(wanted, muscles.ctrl_low[m]), muscles.ctrl_high[m])
        if source[m] == FROM_ACT:
            activation[m] = act[index[m]]
        elif source[m] == FROM_NEXT_ACT:
            activation[m] = next_activation(
                muscles.form[m], muscles.times, m, act[index[m]], drive[m], timing.timestep
            )
        elif source[m] == FROM_CTRL or source[m] == FROM_EXCITATION:
            activation[m] = drive[m]
        elif timing.since <= 0.0:
            activation[m] = min(max(act[index[m]], 0.0), 1.0) if source[m] == STATE_IN_ACT else own[m, 0]
            fiber[m] = act[index[m] + 1] if source[m] == STATE_IN_ACT else own[m, 1]


@from_python
def write_states(source, index, activation, fiber, act, own):
    """Write the states that mjwrap integrates, (n,) each, to where `read_states` reads them."""
    for m in range(source.shape[0]):
        if source[m] == STATE_IN_ACT:
            act[index[m]] = activation[m]
            act[index[m] + 1] = fiber[m]
        elif source[m] == STATE_IN_MJWRAP:
            own[m, 0] = activation[m]
            own[m, 1] = fiber[m]


@jit
def is_elastic(law, params, m):
    """Return whether the fibre length of muscle m is a state."""
    return has_fiber(law) and params[m, ELASTIC] != 0.0


@jit
def least_activation(law, params, m):
    """Return the activation below which that of muscle m does not fall."""
    return params[m, MIN_ACTIVATION] if has_fiber(law) else 0.0


@jit
def drive_muscles(muscles, timing, start, states):
    """Write every muscle's tension, and its state at the end of the step, into `states`, which has length and speed.

    The states in `start` are `since` [s] old (in a stage of Runge-Kutta; where it is zero, fibre and path length are
    written to `start`). The tension will act for `ahead` [s]. An elastic tendon makes one implicit step over both
    times, to the length that the path will have at the end, and its tension is that at the end; if both are zero, it is
    that of the present state. With other laws the tension is that of the present state. A muscle without a path (status
    > 0) keeps its tension and fibre length. One with a substitute path (status < 0, `measure_muscles`) is computed, and
    its status becomes positive.
    """
    law, params, source, form, times, off = (
        muscles.law, muscles.params, muscles.source, muscles.form, muscles.times, muscles.off,
    )  # fmt: skip
    length, velocity, fiber = states.length, states.velocity, states.fiber
    next_fiber, status, since, ahead = states.next_fiber, states.status, timing.since, timing.ahead
    duration = since + ahead
    for m in range(law.shape[0]):
        a, end = start.activation[m], start.activation[m]
        least = least_activation(law[m], params, m)
        if (source[m] == STATE_IN_MJWRAP or source[m] == STATE_IN_ACT) and not off[m]:
            a = advance_above(form[m], end, start.drive[m], times, m, least, since)
            if ahead > 0.0:
                end = advance_above(form[m], end, start.drive[m], times, m, least, duration)
            else:
                end = a
        if since <= 0.0:
            start.length[m] = length[m]
        states.activation[m], states.next_activation[m], next_fiber[m] = a, end, start.fiber[m]
        if not math.isfinite(a + end):  # an unknown form of activation dynamics; clamping would hide it
            states.activation[m] = states.next_activation[m] = start.activation[m]
            if status[m] <= lay.CONVERGED:
                status[m] = lay.NON_FINITE
        if status[m] > lay.CONVERGED:
            continue
        status[m] = -status[m]
        if not is_elastic(law[m], params, m):
            force = law_tension(law[m], params, m, a, length[m], velocity[m])
            fiber[m] = rigid_fiber(params, m, length[m]) if has_fiber(law[m]) else NO_FIBER
        else:
            if start.fiber[m] <= NO_FIBER:
                start.fiber[m] = equilibrium(law[m], params, m, start.activation[m], length[m])[0]
            start.fiber[m] = max(start.fiber[m], params[m, LEAST])
            fiber[m] = start.fiber[m]
            next_fiber[m] = start.fiber[m]
            if off[m] or duration <= 0.0:
                force = tendon_force(law[m], params, m, length[m], fiber[m])
            else:
                growth = rate_above(form[m], start.drive[m], end, times, m, least)
                next_fiber[m], force, _, _ = step_fiber(
                    law[m], params, m, start.activation[m], end, growth,
                    start.length[m], length[m] + ahead * velocity[m], velocity[m], start.fiber[m], duration,
                )  # fmt: skip
                if since > 0.0:
                    fiber[m] = next_fiber[m]
        if off[m]:
            force = 0.0
        if math.isfinite(force):
            states.tension[m] = force
        else:
            status[m] = lay.NON_FINITE
            next_fiber[m] = start.fiber[m]


@from_python
def simulate(
    law,
    params,
    form,
    times,
    time,
    length,
    velocity,
    drive,
    growth,
    prescribed,
    activation,
    fiber,
    tension,
    counts,
):
    """Run one muscle, row 0 of params, along prescribed lengths: arrays (T,) of time [s], length [m], velocity [m/s].

    drive: excitations; if `prescribed`, activations, with growth as their rates [1/s]. activation[0] and fiber[0] are
    the start (NO_FIBER: equilibrium). activation, fiber and tension (T,) are filled, and counts (T, 2) with evaluations
    and status of each step.
    """
    elastic, least = is_elastic(law, params, 0), least_activation(law, params, 0)
    if prescribed:
        activation[0] = drive[0]
    for k in range(time.shape[0]):
        duration, rise = 0.0, growth[k]
        if k > 0:
            duration = time[k] - time[k - 1]
            activation[k] = drive[k]
            if not prescribed:
                u = drive[k - 1]
                activation[k] = advance_above(form, activation[k - 1], u, times, 0, least, duration)
                rise = rate_above(form, u, activation[k], times, 0, least)
        if not elastic:
            tension[k] = law_tension(law, params, 0, activation[k], length[k], velocity[k])
            fiber[k] = rigid_fiber(params, 0, length[k]) if has_fiber(law) else NO_FIBER
        elif k == 0:
            if fiber[0] <= NO_FIBER:
                fiber[0], counts[0, 0], counts[0, 1] = equilibrium(law, params, 0, activation[0], length[0])
            tension[0] = tendon_force(law, params, 0, length[0], fiber[0])
        else:
            fiber[k], tension[k], counts[k, 0], counts[k, 1] = step_fiber(
                law, params, 0, activation[k - 1], activation[k], rise,
                length[k - 1], length[k], velocity[k], fiber[k - 1], duration,
            )  # fmt: skip
