"""CPU time per simulated second of an imported model beside OpenSim's own, at equal accuracy.

    python benchmarks/osim/bench_simulation.py path/to/model.osim ... [--seconds 0.2] [--rounds 10] [--json out.json]

Needs the `opensim` wheel. Every muscle has a constant random excitation, the same in both, and the model starts at its
default pose at rest with the muscles that OpenSim's equilibrium gives. Each engine's error is the largest difference of
a coordinate's value at the end [rad, m] from a fine run of its own: OpenSim's Manager at an accuracy of 1e-9, mjwrap at
a time step 16 times smaller. OpenSim then runs at the largest of the accuracies 1e-1, 3e-2, 1e-2, ... whose error is at
most mjwrap's at the model's time step. Both runs are timed in turn, by the thread's CPU time: median, 95th percentile,
and the median and quartiles of the ratios of each pair. OpenSim's time is that of `Manager.integrate` alone.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from time import thread_time as clock
from typing import Any

import mujoco
import numpy as np
import opensim  # pyright: ignore[reportMissingImports]

import mjwrap as mw

FINE_ACCURACY, FINER = 1e-9, 16  # of the reference runs
ACCURACIES = [f * 10.0**-e for e in range(1, 8) for f in (1.0, 0.3)]
Row = dict[str, Any]
Values = dict[str, float]


class Opensim:
    """A model in OpenSim with constant excitations."""

    def __init__(self, path: Path, seed: int) -> None:
        self.model = opensim.Model(str(path))
        self.model.initSystem()
        muscles = self.model.getMuscles()
        self.names = [muscles.get(i).getName() for i in range(muscles.getSize())]
        drawn = np.random.default_rng(seed).uniform(0.05, 0.6, len(self.names))
        self.excitation = dict(zip(self.names, map(float, drawn), strict=True))
        controllers = self.model.updControllerSet()
        for i in range(controllers.getSize()):
            controllers.get(i).setEnabled(False)
        control = opensim.PrescribedController()
        control.setName("mjwrap_excitation")
        for name, value in self.excitation.items():
            control.addActuator(self.model.getMuscles().get(name))
            control.prescribeControlForActuator(name, opensim.Constant(value))
        self.model.addController(control)
        self._start()
        self.muscles = {
            name: (float(m.getActivation(self.state)), float(m.getFiberLength(self.state)))
            for name in self.names
            for m in [self.model.getMuscles().get(name)]
        }

    def _start(self) -> None:
        self.state = self.model.initSystem()
        self.model.equilibrateMuscles(self.state)

    def run(self, accuracy: float, seconds: float) -> tuple[float, Values]:
        """Return CPU seconds and the coordinates' values at the end."""
        self._start()
        manager = opensim.Manager(self.model)
        manager.setIntegratorAccuracy(accuracy)
        manager.initialize(self.state)
        began = clock()
        state = manager.integrate(seconds)
        spent = clock() - began
        every = self.model.getCoordinateSet()
        return spent, {
            every.get(i).getName(): float(every.get(i).getValue(state)) for i in range(every.getSize())
        }


class Imported:
    """The imported model, with the plugin in MuJoCo's own step."""

    def __init__(self, path: Path, truth: Opensim) -> None:
        self.model = mw.install(mw.import_osim(path).spec)
        self.truth = truth
        self.joints = {self.model.joint(i).name: i for i in range(self.model.njnt)}
        self.data = mujoco.MjData(self.model)

    def run(self, timestep: float, seconds: float) -> tuple[float, Values]:
        """Return CPU seconds and the values at the end of the coordinates that are joints."""
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        for name, (activation, fiber) in self.truth.muscles.items():
            actuator = model.actuator(name).id
            data.ctrl[actuator] = self.truth.excitation[name]
            first, count = int(model.actuator_actadr[actuator]), int(model.actuator_actnum[actuator])
            if count > 0:
                data.act[first] = activation
            if count > 1:
                data.act[first + 1] = fiber
        before, model.opt.timestep = model.opt.timestep, timestep
        began = clock()
        mujoco.mj_step(model, data, round(seconds / timestep))
        spent = clock() - began
        model.opt.timestep = before
        return spent, {name: float(data.qpos[model.jnt_qposadr[i]]) for name, i in self.joints.items()}


def error(values: Values, fine: Values) -> float:
    """Return the largest difference of a value [rad, m]; infinite where one is not finite."""
    worst = max(abs(values[name] - fine[name]) for name in fine if name in values)
    return worst if np.isfinite(worst) else np.inf


def measure(path: Path, seconds: float, rounds: int) -> Row:
    """Return the figures of one model."""
    theirs = Opensim(path, 0)
    ours = Imported(path, theirs)
    step = float(ours.model.opt.timestep)
    _, fine = ours.run(step / FINER, seconds)
    _, values = ours.run(step, seconds)
    own = error(values, fine)
    _, fine_theirs = theirs.run(FINE_ACCURACY, seconds)
    difference = error(fine, fine_theirs)
    tried = {}
    for accuracy in ACCURACIES:
        _, values = theirs.run(accuracy, seconds)
        tried[accuracy] = error(values, fine_theirs)
        if tried[accuracy] <= own:
            break
    times = np.array([(ours.run(step, seconds)[0], theirs.run(accuracy, seconds)[0]) for _ in range(rounds)])
    times /= seconds
    ratios = times[:, 0] / times[:, 1]
    return {
        "model": path.name, "muscles": len(theirs.names), "timestep": step, "error": own,
        "accuracy": accuracy, "error of OpenSim": tried[accuracy], "difference": difference,
        "seconds": [float(x) for x in np.percentile(times[:, 0], (50, 95))],
        "seconds of OpenSim": [float(x) for x in np.percentile(times[:, 1], (50, 95))],
        "ratio": float(np.median(ratios)), "quartiles": [float(x) for x in np.percentile(ratios, (25, 75))],
    }  # fmt: skip


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", type=Path, nargs="+")
    parser.add_argument("--seconds", type=float, default=0.2, help="length of a run")
    parser.add_argument("--rounds", type=int, default=10, help="pairs of timed runs")
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    opensim.Logger.setLevelString("Off")
    rows = []
    for path in options.models:
        row = measure(path, options.seconds, options.rounds)
        rows.append(row)
        (a, b), (c, d) = row["seconds"], row["seconds of OpenSim"]
        print(
            f"{row['model']}: {row['muscles']} muscles\n"
            f"  mjwrap  step {row['timestep']:g} s, error {row['error']:.1e}: "
            f"{a:.3f} s per simulated second (p95 {b:.3f})\n"
            f"  OpenSim accuracy {row['accuracy']:g}, error {row['error of OpenSim']:.1e}: {c:.3f} s (p95 {d:.3f})\n"
            f"  ratio {row['ratio']:.4f} (quartiles {row['quartiles'][0]:.4f} to {row['quartiles'][1]:.4f}); "
            f"the two fine runs differ by {row['difference']:.1e}",
            flush=True,
        )
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
