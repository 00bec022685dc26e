"""Make tests/data/umberger2010.csv with OpenSim's Umberger2010MuscleMetabolicsProbe: python tests/umberger_table.py

One De Groote-Fregly muscle with a rigid tendon on a slider, its activation and control set, and four probes on it: all
heats and work, activation and maintenance heat alone, shortening heat alone, work alone. Drawn from a seed: 40 states
for each of six sets of options. Needs the opensim wheel; the tests need the table only.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

TABLE = Path(__file__).parent / "data" / "umberger2010.csv"
SEED = 2010
STATES = 40
OPTIONS = (
    "slow_twitch_ratio",
    "aerobic_factor",
    "effort",
    "recruitment",
    "negative_work",
    "forbid",
    "minimum",
    "mass",
)
SETS = (  # mass nan: from the maximum isometric force and the optimal fibre length
    (0.5, 1.5, 1.0, 1, 1, 1, 1, np.nan),  # OpenSim's defaults
    (0.4, 1.5, 1.0, 0, 0, 0, 1, np.nan),  # as published in 2010
    (0.7, 1.5, 1.0, 0, 1, 0, 1, np.nan),  # as published in 2003
    (0.3, 1.0, 1.0, 1, 1, 1, 0, np.nan),
    (0.6, 1.5, 0.8, 1, 0, 1, 1, 0.35),
    (0.0, 1.5, 1.0, 1, 1, 0, 0, np.nan),
)
MUSCLES = (  # F_max [N], l_o [m], l_s [m], pennation [rad], v_max [l_o/s], fibre damping
    (1000.0, 0.10, 0.20, 0.0, 10.0, 0.0),
    (3549.0, 0.05, 0.25, 0.44, 8.0, 0.1),
)
SIZES = (
    "max_isometric_force",
    "optimal_fiber_length",
    "tendon_slack_length",
    "pennation",
    "max_velocity",
    "damping",
)
STATE = ("activation", "excitation", "length", "velocity")
FIBER = ("norm_fiber_length", "fiber_velocity", "active_fiber_force", "active_multiplier")
POWERS = ("total", "activation_maintenance", "shortening", "work")
COLUMNS = SIZES + OPTIONS + STATE + FIBER + POWERS


def build(osim: Any, sizes: tuple[float, ...], options: tuple[float, ...]) -> tuple[Any, Any, Any]:
    """Return a model of one muscle with its four probes, its state and the muscle."""
    slow, aerobic, effort, recruitment, negative, forbid, minimum, mass = options
    model = osim.Model()
    body = osim.Body("body", 1.0, osim.Vec3(0), osim.Inertia(1))
    joint = osim.SliderJoint("joint", model.getGround(), body)
    model.addBody(body)
    model.addJoint(joint)
    muscle = osim.DeGrooteFregly2016Muscle()
    muscle.setName("muscle")
    muscle.set_max_isometric_force(sizes[0])
    muscle.set_optimal_fiber_length(sizes[1])
    muscle.set_tendon_slack_length(sizes[2])
    muscle.set_pennation_angle_at_optimal(sizes[3])
    muscle.set_max_contraction_velocity(sizes[4])
    muscle.set_fiber_damping(sizes[5])
    muscle.set_ignore_tendon_compliance(True)
    muscle.addNewPathPoint("origin", model.updGround(), osim.Vec3(0))
    muscle.addNewPathPoint("insertion", body, osim.Vec3(0))
    model.addForce(muscle)
    for heat, shortening, work in ((1, 1, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1)):
        probe = osim.Umberger2010MuscleMetabolicsProbe(bool(heat), bool(shortening), False, bool(work))
        probe.setName(f"probe_{heat}{shortening}{work}")
        probe.set_aerobic_factor(aerobic)
        probe.set_muscle_effort_scaling_factor(effort)
        probe.set_use_Bhargava_recruitment_model(bool(recruitment))
        probe.set_include_negative_mechanical_work(bool(negative))
        probe.set_forbid_negative_total_power(bool(forbid))
        probe.set_enforce_minimum_heat_rate_per_muscle(bool(minimum))
        probe.addMuscle("muscle", slow)
        model.addProbe(probe)
        if not np.isnan(mass):
            model.finalizeConnections()
            model.initSystem()
            probe.useProvidedMass("muscle", mass)
    state = model.initSystem()
    return model, state, osim.DeGrooteFregly2016Muscle.safeDownCast(model.getMuscles().get(0))


def measure(
    osim: Any, sizes: tuple[float, ...], options: tuple[float, ...], rows: np.ndarray
) -> list[list[float]]:
    """Return what OpenSim has for each row of activation, excitation, length [m] and lengthening speed [m/s]."""
    model, state, muscle = build(osim, sizes, options)
    coordinate = model.getCoordinateSet().get(0)
    found = []
    for activation, excitation, length, velocity in rows:
        coordinate.setValue(state, length)
        coordinate.setSpeedValue(state, velocity)
        muscle.setActivation(state, activation)
        model.realizeVelocity(state)
        model.setControls(state, osim.Vector(1, excitation))
        model.realizeReport(state)
        fiber = [
            muscle.getNormalizedFiberLength(state),
            muscle.getFiberVelocity(state),
            muscle.getActiveFiberForce(state),
            muscle.getActiveForceLengthMultiplier(state),
        ]
        probes = model.getProbeSet()
        powers = [
            osim.Probe.safeDownCast(probes.get(k)).getProbeOutputs(state).get(0) for k in range(len(POWERS))
        ]
        seen = [muscle.getActivation(state), muscle.getControl(state), muscle.getLength(state)]
        found.append([*sizes, *options, *seen, velocity, *fiber, *powers])
    return found


def draw(rng: np.random.Generator, sizes: tuple[float, ...]) -> np.ndarray:
    """Return states (STATES, 4): some passive, one at rest, fibres of 0.5 to 1.5 l_o, 1.2 v_max at most."""
    _, optimal, slack, pennation, fastest, _ = sizes
    fiber = rng.uniform(max(0.5, 1.2 * np.sin(pennation)), 1.5, STATES) * optimal
    along = np.sqrt(fiber**2 - (optimal * np.sin(pennation)) ** 2)
    activation, excitation = rng.uniform(0.01, 1.0, STATES), rng.uniform(0.0, 1.0, STATES)
    excitation[:6] = (0.0, 0.0, 1e-3, 1.0, 1.0, 0.2)
    activation[:3] = 0.01
    speed = rng.uniform(-1.2, 1.2, STATES) * rng.choice((0.05, 1.0), STATES) * fastest * optimal
    speed[3] = 0.0
    return np.stack([activation, excitation, slack + along, speed], axis=1)


def main() -> None:
    """Write the table."""
    import opensim

    opensim.Logger.setLevelString("off")
    rng = np.random.default_rng(SEED)
    rows = []
    for k, options in enumerate(SETS):
        sizes = MUSCLES[k % 2]
        rows += measure(opensim, sizes, options, draw(rng, sizes))
    head = (
        f"# Umberger2010MuscleMetabolicsProbe of OpenSim {opensim.GetVersion()}, made by tests/umberger_table.py, "
        f"seed {SEED}\n# SI units; lengthening positive; mass nan: F_max / 0.25e6 x 1059.7 x l_o\n"
    )
    lines = [",".join(f"{float(value):.17g}" for value in row) for row in rows]
    TABLE.parent.mkdir(exist_ok=True)
    TABLE.write_text(head + ",".join(COLUMNS) + "\n" + "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
