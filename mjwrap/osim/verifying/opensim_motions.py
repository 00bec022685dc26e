"""Motions of a model in OpenSim that an imported model is compared with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mjwrap.osim.verifying.reference import MotionNumbers, MotionSample

ACCURACY = 1e-9  # of OpenSim's integrator
INTERVAL = 0.01  # between frames [s]
SPREAD = 0.2  # of the start of a passive motion from the default pose [rad, m]
SPEED = 1.0  # at most, then [rad/s, m/s]
MOMENT = 1e-4  # of differences [s]
SAMPLED = 5  # every so many frames of a driven motion have a sample
SHORT = 1e-6  # of differences of lengths [s]


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
        _start(model, state, coordinates, np.random.default_rng(seed))
    muscles = {} if excitation is None else {name: model.getMuscles().get(name) for name in names}
    activation = {name: float(m.getActivation(state)) for name, m in muscles.items()}
    fiber = {name: float(m.getFiberLength(state)) for name, m in muscles.items()}
    places = dict(zip(coordinates, coordinate_places(state, coordinates), strict=True))
    manager = opensim.Manager(model)
    manager.setIntegratorAccuracy(ACCURACY)
    manager.initialize(state)
    times = INTERVAL * np.arange(round(duration / INTERVAL) + 1)
    rows: dict[str, list[float]] = {name: [] for name in coordinates}
    speeds: dict[str, float] = {}
    energy, samples = [], []
    for frame, time in enumerate(times):
        if time > 0.0:
            state = manager.integrate(float(time))
        model.realizeDynamics(state)
        energy.append(float(model.calcKineticEnergy(state) + model.calcPotentialEnergy(state)))
        for name, coordinate in coordinates.items():
            rows[name].append(float(coordinate.getValue(state)))
        if time == 0.0:
            rates = state.getQDot()
            speeds = {name: float(rates.get(places[name])) for name in coordinates}
        if excitation is not None and frame % SAMPLED == 0:
            samples.append(_sample(opensim, model, state, frame, coordinates, places))
    passive = energy if excitation is None else []
    return MotionNumbers(times.tolist(), rows, excitation, activation, fiber, speeds, passive, samples)


def _sample(
    opensim: Any, model: Any, state: Any, frame: int, coordinates: dict[str, Any], places: dict[str, int]
) -> MotionSample:
    """Return what OpenSim says of the muscles at a state."""
    model.realizeAcceleration(state)
    every = model.getMuscles()
    muscles = {every.get(i).getName(): every.get(i) for i in range(every.getSize())}
    rates, second = state.getQDot(), state.getQDotDot()
    beside = []
    for sign in (-1.0, 1.0):
        near, q = opensim.State(state), opensim.Vector(state.getQ())
        for i in range(q.size()):
            q.set(i, q.get(i) + sign * SHORT * rates.get(i))
        near.setQ(q)
        model.realizePosition(near)
        beside.append({name: float(muscle.getLength(near)) for name, muscle in muscles.items()})
    return MotionSample(
        frame=frame,
        speeds={name: float(rates.get(places[name])) for name in coordinates},
        accelerations={name: float(second.get(places[name])) for name in coordinates},
        activation={name: float(muscle.getActivation(state)) for name, muscle in muscles.items()},
        fiber_length={name: float(muscle.getFiberLength(state)) for name, muscle in muscles.items()},
        lengths={name: float(muscle.getLength(state)) for name, muscle in muscles.items()},
        lengthening={name: (beside[1][name] - beside[0][name]) / (2.0 * SHORT) for name in muscles},
        velocities={name: float(muscle.getLengtheningSpeed(state)) for name, muscle in muscles.items()},
        tensions={name: float(muscle.getTendonForce(state)) for name, muscle in muscles.items()},
    )


def coordinate_places(state: Any, coordinates: dict[str, Any]) -> list[int]:
    """Return the place of each coordinate in OpenSim's vector q, whose rates are not the speeds u of all joints."""
    found = []
    for coordinate in coordinates.values():
        value, before = float(coordinate.getValue(state)), _q(state)
        locked = coordinate.getLocked(state)
        coordinate.setLocked(state, False)
        coordinate.setValue(state, value + 0.125, False)
        found.append(int(np.argmax(np.abs(_q(state) - before))))
        coordinate.setValue(state, value, False)
        coordinate.setLocked(state, locked)
    return found


def _q(state: Any) -> np.ndarray:
    q = state.getQ()
    return np.array([q.get(i) for i in range(q.size())])


def _bound(opensim: Any, model: Any) -> bool:
    """Return whether a model has constraints other than couplers."""
    every = model.getConstraintSet()
    kind = opensim.CoordinateCouplerConstraint
    return any(kind.safeDownCast(every.get(i)) is None for i in range(every.getSize()))


def _start(model: Any, state: Any, coordinates: dict[str, Any], rng: np.random.Generator) -> None:
    """Move the free coordinates, and give them speeds; the others follow, their speeds by differences."""
    drawn = {name: (rng.uniform(-SPREAD, SPREAD), rng.uniform(-SPEED, SPEED)) for name in coordinates}
    free = [name for name, c in coordinates.items() if not c.isConstrained(state)]
    start = {name: float(coordinates[name].getValue(state)) + drawn[name][0] for name in free}

    def values(time: float) -> dict[str, float]:
        for name in free:
            coordinates[name].setValue(state, float(start[name] + time * drawn[name][1]), False)
        model.assemble(state)
        return {name: float(c.getValue(state)) for name, c in coordinates.items()}

    before, after = values(-MOMENT), values(MOMENT)
    values(0.0)
    for name, coordinate in coordinates.items():
        if name in free:
            coordinate.setSpeedValue(state, float(drawn[name][1]))
        elif not coordinate.getLocked(state):
            coordinate.setSpeedValue(state, (after[name] - before[name]) / (2.0 * MOMENT))
