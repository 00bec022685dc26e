"""Freeze OpenSim's numbers of models for `mjwrap import --verify --numbers`, as JSON for the tests.

    python benchmarks/osim/freeze_verify.py MODELS_FOLDER tests/data/osim [--poses 3] [--models NAME ...]

It needs the package opensim. Each model has a process of its own, because OpenSim keeps the <defaults> of one model for
the next. The files are called verify_MODEL.json.
"""

import argparse
import subprocess
import sys
from pathlib import Path

from mjwrap.osim.verifying.opensim_numbers import compute_reference

MODELS = (
    "arm26", "BushingForceModel_30000", "CoupledCoordinatesMPPsMomentArmTest", "leg6dof9musc",
    "PathOnConstrainedBodyMomentArmTest", "StationDefinedFrames_Basic", "Tug_of_War_Millard",
    "WrapPathCustomJointMomentArmTest", "knee_patella_ligament", "ThoracoscapularShoulderModel",
)  # fmt: skip
STILL = ("ThoracoscapularShoulderModel",)  # without motions, which OpenSim computes in minutes


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("output", type=Path)
    parser.add_argument("--poses", type=int, default=3)
    parser.add_argument("--models", nargs="+", default=MODELS)
    options = parser.parse_args()
    if len(options.models) == 1:
        name = options.models[0]
        reference = compute_reference(
            options.folder / f"{name}.osim", options.poses, motions=name not in STILL
        )
        reference.save(options.output / f"verify_{name}.json")
        return
    for name in options.models:
        command = [sys.executable, __file__, options.folder, options.output, "--poses", str(options.poses)]
        subprocess.run([*map(str, command), "--models", name], check=True)


if __name__ == "__main__":
    main()
