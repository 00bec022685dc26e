"""The parameters of the curves of a Millard muscle, with the values that OpenSim takes for those not given."""

from __future__ import annotations

from mjwrap.osim.reading.nodes import Node

CURVES: dict[str, dict[str, float | None]] = {
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


def read_curves(muscle: Node) -> dict[str, dict[str, float]]:
    """Return all parameters of the four curves of a muscle, by class."""
    return {kind: _curve(muscle, kind) for kind in CURVES}


def _curve(muscle: Node, kind: str) -> dict[str, float]:
    node = muscle.find(kind)
    values: dict[str, float | None] = dict(CURVES[kind])
    if kind == "ActiveForceLengthCurve" and muscle.tag == "Millard2012AccelerationMuscle":
        values["minimum_value"] = 0.0
    if node is not None:
        for tag, default in values.items():
            values[tag] = (
                (node.numbers(tag) or [default])[0] if default is None else node.number(tag, default=default)
            )
    stretch = (values.get("strain_at_one_norm_force") or 0.0) - (values.get("strain_at_zero_force") or 0.0)
    if node is not None and "strain_at_one_norm_force" in values and not stretch > 0.0:
        raise node.error("strain_at_one_norm_force must be positive and above strain_at_zero_force")
    fitted = [tag for tag, default in CURVES[kind].items() if default is None]
    given = [tag for tag in fitted if values[tag] is not None]
    if given and len(given) < len(fitted):
        assert node is not None
        raise node.error(f"gives {', '.join(given)} only; {', '.join(fitted)} must be given all or none")
    if fitted and not given:
        values.update(_fiber(stretch) if kind == "FiberForceLengthCurve" else _tendon(stretch))
    return {tag: float(value) for tag, value in values.items() if value is not None}


def _fiber(stretch: float) -> dict[str, float]:
    return {"stiffness_at_low_force": 0.2, "stiffness_at_one_norm_force": 2.0 / stretch, "curviness": 0.75}


def _tendon(stretch: float) -> dict[str, float]:
    return {
        "stiffness_at_one_norm_force": 1.375 / stretch,
        "norm_force_at_toe_end": 2.0 / 3.0,
        "curviness": 0.5,
    }
