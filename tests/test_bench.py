"""The timing benchmarks as scripts: arguments, and a run of the one that times steps."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).resolve().parent.parent / "benchmarks"
# Times of uncompiled kernels mean nothing, also where the tests run uncompiled.
ENVIRONMENT = {key: value for key, value in os.environ.items() if key != "NUMBA_DISABLE_JIT"}
ENVIRONMENT["PYTHONPATH"] = str(BENCHMARKS.parent)


@pytest.mark.parametrize(
    ("script", "arguments", "message"),
    [
        ("bench_paths.py", ["--poses", "3"], "--poses at least 105"),
        ("bench_paths.py", ["--scenes", "1 cylinder", "1 cube"], "'1 cube'; there are: 1 cylinder, 1 sphere"),
        ("bench_paths.py", ["--against", "no/such.json"], "cannot read no/such.json: No such file"),
        ("bench_paths.py", ["--against", str(BENCHMARKS / "energy.py")], "is not a file that --json of this"),
        ("bench_paths.py", ["--json", "no/such/x.json"], "there is no folder"),
        ("bench_step.py", ["--repeats", "0"], "--repeats must be at least 1"),
        ("bench_step.py", ["--json", "no/such/x.json"], "there is no folder"),
        ("energy.py", ["--seconds", "nan"], "--seconds must be between"),
    ],
)
def test_bad_arguments_are_refused_before_anything_runs(
    script: str, arguments: list[str], message: str
) -> None:
    done = subprocess.run(
        [sys.executable, str(BENCHMARKS / script), *arguments],
        cwd=BENCHMARKS.parent,
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


def test_the_step_benchmark_runs_and_adds_up(tmp_path: Path) -> None:
    file = tmp_path / "step.json"
    done = subprocess.run(
        [sys.executable, str(BENCHMARKS / "bench_step.py"), "--repeats", "1", "--json", str(file)],
        cwd=BENCHMARKS.parent,
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    rows = json.loads(file.read_text(encoding="utf-8"))
    assert any(label.endswith("RK4") for label in rows)
    for row in rows.values():
        assert row["failures"] == 0
        assert row["ratio"] > 0
        assert row["kernel_calls"] > 1
        assert row["kernels"] > 0
