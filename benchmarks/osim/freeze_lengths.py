"""Freeze lengths of paths that OpenSim computes at random poses, as JSON for the tests. Needs the package opensim.

    python benchmarks/osim/freeze_lengths.py MODELS_FOLDER tests/data/osim

Every coordinate gets a random value in its range (a locked one its default, a coupled one what its coupler says); no
constraint is assembled, so that a length is a function of the stated values only. Units: rad, m.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import opensim

MODELS = (
    "arm26", "gait10dof18musc", "gait2392_millard", "leg6dof9musc", "Tug_of_War_Millard",
    "Rajagopal2015_right_leg_9musc", "ThoracoscapularShoulderModel", "CoupledCoordinatesMPPsMomentArmTest",
    "MovingPointCustomJointMomentArmTest", "WrapPathCustomJointMomentArmTest", "PathOnConstrainedBodyMomentArmTest",
    "knee_patella_ligament", "test_wrapAllVis",
)  # fmt: skip
WIDEST = 1.5  # [rad or m] largest distance from the default value that is tried


def frozen(file: Path, poses: int, seed: int) -> dict:
    """Return coordinates, their values at random poses, and the length of every path and of its straight polyline."""
    model = opensim.Model(str(file))
    state = model.initSystem()
    coordinates = [model.getCoordinateSet().get(i) for i in range(model.getCoordinateSet().getSize())]
    couplers = {}
    for i in range(model.getConstraintSet().getSize()):
        coupler = opensim.CoordinateCouplerConstraint.safeDownCast(model.getConstraintSet().get(i))
        if coupler is not None:
            names = coupler.getIndependentCoordinateNames()
            couplers[coupler.getDependentCoordinateName()] = (names.get(0), coupler)
    paths = {}
    for force in model.getForceSet():
        for kind in (opensim.PathActuator, opensim.Ligament, opensim.PathSpring, opensim.Muscle):
            found = kind.safeDownCast(force)
            if found is not None:
                paths[force.getName()] = opensim.GeometryPath.safeDownCast(
                    found.getPath() if hasattr(found, "getPath") else found.getGeometryPath()
                )
    random = np.random.default_rng(seed)
    values, lengths = [], []
    for _ in range(poses):
        pose = {}
        for coordinate in coordinates:
            default = coordinate.getDefaultValue()
            low = max(coordinate.getRangeMin(), default - WIDEST)
            high = min(coordinate.getRangeMax(), default + WIDEST)
            drawn = float(random.uniform(min(low, high), max(low, high)))
            pose[coordinate.getName()] = default if coordinate.getDefaultLocked() else drawn
        for name, (leader, coupler) in couplers.items():
            x = opensim.Vector(1, pose[leader])
            scale = opensim.PropertyHelper.getValueDouble(coupler.getPropertyByName("scale_factor"))
            pose[name] = scale * coupler.getFunction().calcValue(x)
        for coordinate in coordinates:
            if coordinate.getDefaultLocked():
                coordinate.setLocked(state, False)
            coordinate.setValue(state, pose[coordinate.getName()], False)
        model.realizePosition(state)
        values.append([pose[c.getName()] for c in coordinates])
        lengths.append([path.getLength(state) for path in paths.values()])
    return {
        "source": f"OpenSim {opensim.GetVersion()}, {file.name}, benchmarks/osim/freeze_lengths.py, seed {seed}",
        "coordinates": [c.getName() for c in coordinates],
        "values": values,
        "paths": list(paths),
        "wrapped": [path.getWrapSet().getSize() for path in paths.values()],
        "lengths": lengths,
    }


def main() -> None:
    """Write one file for every model."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", type=Path, help="folder of .osim files")
    parser.add_argument("out", type=Path, help="folder to write to")
    parser.add_argument("--poses", type=int, default=8, help="poses a model (default: 8)")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    opensim.Logger.setLevelString("Error")
    for name in MODELS:
        record = frozen(options.models / f"{name}.osim", options.poses, seed=1)
        (options.out / f"lengths_{name}.json").write_text(
            json.dumps(record, indent=0) + "\n", encoding="utf-8"
        )
        print(f"{name}: {len(record['paths'])} paths, {sum(map(bool, record['wrapped']))} with wraps")


if __name__ == "__main__":
    main()
