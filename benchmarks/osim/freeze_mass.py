"""Freeze body poses and reduced mass matrices of OpenSim models into a JSON file, for tests without OpenSim.

    python benchmarks/osim/freeze_mass.py FOLDER OUTPUT.json [MODEL.osim ...]

It needs the package `opensim`. For each model, at seeded random values of the coordinates that follow no other, it
stores these values, the position and rotation of two bodies, and M x for one vector x: M is the mass matrix for the
rates of these coordinates. Point, weld and distance constraints are left aside, and locked coordinates released.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import opensim

POSES = 50
WIDEST = 2.0  # [rad or m] coordinates are drawn from their range, within this distance of zero


def main() -> None:
    folder, output = Path(sys.argv[1]), Path(sys.argv[2])
    names = sys.argv[3:] or sorted(path.name for path in folder.glob("*.osim"))
    opensim.Logger.setLevelString("Off")
    records = {name: record for name in names if (record := freeze(folder / name))}
    about = {"made by": "benchmarks/osim/freeze_mass.py", "OpenSim": opensim.GetVersion(), "models": records}
    output.write_text(json.dumps(about, separators=(",", ":")).replace('"values"', '\n"values"') + "\n")


def freeze(path: Path) -> dict:
    """Return the record of one model; empty where nothing moves."""
    model = opensim.Model(str(path))
    state = model.initSystem()
    coordinates = {c.getName(): c for c in model.getCoordinateSet()}
    for coordinate in coordinates.values():
        coordinate.setLocked(state, False)
    if not coordinates:
        return {}
    couplers = couplers_of(model)
    independent = [name for name in coordinates if name not in couplers]
    rng = np.random.default_rng(5)
    direction = rng.normal(size=len(independent))
    bodies = [body.getName() for body in model.getBodySet()]
    shown = [bodies[len(bodies) // 2], bodies[-1]]
    poses = []
    for _ in range(POSES):
        values = {}
        for name in independent:
            low, high = coordinates[name].getRangeMin(), coordinates[name].getRangeMax()
            values[name] = float(rng.uniform(max(low, -WIDEST), min(high, WIDEST)))
        spread = spread_out(values, list(coordinates), couplers)
        for name, coordinate in coordinates.items():
            coordinate.setValue(state, values[name], False)
        model.realizePosition(state)
        matrix = rate_mass_matrix(model, state, list(coordinates.values()))
        poses.append(
            {
                "values": [values[name] for name in independent],
                "bodies": [pose_of(model, state, name) for name in shown],
                "mass_times_direction": (spread.T @ matrix @ spread @ direction).tolist(),
            }
        )
    return {"coordinates": independent, "direction": direction.tolist(), "bodies": shown, "poses": poses}


def couplers_of(model: opensim.Model) -> dict:
    """Return (leader, function, scale) by dependent coordinate."""
    found = {}
    for constraint in model.getConstraintSet():
        if constraint.getConcreteClassName() == "CoordinateCouplerConstraint":
            coupler = opensim.CoordinateCouplerConstraint.safeDownCast(constraint)
            leaders = coupler.getIndependentCoordinateNames()
            scale = coupler.getPropertyByName("scale_factor")
            factor = opensim.PropertyHelper.getValueDouble(scale)
            found[coupler.getDependentCoordinateName()] = leaders.get(0), coupler.getFunction(), factor
    return found


def spread_out(values: dict, names: list, couplers: dict) -> np.ndarray:
    """Set the dependent values; return the derivatives of all coordinates (n, k) by the independent ones."""
    independent = list(values)
    spread = np.zeros((len(names), len(independent)))
    for column, name in enumerate(independent):
        spread[names.index(name), column] = 1.0
    waiting = dict(couplers)
    while waiting:
        for name, (leader, function, factor) in list(waiting.items()):
            if leader in values:
                at = opensim.Vector(1, values[leader])
                order = opensim.StdVectorInt()
                order.push_back(0)
                values[name] = factor * function.calcValue(at)
                slope = factor * function.calcDerivative(order, at)
                spread[names.index(name)] = slope * spread[names.index(leader)]
                del waiting[name]
    return spread


def rate_mass_matrix(model: opensim.Model, state: opensim.State, coordinates: list) -> np.ndarray:
    """Return the mass matrix (n, n) for the rates of the coordinates, in their order.

    The speeds of free, ball and ellipsoid joints are angular velocities in Simbody, and not rates: q' = N u.
    """
    matter = model.getMatterSubsystem()
    packed = opensim.Matrix()
    matter.calcM(state, packed)
    mass = np.array([[packed.get(i, k) for k in range(packed.ncol())] for i in range(packed.nrow())])
    rates = np.zeros((state.getNQ(), state.getNU()))
    for k in range(state.getNU()):
        unit, out = opensim.Vector(state.getNU(), 0.0), opensim.Vector(state.getNQ(), 0.0)
        unit.set(k, 1.0)
        matter.multiplyByN(state, False, unit, out)
        rates[:, k] = [out.get(i) for i in range(state.getNQ())]
    rows = [q_index(model, state, coordinate) for coordinate in coordinates]
    inverse = np.linalg.inv(rates[rows])
    return inverse.T @ mass @ inverse


def q_index(model: opensim.Model, state: opensim.State, coordinate: opensim.Coordinate) -> int:
    """Return the place of a coordinate in Simbody's q."""
    before, value = state.getQ(), coordinate.getValue(state)
    old = [before.get(i) for i in range(state.getNQ())]
    coordinate.setValue(state, value + 1.0, False)
    after = state.getQ()
    found = next(i for i in range(state.getNQ()) if after.get(i) != old[i])
    coordinate.setValue(state, value, False)
    model.realizePosition(state)
    return found


def pose_of(model: opensim.Model, state: opensim.State, body: str) -> list:
    """Return position (3) and rotation matrix (9, row by row) of a body in ground."""
    pose = model.getBodySet().get(body).getTransformInGround(state)
    return [pose.p().get(i) for i in range(3)] + [pose.R().get(i, k) for i in range(3) for k in range(3)]


if __name__ == "__main__":
    main()
