"""Freeze generalised forces of OpenSim's forces on coordinates into a JSON file, for tests without OpenSim.

    python benchmarks/osim/freeze_forces.py MODEL.osim OUTPUT.json

It needs the package `opensim`, and a model without constraints. At seeded random values and rates of all coordinates it
stores, for each force alone, M (q''(with the force) - q''(without)), for the rates of the coordinates.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import opensim
from freeze_mass import q_index, rate_mass_matrix

STATES = 5
CONTROL = 0.7


def main() -> None:
    path, output = Path(sys.argv[1]), Path(sys.argv[2])
    opensim.Logger.setLevelString("Off")
    rng = np.random.default_rng(11)
    model = opensim.Model(str(path))
    coordinates = [c.getName() for c in model.getCoordinateSet()]
    forces = [force.getName() for force in model.getForceSet()]
    states = [
        (rng.uniform(-0.4, 0.4, len(coordinates)), rng.normal(size=len(coordinates))) for _ in range(STATES)
    ]
    without = [acceleration(path, None, *state) for state in states]
    found = {}
    for force in forces:
        rows = []
        for state, (quiet, mass) in zip(states, without, strict=True):
            rows.append((mass @ (acceleration(path, force, *state)[0] - quiet)).tolist())
        found[force] = rows
    about = {
        "made by": "benchmarks/osim/freeze_forces.py",
        "OpenSim": opensim.GetVersion(),
        "model": path.name,
    }
    about |= {"coordinates": coordinates, "control": CONTROL, "forces": found}
    about["states"] = [[q.tolist(), rates.tolist()] for q, rates in states]
    output.write_text(json.dumps(about) + "\n")


def acceleration(
    path: Path, only: str | None, q: np.ndarray, rates: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return q'' (n,) with one force, or none, and the mass matrix (n, n), at a state."""
    model = opensim.Model(str(path))
    for force in range(model.getForceSet().getSize()):
        each = model.updForceSet().get(force)
        each.set_appliesForce(each.getName() == only)
    state = model.initSystem()
    coordinates = list(model.getCoordinateSet())
    for coordinate, value in zip(coordinates, q, strict=True):
        coordinate.setValue(state, float(value), False)
    model.realizePosition(state)
    mass = rate_mass_matrix(model, state, coordinates)
    order = [q_index(model, state, coordinate) for coordinate in coordinates]
    matter = model.getMatterSubsystem()
    by_speed = np.zeros((state.getNQ(), state.getNU()))
    for k in range(state.getNU()):
        unit, out = opensim.Vector(state.getNU(), 0.0), opensim.Vector(state.getNQ(), 0.0)
        unit.set(k, 1.0)
        matter.multiplyByN(state, False, unit, out)
        by_speed[:, k] = [out.get(i) for i in range(state.getNQ())]
    speeds = np.linalg.solve(by_speed[order], rates)
    for k, speed in enumerate(speeds):
        state.updU().set(k, float(speed))
    model.realizeVelocity(state)
    controls = model.getDefaultControls()
    for k in range(controls.size()):
        controls.set(k, CONTROL)
    model.setControls(state, controls)
    model.realizeAcceleration(state)
    return np.array([state.getQDotDot().get(i) for i in order]), mass


if __name__ == "__main__":
    main()
