"""Write what OpenSim says of muscles at random states, for tests/test_osim_muscles.py, to tests/data/osim/muscles.json.

Run it with a Python that has the `opensim` wheel (4.6): python benchmarks/osim/freeze_muscles.py FOLDER, with the
folder of the models. A set is the muscles of one model, or a muscle with curves of its own; each has 200 states. A
muscle pulls on a slider, so that its length is any number; its other parameters are those of the file.
"""

from __future__ import annotations

import argparse
import importlib
import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

osim: Any = importlib.import_module("opensim")  # not among the packages that mjwrap needs

STATES = 200
MODELS = (
    "gait10dof18musc.osim",
    "gait2392_millard.osim",
    "Rajagopal2015_right_leg_9musc.osim",
    "ThoracoscapularShoulderModel.osim",
    "Tug_of_War_Millard.osim",
    "arm26.osim",
    "leg6dof9musc.osim",
)
OUT = Path(__file__).parents[2] / "tests" / "data" / "osim" / "muscles.json"
MOST = 8  # muscles of a model that are taken
HILL = {
    "max_isometric_force": "max_isometric_force",
    "optimal_fiber_length": "optimal_fiber_length",
    "tendon_slack_length": "tendon_slack_length",
    "pennation_angle": "pennation_angle_at_optimal",
    "max_contraction_velocity": "max_contraction_velocity",
    "minimum_activation": "minimum_activation",
    "max_pennation": "maximum_pennation_angle",
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
CURVES = {
    "active_force_length_curve": "ActiveForceLengthCurve",
    "force_velocity_curve": "ForceVelocityCurve",
    "fiber_force_length_curve": "FiberForceLengthCurve",
    "tendon_force_length_curve": "TendonForceLengthCurve",
}
# Muscles beyond those of the models: law, and what differs from a plain muscle.
PLAIN = {
    "max_isometric_force": 1000.0,
    "optimal_fiber_length": 0.1,
    "tendon_slack_length": 0.2,
    "pennation_angle": 0.3,
    "max_contraction_velocity": 10.0,
    "minimum_activation": 0.01,
    "times": [0.012, 0.05],
}
SHAPED = {
    "active_force_length_curve": [0.35, 0.7, 1.7, 0.9, 0.05],
    "force_velocity_curve": [0.05, 0.3, 4.0, 0.06, 0.2, 1.5, 0.5, 0.8],
    "fiber_force_length_curve": [-0.05, 0.55, 0.15, 5.0, 0.6],
    "tendon_force_length_curve": [0.07, 25.0, 0.5, 0.7],
}
OWN: dict[str, tuple[str, dict[str, Any]]] = {
    "own curves, damped": ("millard_2012", {"fiber_damping": 0.1, **SHAPED}),
    "own curves, undamped": ("millard_2012", {"fiber_damping": 0.0, "minimum_activation": 0.02, **SHAPED}),
    "default curves, undamped": ("millard_2012", {"fiber_damping": 0.0}),
    "stiff tendon, steep limb": (
        "millard_2012",
        {
            "fiber_damping": 0.02,
            "max_pennation": 1.2,
            "pennation_angle": 0.5,
            "tendon_force_length_curve": [0.02],
            "fiber_force_length_curve": [0.1, 0.9],
            "active_force_length_curve": [0.5, 0.8, 1.6, 0.5, 0.0],
        },
    ),
    "Thelen, OpenSim's defaults": ("thelen_2003", {}),
    "Thelen, other shapes": (
        "thelen_2003",
        {
            "max_tendon_strain": 0.08,
            "max_fiber_strain": 0.5,
            "active_shape": 0.6,
            "passive_shape": 3.0,
            "velocity_shape": 0.4,
            "max_lengthening_force": 1.6,
            "velocity_extrapolation": 0.8,
            "max_pennation": 1.1,
            "minimum_activation": 0.05,
        },
    ),
}


def numbers(curve: Any) -> list[float]:
    """Return the parameters of a curve of OpenSim's that are set, in its order."""
    found: list[float] = []
    for i in range(curve.getNumProperties()):
        given = curve.getPropertyByIndex(i)
        if given.size():
            found.append(float(given.toString()))
    return found


def parameters(muscle: Any) -> tuple[str, dict[str, Any]]:
    """Return law and parameters of a muscle of a model."""
    thelen = muscle.getConcreteClassName() == "Thelen2003Muscle"
    kind = osim.Thelen2003Muscle if thelen else osim.Millard2012EquilibriumMuscle
    exact = kind.safeDownCast(muscle)
    names = HILL | (THELEN if thelen else {"fiber_damping": "fiber_damping"})
    given: dict[str, Any] = {key: getattr(exact, f"get_{name}")() for key, name in names.items()}
    if not thelen:
        given |= {key: numbers(getattr(exact, f"get{name}")()) for key, name in CURVES.items()}
    given["times"] = [exact.get_activation_time_constant(), exact.get_deactivation_time_constant()]
    return ("thelen_2003" if thelen else "millard_2012"), given


def build(law: str, given: dict[str, Any], rigid: bool) -> tuple[Any, Any, Any]:
    """Return a model with the muscle on a slider, the muscle, and a state."""
    model = osim.Model()
    body = osim.Body("body", 1.0, osim.Vec3(0), osim.Inertia(1))
    model.addBody(body)
    model.addJoint(osim.SliderJoint("slider", model.getGround(), body))
    muscle = osim.Thelen2003Muscle() if law == "thelen_2003" else osim.Millard2012EquilibriumMuscle()
    muscle.setName("muscle")
    names = HILL | (THELEN if law == "thelen_2003" else {"fiber_damping": "fiber_damping"})
    for key, name in names.items():
        if key in given:
            getattr(muscle, f"set_{name}")(given[key])
    for key, name in CURVES.items():
        if key in given:
            curve = getattr(osim, name)()
            for i, value in enumerate(given[key]):
                words = curve.getPropertyByIndex(i).getName()
                getattr(curve, f"set_{words}")(value)
            getattr(muscle, f"set_{name}")(curve)
    muscle.set_activation_time_constant(given["times"][0])
    muscle.set_deactivation_time_constant(given["times"][1])
    muscle.setMinControl(max(0.01, given["minimum_activation"]))
    muscle.set_ignore_tendon_compliance(rigid)
    muscle.addNewPathPoint("from", model.getGround(), osim.Vec3(0))
    muscle.addNewPathPoint("to", body, osim.Vec3(0))
    model.addForce(muscle)
    state = model.initSystem()
    return model, model.getMuscles().get(0), state


def evaluate(law: str, given: dict[str, Any], states: list[list[float]]) -> list[list[float]]:
    """Return tensions with a rigid tendon, at equilibrium and at the fibre length, fibre velocity, activation's rate.

    Tensions in maximum isometric forces; NaN where OpenSim has no rigid tendon, or finds no equilibrium or velocity.
    """
    found: list[list[float]] = [[] for _ in states]
    force = given["max_isometric_force"]
    for rigid in (True, False):
        if rigid and law == "thelen_2003":  # OpenSim has no rigid tendon for it
            found = [[math.nan] for _ in states]
            continue
        model, muscle, state = build(law, given, rigid)
        coordinate = model.getCoordinateSet().get(0)
        for k, (activation, excitation, length, speed, fiber) in enumerate(states):
            coordinate.setValue(state, length, False)
            coordinate.setSpeedValue(state, speed)
            muscle.setStateVariableValue(state, "activation", activation)
            if rigid:
                model.realizeDynamics(state)
                found[k].append(muscle.getTendonForce(state) / force)
                continue
            muscle.setStateVariableValue(state, "fiber_length", fiber)
            model.realizeVelocity(state)
            controls = model.updControls(state)  # after the rest, which resets them
            controls.set(0, excitation)
            model.setControls(state, controls)
            try:
                model.realizeAcceleration(state)
                tension, velocity = muscle.getTendonForce(state) / force, muscle.getFiberVelocity(state)
                rate = muscle.getStateVariableDerivativeValue(state, "activation")
            except RuntimeError:  # OpenSim's search for the fibre velocity did not end
                tension = velocity = rate = math.nan
            coordinate.setSpeedValue(state, 0.0)
            try:
                muscle.computeEquilibrium(state)
                model.realizeDynamics(state)
                rest = muscle.getTendonForce(state) / force
            except RuntimeError:
                rest = math.nan
            found[k] += [rest, tension, velocity, rate]
    return found


def random_states(given: dict[str, Any], count: int, rng: np.random.Generator) -> list[list[float]]:
    """Return activation, excitation, length [m], speed [m/s] and fibre length [m], rounded so that they are short."""
    optimal, slack = given["optimal_fiber_length"], given["tendon_slack_length"]
    height = optimal * math.sin(given.get("pennation_angle", 0.0))
    shortest = 0.46 * optimal
    if "active_force_length_curve" in given:
        shortest = (given["active_force_length_curve"][0] + 0.02) * optimal
    shortest = max(shortest, 1.02 * height / math.sin(given.get("max_pennation", math.acos(0.1))))
    made: list[list[float]] = []
    while len(made) < count:
        fiber = rng.uniform(shortest, max(1.5 * optimal, 1.3 * shortest))
        strain = given.get("max_tendon_strain", given.get("tendon_force_length_curve", [0.049])[0])
        tendon = slack * (1.0 + rng.uniform(-0.2, 1.3) * strain)
        length = math.sqrt(max(fiber**2 - height**2, 0.0)) + tendon
        low = given["minimum_activation"]
        activation = low + (1.0 - low) * rng.uniform() ** 2
        speed = rng.uniform(-1.2, 1.2) * optimal * given["max_contraction_velocity"]
        values = activation, rng.uniform(), length, speed, fiber
        made.append([float(f"{value:.8g}") for value in values])
    return made


def main() -> int:
    """Write the file."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("folder", type=Path, help="folder of the OpenSim models")
    folder = parser.parse_args().folder
    osim.Logger.setLevelString("Off")
    sets: dict[str, list[dict[str, Any]]] = {}
    for name in MODELS:
        model = osim.Model(str(folder / name))
        model.initSystem()
        muscles = model.getMuscles()
        places = np.unique(np.linspace(0, muscles.getSize() - 1, MOST).astype(int))
        sets[name] = []
        for i in map(int, places):
            law, given = parameters(muscles.get(i))
            sets[name].append({"muscle": muscles.get(i).getName(), "law": law, "parameters": given})
    for name, (law, given) in OWN.items():
        sets[name] = [{"muscle": name, "law": law, "parameters": PLAIN | given}]
    rng = np.random.default_rng(16)
    for name, muscles_of in sets.items():
        share = math.ceil(STATES / len(muscles_of))
        for each in muscles_of:
            given = each["parameters"]
            if each["law"] == "millard_2012" and given["fiber_damping"] == 0.0:
                given["minimum_activation"] = max(given["minimum_activation"], 0.01)
            each["states"] = random_states(given, share, rng)
            results = evaluate(each["law"], given, each["states"])
            each["results"] = [
                [None if math.isnan(x) else float(f"{x:.14g}") for x in row] for row in results
            ]
        print(name, len(muscles_of), flush=True)
    OUT.parent.mkdir(parents=True, exist_ok=True)
    document = {
        "made by": "benchmarks/osim/freeze_muscles.py",
        "program": f"OpenSim {osim.GetVersion()}",
        "columns of states": ["activation", "excitation", "length", "speed", "fiber length"],
        "columns of results": [
            "rigid",
            "equilibrium",
            "at fiber length",
            "fiber velocity",
            "activation rate",
        ],
        "sets": sets,
    }
    OUT.write_text(json.dumps(document, separators=(",", ":")) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
