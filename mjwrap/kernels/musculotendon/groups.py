"""Named groups of the arrays that muscles' forces and states are computed from, a row or an entry for each muscle."""

from __future__ import annotations

from typing import NamedTuple

from mjwrap.kernels.array_types import Flags, FloatRows, Floats, Ints, Number


class Muscles(NamedTuple):
    """What muscles are: laws, parameters, and where their activations come from; fixed while a model is."""

    law: Ints  # code of the force law
    params: FloatRows  # (n, PARAMS), in the order of the law
    source: Ints  # where activation and state come from: FROM_ACT, ..., FROM_NEXT_ACT of `dynamics.py`
    index: Ints  # index of the state in `act`
    control: Ints  # index of the control in `ctrl`
    ctrl_low: Floats  # limits of the control
    ctrl_high: Floats
    form: Ints  # of the activation dynamics
    times: FloatRows  # (n, TIMES) constants of the activation dynamics
    off: Flags  # which muscles pull with no tension and keep their states


class Inputs(NamedTuple):
    """What drives muscles, and the states that are kept between steps."""

    act: Floats  # mjData's
    ctrl: Floats  # mjData's
    own: FloatRows  # (n, 2) activation and fibre length [m] of muscles without an actuator
    excitation: Floats  # of muscles without an actuator


class Timing(NamedTuple):
    """Where in a step an evaluation stands [s]."""

    since: Number  # how old the states are: 0, or the time since a Runge-Kutta step began
    ahead: Number  # how long the tensions are to act from here
    timestep: Number


class StepStart(NamedTuple):
    """Drives, and states at the start of the step."""

    drive: Floats  # excitations
    activation: Floats
    fiber: Floats  # fibre lengths [m]
    length: Floats  # path lengths [m]


class MuscleStates(NamedTuple):
    """What an evaluation finds, one entry for each muscle."""

    activation: Floats
    fiber: Floats  # fibre lengths [m]
    length: Floats  # [m]
    velocity: Floats  # lengthening speed [m/s]
    tension: Floats  # [N]
    next_activation: Floats  # at the end of the step
    next_fiber: Floats  # [m]
    status: Ints
