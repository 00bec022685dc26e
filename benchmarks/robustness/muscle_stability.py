"""Stability of elastic tendons at coarse time steps, for every muscle of myo_sim's models.

Each native muscle becomes a Hill-type muscle (`mw.hill_from_mujoco`) and runs for some seconds along a smooth random
length within its range, under an excitation that jumps at random every 50 ms, at 5, 2 and 0.1 ms. Counted are steps
that do not converge or are not finite, the most evaluations that a step takes, and oscillations that the finest run
lacks: zigzags of the tension, up, down, up and down again by more than a thousandth of the maximum isometric force from
sample to sample, beyond those of the finest run sampled at the same times. With --whole the models themselves move
then, every muscle that mjwrap takes over on an elastic tendon, under random excitations. Exit code 1 if
one of these counts is not zero or a step takes more than 10 evaluations.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

import mjwrap as mw
from mjwrap.mjcf.actuators import mujoco_law
from mjwrap.muscles.laws import MuJoCoMuscle
from mjwrap.runs.models import load_spec

LAWS = {"degroote_fregly_2016": mw.DeGrooteFregly2016, "millard_2012": mw.Millard2012}
MODELS = ("elbow", "myohand_r", "myoarm_r", "myolegs", "myotorso", "myofullbody")
FINEST = 1e-4  # [s]
STEPS = (5e-3, 2e-3)  # [s]
TURN = 1e-3  # [F_max]
MOST = 10  # evaluations of a step
Array = NDArray[np.float64]


@dataclass
class Row:
    """What the muscles of one model did at one time step, one law."""

    model: str
    law: str
    timestep: float
    muscles: int = 0
    seconds: float = 0.0
    not_finite: int = 0
    not_converged: int = 0
    evaluations: int = 0
    above: int = 0  # steps of more than MOST evaluations
    extra: int = 0
    zigzags: int = 0
    noisy: int = 0  # muscles with extra zigzags
    off: float = 0.0  # largest difference of a tension from the finest run's [F_max]

    @property
    def good(self) -> bool:
        """Whether nothing is to be complained of."""
        return not (self.not_finite or self.not_converged or self.extra) and self.evaluations <= MOST


def zigzags(tension: Array) -> int:
    """Count where a history of tensions (T,) [F_max] turns at three samples in a row, by more than TURN each time.

    A muscle cannot: excitation jumps only every tenth or twenty-fifth sample. A time step that is too long does.
    """
    change = np.diff(tension)
    turn = (change[:-1] * change[1:] < 0.0) & (np.minimum(abs(change[:-1]), abs(change[1:])) > TURN)
    return int((turn[:-2] & turn[1:-1] & turn[2:]).sum())


def smooth(rng: np.random.Generator, time: Array, low: float, high: float) -> Array:
    """Return a smooth random history (T,) within low and high: three sines of 0.3 to 2 Hz."""
    share = rng.uniform(0.2, 1.0, 3)
    share /= share.sum()
    waves = [
        s * np.sin(2.0 * np.pi * (rng.uniform(0.3, 2.0) * time + rng.uniform()))
        for s in share
    ]  # fmt: skip
    return 0.5 * (low + high) + 0.5 * (high - low) * np.sum(waves, axis=0)


def jumps(rng: np.random.Generator, time: Array) -> Array:
    """Return an excitation (T,) that jumps every 50 ms, at times to 0 or 1."""
    levels = np.clip(rng.uniform(-0.2, 1.2, int(time[-1] / 0.05) + 2), 0.0, 1.0)
    return levels[np.floor(time / 0.05 + 1e-9).astype(int)]


def muscles_of(model: mujoco.MjModel) -> dict[str, MuJoCoMuscle]:
    """Return the native muscles of a model by name."""
    gain = int(mujoco.mjtGain.mjGAIN_MUSCLE)
    chosen = [a for a in range(model.nactuator) if int(model.actuator_gaintype[a]) == gain]
    return {model.actuator(a).name: mujoco_law(model, a) for a in chosen}


def alone(name: str, model: mujoco.MjModel, law: str, seconds: float, seed: int) -> Iterable[Row]:
    """Run every muscle of a model along a prescribed length."""
    found = muscles_of(model)
    rows = {h: Row(name, law, h, len(found), seconds) for h in STEPS}
    fine = np.arange(0.0, seconds + 0.5 * FINEST, FINEST)
    for k, (muscle, native) in enumerate(
        tqdm(found.items(), desc=f"{name}, {law}", leave=False, disable=None)
    ):
        rng = np.random.default_rng((seed, k))
        low, high = (x / native.gear for x in native.length_range)
        length, excitation = smooth(rng, fine, low, high), jumps(rng, fine)
        hill = LAWS[law](
            **{**asdict(mw.hill_from_mujoco(native).muscle), "fiber_damping": 0.1, "tendon": "elastic"}
        )
        reference = mw.simulate_muscle(hill, fine, length, excitation=excitation, initial_activation=0.1)
        strong = hill.max_isometric_force
        for h, row in rows.items():
            stride = round(h / FINEST)
            run = mw.simulate_muscle(
                hill,
                fine[::stride],
                length[::stride],
                excitation=excitation[::stride],
                initial_activation=0.1,
            )
            row.not_finite += int((~np.isfinite(run.tension)).sum())
            row.not_converged += int((run.status == 3).sum())
            row.evaluations = max(row.evaluations, int(run.iterations[1:].max()))
            row.above += int((run.iterations[1:] > MOST).sum())
            here, there = zigzags(run.tension / strong), zigzags(reference.tension[::stride] / strong)
            row.zigzags += there
            if here > there:
                row.noisy += 1
                row.extra += here - there
                tqdm.write(
                    f"{muscle}: {here} zigzags at {1e3 * h:g} ms, {there} at {1e3 * FINEST:g} ms",
                    file=sys.stderr,
                )
            row.off = max(row.off, float(abs(run.tension - reference.tension[::stride]).max()) / strong)
    return rows.values()


def whole(name: str, timestep: float, seconds: float, seed: int) -> tuple[str, bool]:
    """Let a model move with all its muscles on elastic tendons; return a line about it, and whether it held."""
    spec = load_spec(f"myo_sim:{name}")
    before = mw.MuscleSystem(spec.compile())
    laws = {m.name: mw.hill_from_mujoco(m.parameters, tendon="elastic").muscle
            for m in before.declarations if isinstance(m.parameters, MuJoCoMuscle)}  # fmt: skip
    mw.set_laws(spec, laws)
    model = spec.compile()
    model.opt.timestep = timestep
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    rng, told, strongest = np.random.default_rng(seed), "", 0.0
    strong = np.array([m.parameters.row()[0] for m in muscles.declarations])
    try:
        while data.time < seconds:
            data.ctrl[:] = np.clip(rng.uniform(-0.2, 0.6, model.nu), 0.0, 1.0)
            muscles.step(data, nstep=round(0.05 / timestep))
            strongest = max(strongest, float((muscles.tension / strong).max()))
    except mw.StateError as error:
        told = f"; {error}"
    finite = (
        np.isfinite(data.qpos).all() and np.isfinite(data.act).all() and np.isfinite(muscles.tension).all()
    )
    line = (
        f"{name:11} {1e3 * timestep:g} ms: {muscles.n} elastic, {len(muscles.native)} native, {data.time:.1f} s, "
        f"{'finite' if finite else 'NOT FINITE'}, strongest {strongest:.2f} F_max, without a path "
        f"{int(muscles.failures.sum())} of {muscles.n * round(data.time / timestep)}{told}"
    )
    return line, bool(finite) and not told


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--models", nargs="+", choices=MODELS, default=["elbow", "myofullbody"])
    parser.add_argument("--laws", nargs="+", choices=LAWS, default=list(LAWS))
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--whole", action="store_true", help="let the models move too, at 2 and 5 ms")
    parser.add_argument("--json", type=Path, help="write the rows to this file")
    args = parser.parse_args(arguments)
    rows: list[Row] = []
    print(
        "model       law                   step   muscles  not finite  not conv.  evaluations  above 10",
        end="",
    )
    print("  zigzags  extra  off [F_max]")
    for name in args.models:
        model = load_spec(f"myo_sim:{name}").compile()
        for law in args.laws:
            for row in alone(name, model, law, args.seconds, args.seed):
                rows.append(row)
                print(
                    f"{row.model:11} {row.law:21} {1e3 * row.timestep:3.0f} ms  {row.muscles:7}  {row.not_finite:10}  "
                    f"{row.not_converged:9}  {row.evaluations:11}  {row.above:8}  {row.zigzags:7}  {row.extra:5}  "
                    f"{row.off:.3f}",
                    flush=True,
                )
    held = True
    for name in args.models if args.whole else ():
        for h in STEPS:
            line, good = whole(name, h, args.seconds, args.seed)
            print(line, flush=True)
            held = held and good
    if args.json:
        args.json.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n")
    return 0 if held and all(row.good for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
