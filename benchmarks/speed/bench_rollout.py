"""Throughput of `mujoco.rollout` and `mujoco.batch` on models with mjwrap's plugin, on one thread and on several.

The same environments, from different starts and under different smooth random controls, are run by the model as it is
and with its muscles in the plugin, on each number of threads in turn. Times are wall-clock times, because several
threads are at work; figures are steps of all environments a second, the plugin's over the native model's, and several
threads' over one's, each the median over the repeats of neighbours in time. All runs of a model must give the same
states to the last bit, whoever makes them and on however many threads. Exit code 1 where they do not, 2 for a bad
argument.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from time import perf_counter as clock
from typing import Any

import mujoco
import numpy as np
from installed_models import HOME, MODELS, MODES, Array, compiled, excitations
from mujoco import rollout

import mjwrap as mw

batch: Any
try:
    from mujoco import batch
except ImportError:  # before MuJoCo 3.17
    batch = None

STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
LOOK = 20  # steps between two controls
Row = dict[str, Any]


class Environments:
    """Environments of one model with their starts and controls; `run` gives their last states and the time [s]."""

    def __init__(self, label: str, mode: str | None, count: int, steps: int) -> None:
        self.model = compiled(label, mode)
        self.steps = steps
        data = mujoco.MjData(self.model)
        starts: list[Array] = []
        for env in range(count):
            mujoco.mj_resetData(self.model, data)
            data.qvel[:] = np.random.default_rng(env).uniform(-0.1, 0.1, self.model.nv)
            starts.append(np.empty(mujoco.mj_stateSize(self.model, STATE)))
            mujoco.mj_getState(self.model, data, starts[-1], STATE)
        self.starts = np.stack(starts)
        interval = LOOK * self.model.opt.timestep
        looks = [excitations(self.model.nu, -(-steps // LOOK), interval, env) for env in range(count)]
        self.controls = np.repeat(np.stack(looks), LOOK, axis=1)[:, :steps]
        self._datas: dict[int, list[mujoco.MjData]] = {}
        self._batches: dict[int, Any] = {}

    def run(self, way: str, threads: int) -> tuple[Array, float]:
        """Run all environments from their starts by "rollout" or "batch"."""
        if way == "rollout":
            if threads not in self._datas:
                self._datas[threads] = [mujoco.MjData(self.model) for _ in range(threads)]
            began = clock()
            states, _ = rollout.rollout(self.model, self._datas[threads], self.starts, self.controls)
            return states[:, -1], clock() - began
        if threads not in self._batches:
            self._batches[threads] = batch.Batch(self.model, len(self.starts), nthread=threads)
        pool = self._batches[threads]
        pool.reset(stage=int(mujoco.mjtStage.mjSTAGE_NONE))
        pool.qvel[:] = self.starts[:, 1 + self.model.nq : 1 + self.model.nq + self.model.nv]
        began = clock()
        states = pool.rollout(self.steps, self.controls, record=[int(STATE)])[int(STATE)]
        return states[:, -1], clock() - began


def measure(label: str, mode: str, options: argparse.Namespace) -> Row:
    """Return the figures of one model."""
    made = {
        "native": Environments(label, None, options.envs, options.steps),
        "mjwrap": Environments(label, mode, options.envs, options.steps),
    }
    ways = [(way, threads) for way in options.ways for threads in options.threads]
    times: dict[tuple[str, str, int], list[float]] = {}
    same = True
    first: dict[str, Array] = {}
    for repeat in range(options.repeats + 1):
        for way, threads in ways:
            for name, environments in made.items():
                states, spent = environments.run(way, threads)
                same = same and np.array_equal(first.setdefault(name, states), states)
                if repeat > 0:  # the first run makes the mjData and warms up
                    times.setdefault((name, way, threads), []).append(spent)
    count = options.envs * options.steps
    rows: Row = {"same bits": bool(same), "finite": bool(np.isfinite(first["mjwrap"]).all())}
    for way, threads in ways:
        ours, native = (np.array(times[name, way, threads]) for name in ("mjwrap", "native"))
        alone = np.array(times["mjwrap", way, options.threads[0]])
        rows[f"{way}, {threads}"] = {
            "mjwrap": float(count / np.median(ours)),
            "native": float(count / np.median(native)),
            "ratio": float(np.median(native / ours)),
            "scaling": float(np.median(alone / ours)),
            "native scaling": float(np.median(np.array(times["native", way, options.threads[0]]) / native)),
        }
    return rows


def main() -> int:
    """Run the benchmark; return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    known = [HOME, *MODELS]
    parser.add_argument(
        "--models", nargs="+", choices=known, default=list(MODELS), metavar="MODEL", help=", ".join(known)
    )
    parser.add_argument("--mode", choices=MODES, default=MODES[0])
    ways = ["rollout", "batch"] if batch is not None else ["rollout"]
    parser.add_argument("--ways", nargs="+", choices=ways, default=ways)
    parser.add_argument("--threads", nargs="+", type=int, default=[1, 2])
    parser.add_argument("--envs", type=int, default=4, help="environments (default 4)")
    parser.add_argument("--steps", type=int, default=250, help="steps of each (default 250)")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures to FILE")
    options = parser.parse_args()
    for name in ("envs", "steps", "repeats"):
        if getattr(options, name) < 1:
            parser.error(f"--{name} must be at least 1, not {getattr(options, name)}")
    if min(options.threads) < 1:
        parser.error(f"--threads must be at least 1, not {min(options.threads)}")
    if options.json and not options.json.resolve().parent.is_dir():
        parser.error(f"--json: there is no folder {options.json.resolve().parent}")
    print(f"mjwrap {mw.__version__} ({options.mode}), MuJoCo {mujoco.__version__}; ", end="")
    print(f"{options.envs} environments, {options.steps} steps; steps a second of all together")
    print(
        f"{'':11}{'':8}{'threads':>8}{'mjwrap':>10}{'native':>10}{'ratio':>8}{'scaling':>9}{'native':>8}   same bits"
    )
    found: dict[str, Row] = {}
    for label in options.models:
        try:
            found[label] = rows = measure(label, options.mode, options)
        except (ImportError, mw.ModelError) as error:
            print(f"bench_rollout.py: {label}: {error}", file=sys.stderr)
            return 2
        for way in options.ways:
            for threads in options.threads:
                row = rows[f"{way}, {threads}"]
                print(
                    f"{label:11}{way:8}{threads:8}{row['mjwrap']:10.0f}{row['native']:10.0f}{row['ratio']:8.3f}"
                    f"{row['scaling']:9.2f}{row['native scaling']:8.2f}   {'yes' if rows['same bits'] else 'NO'}"
                    + ("" if rows["finite"] else "   NOT FINITE"),
                    flush=True,
                )
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return 0 if all(rows["same bits"] and rows["finite"] for rows in found.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
