"""Read the parameters of the curves of a Millard muscle, with the values that OpenSim takes for those not given."""

from __future__ import annotations

from mjwrap.kernels.musculotendon.millard_numbers import PARAMETERS, fiber_by_rule, tendon_by_rule
from mjwrap.osim.reading.nodes import Node


def read_curves(muscle: Node) -> dict[str, dict[str, float]]:
    """Return all parameters of the four curves of a muscle, by class."""
    return {kind: _curve(muscle, kind) for kind in PARAMETERS}


def _curve(muscle: Node, kind: str) -> dict[str, float]:
    node = muscle.find(kind)
    values: dict[str, float | None] = dict(PARAMETERS[kind])
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
    fitted = [tag for tag, default in PARAMETERS[kind].items() if default is None]
    given = [tag for tag in fitted if values[tag] is not None]
    if given and len(given) < len(fitted):
        assert node is not None
        raise node.error(f"gives {', '.join(given)} only; {', '.join(fitted)} must be given all or none")
    if fitted and not given:
        fiber = kind == "FiberForceLengthCurve"
        rule = fiber_by_rule(0.0, stretch) if fiber else tendon_by_rule(stretch)
        values.update(zip(fitted, rule, strict=True))
    return {tag: float(value) for tag, value in values.items() if value is not None}
