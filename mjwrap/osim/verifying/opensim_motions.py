"""Motions of a model in OpenSim that an imported model is compared with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mjwrap.osim.verifying.reference import MotionNumbers

ACCURACY = 1e-9  # of OpenSim's integrator
INTERVAL = 0.01  # between frames [s]
SPREAD, SPEED = (
    0.2,
    1.0,
)  # of the start of a passive motion: distance from the default pose and speed [rad, m, rad/s, m/s]


def opensim_motion(
    opensim: Any, path: Path, excitation: float | None, duration: float, seed: int
) -> MotionNumbers:
    """Return a motion in which no force but gravity acts and, with an excitation, muscles; `RuntimeError` if it fails.

    A driven motion starts at the default pose at rest. A passive one starts near it with random speeds, or at rest at
    the default pose where constraints hold bodies together.
    """
    model = opensim.Model(str(path))
    model.set_assembly_accuracy(1e-12)
    forces = model.updForceSet()
    for i in range(forces.getSize()):
        if excitation is None or opensim.Muscle.safeDownCast(forces.get(i)) is None:
            forces.get(i).set_appliesForce(False)
    controllers = model.updControllerSet()
    for i in range(controllers.getSize()):
        controllers.get(i).setEnabled(False)
    every = model.getMuscles()
    names = [every.get(i).getName() for i in range(every.getSize())]
    if excitation is not None:
        controller = opensim.PrescribedController()
        controller.setName("mjwrap_excitation")
        for name in names:
            controller.addActuator(model.getMuscles().get(name))
            controller.prescribeControlForActuator(name, opensim.Constant(excitation))
        model.addController(controller)
    state = model.initSystem()
    found = model.getCoordinateSet()
    coordinates = {found.get(i).getName(): found.get(i) for i in range(found.getSize())}
    if excitation is not None:
        model.equilibrateMuscles(state)
    elif not _bound(opensim, model):
        _start(state, coordinates, np.random.default_rng(seed))
    muscles = {} if excitation is None else {name: model.getMuscles().get(name) for name in names}
    activation = {name: float(m.getActivation(state)) for name, m in muscles.items()}
    fiber = {name: float(m.getFiberLength(state)) for name, m in muscles.items()}
    manager = opensim.Manager(model)
    manager.setIntegratorAccuracy(ACCURACY)
    manager.initialize(state)
    times = INTERVAL * np.arange(round(duration / INTERVAL) + 1)
    rows: dict[str, list[float]] = {name: [] for name in coordinates}
    speeds: dict[str, float] = {}
    energy = []
    for time in times:
        if time > 0.0:
            state = manager.integrate(float(time))
        model.realizeDynamics(state)
        energy.append(float(model.calcKineticEnergy(state) + model.calcPotentialEnergy(state)))
        for name, coordinate in coordinates.items():
            rows[name].append(float(coordinate.getValue(state)))
            if time == 0.0:
                speeds[name] = float(coordinate.getSpeedValue(state))
    passive = energy if excitation is None else []
    return MotionNumbers(times.tolist(), rows, excitation, activation, fiber, speeds, passive)


def _bound(opensim: Any, model: Any) -> bool:
    """Return whether a model has constraints other than couplers."""
    every = model.getConstraintSet()
    kind = opensim.CoordinateCouplerConstraint
    return any(kind.safeDownCast(every.get(i)) is None for i in range(every.getSize()))


def _start(state: Any, coordinates: dict[str, Any], rng: np.random.Generator) -> None:
    for coordinate in coordinates.values():
        change, speed = rng.uniform(-SPREAD, SPREAD), rng.uniform(-SPEED, SPEED)
        if coordinate.getLocked(state) or coordinate.isConstrained(state):
            continue
        value = coordinate.getValue(state) + change
        coordinate.setValue(state, float(value), False)
        coordinate.setSpeedValue(state, float(speed))
