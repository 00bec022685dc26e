"""Numbers of the curves of Millard et al. 2013 (doi 10.1115/1.4023390) in OpenSim: names, order, defaults and rules."""

from __future__ import annotations

# The parameters of each class of curves, in OpenSim's order, with its defaults; None: by a rule from the others.
PARAMETERS: dict[str, dict[str, float | None]] = {
    "ActiveForceLengthCurve": {
        "min_norm_active_fiber_length": 0.4441,
        "transition_norm_fiber_length": 0.73,
        "max_norm_active_fiber_length": 1.8123,
        "shallow_ascending_slope": 0.8616,
        "minimum_value": 0.1,
    },
    "ForceVelocityCurve": {
        "concentric_slope_at_vmax": 0.0,
        "concentric_slope_near_vmax": 0.25,
        "isometric_slope": 5.0,
        "eccentric_slope_at_vmax": 0.0,
        "eccentric_slope_near_vmax": 0.15,
        "max_eccentric_velocity_force_multiplier": 1.4,
        "concentric_curviness": 0.6,
        "eccentric_curviness": 0.9,
    },
    "FiberForceLengthCurve": {
        "strain_at_zero_force": 0.0,
        "strain_at_one_norm_force": 0.7,
        "stiffness_at_low_force": None,
        "stiffness_at_one_norm_force": None,
        "curviness": None,
    },
    "TendonForceLengthCurve": {
        "strain_at_one_norm_force": 0.049,
        "stiffness_at_one_norm_force": None,
        "norm_force_at_toe_end": None,
        "curviness": None,
    },
}


def fiber_by_rule(zero: float, strain: float) -> tuple[float, float, float]:
    """Return stiffness at low force and at one, and curviness, of a fibre with these strains at zero and at one."""
    return 0.2, 2.0 / (strain - zero), 0.75


def tendon_by_rule(strain: float) -> tuple[float, float, float]:
    """Return stiffness at one, force at the toe's end, and curviness, of a tendon with this strain at one."""
    return 1.375 / strain, 2.0 / 3.0, 0.5


def defaults(kind: str) -> tuple[float, ...]:
    """Return all parameters of a class with its defaults."""
    given = [value for value in PARAMETERS[kind].values() if value is not None]
    if kind == "FiberForceLengthCurve":
        return (*given, *fiber_by_rule(given[0], given[1]))
    return (*given, *tendon_by_rule(given[0])) if kind == "TendonForceLengthCurve" else tuple(given)
