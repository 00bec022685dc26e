"""Lengths, angles and forces of fibres and tendons at one instant, as OpenSim's MuscleAnalysis reports them."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from mjwrap.kernels.musculotendon.dispatch import curve_set, has_fiber, length_curves, velocity_force
from mjwrap.kernels.musculotendon.fiber import (
    DAMPING,
    ELASTIC,
    F_MAX,
    HEIGHT,
    LEAST,
    OPTIMAL,
    SLACK,
    V_MAX,
    held_activation,
)
from mjwrap.kernels.musculotendon.tension import tension

Vector = NDArray[np.float64]
SHORTEST = 1e-300  # [m] keeps a fibre without length and height from dividing by zero


@dataclass(frozen=True, eq=False)
class FiberState:
    """Fibres and tendons of n muscles at one instant, as arrays (n,).

    Lengths, velocities and angles are NaN for muscles whose law has no fibre (MuJoCo's, the path actuator). Their
    passive force is the tension without activation, and their active force is the rest, both along the path.

    Attributes:
        length: fibre length [m].
        normalized_length: fibre length per optimal fibre length.
        velocity: fibre velocity [m/s], positive when lengthening.
        normalized_velocity: fibre velocity per maximum contraction velocity.
        pennation: pennation angle [rad].
        pennation_rate: rate of the pennation angle [rad/s].
        tendon_length: length of the tendon [m]; its slack length if it is rigid.
        active_force: active force along the fibre [N].
        passive_force: passive force along the fibre [N]: of the parallel elastic element and of the damping.
        active_force_along_tendon: active force times the cosine of the pennation angle [N].
        passive_force_along_tendon: passive force times this cosine [N].
    """

    length: Vector
    normalized_length: Vector
    velocity: Vector
    normalized_velocity: Vector
    pennation: Vector
    pennation_rate: Vector
    tendon_length: Vector
    active_force: Vector
    passive_force: Vector
    active_force_along_tendon: Vector
    passive_force_along_tendon: Vector

    @property
    def force(self) -> Vector:
        """Sum of active and passive force along the fibre [N]."""
        return self.active_force + self.passive_force


def fiber_state(
    law: NDArray[np.int64],
    params: Vector,
    activation: Vector,
    length: Vector,
    velocity: Vector,
    fiber_length: Vector,
    fiber_velocity: Vector,
) -> FiberState:
    """Return the state of the fibres and tendons of n muscles.

    Args:
        law: (n,) codes of the laws, as in the kernels.
        params: (n, PARAMS) parameters of the muscles, as in the kernels.
        activation: (n,) 0 to 1.
        length: (n,) musculotendon lengths [m].
        velocity: (n,) lengthening speeds [m/s].
        fiber_length: (n,) [m], along the fibre.
        fiber_velocity: (n,) [m/s], as in `Energetics`.

    Returns:
        The state.
    """
    out = {field.name: np.full(len(law), np.nan) for field in fields(FiberState)}
    for m in range(len(law)):
        given = float(activation[m]), float(length[m]), float(velocity[m])
        if has_fiber(int(law[m])):
            now = float(fiber_length[m]), float(fiber_velocity[m])
            curves = curve_set(int(law[m]), params, m)
            activation_held = float(held_activation(params, m, given[0]))
            values = _with_fiber(curves, params[m], activation_held, given[1], *now)
        else:
            passive = tension(int(law[m]), params, m, 0.0, *given[1:])
            active = tension(int(law[m]), params, m, *given) - passive
            values = {"active_force": active, "passive_force": passive}
            values |= {f"{name}_along_tendon": value for name, value in values.items()}
        for name, value in values.items():
            out[name][m] = value
    return FiberState(**out)


def _with_fiber(
    curves: int, row: Vector, activation: float, length: float, fiber: float, speed: float
) -> dict[str, float]:
    """Return the state of a muscle with a fibre; row (PARAMS,): its parameters, curves: as of `curve_set`."""
    height, optimal, fastest = float(row[HEIGHT]), float(row[OPTIMAL]), float(row[V_MAX] * row[OPTIMAL])
    now = max(fiber, float(row[LEAST]) if row[ELASTIC] else height, SHORTEST)
    along = float(np.sqrt(max(now * now - height * height, 0.0)))
    cosine = along / now if height else 1.0
    multiplier, _, elastic, _ = length_curves(curves, now / optimal)
    rate, _, _ = velocity_force(curves, activation, speed / fastest)
    active = row[F_MAX] * activation * multiplier * rate
    passive = row[F_MAX] * (elastic + row[DAMPING] * speed / fastest)
    return {
        "length": now,
        "normalized_length": now / optimal,
        "velocity": speed,
        "normalized_velocity": speed / fastest,
        "pennation": float(np.arctan2(height, along)),
        "pennation_rate": -speed * height / (now * along) if along > 0.0 else 0.0,
        "tendon_length": length - along if row[ELASTIC] else float(row[SLACK]),
        "active_force": active,
        "passive_force": passive,
        "active_force_along_tendon": active * cosine,
        "passive_force_along_tendon": passive * cosine,
    }
