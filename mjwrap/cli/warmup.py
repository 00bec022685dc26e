"""Compile everything in advance, so that later commands start faster: paths, muscles, the engine plugin, recordings.

The machine code is kept for this user, this version of mjwrap and this version of numba; later commands load it. With
MODEL, the code that this model needs is compiled too.

Examples:
  mjwrap warmup
  mjwrap warmup models/elbow/elbow.xml --json
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import mujoco
import numpy as np

import mjwrap as mw
from mjwrap.cli.common.arguments import MODEL_HELP, add_json
from mjwrap.cli.common.meanwhile import OtherProcess, can_help, laws
from mjwrap.cli.common.output import Report
from mjwrap.errors import RecordingError, VersionError
from mjwrap.inverse.muscle_wrenches import muscle_wrenches
from mjwrap.kernels.compilation import cache_folders, self_test
from mjwrap.kernels.compilation.cache_folders import config
from mjwrap.kernels.musculotendon.dispatch import PARAMS
from mjwrap.kernels.musculotendon.tangent import tangents
from mjwrap.runs.compile_time import CompileClock
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
MOVING = """
    <numeric name="insertion_x" data="1 0 .2 .1"/>
    <tuple name="mjwrap_moving_insertion">
      <element objtype="site" objname="insertion"/><element objtype="joint" objname="slide" prm="0"/>
      <element objtype="numeric" objname="insertion_x"/>
    </tuple>
  </custom>"""  # with this SCENE has a moving point


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("model", nargs="?", metavar="MODEL", help=MODEL_HELP)
    add_json(parser, "write what was compiled, how long it took, and its folder")


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
    parts: list[Part] = []

    def done(part: Part) -> None:
        told = part.left_out or f"{counted(part.compiled, 'function')} compiled"
        report.say(f"{part.part}: {told}, {part.seconds:.1f} s")
        parts.append(part)

    done(compile_part("first step", first_step))
    started = time.perf_counter()
    other = OtherProcess(f"{__name__}:muscles") if can_help() else None
    for work in (paths, plugin, recording, surfaces):
        done(compile_part(work.__name__, work))
    compiled = other.compiled() if other is not None else None
    if compiled is not None:
        done(Part("muscles", compiled, time.perf_counter() - started, ""))
    else:
        done(compile_part("muscles", muscles))
    if settings.model and model is not None:
        done(compile_part(settings.model, lambda: evaluate(model)))
    folder = cache_folders.base()
    size = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
    total = sum(part.compiled for part in parts)
    report.say(f"{'compiled' if total else 'nothing to compile'}; {size / 1e6:.0f} MB in {folder}")
    values = {
        "parts": [asdict(part) for part in parts],
        "compiled": total,
        "folder": str(folder),
        "bytes": size,
    }
    report.finish(values)
    return 0


@dataclass(frozen=True)
class Part:
    """A part of the work: how many functions were compiled, in how many seconds, and why it was left out, if so."""

    part: str
    compiled: int
    seconds: float
    left_out: str


def compile_part(name: str, work: Callable[[], str | None]) -> Part:
    """Do a part of the work, which returns why it is left out, if so."""
    started = time.perf_counter()
    with CompileClock() as clock:
        left_out = work() or ""
    return Part(name, clock.compiled, time.perf_counter() - started, left_out)


def first_step() -> None:
    """Take a step with a muscle over a cylinder, which needs what every other part needs."""
    model = mujoco.MjModel.from_xml_string(SCENE.replace("ellipsoid", "cylinder"))
    mw.MuscleSystem(model).step(mujoco.MjData(model))


def paths() -> None:
    """Solve a path and a sweep, also by the paper's methods, and compute every property of a path."""
    row = [mw.Obstacle(mw.Cylinder(0.03), hint=(0.0, 0.03, 0.0)), mw.ViaPoint((-0.06, 0.01, 0.01))]
    ends = (0.1, 0.01, 0.0), (-0.2, 0.0, 0.02)
    path = mw.solve_path(*ends, row)
    path.speed((0.1, 0.0, 0.0), (0.0, 0.2, 0.0), np.zeros((2, 6)))
    path.wrenches(5.0)
    path.points(0.01)
    _ = path.hints_met
    path.gradient()
    path.stiffness()
    path.stiffness_times(np.ones((4, 6)))
    path.contact_velocities((0.1, 0.0, 0.0), (0.0, 0.2, 0.0))
    mw.solve_path(*ends, row, method="nr")
    places = np.tile([[0.0, 0.0, 0.0], [-0.06, 0.01, 0.01]], (2, 1, 1))
    turns = np.tile([1.0, 0.0, 0.0, 0.0], (2, 2, 1))
    mw.solve_sweep(*ends, row, places, turns)


def muscles() -> None:
    """Evaluate and step a MuscleSystem, optimise activations, and simulate a single muscle."""
    for text in (SCENE, SCENE.replace("</custom>", MOVING)):
        evaluate(mujoco.MjModel.from_xml_string(text))
    model, none = mujoco.MjModel.from_xml_string(SCENE), np.zeros((0, 1))
    mw.static_optimization(mw.MuscleSystem(model), mw.Motion([0.0], [model.qpos0]), jobs=1)
    tangents(np.zeros(1, dtype=np.int64), np.zeros((1, PARAMS)), none, none, none, none, none)
    laws()


def evaluate(model: mujoco.MjModel) -> None:
    """Evaluate, step, differentiate, analyse and draw the muscles of a model."""
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
    _ = system.hints_met
    system.energetics(mw.Umberger2010())
    motion = mw.Motion([0.0], [model.qpos0])
    mw.muscle_analysis(system, motion)
    muscle_wrenches(system, motion.completed(model), np.zeros((1, system.n)))
    if not system.status.any():
        system.length_jacobian_rate(data)


def surfaces() -> None:
    """Compile what only some surfaces, rows and moves need: every kernel that is compiled at its first call."""
    if self_test.is_plain() or config.DISABLE_JIT:
        return
    from mjwrap.kernels.compilation.linking import (
        Deferred,  # uses inner parts of numba that another version may lack
    )

    modules = [module for name, module in list(sys.modules.items()) if name.startswith("mjwrap.kernels.")]
    kernels = {
        kernel for module in modules for kernel in vars(module).values() if isinstance(kernel, Deferred)
    }
    while sum(kernel.compile_called() for kernel in kernels):  # one may call another
        pass


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
