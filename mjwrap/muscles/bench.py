"""Simulate a single muscle along a prescribed length, as in an experiment on an isolated muscle."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjwrap import validation
from mjwrap.errors import StateError
from mjwrap.kernels.musculotendon import dynamics as kernels
from mjwrap.muscles.activation import ActivationDynamics
from mjwrap.muscles.laws import Law, parameter_row

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MuscleTrial:
    """The history of a single muscle, as arrays (T,).

    Attributes:
        time: [s].
        length: musculotendon length [m].
        activation: activation, 0 to 1.
        fiber_length: [m].
        tension: [N].
        iterations: evaluations of the equilibrium of fibre and tendon; 0 with a rigid tendon.
        status: codes of `mjwrap/kernels/musculotendon/fiber.py`: 0 normal, 1 at the minimum fibre length, 2 slack
            tendon, 3 not converged.
    """

    time: Array
    length: Array
    activation: Array
    fiber_length: Array
    tension: Array
    iterations: NDArray[np.int64]
    status: NDArray[np.int64]


def simulate_muscle(
    law: Law,
    time: ArrayLike,
    length: ArrayLike,
    *,
    excitation: ArrayLike | None = None,
    activation: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    initial_activation: float = 0.0,
    initial_fiber_length: float | None = None,
    dynamics: ActivationDynamics | None = None,
) -> MuscleTrial:
    """Simulate one muscle along a prescribed musculotendon length, with the same steps as in a `MuscleSystem`.

    Give either `excitation` or `activation`. An elastic tendon takes one implicit step from each time to the next.

    Args:
        law: the muscle.
        time: (T,) increasing times [s].
        length: (T,) or one number, musculotendon length [m].
        excitation: (T,) or one number, constant from each time to the next.
        activation: (T,) or one number.
        velocity: (T,) lengthening speed [m/s]; None for central differences of the length.
        initial_activation: at the first time, with `excitation`.
        initial_fiber_length: at the first time [m], with an elastic tendon; None for static equilibrium.
        dynamics: activation dynamics, with `excitation`.

    Returns:
        Tension, fibre length and activation at every time.

    Raises:
        StateError: an array has a wrong shape, or a number is not finite or not in its range.
    """
    validation.require(
        hasattr(law, "row") and not isinstance(law, type), "law", "a muscle's law", law, StateError
    )
    validation.optional(dynamics, ActivationDynamics, "dynamics", StateError, "an ActivationDynamics")
    t = validation.numbers(time, "time", StateError).copy()
    if t.ndim != 1 or t.size == 0 or not np.isfinite(t).all() or (np.diff(t) <= 0.0).any():
        raise StateError("time must be a list of finite, increasing numbers [s]")
    if (excitation is None) == (activation is None):
        raise StateError("give either an excitation or an activation, not both")
    lengths = _column("length", length, t.size)
    if not (lengths > 0.0).all():
        raise StateError("length must be positive [m]")
    most = math.nextafter(1.0, 2.0)
    validation.between(initial_activation, 0.0, most, "initial_activation", StateError, "in [0, 1]")
    if initial_fiber_length is not None:
        validation.positive(initial_fiber_length, "initial_fiber_length", StateError, "m")
    drive = _column(
        "excitation" if activation is None else "activation", _either(excitation, activation), t.size
    )
    speeds = _rates(lengths, t) if velocity is None else _column("velocity", velocity, t.size)
    states, fibers, tension = np.zeros((3, t.size))
    states[0] = initial_activation
    fibers[0] = kernels.NO_FIBER if initial_fiber_length is None else initial_fiber_length
    counts = np.zeros((t.size, 2), dtype=np.int64)
    params = np.array([parameter_row(law)])
    chosen = dynamics or ActivationDynamics()
    kernels.simulate(
        law.code, params, chosen.form, np.array([chosen.row()]), t, lengths, speeds, drive, _rates(drive, t),
        activation is not None, states, fibers, tension, counts,
    )  # fmt: skip
    return MuscleTrial(t, lengths, states, fibers, tension, counts[:, 0], counts[:, 1])


def _either(first: ArrayLike | None, second: ArrayLike | None) -> ArrayLike:
    return second if first is None and second is not None else first if first is not None else 0.0


def _column(name: str, values: ArrayLike, size: int) -> Array:
    """Return a number or (T,) as an array (T,), finite."""
    given = validation.numbers(values, name, StateError)
    if given.shape not in ((), (size,)):
        raise StateError(f"{name} must be one number or have shape ({size},) like time, not {given.shape}")
    if not np.isfinite(given).all():
        raise StateError(f"{name} is not finite")
    return np.array(np.broadcast_to(given, (size,)), order="C")


def _rates(values: Array, time: Array) -> Array:
    """Return central differences (T,) of a history, one-sided at its ends."""
    if time.size == 1:
        return np.zeros(1)
    return np.gradient(values, time, edge_order=2 if time.size > 2 else 1)
