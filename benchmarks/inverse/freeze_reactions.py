"""Freeze OpenSim's joint reactions at random states under given muscle forces into a JSON file, for tests.

    python benchmarks/inverse/freeze_reactions.py MODEL.osim OUTPUT.json

It needs the package `opensim`. Muscles without wrapping objects pull with random forces, others with none; no other
force but gravity acts. The accelerations are those of OpenSim's forward dynamics, whose constraints hold followers of
couplers. Stored are free coordinates with rates, tensions, and for every joint what JointReaction takes its numbers
from: `calcReactionOnChildExpressedInGround` at the origin of the child frame, and that on the parent.
"""

from __future__ import annotations

import json
import sys
from hashlib import sha256
from pathlib import Path

import numpy as np
import opensim

STATES = 5
STEP = 0.02  # [s] of difference quotients of linear functions


def main() -> None:
    path, output = Path(sys.argv[1]), Path(sys.argv[2])
    opensim.Logger.setLevelString("Off")
    model = opensim.Model(str(path))
    for force in model.getForceSet():
        if opensim.Muscle.safeDownCast(force) is None:
            force.set_appliesForce(False)
    state = model.initSystem()
    rng = np.random.default_rng(23)
    coordinates = list(model.getCoordinateSet())
    free = [c for c in coordinates if not c.isConstrained(state)]
    muscles = [m for m in model.getMuscles() if not m.getGeometryPath().getWrapSet().getSize()]
    about = {
        "made by": "benchmarks/inverse/freeze_reactions.py",
        "OpenSim": opensim.GetVersion(),
        "model": path.name,
        "sha256": sha256(path.read_bytes()).hexdigest(),
        "coordinates": [c.getName() for c in free],
        "muscles": [m.getName() for m in muscles],
        "joints": {j.getName(): body(j.getChildFrame()) for j in model.getJointSet()},
        "states": [one(model, state, rng, free, muscles) for _ in range(STATES)],
    }
    output.write_text(json.dumps(about) + "\n")


def body(frame: opensim.PhysicalFrame) -> str:
    return str(frame.findBaseFrame().getName())


def one(
    model: opensim.Model, state: opensim.State, rng: np.random.Generator, free: list, muscles: list
) -> dict[str, object]:
    """Return a random state with its accelerations and reactions."""
    for coordinate in free:
        low, high = coordinate.getRangeMin(), coordinate.getRangeMax()
        middle, half = (low + high) / 2, min((high - low) / 2, 1.0)
        coordinate.setValue(state, float(middle + half * rng.uniform(-0.6, 0.6)), False)
    model.assemble(state)
    for coordinate in free:
        coordinate.setSpeedValue(state, float(rng.uniform(-1.0, 1.0)))
    follow(model, state, free)
    for muscle in model.getMuscles():
        muscle.overrideActuation(state, True)
        muscle.setOverrideActuation(state, 0.0)
    tension = [float(x) for x in np.round(rng.uniform(0.0, 300.0, len(muscles)), 3)]
    for muscle, pull in zip(muscles, tension, strict=True):
        muscle.setOverrideActuation(state, pull)
    model.realizeAcceleration(state)
    reactions = {}
    for joint in model.getJointSet():
        row = []
        for on in (joint.calcReactionOnChildExpressedInGround, joint.calcReactionOnParentExpressedInGround):
            loads = on(state)
            row.append([loads.get(k).get(i) for k in (1, 0) for i in range(3)])
        place = [
            frame.getPositionInGround(state) for frame in (joint.getChildFrame(), joint.getParentFrame())
        ]
        row += [[point.get(i) for i in range(3)] for point in place]
        reactions[joint.getName()] = row
    return {
        "values": [c.getValue(state) for c in free],
        "speeds": [c.getSpeedValue(state) for c in free],
        "accelerations": [c.getAccelerationValue(state) for c in free],
        "tension": tension,
        "reactions": reactions,
    }


def follow(model: opensim.Model, state: opensim.State, free: list) -> None:
    """Set the speeds of coordinates that follow linear couplers, whose difference quotients are exact."""
    known = {c.getName() for c in free}
    moved = [opensim.State(state) for _ in range(2)]
    for sign, other in zip((-1.0, 1.0), moved, strict=True):
        for c in free:
            c.setValue(other, c.getValue(state) + sign * STEP * c.getSpeedValue(state), False)
        model.assemble(other)
    for c in model.getCoordinateSet():
        if c.getName() not in known:
            before, after = (c.getValue(other) for other in moved)
            c.setSpeedValue(state, (after - before) / (2 * STEP))


if __name__ == "__main__":
    main()
