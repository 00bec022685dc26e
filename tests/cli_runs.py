"""Running commands: in this process for speed, or in one of their own where that is what is tested."""

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
    """Return the lines of standard error, without the one that says that kernels are compiled."""
    return [line for line in ran.err.splitlines() if "compiling its kernels" not in line]
