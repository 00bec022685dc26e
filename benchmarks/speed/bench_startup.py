"""The first hour's waits: a first path, the first `run` and `warmup` after it, each from machine code as it finds it.

    python benchmarks/speed/bench_startup.py --repeats 3
    python benchmarks/speed/bench_startup.py --package ../other    # another checkout, in turn with this one

Every repeat begins with an empty cache. Printed are the clock and, in brackets, the processor time of the program and
of the process that helps it [s], as medians.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PATH = """
import mjwrap as mw
elbow = mw.Obstacle(mw.Cylinder(radius=0.02), hint=(-0.02, 0.0, 0.0))
assert mw.solve_path((-0.01, 0.15, 0.0), (0.05, 0.0, -0.01), [elbow]).converged
"""
MODEL = "models/elbow/elbow.xml"
RUN = ["-m", "mjwrap", "run", MODEL, "--duration", "2", "--excitation", "pulses"]
# Each group begins with an empty cache; what follows in it finds what came before.
GROUPS = [
    [("first path over one cylinder", ["-c", PATH])],
    [("first run of the elbow", RUN), ("warmup after it", ["-m", "mjwrap", "warmup"]), ("second run", RUN)],
    [("warmup, from an empty cache", ["-m", "mjwrap", "warmup"])],
]


def measure(arguments: list[str], package: Path, cache: str) -> tuple[float, float]:
    """Return clock and processor time of a program [s], in a checkout and with a folder for machine code."""
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("NUMBA", "MJWRAP"))}
    environment = kept | {"PYTHONPATH": str(package), "XDG_CACHE_HOME": cache}
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(
        [sys.executable, *arguments], cwd=package, env=environment, check=True, capture_output=True
    )
    seconds, after = time.perf_counter() - started, resource.getrusage(resource.RUSAGE_CHILDREN)
    return seconds, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Measure the checkouts in turn and print a line for each program."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--package", type=Path, help="another checkout to measure, in turn with this one")
    options = parser.parse_args()
    packages = [ROOT] if options.package is None else [ROOT, options.package.resolve()]
    found: dict[tuple[str, Path], list[tuple[float, float]]] = {}
    for _ in range(options.repeats):
        for group in GROUPS:
            for package in packages:
                with tempfile.TemporaryDirectory(prefix="mjwrap-") as cache:
                    for name, arguments in group:
                        found.setdefault((name, package), []).append(measure(arguments, package, cache))
    for (name, package), times in found.items():
        clock, processor = (statistics.median(column) for column in zip(*times, strict=True))
        print(f"{name:30s} {clock:6.1f} s ({processor:5.1f} s)  {package}")


if __name__ == "__main__":
    main()
