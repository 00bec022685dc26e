"""Compile everything in advance, so that later commands start faster: paths, muscles, the engine plugin, recordings.

The machine code is kept for this user, this version of mjwrap and this version of numba; later commands load it. With
MODEL, the code that this model needs is compiled too.

Examples:
  mjwrap warmup
  mjwrap warmup models/elbow/elbow.xml --json
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numba.core import event

import mjwrap as mw
from mjwrap.cli.common.arguments import MODEL_HELP, add_json
from mjwrap.cli.common.output import Report
from mjwrap.errors import RecordingError, VersionError
from mjwrap.kernels.compilation import cache_folders
from mjwrap.runs.models import load
from mjwrap.system import CableSystem
from mjwrap.text import counted

SCENE = """
<mujoco>
  <worldbody>
    <geom name="ball" type="ellipsoid" size=".05 .04 .06" contype="0" conaffinity="0"/>
    <site name="origin" pos="-.2 0 .01"/>
    <body>
      <joint name="slide" type="slide" axis="1 0 0"/>
      <geom type="sphere" size=".01" pos=".2 0 0" mass="1" contype="0" conaffinity="0"/>
      <site name="insertion" pos=".2 0 0"/>
    </body>
  </worldbody>
  <tendon><spatial name="line"><site site="origin"/><site site="insertion"/></spatial></tendon>
  <actuator><muscle name="muscle" tendon="line" lengthrange=".2 .6"/></actuator>
  <custom>
    <tuple name="mjwrap_muscle">
      <element objtype="actuator" objname="muscle"/>
      <element objtype="site" objname="origin"/><element objtype="geom" objname="ball"/>
      <element objtype="site" objname="insertion"/>
    </tuple>
  </custom>
</mujoco>
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("model", nargs="?", metavar="MODEL", help=MODEL_HELP)
    add_json(parser, "write what was compiled, how long it took, and its folder")


class _Count(event.Listener):
    """Count the functions that are compiled, not loaded."""

    def __init__(self) -> None:
        self.compiled = 0

    def on_start(self, event: Any) -> None:
        self.compiled += 1

    def on_end(self, event: Any) -> None:
        pass


@dataclass(frozen=True)
class WarmupSettings:
    """The settings of `mjwrap warmup`: a model to compile for, and a file for the report ("-": standard output)."""

    model: str | None
    json: str | None


def execute(options: argparse.Namespace) -> int:
    """Run the command and return its exit code."""
    return warm_up(WarmupSettings(options.model, options.json))


def warm_up(settings: WarmupSettings) -> int:
    """Compile, and report what was compiled and the folder of the machine code."""
    report = Report(settings.json)
    model = load(settings.model) if settings.model else None
    count = _Count()
    event.register("numba:compile", count)
    steps: dict[str, Callable[[], object]] = {
        "paths": paths, "muscles": muscles, "plugin": plugin, "recording": recording,
    }  # fmt: skip
    if settings.model and model is not None:
        steps[settings.model] = lambda: evaluate(model)
    parts = []
    try:
        for name, step in steps.items():
            before, started = count.compiled, time.perf_counter()
            left_out = step()
            seconds = time.perf_counter() - started
            part = {
                "part": name,
                "compiled": count.compiled - before,
                "seconds": seconds,
                "left_out": left_out,
            }
            told = left_out or f"{counted(count.compiled - before, 'function')} compiled"
            report.say(f"{name}: {told}, {seconds:.1f} s")
            parts.append(part)
    finally:
        event.unregister("numba:compile", count)
    folder = cache_folders.base()
    size = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
    report.say(f"{'compiled' if count.compiled else 'nothing to compile'}; {size / 1e6:.0f} MB in {folder}")
    report.finish({"parts": parts, "compiled": count.compiled, "folder": str(folder), "bytes": size})
    return 0


def paths() -> None:
    """Solve a path and a sweep, also by the paper's methods, and compute every property of a path."""
    row = [mw.Obstacle(mw.Cylinder(0.03), hint=(0.0, 0.03, 0.0)), mw.ViaPoint((-0.06, 0.01, 0.01))]
    ends = (0.1, 0.01, 0.0), (-0.2, 0.0, 0.02)
    path = mw.solve_path(*ends, row)
    path.speed((0.1, 0.0, 0.0), (0.0, 0.2, 0.0), np.zeros((2, 6)))
    path.wrenches(5.0)
    path.points(0.01)
    path.gradient()
    path.stiffness()
    path.stiffness_times(np.ones((4, 6)))
    path.contact_velocities((0.1, 0.0, 0.0), (0.0, 0.2, 0.0))
    mw.solve_path(*ends, row, method="nr")
    places = np.tile([[0.0, 0.0, 0.0], [-0.06, 0.01, 0.01]], (2, 1, 1))
    turns = np.tile([1.0, 0.0, 0.0, 0.0], (2, 2, 1))
    mw.solve_sweep(*ends, row, places, turns)


def muscles() -> None:
    """Evaluate and step a MuscleSystem, and simulate a single muscle."""
    evaluate(mujoco.MjModel.from_xml_string(SCENE))
    law = mw.DeGrooteFregly2016(500.0, 0.1, 0.2, tendon="elastic")
    mw.simulate_muscle(law, [0.0, 0.01, 0.02], 0.3, excitation=0.5)


def evaluate(model: mujoco.MjModel) -> None:
    """Evaluate, step, differentiate and draw the muscles of a model."""
    system, data = CableSystem(model), mujoco.MjData(model)
    system.step(data)
    mujoco.mj_resetData(model, data)
    system.reset(data)
    system.apply(data)
    mujoco.mj_step(model, data)
    system.advance(data)
    system.length_jacobian(data)
    if system.n:
        system.forces(0)
    system.polylines()
    system.contacts()
    system.energetics(mw.Umberger2010())
    if not system.status.any():
        system.length_jacobian_rate(data)


def plugin() -> str:
    """Run a model with the engine plugin; return why that is impossible, or an empty string."""
    try:
        model = mw.install(mujoco.MjSpec.from_string(SCENE))
    except VersionError as error:
        return f"left out: {error}"
    mujoco.mj_step(model, mujoco.MjData(model))
    return ""


def recording() -> str:
    """Record a state; return why that is impossible, or an empty string."""
    model = mujoco.MjModel.from_xml_string(SCENE)
    system, data = mw.MuscleSystem(model), mujoco.MjData(model)
    with tempfile.TemporaryDirectory(prefix="mjwrap-") as folder:
        try:
            with mw.Recorder(model, system, Path(folder) / "warmup.rrd") as recorder:
                system.step(data)
                recorder.log(data)
        except RecordingError as error:
            return f"left out: {error}"
    return ""
