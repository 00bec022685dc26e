"""Programs in fresh interpreters whose caches of machine code are under a folder of the test's."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mjwrap as mw

PACKAGE = Path(mw.__file__).parent
NOTICE = "mjwrap: compiling its kernels"
COUNT = "kernels compiled so far"  # in lines that come every some seconds

# A path over a cylinder and a sphere with a via point between them: most of what is compiled.
SOLVE = """
import json, mjwrap as mw
row = [mw.Obstacle(mw.Cylinder(0.03), hint=(0.0, 0.03, 0.0)), mw.ViaPoint((-0.06, 0.01, 0.01)),
       mw.Obstacle(mw.Sphere(0.02), pos=(-0.1, 0.0, 0.01), hint=(0.0, 0.02, 0.0))]
path = mw.solve_path((0.1, 0.01, 0.0), (-0.2, 0.0, 0.02), row)
twists = [[0.1, 0.2, 0.3, 1.0, -0.5, 0.2]] * 3
from mjwrap.kernels.compilation import cache_folders
print(json.dumps({
    "numbers": [path.length, path.speed((0.1, 0, 0), (0, 0.2, 0), twists), *path.wrenches(5.0).ravel().tolist(),
                *path.points(0.01).ravel().tolist()],
    "converged": bool(path.converged), "folder": str(cache_folders.base())}))
"""


@dataclass
class Run:
    """What one program said, but for counts of kernels, and how long it took [s], interpreter and imports included."""

    numbers: list[float]
    folder: Path
    told: list[str]
    seconds: float


def run(program: str, home: Path, package: Path = PACKAGE, **environment: str) -> Run:
    """Run a program in a fresh interpreter whose caches are under `home`."""
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("NUMBA", "XDG", "MJWRAP"))}
    kept |= {"PYTHONPATH": str(package.parent), "XDG_CACHE_HOME": str(home), "TMPDIR": str(home.parent)}
    started = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        env=kept | environment,
        cwd=home.parent,
    )
    seconds = time.perf_counter() - started
    assert done.returncode == 0, done.stderr
    said: dict[str, Any] = json.loads(done.stdout)
    assert said.get("converged", True)
    told = [line for line in done.stderr.splitlines() if COUNT not in line]
    return Run(said["numbers"], Path(said["folder"]), told, seconds)


def copy_of_the_package(folder: Path) -> Path:
    """Return a copy of the package in a folder."""
    shutil.copytree(PACKAGE, folder / "mjwrap", ignore=shutil.ignore_patterns("__pycache__"))
    return folder / "mjwrap"


def kernel_file(package: Path, name: str) -> Path:
    """Return the file of a kernel, in whichever folder it is."""
    (found,) = (package / "kernels").rglob(f"{name}.py")
    return found
