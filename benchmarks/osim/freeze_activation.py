"""Write rates of activation of OpenSim's DeGrooteFregly2016Muscle for tests/test_osim_activation.py.

Run it with a Python that has the `opensim` wheel (4.6): python benchmarks/osim/freeze_activation.py. The muscles are
those of tests/data/osim/own_activation.osim; each has 50 random states, some with excitation close to activation.

OpenSim 4.6 keeps the constants of the first muscle that a process evaluates, and takes them for all muscles. So each
muscle is alone in its model, in a process of its own.
"""

from __future__ import annotations

import importlib
import json
import multiprocessing
from pathlib import Path
from typing import Any

import numpy as np

DATA = Path(__file__).parents[2] / "tests" / "data" / "osim"
NAMES = ("usual", "slow", "sharp", "between")
STATES = 50


def rates(index: int) -> tuple[str, list[list[float]]]:
    """Return the program, and activation, excitation and rate [1/s] of a muscle at random states."""
    osim: Any = importlib.import_module("opensim")  # not among the packages that mjwrap needs
    model = osim.Model(str(DATA / "own_activation.osim"))
    for k in reversed(range(len(NAMES))):
        if k != index:
            model.updForceSet().remove(k)
    state = model.initSystem()
    (muscle,) = (model.getMuscles().get(k) for k in range(model.getMuscles().getSize()))
    assert muscle.getName() == NAMES[index]
    rng = np.random.default_rng(16 + index)
    found = []
    for k in range(STATES):
        activation, excitation = (float(f"{x:.6g}") for x in rng.uniform(0.01, 1.0, 2))
        if k % 5 == 0:
            excitation = activation + float(f"{rng.uniform(-0.01, 0.01):.3g}")
        muscle.setActivation(state, activation)
        model.realizeVelocity(state)
        model.setControls(state, osim.Vector(1, excitation))
        model.realizeAcceleration(state)
        found.append([activation, excitation, muscle.getStateVariableDerivativeValue(state, "activation")])
    return f"OpenSim {osim.GetVersion()}", found


def main() -> None:
    """Write the file."""
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        results = pool.map(rates, range(len(NAMES)), chunksize=1)
    content = {
        "made by": "benchmarks/osim/freeze_activation.py",
        "program": results[0][0],
        "columns": ["activation", "excitation", "activation rate"],
        "muscles": {name: found for name, (_, found) in zip(NAMES, results, strict=True)},
    }
    (DATA / "activation.json").write_text(json.dumps(content, separators=(",", ":")) + "\n")


if __name__ == "__main__":
    main()
