#!/usr/bin/env python3
"""Build the wheel from the source archive, install it into an empty environment outside the checkout, and try it there.

    python scripts/check_wheel.py
    python scripts/check_wheel.py --python 3.13 --with myosuite==3.0.0 --empty-cache

It needs Python with venv and pip, and nothing else. Every step is printed with its time. With --empty-cache the kernels
are compiled anew, as for a first user. The exit code is 1 if a step fails.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from check_versions import ROOT, environment, find_python

ELBOW = "mjwrap:elbow"
WRITTEN = ("out/elbow.sto", "out/elbow.rrd", "out/a_MuscleAnalysis_Length.sto")

# That the package is the installed one, that its models are there, and that a path, a system and the plugin work.
TRIAL = """
import sys
from pathlib import Path
import mujoco
import mjwrap as mw
from mjwrap.mjcf.named_models import own_models
from mjwrap.runs import load

inside = Path(sys.prefix).resolve()
assert inside in Path(mw.__file__).resolve().parents, mw.__file__
assert len(own_models()) >= 7, own_models()
for name, file in own_models().items():
    assert inside in file.parents, file
    load(f"mjwrap:{name}")

ball = mw.Obstacle(mw.Sphere(radius=0.03), pos=(0.0, 0.01, 0.0))
path = mw.solve_path((0.1, 0.0, 0.0), (-0.1, 0.02, 0.03), [ball])
assert abs(path.length - 0.205509356) < 1e-9, path.length

model = mw.load("mjwrap:elbow")
data = mujoco.MjData(model)
data.ctrl[:] = 0.3
mujoco.mj_step(model, data, nstep=10)
other = load("mjwrap:elbow")
muscles = mw.MuscleSystem(other)
beside = mujoco.MjData(other)
beside.ctrl[:] = 0.3
muscles.step(beside, nstep=10)
assert abs(data.qpos - beside.qpos).max() < 1e-9, (data.qpos, beside.qpos)
print("the path, the system and the plugin agree")
"""


class Failed(Exception):
    """A step failed; the message says which."""


def step(command: list[str], folder: Path, variables: dict[str, str], expected: int = 0) -> str:
    """Run a command in a folder, print it with its time, and return what it printed; `Failed` for another exit code."""
    started = time.monotonic()
    ran = subprocess.run(
        command, cwd=folder, env=environment() | variables, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )  # fmt: skip
    shown = " ".join("..." if "\n" in word else word for word in (Path(command[0]).name, *command[1:]))
    print(f"{time.monotonic() - started:6.1f} s  {shown}", flush=True)
    if ran.returncode != expected:
        raise Failed(f"exit code {ran.returncode} in place of {expected}: {shown}\n{ran.stdout}")
    return ran.stdout


def programs(folder: Path) -> Path:
    return folder / ("Scripts" if os.name == "nt" else "bin")


def build(folder: Path) -> Path:
    """Build the source archive, and from it the wheel; return the wheel."""
    tools = folder / "tools"
    step([sys.executable, "-m", "venv", str(tools)], folder, {})
    python = str(programs(tools) / "python")
    step([python, "-m", "pip", "install", "-q", "--disable-pip-version-check", "build"], folder, {})
    step([python, "-m", "build", "--outdir", str(folder / "dist"), str(ROOT)], folder, {})
    (wheel,) = (folder / "dist").glob("*.whl")
    return wheel


def check(folder: Path, options: argparse.Namespace) -> None:
    """Build, install and try the wheel in `folder`; raises `Failed` at the first step that fails."""
    wheel = build(folder)
    fresh, work = folder / "fresh", folder / "work"
    work.mkdir()
    variables = {"XDG_CACHE_HOME": str(folder / "cache")} if options.empty_cache else {}
    step([find_python(options.python), "-m", "venv", str(fresh)], work, {})
    python, mjwrap = (str(programs(fresh) / name) for name in ("python", "mjwrap"))
    # modules that nothing imports here need no bytecode, which takes as long as the download
    install = [python, "-m", "pip", "install", "-q", "--disable-pip-version-check", "--no-compile"]
    step([*install, str(wheel), *options.extra], work, {})
    step([python, "-m", "pip", "check"], work, {})

    def tried(*command: str, expected: int = 0, tells: str) -> None:
        if tells not in (out := step(list(command), work, variables, expected)):
            raise Failed(f"'{tells}' is missing in the output of {' '.join(command[1:])}:\n{out}")

    tried(mjwrap, "--version", tells="mjwrap 0.")
    tried(mjwrap, "inspect", ELBOW, "--quick", tells="7 muscles with geodesic paths")
    tried(
        mjwrap, "run", ELBOW, "--duration", "0.2", "--excitation", "pulses", "--out", "out/elbow.sto",
        "--record", "out/elbow.rrd", "--analysis", "out/a", tells="times real time",
    )  # fmt: skip
    if missing := [name for name in WRITTEN if not (work / name).is_file()]:
        raise Failed(f"the run left no {', '.join(missing)}")
    tried(python, "-c", TRIAL, tells="agree")
    tried(mjwrap, "run", "mjwrap:elbw", expected=2, tells="elbow_conservative")
    if not options.extra:
        tried(mjwrap, "run", ELBOW, "--plot", "out/p.png", expected=2, tells="mjwrap[demo]")
        tried(mjwrap, "inspect", "myo_sim:elbow", expected=2, tells="mjwrap[myo]")


def main() -> int:
    """Read the command line and carry it out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False
    )
    here = "{}.{}".format(*sys.version_info)
    parser.add_argument("--python", default=here, metavar="X", help=f"version, or an interpreter ({here})")
    parser.add_argument("--with", dest="extra", action="append", default=[], metavar="REQUIREMENT",
                        help="what pip installs beside the wheel; any number of times")  # fmt: skip
    parser.add_argument("--empty-cache", action="store_true", help="compile all kernels anew")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="mjwrap-wheel-") as folder:
        try:
            check(Path(folder).resolve(), options)
        except Failed as failure:
            print(f"check_wheel: {failure}", file=sys.stderr)
            return 1
    print("the wheel works")
    return 0


if __name__ == "__main__":
    sys.exit(main())
