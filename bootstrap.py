#!/usr/bin/env python3
"""Set everything up and run it: needs Python 3.11 or newer with venv and pip, and nothing else.

    python3 bootstrap.py demo               install, run the elbow, leave a recording and a plot in out/; play it
    python3 bootstrap.py test [ARGS]        install, run the tests with MuJoCo 3; ARGS go to pytest
    python3 bootstrap.py test --mujoco 4    the same with MuJoCo 4, in an environment of its own

Environments are kept beside this file (.venv, .venv-mujoco4) and used again as long as pyproject.toml stays as it is.
"""

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent
OLDEST_PYTHON = (3, 11)
STAMP = "mjwrap-bootstrap.json"

DEMO_MODEL = "models/elbow/elbow.xml"
DEMO_RECORDING = "out/elbow.rrd"
DEMO_PLOT = "out/elbow.png"

# The wheels of MuJoCo 3 and 4 share a folder but not their lists of files, so going from one to the other inside an
# environment leaves a mixture of both. Each has its own. The newest myo-sim, real models for tests and demo, needs
# mujoco<4.
FOLDERS = {3: ".venv", 4: ".venv-mujoco4"}
DEMO_EXTRAS = {"demo", "myo"}
TEST_EXTRAS = {3: {"demo", "dev", "myo", "test"}, 4: {"demo", "test"}}
ON_ALL_CORES = (
    "-n",
    "auto",
    "--dist",
    "loadfile",
)  # whole files, because the tests of one share what they make
PINS = {3: "mujoco<4", 4: "mujoco>=4"}


class SetupError(Exception):
    """Something that the user has to mend; the message says what and how. `code` becomes the exit code."""

    def __init__(self, message: str, code: int = 1) -> None:
        super().__init__(message)
        self.code = code


def say(text: str) -> None:
    print(f"bootstrap: {text}", flush=True)


def check_python() -> None:
    """Raise `SetupError` unless this Python is new enough and can make virtual environments."""
    if sys.version_info[:2] < OLDEST_PYTHON:
        wanted, found = ".".join(map(str, OLDEST_PYTHON)), ".".join(map(str, sys.version_info[:2]))
        raise SetupError(
            f"mjwrap needs Python {wanted} or newer, this is {found} ({sys.executable}). "
            f"Run it with another, for example: python{wanted} bootstrap.py demo"
        )
    try:
        import ensurepip  # noqa: F401
        import venv  # noqa: F401
    except ImportError as error:
        raise SetupError(
            f"this Python cannot make virtual environments ({error}). "
            "On Debian and Ubuntu: sudo apt install python3-venv"
        ) from None


def environment() -> dict:
    """The environment of every command run here: the user's, less what would let other packages in."""
    return {k: v for k, v in os.environ.items() if k not in ("PYTHONHOME", "PYTHONPATH")}


def interpreter(folder: Path) -> Path:
    return folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def wanted_stamp(extras: "set[str]", mujoco: int) -> dict:
    """What an environment was made from: it is used again while this stays the same."""
    return {
        "project": hashlib.sha256((ROOT / "pyproject.toml").read_bytes()).hexdigest(),
        "python": ".".join(map(str, sys.version_info[:3])),
        "mujoco": PINS[mujoco],
        "extras": sorted(extras),
    }


def read_stamp(folder: Path) -> dict:
    try:
        return json.loads((folder / STAMP).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


def write_stamp(folder: Path, stamp: dict) -> None:
    """Mark `folder` as made here; an empty stamp says that it is not finished."""
    (folder / STAMP).write_text(json.dumps(stamp, indent=1), encoding="utf-8")


def is_ready(folder: Path, wanted: dict) -> bool:
    """True where the environment in `folder` has everything that `wanted` names, from the same project file."""
    found = read_stamp(folder)
    same = all(found.get(key) == wanted[key] for key in ("project", "python", "mujoco"))
    return same and set(wanted["extras"]) <= set(found.get("extras", [])) and interpreter(folder).exists()


def make(folder: Path, version: str) -> None:
    """Make an empty environment in `folder`, in the place of an earlier one made here."""
    if folder.exists() and not (folder / STAMP).exists():
        raise SetupError(f"{folder} is there, but this script did not make it: move it away, or remove it")
    say(f"making {folder.name} with Python {version}")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    write_stamp(folder, {})
    made = subprocess.run([sys.executable, "-m", "venv", str(folder)], env=environment())
    if made.returncode:
        raise SetupError(
            f"the virtual environment {folder.name} could not be made (see above)", made.returncode
        )


def prepare(extras: "set[str]", mujoco: int) -> Path:
    """Make the environment for `mujoco` (3 or 4) with `extras` or find it ready; return its interpreter."""
    folder = ROOT / FOLDERS[mujoco]
    wanted = wanted_stamp(extras, mujoco)
    python = interpreter(folder)
    if is_ready(folder, wanted):
        say(f"{folder.name} is up to date")
        return python

    started = time.monotonic()
    found = read_stamp(folder)
    if python.exists() and all(found.get(key) == wanted[key] for key in ("python", "mujoco")):
        wanted["extras"] = sorted(extras | set(found["extras"]))
        write_stamp(folder, {})
    else:
        make(folder, wanted["python"])

    say(
        f"installing mjwrap[{','.join(wanted['extras'])}] with {wanted['mujoco']} (takes minutes the first time)"
    )
    target = f"{ROOT}[{','.join(wanted['extras'])}]"
    command = [str(python), "-m", "pip", "install", "-qq", "--disable-pip-version-check"]
    install = subprocess.run([*command, "-e", target, wanted["mujoco"]], env=environment())
    if install.returncode:
        raise SetupError(
            "pip could not install what mjwrap needs (its own words are above). Without a network connection the "
            "first run cannot work; behind a proxy or mirror, pip reads HTTPS_PROXY and PIP_INDEX_URL",
            install.returncode,
        )
    write_stamp(folder, wanted)
    say(f"{folder.name} is ready after {time.monotonic() - started:.0f} s")
    return python


def run_demo(view: bool) -> int:
    """Simulate the elbow; say where the recording and the plot are, and play it where somebody can look."""
    python = prepare(DEMO_EXTRAS, 3)
    (ROOT / "out").mkdir(exist_ok=True)
    arguments = [DEMO_MODEL, "--duration", "2", "--excitation", "pulses"]
    outputs = ["--record", DEMO_RECORDING, "--plot", DEMO_PLOT]
    say(f"running mjwrap run {' '.join(arguments + outputs)}")
    result = subprocess.run(
        [str(python), "-m", "mjwrap", "run", *arguments, *outputs], cwd=ROOT, env=environment()
    )
    if result.returncode:
        return result.returncode
    missing = [name for name in (DEMO_RECORDING, DEMO_PLOT) if not (ROOT / name).is_file()]
    if missing:
        raise SetupError(f"the run ended well but did not leave {' and '.join(missing)}")
    say(f"the plot is {ROOT / DEMO_PLOT}")
    say(f"the recording is {ROOT / DEMO_RECORDING}")
    replay = [str(python), "-m", "mjwrap", "replay", DEMO_RECORDING]
    say(f"look at it with: {python.relative_to(ROOT)} {' '.join(replay[1:])}")
    if view and has_screen():
        subprocess.run(replay, cwd=ROOT, env=environment())
    return 0


def has_screen() -> bool:
    """Whether a person sits at a terminal beside a screen."""
    screen = sys.platform in ("win32", "darwin") or "DISPLAY" in os.environ or "WAYLAND_DISPLAY" in os.environ
    return screen and sys.stdin.isatty() and "CI" not in os.environ


def run_tests(mujoco: int, arguments: "list[str]") -> int:
    """Run pytest with `arguments`, files side by side on all cores; its exit code is returned."""
    python = prepare(TEST_EXTRAS[mujoco], mujoco)
    command = ["pytest", *ON_ALL_CORES, *arguments]  # a -n among the arguments counts more
    say(f"running {' '.join(command)}")
    return subprocess.run([str(python), "-m", *command], cwd=ROOT, env=environment()).returncode


def main(argv: "list[str] | None" = None) -> int:
    try:
        check_python()
        return run(argv)
    except SetupError as error:
        print(f"bootstrap: error: {error}", file=sys.stderr)
        return error.code
    except KeyboardInterrupt:
        return 130


def run(argv: "list[str] | None") -> int:
    """Read the command line and carry it out."""
    parser = argparse.ArgumentParser(
        prog="bootstrap.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="{demo,test}")
    demo = commands.add_parser("demo", help="install, run the elbow, leave a recording and a plot; play it")
    demo.add_argument("--no-view", action="store_true", help="open no viewer, also where there is a screen")
    test = commands.add_parser("test", help="install and run the tests; further arguments go to pytest")
    test.add_argument("--mujoco", type=int, choices=sorted(FOLDERS), default=3, help="MuJoCo's major version")
    options, rest = parser.parse_known_args(argv)
    if rest and options.command != "test":
        parser.error(f"unrecognized arguments: {' '.join(rest)}")
    return run_demo(not options.no_view) if options.command == "demo" else run_tests(options.mujoco, rest)


if __name__ == "__main__":
    sys.exit(main())
