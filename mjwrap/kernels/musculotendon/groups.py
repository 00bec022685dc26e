"""Named groups of arrays for forces and states of muscles, with a row or an entry for each muscle."""

from __future__ import annotations

from typing import NamedTuple

from mjwrap.kernels.array_types import Flags, FloatRows, Floats, Ints, Number


class Muscles(NamedTuple):
    """Laws and parameters of muscles, and where their activations come from; constant for a model."""

    law: Ints  # code of the force law
    params: FloatRows  # (n, PARAMS), in the order of the law
    source: Ints  # where activation and state come from: FROM_ACT, ..., FROM_NEXT_ACT of `dynamics.py`
    index: Ints  # index of the state in `act`
    control: Ints  # index of the control in `ctrl`
    ctrl_low: Floats  # limits of the control
    ctrl_high: Floats
    form: Ints  # code of the activation dynamics
    times: FloatRows  # (n, TIMES) constants of the activation dynamics
    off: Flags  # muscles that are switched off: no tension, constant states


class Inputs(NamedTuple):
    """Controls and excitations, and the states that are kept between steps."""

    act: Floats  # mjData's
    ctrl: Floats  # mjData's
    own: FloatRows  # (n, 2) activation and fibre length [m] of muscles without an actuator
    excitation: Floats  # excitations of muscles without an actuator


class Timing(NamedTuple):
    """Times of an evaluation within a step [s]."""

    since: Number  # age of the states: 0, or the time since a Runge-Kutta step began
    ahead: Number  # time for which the tensions will act
    timestep: Number


class StepStart(NamedTuple):
    """Excitations, states and path lengths at the start of the step."""

    drive: Floats  # excitations
    activation: Floats
    fiber: Floats  # fibre lengths [m]
    length: Floats  # path lengths [m]


class MuscleStates(NamedTuple):
    """Results of an evaluation, one entry for each muscle."""

    activation: Floats
    fiber: Floats  # fibre lengths [m]
    length: Floats  # [m]
    velocity: Floats  # lengthening speed [m/s]
    tension: Floats  # [N]
    next_activation: Floats  # at the end of the step
    next_fiber: Floats  # [m]
    status: Ints
