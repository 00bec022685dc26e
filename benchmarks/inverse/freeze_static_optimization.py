"""Freeze a model, a motion and OpenSim's static optimisation of it, for tests without OpenSim.

    python benchmarks/inverse/freeze_static_optimization.py FOLDER

It needs the package `opensim`. Into FOLDER it writes `parity_arm.osim`, an arm with two hinges and six Millard muscles
on straight lines and via points, some of them pennate, with a reserve of 1 N m at each hinge; `parity_arm.mot`, 201
frames over 1 s; and what OpenSim's StaticOptimization finds, as `parity_arm_activation.sto` and
`parity_arm_force.sto`. Also `pennate_muscles.osim`, one pennate muscle of each law on a slide, and
`pennate_muscles.json`, the active forces along the tendon that the tool takes for them.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

import numpy as np
import opensim

FRAMES = 201
CONVERGENCE = 1e-10  # OpenSim's default, 1e-4, leaves errors of 1e-3 in activations
MASS = {"upper_arm": 1.86, "forearm": 1.53}
# name, force [N], optimal length, slack length [m], pennation [rad], points (body, x, y, z)
GROUND, UPPER, FORE = "ground", "upper_arm", "forearm"
MUSCLES = [
    ("deltoid", 1200.0, 0.10, 0.09, 0.26, [(GROUND, 0.02, 0.03, 0.0), (UPPER, 0.02, -0.15, 0.0)]),
    ("latissimus", 1000.0, 0.14, 0.05, 0.0, [(GROUND, -0.05, -0.08, 0.0), (UPPER, -0.01, -0.08, 0.0)]),
    ("biceps", 800.0, 0.13, 0.19, 0.0, [(GROUND, 0.03, 0.02, 0.0), (UPPER, 0.03, -0.2, 0.0), (FORE, 0.01, -0.05, 0.0)]),
    ("brachialis", 900.0, 0.09, 0.05, 0.15, [(UPPER, 0.02, -0.17, 0.0), (FORE, 0.01, -0.04, 0.0)]),
    ("triceps_long", 800.0, 0.14, 0.15, 0.21,
     [(GROUND, -0.03, -0.03, 0.0), (UPPER, -0.03, -0.28, 0.0), (FORE, -0.02, 0.01, 0.0)]),
    ("triceps_short", 1100.0, 0.09, 0.1, 0.16,
     [(UPPER, -0.03, -0.1, 0.0), (UPPER, -0.03, -0.27, 0.0), (FORE, -0.02, 0.01, 0.0)]),
]  # fmt: skip


def main() -> None:
    folder = Path(sys.argv[1])
    opensim.Logger.setLevelString("Error")
    model = arm()
    model.printToXML(str(folder / "parity_arm.osim"))
    motion = folder / "parity_arm.mot"
    motion.write_text(motion_table())
    freeze_pennate(folder)
    with tempfile.TemporaryDirectory() as made:
        run(str(folder / "parity_arm.osim"), str(motion), made, 1.0, CONVERGENCE)
        for part in ("activation", "force"):
            text = Path(made, f"run_StaticOptimization_{part}.sto").read_text()
            about = (
                f"made by benchmarks/inverse/freeze_static_optimization.py, OpenSim {opensim.GetVersion()}\n"
            )
            (folder / f"parity_arm_{part}.sto").write_text(about + text)


def arm() -> opensim.Model:
    """Return the model."""
    model = opensim.Model()
    model.setName("parity_arm")
    bodies = {GROUND: model.getGround()}
    parent, place = model.getGround(), opensim.Vec3(0)
    for body, joint in ((UPPER, "shoulder"), (FORE, "elbow")):
        bodies[body] = opensim.Body(
            body, MASS[body], opensim.Vec3(0, -0.15, 0), opensim.Inertia(0.013, 0.003, 0.014)
        )
        model.addBody(bodies[body])
        pin = opensim.PinJoint(
            f"{joint}_joint", parent, place, opensim.Vec3(0), bodies[body], opensim.Vec3(0), opensim.Vec3(0)
        )
        pin.updCoordinate().setName(joint)
        model.addJoint(pin)
        parent, place = bodies[body], opensim.Vec3(0, -0.3, 0)
    for name, force, optimal, slack, pennation, points in MUSCLES:
        muscle = opensim.Millard2012EquilibriumMuscle(name, force, optimal, slack, pennation)
        muscle.setMinControl(0.01)
        for i, (body, *at) in enumerate(points):
            muscle.addNewPathPoint(f"{name}-P{i + 1}", bodies[body], opensim.Vec3(*at))
        model.addForce(muscle)
    add_reserves(model, 1.0)
    return model


def add_reserves(model: opensim.Model, optimal: float) -> None:
    """Add a reserve to every coordinate of a model, with its optimal force [N m], [N]."""
    model.finalizeConnections()
    for coordinate in [each.getName() for each in model.getCoordinateSet()]:
        reserve = opensim.CoordinateActuator(coordinate)
        reserve.setName(f"{coordinate}_reserve")
        reserve.setOptimalForce(optimal)
        reserve.setMinControl(-1e5)
        reserve.setMaxControl(1e5)
        model.addForce(reserve)
    model.finalizeConnections()


def freeze_pennate(folder: Path) -> None:
    """Write a model with a pennate muscle of each law, and its active forces with rigid tendons at some states."""
    model = opensim.Model()
    model.setName("pennate_muscles")
    body = opensim.Body("body", 1.0, opensim.Vec3(0), opensim.Inertia(1, 1, 1))
    model.addBody(body)
    slide = opensim.SliderJoint("joint", model.getGround(), body)
    slide.updCoordinate().setName("slide")
    model.addJoint(slide)
    for kind in ("Millard2012EquilibriumMuscle", "Thelen2003Muscle", "DeGrooteFregly2016Muscle"):
        muscle = getattr(opensim, kind)()
        muscle.setName(kind)
        muscle.set_max_isometric_force(1000.0)
        muscle.set_optimal_fiber_length(0.08)
        muscle.set_tendon_slack_length(0.2)
        muscle.set_pennation_angle_at_optimal(0.4)
        muscle.addNewPathPoint("origin", model.getGround(), opensim.Vec3(0))
        muscle.addNewPathPoint("insertion", body, opensim.Vec3(0))
        model.addForce(muscle)
    model.finalizeConnections()
    model.printToXML(str(folder / "pennate_muscles.osim"))
    state, records = model.initSystem(), []
    muscles = [model.getMuscles().get(i) for i in range(model.getMuscles().getSize())]
    for position, speed in ((0.25, 0.0), (0.27, -0.05), (0.29, 0.1)):
        model.getCoordinateSet().get(0).setValue(state, position)
        model.getCoordinateSet().get(0).setSpeedValue(state, speed)
        model.realizeDynamics(state)
        force = {each.getName(): each.calcInextensibleTendonActiveFiberForce(state, 1.0) for each in muscles}
        records.append({"position": position, "speed": speed, "force": force})
    about = {"made by": "benchmarks/inverse/freeze_static_optimization.py", "OpenSim": opensim.GetVersion()}
    (folder / "pennate_muscles.json").write_text(json.dumps(about | {"records": records}) + "\n")


def motion_table() -> str:
    """Return a .mot file [rad]: the elbow bends while the shoulder swings."""
    time = np.linspace(0.0, 1.0, FRAMES)
    shoulder = 0.3 + 0.4 * np.sin(2.0 * np.pi * time)
    elbow = 1.1 - 0.8 * np.cos(2.0 * np.pi * time)
    rows = [f"{t:.17g}\t{a:.17g}\t{b:.17g}" for t, a, b in zip(time, shoulder, elbow, strict=True)]
    head = [
        "motion",
        "version=1",
        f"nRows={FRAMES}",
        "nColumns=3",
        "inDegrees=no",
        "endheader",
        "time\tshoulder\telbow",
    ]
    return "\n".join([*head, *rows, ""])


def run(model: str, motion: str, folder: str, end: float, convergence: float) -> None:
    """Run OpenSim's static optimisation of a motion from 0 to `end` [s]; it writes its tables to a folder."""
    tool = opensim.AnalyzeTool()
    tool.setName("run")
    tool.setModelFilename(model)
    tool.setCoordinatesFileName(motion)
    tool.setLowpassCutoffFrequency(-1.0)
    tool.setInitialTime(0.0)
    tool.setFinalTime(end)
    tool.setResultsDir(folder)
    tool.setOutputPrecision(16)
    optimization = opensim.StaticOptimization()
    optimization.setStartTime(0.0)
    optimization.setEndTime(end)
    optimization.setActivationExponent(2.0)
    optimization.setConvergenceCriterion(convergence)
    optimization.setMaxIterations(2000)
    tool.updAnalysisSet().cloneAndAppend(optimization)
    setup = Path(folder, "setup.xml")
    tool.printToXML(str(setup))
    opensim.AnalyzeTool(str(setup)).run()


if __name__ == "__main__":
    main()
