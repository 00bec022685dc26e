"""OpenSim's muscle classes as mjwrap's laws: which law, which numbers, and what an element of the file loses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from mjwrap.errors import ModelError
from mjwrap.mjcf.parameters import law_arguments
from mjwrap.muscles.activation import ActivationDynamics
from mjwrap.muscles.laws import LAWS, parameter_row
from mjwrap.muscles.millard_curves import CLASSES, PARAMETERS
from mjwrap.osim.description.forces import Muscle

HILL = {  # numeric -> the file's parameter, of every class with fibre and tendon
    "max_isometric_force": "max_isometric_force",
    "optimal_fiber_length": "optimal_fiber_length",
    "tendon_slack_length": "tendon_slack_length",
    "pennation_angle": "pennation_angle_at_optimal",
    "max_contraction_velocity": "max_contraction_velocity",
}
THELEN = {
    "max_tendon_strain": "FmaxTendonStrain",
    "max_fiber_strain": "FmaxMuscleStrain",
    "active_shape": "KshapeActive",
    "passive_shape": "KshapePassive",
    "velocity_shape": "Af",
    "max_lengthening_force": "Flen",
    "velocity_extrapolation": "fv_linear_extrap_threshold",
}
MINIMUM, MOST_PENNATION = "minimum_activation", "max_pennation"
ACTIVATION = ("activation_time_constant", "deactivation_time_constant")
AT_ONCE = 1e-9  # [s] time constants of a muscle whose file ignores activation dynamics
THELEN_CLASSES = ("Thelen2003Muscle", "Thelen2003Muscle_Deprecated")
MILLARD_CLASSES = ("Millard2012EquilibriumMuscle", "Millard2012AccelerationMuscle")


@dataclass
class WrittenLaw:
    """A law's name, its numbers by numeric, its words by text, and what differs from the file's muscle."""

    name: str
    numbers: dict[str, list[float]] = field(default_factory=dict)
    words: dict[str, str] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)  # approximations
    own_states: bool = True  # mjwrap integrates the activation, else it is the control


def law_of(muscle: Muscle) -> WrittenLaw:
    """Return the law of a muscle."""
    given = muscle.parameters
    law = WrittenLaw("millard_2012")
    _take(law, HILL, given)
    law.words["tendon_model"] = "rigid" if muscle.rigid_tendon else "elastic"
    if muscle.kind in THELEN_CLASSES:
        law.name = "thelen_2003"
        _take(law, THELEN, given)
        _take(law, {MINIMUM: MINIMUM, MOST_PENNATION: "maximum_pennation_angle"}, given)
    elif muscle.kind in MILLARD_CLASSES:
        _millard(law, muscle)
    elif muscle.kind == "DeGrooteFregly2016Muscle":
        _degroote(law, given)
    elif muscle.kind.startswith("Schutte1993"):
        law.remarks.append(f"{muscle.kind} has the curves and dynamics of Millard2012EquilibriumMuscle")
        _take(law, {"fiber_damping": "damping"}, given)
    else:
        law.remarks.append(f"{muscle.kind} is not known: it has the curves of Millard2012EquilibriumMuscle")
        _take(law, {MINIMUM: MINIMUM}, given)
    _dynamics(law, muscle)
    return law


def refusal(law: WrittenLaw) -> str:
    """Return why mjwrap does not accept the numbers of a law, or an empty string."""
    tendon = law.words.get("tendon_model")
    up, down = law.numbers.get("activation_time_constants", (None, None))
    try:
        with np.errstate(divide="raise", invalid="raise", over="raise"):
            found = LAWS[law.name](
                **law_arguments(law.numbers), **({} if tendon is None else {"tendon": tendon})
            )
            parameter_row(found)
        ActivationDynamics(law.words.get("activation_dynamics", "zajac"), up, down)
    except ModelError as error:
        return str(error)
    except FloatingPointError as error:
        return f"law {law.name}: a curve cannot be computed from the file's numbers ({error})"
    return ""


def _take(law: WrittenLaw, names: Mapping[str, str], given: Mapping[str, float]) -> None:
    for numeric, parameter in names.items():
        if parameter in given:
            law.numbers[numeric] = [float(given[parameter])]


def _millard(law: WrittenLaw, muscle: Muscle) -> None:
    names = {MINIMUM: MINIMUM, MOST_PENNATION: "maximum_pennation_angle", "fiber_damping": "fiber_damping"}
    _take(law, names, muscle.parameters)
    for numeric, kind in CLASSES.items():
        curve = muscle.curves.get(kind, {})
        if all(name in curve for name in PARAMETERS[numeric]):
            law.numbers[numeric] = [float(curve[name]) for name in PARAMETERS[numeric]]
    if muscle.kind == "Millard2012AccelerationMuscle":
        law.remarks.append("the fibre has no mass: it is that of Millard2012EquilibriumMuscle")


def _degroote(law: WrittenLaw, given: Mapping[str, float]) -> None:
    law.name = "degroote_fregly_2016"
    _take(
        law,
        {"fiber_damping": "fiber_damping", "activation_smoothing": "activation_dynamics_smoothing"},
        given,
    )
    law.words["activation_dynamics"] = "degroote_fregly_2016"
    usual = {"active_force_width_scale": 1.0, "tendon_strain_at_one_norm_force": 0.049,
             "passive_fiber_strain_at_one_norm_force": 0.6, "ignore_passive_fiber_force": 0.0}  # fmt: skip
    for name, value in usual.items():
        if abs(given.get(name, value) - value) > 1e-12:
            law.remarks.append(f"{name} is {value:g}, not the file's {given[name]:g}")


def _dynamics(law: WrittenLaw, muscle: Muscle) -> None:
    given = muscle.parameters
    if given.get("ignore_activation_dynamics", 0.0):
        law.words.pop("activation_dynamics", None)
        law.numbers["activation_time_constants"] = [AT_ONCE, AT_ONCE]
    elif all(name in given for name in ACTIVATION):
        law.numbers["activation_time_constants"] = [float(given[name]) for name in ACTIVATION]
