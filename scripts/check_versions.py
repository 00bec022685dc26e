#!/usr/bin/env python3
"""Run the tests in a fresh environment with the versions of Python and MuJoCo that are asked for.

    python scripts/check_versions.py --python 3.12 --mujoco 3.11
    python scripts/check_versions.py --mujoco 4.0 -m "not slow"
    python scripts/check_versions.py --mujoco 3.17 --with "numba==0.68.*" tests/test_plugin.py

This is how the table in docs/versions.md was made. The environment is made in a temporary folder and removed in the
end, or kept with --keep FOLDER. All other arguments go to pytest, whose exit code is returned; 2 means that there is no
such Python, or that pip found no such packages.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
EXTRAS = ["demo", "test", "video"]


def find_python(wanted: str) -> str:
    """Return the interpreter of a version as "3.12", or of a path."""
    if wanted == "{}.{}".format(*sys.version_info):
        return sys.executable
    found = shutil.which(wanted) or shutil.which(f"python{wanted}")
    if found is None:
        raise SystemExit(
            f"there is no python{wanted} on the PATH; --python also takes the path of an interpreter"
        )
    return found


def environment() -> dict[str, str]:
    """The user's environment, less what would let other packages in."""
    return {name: text for name, text in os.environ.items() if name not in ("PYTHONHOME", "PYTHONPATH")}


def check(folder: Path, options: argparse.Namespace, arguments: list[str]) -> int:
    """Make the environment in `folder`, say what is in it, and run pytest with `arguments`."""
    extras = (
        EXTRAS if int(options.mujoco.split(".")[0]) > 3 else [*EXTRAS, "myo"]
    )  # the newest myo-sim asks for mujoco<4
    requirements = ["-e", f"{ROOT}[{','.join(extras)}]", f"mujoco=={options.mujoco}.*", *options.extra]
    python = str(folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python"))
    steps = [
        [find_python(options.python), "-m", "venv", "--clear", str(folder)],
        [python, "-m", "pip", "install", "-q", "--disable-pip-version-check", *requirements],
        [python, "-c", "import sys, mujoco, numba, numpy; print('Python', sys.version.split()[0], end=', '); "
         "print(', '.join(f'{m.__name__} {m.__version__}' for m in (mujoco, numba, numpy)), flush=True)"],
    ]  # fmt: skip
    for step in steps:
        if subprocess.run(step, env=environment()).returncode:
            return 2
    return subprocess.run([python, "-m", "pytest", *arguments], cwd=ROOT, env=environment()).returncode


def main() -> int:
    """Read the command line and carry it out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False
    )
    here = "{}.{}".format(*sys.version_info)
    parser.add_argument("--python", default=here, metavar="X", help=f"version, or an interpreter ({here})")
    parser.add_argument("--mujoco", required=True, metavar="Y", help="version, as 3.11 or 3.11.0")
    parser.add_argument("--with", dest="extra", action="append", default=[], metavar="REQUIREMENT",
                        help="what pip installs beside it, as numba==0.68.*; any number of times")  # fmt: skip
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="make the environment there and keep it")
    options, arguments = parser.parse_known_args()
    if not all(part.isdigit() for part in options.mujoco.split(".")):
        parser.error(f"--mujoco is a version as 3.11, not {options.mujoco}")
    if options.keep is not None:
        if options.keep.exists():
            parser.error(f"--keep: {options.keep} is there already")
        return check(options.keep.resolve(), options, arguments)
    with tempfile.TemporaryDirectory(prefix="mjwrap-versions-") as folder:
        return check(Path(folder), options, arguments)


if __name__ == "__main__":
    sys.exit(main())
