"""Time of a step of real models whose muscles mjwrap's plugin has taken over, beside the same models as they are.

All variants of a model run in one process, block after block in turn, under the same smooth random excitations. Before
every block the others are given positions, velocities and activations of the first mode's model: so neighbours do the
same work, contacts included, and ratios are taken between them. A run starts anew after a second of simulated time,
with other excitations; its first block is not counted. Times are the CPU time of the thread, per step over a block.
`failures` are steps of muscles without a converged path, `lost` are blocks after which a state was not finite or MuJoCo
had reset it. Exit code 1 where a state was lost, 2 for a bad argument; with --target also 1 where a mode is slower than
the native model.

--profile shows where the time goes: the plugin's `compute` and `advance`, called by their addresses on the state after
half a second; what MuJoCo takes to carry xfrc_applied to the joints (native steps with and without forces of 1e-200 N
on the loaded bodies); and MuJoCo's own rest of a step.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import sys
from collections.abc import Callable
from pathlib import Path
from time import thread_time as clock
from typing import Any

import mujoco
import numpy as np
from installed_models import HOME, MODELS, MODES, compiled, excitations

import mjwrap as mw
from mjwrap.plugin import read
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.mujoco_c.library import library
from mjwrap.plugin.readout import block_address

BLOCK = 20  # steps between two looks at the clock, and between two changes of the controls
RUN = 25  # blocks of a run, the first of which is not timed
SYSTEM = "MuscleSystem"
Row = dict[str, Any]


class Variant:
    """One model that is stepped in blocks; mode: of the plugin, SYSTEM, or None for MuJoCo's own muscles."""

    def __init__(self, label: str, mode: str | None, integrator: str) -> None:
        self.model = compiled(label, None if mode == SYSTEM else mode, integrator)
        self.data = mujoco.MjData(self.model)
        self.muscles = mw.MuscleSystem(self.model) if mode == SYSTEM else None
        self.step: Callable[..., None] = mujoco.mj_step
        if self.muscles is not None:
            self.step = lambda model, data, nstep: muscles.step(data, nstep)
            muscles = self.muscles
        self.installed = mode not in (None, SYSTEM)
        self.failed = self.lost = 0

    def start(self) -> None:
        """Go back to the model's first pose."""
        self._count()
        mujoco.mj_resetData(self.model, self.data)
        if self.muscles is not None:
            self.muscles.reset(self.data)

    def follow(self, leader: mujoco.MjData) -> None:
        """Take over another variant's state."""
        for name in ("qpos", "qvel", "act", "qacc_warmstart"):
            getattr(self.data, name)[:] = getattr(leader, name)
        self.data.time = leader.time

    def block(self, control: Any) -> float:
        """Run one block; return microseconds per step."""
        self.data.ctrl[:] = control
        before = self.data.time
        began = clock()
        self.step(self.model, self.data, nstep=BLOCK)
        spent = clock() - began
        whole = np.isfinite(self.data.qpos).all() and self.data.time > before
        self.lost += not whole
        return 1e6 * spent / BLOCK

    def _count(self) -> None:
        if self.installed:
            self.failed += int(read(self.data).failures.sum())

    def failures(self) -> int:
        """Return the number of steps of muscles without a path so far."""
        self._count()
        return self.failed if self.muscles is None else int(self.muscles.failures.sum())


def measure(label: str, modes: list[str], integrator: str, runs: int) -> dict[str, Row]:
    """Return the figures of one model: a row for every mode, each against the native model."""
    variants = {mode: Variant(label, mode, integrator) for mode in modes} | {
        "native": Variant(label, None, integrator)
    }
    times: list[list[float]] = []
    first = variants[modes[0]]
    model = first.model
    for run in range(runs):
        controls = excitations(model.nu, RUN, BLOCK * model.opt.timestep, run)
        for variant in variants.values():
            variant.start()
        for k in range(RUN):
            for variant in variants.values():
                if variant is not first:
                    variant.follow(first.data)
            # the leader moves last: the others have to start where it does
            spent = [variant.block(controls[k]) for variant in reversed(variants.values())][::-1]
            if k > 0:
                times.append(spent)
    columns = dict(zip(variants, np.array(times).T, strict=True))
    rows: dict[str, Row] = {}
    for mode, variant in variants.items():
        ratios = columns[mode] / columns["native"]
        rows[mode] = {
            "median": float(np.median(columns[mode])),
            "p95": float(np.percentile(columns[mode], 95)),
            "ratio": float(np.median(ratios)),
            "quartiles": [float(q) for q in np.percentile(ratios, (25, 75))],
            "failures": variant.failures(),
            "lost": variant.lost,
        }
    rows[modes[0]]["muscles"] = len(read(first.data).names) if first.installed else model.nu
    rows["native"]["muscles"] = int(
        np.count_nonzero(model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_TENDON))
    )
    return rows


def call_time(function: Callable[..., Any], *addresses: int) -> float:
    """Return how long a call takes [us], the median over fifty times twenty."""
    spent = []
    for _ in range(50):
        began = clock()
        for _ in range(20):
            function(*addresses)
        spent.append((clock() - began) / 20)
    return 1e6 * float(np.median(spent))


def profile(label: str, mode: str) -> Row:
    """Return where the time of an installed model's step goes [us]."""
    ours, native = Variant(label, mode, "Euler"), Variant(label, None, "Euler")
    for control in excitations(ours.model.nu, RUN, BLOCK * ours.model.opt.timestep, 0):
        ours.block(control)
    mujoco.mj_forward(ours.model, ours.data)
    pulled = np.any(ours.data.xfrc_applied != 0.0, axis=1)
    times: list[list[float]] = []
    for _ in range(4 * RUN):
        native.follow(ours.data)
        native.data.xfrc_applied[:] = 0.0
        spent = [native.block(ours.data.ctrl)]
        native.follow(ours.data)
        native.data.xfrc_applied[pulled] = 1e-200
        times.append([*spent, native.block(ours.data.ctrl), ours.block(ours.data.ctrl)])
    without, loaded, whole = np.array(times).T
    mujoco.mj_forward(ours.model, ours.data)
    block = block_address(ours.data, 0)
    head = np.ctypeslib.as_array((ctypes.c_int64 * bk.HEAD).from_address(block))
    kind = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3)
    compute, advance = kind(int(head[bk.STAGE])), kind(int(head[bk.FINISH]))
    nothing = kind(ctypes.cast(library().mj_version, ctypes.c_void_p).value or 0)
    here = block, ours.model._address, ours.data._address

    def step(*addresses: int) -> None:
        compute(*addresses)
        advance(*addresses)

    call = call_time(nothing, *here)
    first = call_time(compute, *here) - call
    row = {
        "native": float(np.median(without)),
        "step": float(np.median(whole)),
        "compute": first,
        "advance": max(call_time(step, *here) - first - 2.0 * call, 0.0),
        "xfrc_applied": float(np.median(loaded - without)),
        "bodies": int(pulled.sum()),
    }
    return row | {"MuJoCo": row["step"] - row["compute"] - row["advance"] - row["xfrc_applied"]}


def print_row(label: str, mode: str, row: Row, native: Row) -> None:
    """Print a mode beside the native model."""
    low, high = row["quartiles"]
    muscles = f"{row['muscles']} of {native['muscles']}" if "muscles" in row else ""
    print(
        f"{label:10}{mode:13}{muscles:>11}{row['median']:9.1f} ({row['p95']:.1f})".ljust(54)
        + f"{native['median']:8.1f} ({native['p95']:.1f})".ljust(20)
        + f"{row['ratio']:6.3f} ({low:.3f} to {high:.3f})"
        + (f"   FAILURES {row['failures']}" if row["failures"] else "")
        + (f"   LOST {row['lost']}" if row["lost"] else ""),
        flush=True,
    )


def main() -> int:
    """Run the benchmark; return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    known = [HOME, *MODELS]
    parser.add_argument(
        "--models", nargs="+", choices=known, default=list(MODELS), metavar="MODEL", help=", ".join(known)
    )
    parser.add_argument(
        "--modes",
        nargs="+",
        choices=[*MODES, SYSTEM],
        default=["wrench"],
        help="variants to time; the first one leads",
    )
    parser.add_argument("--integrator", choices=("Euler", "RK4", "implicit", "implicitfast"), default="Euler")
    parser.add_argument(
        "--runs", type=int, default=6, help=f"runs of {RUN} blocks of {BLOCK} steps (default 6)"
    )
    parser.add_argument("--profile", action="store_true", help="say where the time of the first mode goes")
    parser.add_argument(
        "--target", action="store_true", help="exit with 1 where a mode is slower than the native model"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures to FILE")
    options = parser.parse_args()
    if options.runs < 1:
        parser.error(f"--runs must be at least 1, not {options.runs}")
    if options.profile and options.modes[0] == SYSTEM:
        parser.error(f"--profile is of the plugin, not of {SYSTEM}")
    if options.json and not options.json.resolve().parent.is_dir():
        parser.error(f"--json: there is no folder {options.json.resolve().parent}")
    print(f"mjwrap {mw.__version__}, MuJoCo {mujoco.__version__}, {options.integrator}; ", end="")
    print("microseconds of CPU time per step, median (p95); ratio of neighbours, median (quartiles)")
    print(f"{'':23}{'muscles':>11}{'mjwrap':>16}{'native':>18}{'ratio':>11}")
    rows: dict[str, dict[str, Row]] = {}
    for label in options.models:
        try:
            rows[label] = found = measure(label, options.modes, options.integrator, options.runs)
        except (ImportError, mw.ModelError) as error:
            print(f"bench_models.py: {label}: {error}", file=sys.stderr)
            return 2
        for mode in options.modes:
            print_row(label, mode, found[mode], found["native"])
    parts: dict[str, Row] = {}
    if options.profile:
        names = ("native", "step", "MuJoCo", "compute", "advance", "xfrc_applied", "bodies")
        print(f"\n{'':10}" + "".join(f"{name:>14}" for name in names))
        for label in options.models:
            parts[label] = profile(label, options.modes[0])
            print(f"{label:10}" + "".join(f"{parts[label][name]:14.4g}" for name in names), flush=True)
    if options.json:
        options.json.write_text(
            json.dumps(rows | ({"profile": parts} if parts else {}), indent=1) + "\n", encoding="utf-8"
        )
    timed = [found[mode] for found in rows.values() for mode in options.modes]
    lost = any(row["lost"] for found in rows.values() for row in found.values())
    slow = options.target and any(row["ratio"] > 1.0 for row in timed)
    return 1 if lost or slow else 0


if __name__ == "__main__":
    sys.exit(main())
