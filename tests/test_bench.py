"""The timing benchmarks: their scenes, their arithmetic, and that a failure cannot look fast."""

from __future__ import annotations

import importlib
import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import reference_scene

import mjwrap as mw

BENCHMARKS = Path(__file__).resolve().parent.parent / "benchmarks"
# Times of uncompiled kernels mean nothing, also where the tests run uncompiled.
ENVIRONMENT = {key: value for key, value in os.environ.items() if key != "NUMBA_DISABLE_JIT"}
ENVIRONMENT["PYTHONPATH"] = str(BENCHMARKS.parent)


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("bench_paths")


@pytest.fixture
def scenes(bench: Any) -> Any:
    return importlib.import_module("path_scenes")


@pytest.mark.parametrize(("name", "n"), [("b_sphere", 0), ("f_cyl01", 1), ("f_cyl02", 2), ("f_cyl04", 4)])
def test_scenes_are_those_of_the_exact_references(scenes: Any, name: str, n: int) -> None:
    reference = reference_scene(name)
    poses = reference["poses"]
    scene = scenes.cylinders(n, len(poses)) if n else scenes.sphere(len(poses))
    pos, quat = scene.motion()
    assert pos == pytest.approx(np.array([pose["pos"] for pose in poses]), abs=1e-15)
    assert quat == pytest.approx(np.array([pose["quat"] for pose in poses]), abs=1e-15)
    assert scene.insertion == pytest.approx(poses[0]["insertion"], abs=1e-15)
    assert scene.origin == pytest.approx(poses[0]["origin"], abs=1e-15)
    sweep = mw.solve_sweep(scene.origin, scene.insertion, scene.obstacles(), pos, quat)
    assert sweep.converged
    assert sweep.length == pytest.approx([pose["length"] for pose in poses], rel=1e-12)


def test_every_solver_finds_the_same_lengths(bench: Any, scenes: Any) -> None:
    """A short run: lengths of all solvers agree, MuJoCo's over one surface, OpenSim's where it is installed."""
    for scene in (scenes.cylinders(1, 106), scenes.sphere(106), scenes.cylinders(2, 106)):
        rows, missing = bench.time_scene(scene, repeats=2)
        assert len(rows) + len(missing) == 4
        assert ("MuJoCo tendon" in rows) == (scene.n == 1)
        for row in rows.values():
            assert row["failures"] == 0
            assert row["poses"] == 2 * scene.poses
            assert row["length_difference"] < 1e-9
            assert math.isfinite(row["median"])
        assert rows["mjwrap warm"]["ratio"] == 1.0
        assert rows["mjwrap warm"]["tangency_error"] <= 1e-10


class Fake:
    """A fast solver that is wrong at the poses that it is told to be wrong at."""

    def __init__(self, solvers: Any, name: str, time: float, length: Any, failed: Any) -> None:
        self.name = name
        self.run = solvers.Sweep(time, np.full(15, time), np.array(length), np.array(failed))

    def sweep(self) -> Any:
        return self.run


def test_a_failure_is_counted_and_misses_the_targets(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    solvers = importlib.import_module("path_solvers")
    good, none = [1.0, 1.1, 1.2], [False] * 3
    fakes = [
        Fake(solvers, "mjwrap warm", 0.5, good, none),
        Fake(solvers, "says so", 0.1, good, [False, True, False]),
        Fake(solvers, "silently wrong", 0.1, [1.0, 1.1 + 1e-6, 1.2], none),
        Fake(solvers, "no number", 0.1, [1.0, math.nan, 1.2], none),
    ]
    monkeypatch.setattr(bench, "solvers", lambda scene: (fakes, {}))
    rows, _ = bench.time_scene(None, repeats=4)
    assert {name: row["failures"] for name, row in rows.items()} == {
        "mjwrap warm": 0,
        "says so": 4,
        "silently wrong": 4,
        "no number": 4,
    }
    assert rows["says so"]["ratio"] == pytest.approx(0.2)
    table = {
        "1 cylinder": rows,
        "16 cylinders": {"mjwrap warm": {**rows["mjwrap warm"], "median_each": [4.0] * 4}},
    }
    assert [met for _, met in bench.judge(table)] == [True, True, True]
    assert "8.00 times" in bench.judge(table)[1][0]
    table["1 cylinder"]["mjwrap warm"]["failures"] = 1
    assert [met for _, met in bench.judge(table)] == [False, False, False]
    table["1 cylinder"]["mjwrap warm"]["failures"] = 0
    table["1 cylinder"]["mjwrap warm"]["median"] = 1.01
    assert [met for _, met in bench.judge(table)] == [False, True, True]


@pytest.mark.parametrize(
    ("script", "arguments", "message"),
    [
        ("bench_paths.py", ["--poses", "3"], "--poses at least 105"),
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
