"""Run the tests of kernels, paths and machine code with several versions of numba, each in an environment of its own.

Run this before the range of numba in `pyproject.toml` and `TESTED` in `mjwrap/kernels/compilation/self_test.py` change:
a version belongs there once its tests pass with `plain` "no". Each version takes some minutes.

    python benchmarks/numba_versions.py 0.65.1 0.66.0 0.67.0 0.68.1
    python benchmarks/numba_versions.py 0.69.0 --tests tests/test_newton.py
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).parents[1]
NEEDED = ["numpy", "scipy", "mujoco<4", "sympy", "platformdirs", "pytest", "hypothesis"]
TESTS = ["tests/test_newton.py", "tests/test_paths.py", "tests/test_cache.py", "tests/test_cache_closure.py"]
VERDICT = (
    "from mjwrap.kernels.compilation import cache_folders, self_test; "
    "print('no' if self_test.passes(cache_folders.base()) else 'yes')"
)


def python_with(version: str, folder: Path) -> Path:
    """Return an interpreter that has one version of numba, made where it is missing."""
    home = folder / f"numba-{version}"
    python = home / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    if not python.exists():
        venv.create(home, with_pip=True)
        install = [python, "-m", "pip", "install", "--quiet", f"numba=={version}", *NEEDED]
        subprocess.run(install, check=True)
    return python


def main() -> None:
    """Test each version, print a table, and end with 1 where a test failed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("versions", nargs="+", metavar="VERSION", help="of numba, such as 0.68.1")
    parser.add_argument("--folder", type=Path, default=ROOT / "out" / "numba", help="of the environments")
    parser.add_argument("--tests", nargs="+", default=TESTS, help="files of tests")
    options = parser.parse_args()
    rows = []
    for version in options.versions:
        python = python_with(version, options.folder.absolute())
        with tempfile.TemporaryDirectory(prefix="mjwrap-numba-") as home:
            setting = os.environ | {"PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": home}
            tried = subprocess.run(
                [python, "-c", VERDICT], cwd=ROOT, env=setting, capture_output=True, text=True
            )
            tested = subprocess.run(
                [python, "-m", "pytest", "-q", *options.tests], cwd=ROOT, env=setting, stdout=sys.stderr
            )
        plain = tried.stdout.strip() or "error"
        rows.append((version, plain, "passed" if tested.returncode == 0 else "failed"))
    print(f"{'numba':10s}{'plain':8s}tests")
    for version, plain, outcome in rows:
        print(f"{version:10s}{plain:8s}{outcome}")
    sys.exit(any(outcome == "failed" for *_, outcome in rows))


if __name__ == "__main__":
    main()
