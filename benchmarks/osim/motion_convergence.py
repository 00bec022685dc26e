#!/usr/bin/env python3
"""Show how an imported model's motions come closer to OpenSim's as the time step shrinks.

    python benchmarks/osim/motion_convergence.py MODEL.osim ... [--steps 0.001 0.0002 0.0001]

Needs the package opensim. The motions are those of `mjwrap import --verify`: one under gravity alone, and one driven by
muscles with every other force off. Printed for each step: the largest difference of a coordinate from OpenSim's motion,
at the frames (0.01 s), before OpenSim's lengthening speeds contradict its lengths, and how far coupled joints come
apart. The equalities' time constants are two steps, as in an imported file.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import mujoco
import numpy as np

import mjwrap as mw
from mjwrap.osim.verifying.imported import ImportedModel
from mjwrap.osim.verifying.opensim_numbers import compute_reference
from mjwrap.osim.verifying.reference import MotionNumbers

CONTRADICTION = 1e-3  # [m/s]


def trusted(motion: MotionNumbers) -> int:
    """Return the number of frames before a sample at which OpenSim's muscles contradict themselves."""
    for before, sample in zip([None, *motion.samples], motion.samples, strict=False):
        gaps = [abs(sample.velocities[name] - sample.lengthening[name]) for name in sample.lengths]
        if max(gaps, default=0.0) > CONTRADICTION:
            return 1 if before is None else before.frame + 1
    return len(motion.time)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", nargs="+", type=Path)
    parser.add_argument("--steps", nargs="+", type=float, default=[1e-3, 2e-4, 1e-4])
    options = parser.parse_args()
    for path in options.models:
        reference = compute_reference(path, 1, 0)
        with tempfile.TemporaryDirectory() as folder:
            mw.import_osim(path).save(Path(folder) / "model.xml")
            model = mujoco.MjModel.from_xml_path(str(Path(folder) / "model.xml"))
        imported = ImportedModel(model)
        for what, motion in (("passive", reference.passive), ("driven", reference.driven)):
            if motion is None:
                continue
            for step in options.steps:
                ours, frames = imported.motion(motion, step), trusted(motion)
                gaps = [
                    np.abs(values - np.array(motion.coordinates[name]))[:frames].max()
                    for name, values in ours.coordinates.items()
                ]
                apart = max(ours.coupling_errors.values(), default=0.0)
                print(
                    f"{path.stem}, {what}, {1e3 * step:g} ms: {max(gaps):.1e} rad or m until "
                    f"{motion.time[frames - 1]:g} s, "
                    f"couplings {apart:.1e}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
