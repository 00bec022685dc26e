"""Muscles of all classes: parameters with OpenSim's default values, curves, and splines."""

from __future__ import annotations

from collections.abc import Mapping

from mjwrap.osim.description.forces import Muscle
from mjwrap.osim.description.functions import Piecewise
from mjwrap.osim.description.paths import Path
from mjwrap.osim.reading.default_curves import OF_MUSCLES, spline_through
from mjwrap.osim.reading.functions import read_property
from mjwrap.osim.reading.millard_curves import read_curves
from mjwrap.osim.reading.nodes import Node

_NEARLY_RIGHT = 1.4706289056333368  # [rad] the largest pennation angle, acos(0.1)

COMMON: dict[str, float] = {
    "optimal_force": 1.0,
    "max_isometric_force": 1000.0,
    "optimal_fiber_length": 0.1,
    "tendon_slack_length": 0.2,
    "pennation_angle_at_optimal": 0.0,
    "max_contraction_velocity": 10.0,
    "ignore_tendon_compliance": 0.0,
    "ignore_activation_dynamics": 0.0,
}
MILLARD: dict[str, float] = {
    "fiber_damping": 0.1,
    "default_activation": 0.05,
    "default_fiber_length": 0.1,
    "activation_time_constant": 0.01,
    "deactivation_time_constant": 0.04,
    "minimum_activation": 0.01,
    "maximum_pennation_angle": _NEARLY_RIGHT,
}
SIMM: dict[str, float] = {"time_scale": 0.1, "activation1": 7.667, "activation2": 1.45985}
OWN: dict[str, dict[str, float]] = {
    "Thelen2003Muscle": {
        "default_activation": 0.05,
        "default_fiber_length": 0.1,
        "FmaxTendonStrain": 0.04,
        "FmaxMuscleStrain": 0.6,
        "KshapeActive": 0.45,
        "KshapePassive": 5.0,
        "Af": 0.25,
        "Flen": 1.4,
        "fv_linear_extrap_threshold": 0.95,
        "maximum_pennation_angle": _NEARLY_RIGHT,
        "activation_time_constant": 0.015,
        "deactivation_time_constant": 0.05,
        "minimum_activation": 0.01,
    },
    "Millard2012EquilibriumMuscle": MILLARD,
    "Millard2012AccelerationMuscle": {
        **MILLARD,
        "default_activation": 0.0,
        "default_fiber_velocity": 0.0,
        "minimum_activation": 0.0,
    },
    "DeGrooteFregly2016Muscle": {
        "activation_time_constant": 0.015,
        "deactivation_time_constant": 0.06,
        "default_activation": 0.5,
        "default_normalized_tendon_force": 0.5,
        "active_force_width_scale": 1.0,
        "fiber_damping": 0.0,
        "passive_fiber_strain_at_one_norm_force": 0.6,
        "tendon_strain_at_one_norm_force": 0.049,
        "ignore_passive_fiber_force": 0.0,
        "activation_dynamics_smoothing": 0.1,
    },
    "RigidTendonMuscle": {},
    "Schutte1993Muscle_Deprecated": {**SIMM, "damping": 0.1},
    "Delp1990Muscle_Deprecated": {**SIMM, "mass": 0.00287},
    "Thelen2003Muscle_Deprecated": {
        "activation_time_constant": 0.01,
        "deactivation_time_constant": 0.04,
        "Vmax": 10.0,
        "Vmax0": 5.0,
        "FmaxTendonStrain": 0.033,
        "FmaxMuscleStrain": 0.6,
        "KshapeActive": 0.5,
        "KshapePassive": 4.0,
        "damping": 0.05,
        "Af": 0.3,
        "Flen": 1.8,
    },
}
LEAST_CONTROL = {"Thelen2003Muscle": 0.01, "Millard2012EquilibriumMuscle": 0.01}
NEW_PENNATION = 20302  # the document version that first had pennation_angle_at_optimal
SPLINES = (
    "active_force_length_curve",
    "passive_force_length_curve",
    "tendon_force_length_curve",
    "force_velocity_curve",
)
MILLARD_CLASSES = ("Millard2012EquilibriumMuscle", "Millard2012AccelerationMuscle")


def is_muscle(node: Node) -> bool:
    """Return whether a force is a muscle of a class that is known, or of one with a muscle's parameters."""
    return (
        bool(_own(node))
        or node.tag in OWN
        or (node.tag.find("Muscle") >= 0 and node.find("max_isometric_force") is not None)
    )


def read_muscle(node: Node, name: str, path: Path, active: bool) -> Muscle:
    """Return a muscle along a path."""
    parameters: dict[str, float] = {}
    for tag, default in {**COMMON, **_own(node)}.items():
        parameters[tag] = _value(node, tag, default)
    if node.tag not in OWN:
        parameters.update(_all_numbers(node, parameters))
    for tag in ("max_isometric_force", "optimal_fiber_length"):
        if not parameters[tag] > 0.0:
            raise node.error(f"{tag} must be positive, not {parameters[tag]:g}")
    if parameters["tendon_slack_length"] < 0.0:
        raise node.error(
            f"tendon_slack_length must not be negative, not {parameters['tendon_slack_length']:g}"
        )
    fastest, older = parameters["max_contraction_velocity"], node.find("Vmax")
    if "Vmax" not in parameters and node.tag in OWN and older is not None and older.values() != [fastest]:
        node.note(f"its Vmax is not used; as in OpenSim 4 max_contraction_velocity is {fastest:g}")
    curves: Mapping[str, Mapping[str, float]] = {}
    if node.tag in MILLARD_CLASSES:
        curves = read_curves(node)
    known = OF_MUSCLES.get(node.tag) or OF_MUSCLES.get(f"{node.tag}_Deprecated") or {}
    splines: dict[str, Piecewise] = {tag: spline_through(knots) for tag, knots in known.items()}
    for tag in SPLINES:
        if node.object(tag) is not None:
            splines[tag] = read_property(node, tag)
    low = node.number("min_control", default=LEAST_CONTROL.get(node.tag, 0.0), finite=False)
    high = node.number("max_control", default=1.0, finite=False)
    rigid = bool(parameters["ignore_tendon_compliance"]) or node.tag == "RigidTendonMuscle"
    return Muscle(name, node.tag, path, parameters, curves, splines, rigid, active, (low, high))


def _own(node: Node) -> dict[str, float]:
    """Return the parameters that only this class has, with their defaults; older files lack "_Deprecated" in names."""
    return OWN.get(node.tag) or OWN.get(f"{node.tag}_Deprecated") or {}


def _value(node: Node, tag: str, default: float) -> float:
    tags = (tag,)
    if tag == "pennation_angle_at_optimal" and node.document.version < NEW_PENNATION:
        tags = (tag, "pennation_angle")
    if tag.startswith("ignore_"):
        return float(node.flag(*tags, default=bool(default)))
    if node.find(*tags) is None:
        activation = node.find("MuscleFirstOrderActivationDynamicModel")
        if activation is not None:
            return activation.number(tag, default=default)
    return node.number(*tags, default=default)


def _all_numbers(node: Node, known: Mapping[str, float]) -> dict[str, float]:
    """Return all other children that are one number."""
    numbers = {}
    for child in node.children:
        if child.tag not in known and not child.children and len(child.text.split()) == 1:
            text = child.text.strip().lower()
            if text in ("true", "false"):
                numbers[child.tag] = float(text == "true")
            elif text[0] in "+-.0123456789":
                numbers[child.tag] = child.values()[0]
    return numbers
