"""Freeze passive motions of OpenSim models into a JSON file, for tests without OpenSim.

    python benchmarks/osim/freeze_motion.py FOLDER OUTPUT.json

It needs the package `opensim`. All forces but gravity are switched off. Models without other constraints than couplers
start with seeded random values and speeds, the others at rest in their assembled default pose.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import opensim

MODELS = {  # whether they start with random values and speeds
    "arm26.osim": True,
    "gait10dof18musc.osim": True,
    "gait2392_millard.osim": True,
    "PathOnConstrainedBodyMomentArmTest.osim": False,
    "knee_patella_ligament.osim": False,
    "CoupledCoordinatesMPPsMomentArmTest.osim": False,
    "ThoracoscapularShoulderModel.osim": False,
}
TIMES = (0.1, 0.2, 0.3)
ACCURACY = 1e-11


def main() -> None:
    folder, output = Path(sys.argv[1]), Path(sys.argv[2])
    opensim.Logger.setLevelString("Off")
    records = {name: freeze(folder / name, moving) for name, moving in MODELS.items()}
    about = {
        "made by": "benchmarks/osim/freeze_motion.py",
        "OpenSim": opensim.GetVersion(),
        "models": records,
    }
    output.write_text(json.dumps(about, indent=1) + "\n")


def freeze(path: Path, moving: bool) -> dict:
    """Return the values and speeds of all coordinates at the start, and their values at later times."""
    model = opensim.Model(str(path))
    for i in range(model.getForceSet().getSize()):
        model.updForceSet().get(i).set_appliesForce(False)
    state = model.initSystem()
    coordinates = list(model.getCoordinateSet())
    rng = np.random.default_rng(3)
    if moving:
        for coordinate in coordinates:
            change, speed = rng.uniform(-0.2, 0.2), rng.uniform(-2.0, 2.0)
            coordinate.setValue(state, coordinate.getValue(state) + change, False)
            coordinate.setSpeedValue(state, speed)
            if coordinate.getName().startswith("knee"):
                coordinate.setValue(state, -0.5, False)
                coordinate.setSpeedValue(state, -3.0)
    start = {c.getName(): [c.getValue(state), c.getSpeedValue(state)] for c in coordinates}
    manager = opensim.Manager(model)
    manager.setIntegratorAccuracy(ACCURACY)
    manager.initialize(state)
    later = []
    for time in TIMES:
        state = manager.integrate(time)
        later.append({c.getName(): c.getValue(state) for c in coordinates})
    return {"start": start, "times": TIMES, "values": later}


if __name__ == "__main__":
    main()
