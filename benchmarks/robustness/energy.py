"""Energy drift of the conservative elbow under mjwrap and under the equivalent native force.

The forearm of models/elbow/elbow_conservative.xml swings under gravity and a constant tension T of its brachialis, so
E = kinetic + gravity + T l is a constant of the motion; what it drifts by is the integrator's. The native twin is the
same file without its declaration: MuJoCo's actuator then pulls the tendon with the same T. Two swings: "smooth", which
stays on the cylinder, and "liftoff", which leaves and meets it on every period: there the second derivative of l jumps
and any integrator of fixed step loses its order. Exit code 1 where mjwrap keeps the energy worse than the twin, 2 for a
bad argument.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import mujoco

import mjwrap as mw

MODEL = Path(__file__).parents[2] / "models" / "elbow" / "elbow_conservative.xml"
SWINGS = {"smooth": 0.4, "liftoff": 1.3}  # start at rest [rad]; the muscle is on its cylinder below 0.99
TIMESTEPS = (1e-3, 2e-3, 4e-3)
INTEGRATORS = ("RK4", "Euler")
# Both runs round differently: states agree to about 1e-14, energies of 50 J to 1e-13 J.
ROUNDING = 1e-12  # [J]


@dataclass(frozen=True)
class Drift:
    """Largest |E - E(0)| [J] of a run under mjwrap and of its native twin; angles swept [rad]."""

    swing: str
    integrator: str
    timestep: float
    seconds: float
    mjwrap: float
    native: float
    lowest: float
    highest: float

    @property
    def ratio(self) -> float:
        """mjwrap's drift in native ones."""
        return self.mjwrap / self.native

    @property
    def kept(self) -> bool:
        """Whether mjwrap keeps the energy as well as the twin does, up to rounding."""
        return self.mjwrap <= self.native * (1.0 + 1e-6) + ROUNDING


def _load(integrator: str, timestep: float, native: bool) -> mujoco.MjModel:
    spec = mujoco.MjSpec.from_file(str(MODEL))
    if native:
        for declaration in list(spec.tuples):
            spec.delete(declaration)
    model = spec.compile()
    model.opt.integrator = int(getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}"))
    model.opt.timestep = timestep
    return model


def _run(
    swing: str, integrator: str, timestep: float, seconds: float, native: bool
) -> tuple[float, float, float]:
    """Return the largest |E - E(0)| [J] of one run, and the smallest and largest angle [rad]."""
    model = _load(integrator, timestep, native)
    reference = _load(integrator, timestep, True)
    data, scratch = mujoco.MjData(model), mujoco.MjData(reference)
    data.qpos[0], data.ctrl[0] = SWINGS[swing], 1.0
    tension = -float(reference.actuator_gainprm[0, 0])
    muscles = None if native else mw.MuscleSystem(model)
    if muscles is not None and (muscles.n != 1 or muscles.declarations[0].law != "path_actuator"):
        raise RuntimeError(f"{MODEL.name} should declare one path actuator, not {muscles.declarations}")
    first, worst, low, high = 0.0, 0.0, SWINGS[swing], SWINGS[swing]
    for k in range(round(seconds / timestep) + 1):
        scratch.qpos[:], scratch.qvel[:] = data.qpos, data.qvel
        mujoco.mj_forward(reference, scratch)
        energy = float(scratch.energy.sum() + tension * scratch.ten_length[0])
        first = energy if k == 0 else first
        worst = max(worst, abs(energy - first))
        low, high = min(low, float(data.qpos[0])), max(high, float(data.qpos[0]))
        if muscles is None:
            mujoco.mj_step(model, data)
        else:
            muscles.step(data)
    if muscles is not None and muscles.failures.any():
        raise RuntimeError(f"a path was not found: {muscles.report()}")
    return worst, low, high


def measure(swing: str, integrator: str, timestep: float, seconds: float) -> Drift:
    """Return the energy drift of the elbow under mjwrap and under the native force.

    swing: "smooth" or "liftoff"; integrator: "RK4" or "Euler"; timestep and seconds [s].
    """
    ours, low, high = _run(swing, integrator, timestep, seconds, native=False)
    native, _, _ = _run(swing, integrator, timestep, seconds, native=True)
    return Drift(swing, integrator, timestep, seconds, ours, native, low, high)


def main() -> int:
    """Print the drifts of both, their ratios and the verdict; return the exit code."""
    parser = argparse.ArgumentParser(
        description="Energy drift of the conservative elbow, mjwrap against native."
    )
    parser.add_argument("--seconds", type=float, default=10.0, help="length of every run [s] (default 10)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures to FILE as well")
    options = parser.parse_args()
    if not 0.0 < options.seconds < 1e4:
        parser.error(f"--seconds must be between 0 and 10000, not {options.seconds}")
    print(f"largest |E - E(0)| over {options.seconds:g} s, MuJoCo {mujoco.__version__}")
    print(f"{'swing':9}{'integrator':12}{'step ms':>8}{'mjwrap J':>13}{'native J':>13}{'ratio - 1':>12}")
    results = []
    for swing in SWINGS:
        for integrator in INTEGRATORS:
            for timestep in TIMESTEPS:
                d = measure(swing, integrator, timestep, options.seconds)
                results.append(d)
                print(
                    f"{swing:9}{integrator:12}{1e3 * timestep:8g}{d.mjwrap:13.3e}{d.native:13.3e}"
                    f"{d.ratio - 1:12.1e}{'' if d.kept else '   WORSE'}"
                )
    kept = all(d.kept for d in results)
    print("mjwrap keeps the energy as well as the native force" if kept else "mjwrap keeps the energy WORSE")
    if options.json:
        rows = [{**asdict(d), "ratio": d.ratio, "kept": d.kept} for d in results]
        try:
            options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        except OSError as error:
            print(f"energy.py: cannot write {options.json}: {error.strerror}", file=sys.stderr)
            return 2
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
