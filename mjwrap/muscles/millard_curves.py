"""Parameters of the four curves of Millard 2012: those not given, and what is possible."""

from __future__ import annotations

import math
from collections.abc import Sequence

from mjwrap import validation
from mjwrap.errors import ModelError
from mjwrap.kernels.musculotendon import millard_numbers

Numbers = tuple[float, ...]
ACTIVE, VELOCITY = "active_force_length_curve", "force_velocity_curve"
PASSIVE, TENDON = "fiber_force_length_curve", "tendon_force_length_curve"
# OpenSim's class of each curve, and its parameters in OpenSim's order, with its defaults; None: by a rule.
CLASSES = {
    ACTIVE: "ActiveForceLengthCurve",
    VELOCITY: "ForceVelocityCurve",
    PASSIVE: "FiberForceLengthCurve",
    TENDON: "TendonForceLengthCurve",
}
PARAMETERS = {key: millard_numbers.PARAMETERS[kind] for key, kind in CLASSES.items()}
# How many of its parameters a curve may be given: all, or without those that follow by a rule.
COUNTS: dict[str, tuple[int, ...]] = {
    key: tuple(dict.fromkeys((sum(value is not None for value in names.values()), len(names))))
    for key, names in PARAMETERS.items()
}
LEAST_UNDAMPED = 0.1  # least value of the active curve of a muscle without damping
FLAT = 1e-9  # two numbers of a curve must be apart by more than this


def completed(key: str, given: Sequence[float] | None, law: str) -> Numbers:
    """Return all parameters of a curve, the missing ones by OpenSim's rules; `ModelError` where they are impossible."""
    names = PARAMETERS[key]
    if given is None:
        values = [value for value in names.values() if value is not None]
    else:
        what = f"{law}: {key}"
        wanted = f"a list of {' or '.join(str(count) for count in COUNTS[key])} numbers"
        validation.sequence(given, what, ModelError, wanted)
        if len(given) not in COUNTS[key]:
            raise ModelError(f"{what} must be {wanted} ({', '.join(names)}), not {len(given)}")
        values = [
            validation.finite(value, f"{what}: {name}", ModelError)
            for name, value in zip(names, given, strict=False)
        ]
    if key == PASSIVE and len(values) == 2:
        _above(law, key, "strain_at_one_norm_force", values[1], values[0])
        values += millard_numbers.fiber_by_rule(values[0], values[1])
    if key == TENDON and len(values) == 1:
        _above(law, key, "strain_at_one_norm_force", values[0], 0.0)
        values += millard_numbers.tendon_by_rule(values[0])
    _CHECKS[key](law, *values)
    return tuple(values)


def free_of_singularities(active: Numbers, velocity: Numbers, damped: bool) -> tuple[Numbers, Numbers]:
    """Return both curves as OpenSim uses them.

    With damping, or with a rigid tendon, the active curve ends at zero, and the force-velocity curve is flat beyond
    both ends. Without, the active curve does not fall below 0.1, and the force-velocity curve goes on beyond its ends
    with at least half the slopes near them.
    """
    if damped:
        return (*active[:4], 0.0), (0.0, *velocity[1:3], 0.0, *velocity[4:])
    least = max(active[4], LEAST_UNDAMPED)
    at_least, near_least, isometric, at_most, near_most, *others = velocity
    held = max(at_least, 0.5 * near_least), near_least, isometric, max(at_most, 0.5 * near_most), near_most
    return (*active[:4], least), (*held, *others)


def _above(law: str, key: str, name: str, value: float, least: float, most: float = math.inf) -> None:
    """Raise `ModelError` unless a parameter lies between two numbers, and not at them."""
    if not least + FLAT < value < most - FLAT:
        upper = f" and below {most:g}" if most < math.inf else ""
        raise ModelError(f"{law}: {key}: {name} must be above {least:g}{upper}, not {value!r}")


def _within(law: str, key: str, name: str, value: float, least: float = 0.0, most: float = 1.0) -> None:
    """Raise `ModelError` unless a parameter lies between two numbers or at one of them."""
    if not least <= value <= most:
        raise ModelError(f"{law}: {key}: {name} must be in [{least:g}, {most:g}], not {value!r}")


def _check_active(
    law: str, shortest: float, transition: float, longest: float, shallow: float, least: float
) -> None:
    _above(law, ACTIVE, "min_norm_active_fiber_length", shortest, 0.0)
    _above(law, ACTIVE, "transition_norm_fiber_length", transition, shortest, 0.95)
    _above(law, ACTIVE, "max_norm_active_fiber_length", longest, 1.1)
    _above(law, ACTIVE, "shallow_ascending_slope", shallow, 0.0, 1.0 / (0.95 - transition))
    _within(law, ACTIVE, "minimum_value", least, 0.0, 0.5 * (1.0 - shallow * (0.95 - transition)))


def _check_velocity(
    law: str,
    at_least: float,
    near_least: float,
    isometric: float,
    at_most: float,
    near_most: float,
    most: float,
    *curviness: float,
) -> None:
    _above(law, VELOCITY, "max_eccentric_velocity_force_multiplier", most, 1.0)
    _above(law, VELOCITY, "concentric_slope_near_vmax", near_least, 0.0, 1.0)
    _within(law, VELOCITY, "concentric_slope_at_vmax", at_least, 0.0, near_least)
    _above(law, VELOCITY, "isometric_slope", isometric, max(1.0, (most - 1.0)))
    _above(law, VELOCITY, "eccentric_slope_near_vmax", near_most, 0.0, most - 1.0)
    _within(law, VELOCITY, "eccentric_slope_at_vmax", at_most, 0.0, near_most)
    for name, value in zip(("concentric_curviness", "eccentric_curviness"), curviness, strict=True):
        _within(law, VELOCITY, name, value)


def _check_passive(law: str, zero: float, strain: float, low: float, high: float, curviness: float) -> None:
    _above(law, PASSIVE, "strain_at_zero_force", zero, -1.0)
    _above(law, PASSIVE, "strain_at_one_norm_force", strain, zero)
    mean = 1.0 / (strain - zero)
    _above(law, PASSIVE, "stiffness_at_one_norm_force", high, mean)
    _above(law, PASSIVE, "stiffness_at_low_force", low, 0.0, mean)
    _within(law, PASSIVE, "curviness", curviness)


def _check_tendon(law: str, strain: float, stiffness: float, toe: float, curviness: float) -> None:
    _above(law, TENDON, "strain_at_one_norm_force", strain, 0.0)
    _above(law, TENDON, "stiffness_at_one_norm_force", stiffness, 1.0 / strain)
    _above(law, TENDON, "norm_force_at_toe_end", toe, 0.0, 1.0)
    _within(law, TENDON, "curviness", curviness)


_CHECKS = {ACTIVE: _check_active, VELOCITY: _check_velocity, PASSIVE: _check_passive, TENDON: _check_tendon}
