"""CPU time per simulated second of an imported model beside OpenSim's own, at equal accuracy.

    python benchmarks/osim/bench_simulation.py path/to/model.osim ... [--seconds 0.2] [--rounds 10] [--json out.json]
        [--hold 0.02] [--timesteps 0.002 0.001]

Needs the `opensim` wheel. The excitations are random, held for `--hold` and the same in both. The model starts at its
default pose at rest with the muscles that OpenSim's equilibrium gives. Each engine's error is the largest difference of
a coordinate's value at the end [rad, m] from a fine run of its own: OpenSim's Manager at an accuracy of 1e-9, mjwrap
with RK4 at a step 16 times smaller than the model's. For each time step (the model's, if none is given) and each of two
integrators of MuJoCo, OpenSim runs at the largest of the
accuracies 1e-1, 3e-2, 1e-2, ... whose error is at most mjwrap's at the model's time step. Both runs are timed in turn,
by the thread's CPU time: median, 95th percentile, and the median and quartiles of the ratios of each pair. OpenSim's
time is that of `Manager.integrate` alone. Printed beside mjwrap's time is that of MuJoCo's `mj_step` on the same model
without the plugin, so without muscles: no muscle can be faster than that.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from time import thread_time as clock
from typing import Any

import mujoco
import numpy as np
import opensim  # pyright: ignore[reportMissingImports]

import mjwrap as mw

INTEGRATORS = ("RK4", "IMPLICITFAST")
FINE_ACCURACY, FINER = 1e-9, 16  # of the reference runs
ACCURACIES = [f * 10.0**-e for e in range(1, 8) for f in (1.0, 0.3)]
Row = dict[str, Any]
Values = dict[str, float]


class Opensim:
    """A model in OpenSim with random excitations."""

    def __init__(self, path: Path, seed: int, seconds: float, hold: float) -> None:
        self.model = opensim.Model(str(path))
        self.model.initSystem()
        muscles = self.model.getMuscles()
        self.names = [muscles.get(i).getName() for i in range(muscles.getSize())]
        self.seconds, self.hold = seconds, hold
        self.holds = round(seconds / hold)
        self.excitation = np.random.default_rng(seed).uniform(0.05, 0.6, (len(self.names), self.holds))
        controllers = self.model.updControllerSet()
        for i in range(controllers.getSize()):
            controllers.get(i).setEnabled(False)
        control = opensim.PrescribedController()
        control.setName("mjwrap_excitation")
        for name, values in zip(self.names, self.excitation, strict=True):
            course = opensim.PiecewiseConstantFunction()
            for k, value in enumerate(values):
                course.addPoint(k * hold, float(value))
            control.addActuator(self.model.getMuscles().get(name))
            control.prescribeControlForActuator(name, course)
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

    def run(self, accuracy: float) -> tuple[float, Values]:
        """Return CPU seconds and the coordinates' values at the end."""
        self._start()
        manager = opensim.Manager(self.model)
        manager.setIntegratorAccuracy(accuracy)
        manager.initialize(self.state)
        began = clock()
        for k in range(self.holds):
            state = manager.integrate((k + 1) * self.hold)
        spent = clock() - began
        every = self.model.getCoordinateSet()
        return spent, {
            every.get(i).getName(): float(every.get(i).getValue(state)) for i in range(every.getSize())
        }


class Imported:
    """The imported model, with the plugin in MuJoCo's own step."""

    def __init__(self, path: Path, truth: Opensim) -> None:
        spec = mw.import_osim(path).spec
        self.bare = spec.compile()
        self.model = mw.install(spec)
        self.truth = truth
        self.joints = {self.model.joint(i).name: i for i in range(self.model.njnt)}
        self.data = mujoco.MjData(self.model)

    def run(self, timestep: float, integrator: str) -> tuple[float, Values]:
        """Return CPU seconds and the values at the end of the coordinates that are joints."""
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        actuators = [model.actuator(name).id for name in self.truth.names]
        for name, (activation, fiber) in self.truth.muscles.items():
            actuator = model.actuator(name).id
            first, count = int(model.actuator_actadr[actuator]), int(model.actuator_actnum[actuator])
            if count > 0:
                data.act[first] = activation
            if count > 1:
                data.act[first + 1] = fiber
        before, model.opt.timestep = model.opt.timestep, timestep
        model.opt.integrator = int(getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}"))
        began = clock()
        for values in self.truth.excitation.T:
            data.ctrl[actuators] = values
            mujoco.mj_step(model, data, round(self.truth.hold / timestep))
        spent = clock() - began
        model.opt.timestep = before
        return spent, {name: float(data.qpos[model.jnt_qposadr[i]]) for name, i in self.joints.items()}

    def run_bare(self, timestep: float, integrator: str) -> float:
        """Return CPU seconds of a motion of the same length by MuJoCo alone, without muscles."""
        model, data = self.bare, mujoco.MjData(self.bare)
        model.opt.timestep = timestep
        model.opt.integrator = int(getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}"))
        began = clock()
        mujoco.mj_step(model, data, round(self.truth.seconds / timestep))
        return clock() - began


def error(values: Values, fine: Values) -> float:
    """Return the largest difference of a value [rad, m]; infinite where one is not finite."""
    worst = max(abs(values[name] - fine[name]) for name in fine if name in values)
    return worst if np.isfinite(worst) else np.inf


def measure(
    path: Path, seconds: float, rounds: int, hold: float = 0.02, timesteps: Sequence[float] = ()
) -> list[Row]:
    """Return the figures of one model, a row for each time step and integrator."""
    theirs = Opensim(path, 0, seconds, hold)
    ours = Imported(path, theirs)
    step = float(ours.model.opt.timestep)
    _, fine = ours.run(step / FINER, "RK4")
    _, fine_theirs = theirs.run(FINE_ACCURACY)
    errors = {accuracy: error(theirs.run(accuracy)[1], fine_theirs) for accuracy in ACCURACIES}
    rows = []
    for timestep, integrator in itertools.product(timesteps or (step,), INTEGRATORS):
        own = error(ours.run(timestep, integrator)[1], fine)
        accuracy = next((each for each, other in errors.items() if other <= own), ACCURACIES[-1])
        pairs = [
            (ours.run(timestep, integrator)[0], theirs.run(accuracy)[0], ours.run_bare(timestep, integrator))
            for _ in range(rounds)
        ]
        times = np.array(pairs) / seconds
        ratios = times[:, 0] / times[:, 1]
        rows.append({
            "model": path.name, "muscles": len(theirs.names), "integrator": integrator, "timestep": timestep,
            "hold": hold, "error": own, "accuracy": accuracy, "error of OpenSim": errors[accuracy],
            "difference": error(fine, fine_theirs),
            "seconds": [float(x) for x in np.percentile(times[:, 0], (50, 95))],
            "seconds of OpenSim": [float(x) for x in np.percentile(times[:, 1], (50, 95))],
            "seconds without muscles": float(np.median(times[:, 2])),
            "ratio": float(np.median(ratios)), "quartiles": [float(x) for x in np.percentile(ratios, (25, 75))],
            "ratio without muscles": float(np.median(times[:, 2] / times[:, 1])),
        })  # fmt: skip
    return rows


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", type=Path, nargs="+")
    parser.add_argument("--seconds", type=float, default=0.2, help="length of a run")
    parser.add_argument("--rounds", type=int, default=10, help="pairs of timed runs")
    parser.add_argument("--hold", type=float, default=0.02, help="time for which an excitation is held")
    parser.add_argument("--timesteps", type=float, nargs="*", default=[], help="instead of the model's")
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    opensim.Logger.setLevelString("Off")
    rows = []
    for path in options.models:
        found = measure(path, options.seconds, options.rounds, options.hold, options.timesteps)
        rows += found
        print(
            f"{path.name}: {found[0]['muscles']} muscles; the fine runs differ by {found[0]['difference']:.1e}"
        )
        for row in found:
            (a, b), (c, d) = row["seconds"], row["seconds of OpenSim"]
            print(
                f"  {row['integrator']} at {row['timestep']:g} s, error {row['error']:.1e}: "
                f"{a:.3f} s per simulated second (p95 {b:.3f}); "
                f"OpenSim at {row['accuracy']:g}, error {row['error of OpenSim']:.1e}: {c:.3f} s (p95 {d:.3f}); "
                f"ratio {row['ratio']:.3f} ({row['quartiles'][0]:.3f} to {row['quartiles'][1]:.3f}); "
                f"without muscles {row['seconds without muscles']:.3f} s, ratio {row['ratio without muscles']:.3f}",
                flush=True,
            )
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
