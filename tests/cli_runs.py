"""Running commands: in this process for speed, or in one of their own where that is what is tested."""

import csv
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from mjwrap.cli import main

ROOT = Path(__file__).resolve().parent.parent
ELBOW = str(ROOT / "models" / "elbow" / "elbow.xml")
CASE2 = str(ROOT / "models" / "paper_case2" / "paper_case2.xml")
CART = """
<mujoco>
  <option timestep="{h}" integrator="{integrator}"/>
  <worldbody>
    <body>
      <joint name="cart" type="slide" axis="1 0 0"/><geom size=".05" mass="2" contype="0" conaffinity="0"/>
      <body>
        <joint name="swing" axis="0 1 0"/>
        <geom type="sphere" size=".001" pos="0 0 -.5" mass="1" contype="0" conaffinity="0"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
ENTERS = """
<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <geom name="ball" type="sphere" size=".05" contype="0" conaffinity="0"/>
    <site name="a" pos="-.1 0 .01"/>
    <body><joint name="slide" type="slide" axis="1 0 0" damping="1"/>
      <geom size=".01" pos=".1 0 0" mass="1" contype="0" conaffinity="0"/><site name="b" pos=".1 0 0"/></body>
  </worldbody>
  <tendon><spatial name="t"><site site="a"/><geom geom="ball"/><site site="b"/></spatial></tendon>
  <actuator><muscle name="stuck" tendon="t" lengthrange=".05 .3"/></actuator>
</mujoco>
"""

COMPILING = (
    "mjwrap: compiling its kernels",
    "mjwrap: kernels compiled so far",
)  # the second one on a slow machine


class Ran(NamedTuple):
    """What a command left: exit code, standard output and error."""

    code: int
    out: str
    err: str


def run_here(name: str, capsys: pytest.CaptureFixture[str], *arguments: object) -> Ran:
    """Run a command in this process."""
    capsys.readouterr()
    try:
        code = main([name, *map(str, arguments)])
    except SystemExit as stop:
        code = int(stop.code or 0)
    captured = capsys.readouterr()
    return Ran(code, captured.out, captured.err)


def environment() -> dict[str, str]:
    """Return the environment of a command in a process of its own: this package, whether installed or not."""
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}


def start(name: str, *arguments: object, **options: object) -> "subprocess.Popen[str]":
    """Start a command in a process of its own."""
    command = [sys.executable, "-m", "mjwrap", name, *map(str, arguments)]
    return subprocess.Popen(
        command,
        cwd=ROOT,
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,  # pyright: ignore[reportArgumentType, reportCallIssue]
    )


def finish(process: "subprocess.Popen[str]") -> Ran:
    """Wait for a started command."""
    out, err = process.communicate(timeout=120)
    return Ran(process.returncode, out, err)


def said(ran: Ran) -> list[str]:
    """Return the lines of standard error, without those that say that kernels are compiled, and how many by now."""
    return [line for line in ran.err.splitlines() if not line.startswith(COMPILING)]


def rows_of(path: Path) -> list[dict[str, float]]:
    with path.open(newline="") as file:
        return [{name: float(cell) for name, cell in row.items()} for row in csv.DictReader(file)]


def simulate(capsys: pytest.CaptureFixture[str], *arguments: object) -> Ran:
    return run_here("run", capsys, *arguments)


def only_files(folder: Path, *names: str) -> None:
    assert sorted(path.name for path in folder.iterdir()) == sorted(names)
