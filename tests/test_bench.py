"""The timing benchmarks as scripts: arguments, and runs of those that time steps and muscles."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from newer_mujoco import batch

BENCHMARKS = Path(__file__).resolve().parent.parent / "benchmarks"
# Times of uncompiled kernels mean nothing, also where the tests run uncompiled.
ENVIRONMENT = {key: value for key, value in os.environ.items() if key != "NUMBA_DISABLE_JIT"}
ENVIRONMENT["PYTHONPATH"] = str(BENCHMARKS.parent)


@pytest.mark.parametrize(
    ("script", "arguments", "message"),
    [
        ("speed/bench_paths.py", ["--poses", "3"], "--poses at least 105"),
        (
            "speed/bench_paths.py",
            ["--scenes", "1 cylinder", "1 cube"],
            "'1 cube'; there are: 1 cylinder, 1 sphere",
        ),
        ("speed/bench_paths.py", ["--against", "no/such.json"], "cannot read no/such.json: No such file"),
        (
            "speed/bench_paths.py",
            ["--against", str(BENCHMARKS / "robustness" / "energy.py")],
            "is not a file that --json of this",
        ),
        ("speed/bench_paths.py", ["--json", "no/such/x.json"], "there is no folder"),
        ("speed/bench_step.py", ["--repeats", "0"], "--repeats must be at least 1"),
        ("speed/bench_step.py", ["--json", "no/such/x.json"], "there is no folder"),
        ("speed/bench_models.py", ["--runs", "0"], "--runs must be at least 1"),
        ("speed/bench_models.py", ["--json", "no/such/x.json"], "there is no folder"),
        ("speed/bench_models.py", ["--models", "spider"], "invalid choice: 'spider'"),
        ("speed/bench_rollout.py", ["--steps", "0"], "--steps must be at least 1"),
        ("speed/bench_rollout.py", ["--threads", "1", "0"], "--threads must be at least 1"),
        ("speed/bench_rollout.py", ["--json", "no/such/x.json"], "there is no folder"),
        ("speed/bench_muscle.py", ["--repeats", "0"], "--repeats must be at least 1"),
        ("speed/bench_muscle.py", ["--step", "nan"], "--step must be above 0"),
        ("speed/bench_muscle.py", ["--json", "no/such/x.json"], "there is no folder"),
        ("robustness/energy.py", ["--seconds", "nan"], "--seconds must be between"),
        ("robustness/robustness.py", ["--scenes", "0"], "--scenes must be at least 1"),
        ("robustness/robustness.py", ["--json", "no/such/x.json"], "there is no folder"),
        ("robustness/robustness.py", ["--replay", "no/such.json"], "--replay takes the file"),
        ("robustness/robustness.py", ["--classes", "square"], "invalid choice"),
        ("robustness/motion.py", ["--poses", "5"], "--poses must be at least 101"),
        ("robustness/motion.py", ["--save", "no/such/x.json"], "there is no folder"),
        ("plugin/plugin_soak.py", ["--loads", "5"], "show nothing"),
        ("plugin/plugin_hostile.py", ["--scenes", "none"], "invalid choice: 'none'"),
        ("plugin/upgrade_models.py", ["--samples", "2"], "0, or 3 at least"),
        ("plugin/upgrade_models.py", ["no/such.xml"], "no/such.xml"),
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
        [sys.executable, str(BENCHMARKS / "speed" / "bench_step.py"), "--repeats", "1", "--json", str(file)],
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


def test_the_benchmarks_of_installed_models_pair_what_they_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The elbow, with and without the plugin: all variants start every block from the same state."""
    monkeypatch.syspath_prepend(BENCHMARKS / "speed")
    bench, throughput = importlib.import_module("bench_models"), importlib.import_module("bench_rollout")
    file, label = tmp_path / "rows.json", bench.HOME
    modes = ["wrench", bench.SYSTEM]
    arguments = ["--models", label, "--modes", *modes, "--runs", "1", "--json", str(file)]
    monkeypatch.setattr(sys, "argv", ["bench_models.py", *arguments])
    assert bench.main() == 0
    rows = json.loads(file.read_text(encoding="utf-8"))[label]
    assert list(rows) == [*modes, "native"]
    for mode, row in rows.items():
        assert row["failures"] == row["lost"] == 0
        assert 0.0 < row["median"] <= row["p95"]
        assert row["ratio"] == 1.0 if mode == "native" else row["ratio"] > 0.0
        assert mode == "native" or mode in capsys.readouterr().out or mode == bench.SYSTEM
    leader, native = bench.Variant(label, "wrench", "Euler"), bench.Variant(label, None, "Euler")
    leader.block(0.4)
    native.follow(leader.data)
    np.testing.assert_array_equal(native.data.qpos, leader.data.qpos)
    assert native.data.time == leader.data.time == pytest.approx(bench.BLOCK * leader.model.opt.timestep)
    native.data.qpos[0] = np.nan
    native.block(0.4)
    assert (native.lost, leader.lost) == (1, 0)
    arguments = ["--models", label, "--envs", "3", "--steps", "45", "--repeats", "1", "--json", str(file)]
    monkeypatch.setattr(sys, "argv", ["bench_rollout.py", *arguments])
    assert throughput.main() == 0
    rows = json.loads(file.read_text(encoding="utf-8"))[label]
    assert rows["same bits"]
    last = "rollout" if batch is None else "batch"
    assert rows["rollout, 1"]["scaling"] == rows[f"{last}, 1"]["native scaling"] == 1.0
    assert rows[f"{last}, 2"]["mjwrap"] > 0.0


def test_the_muscle_benchmark_counts_what_it_times(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its short run of every row, which may miss a target on a busy machine, but not fail."""
    monkeypatch.syspath_prepend(BENCHMARKS / "speed")
    bench = importlib.import_module("bench_muscle")
    file = tmp_path / "muscle.json"
    monkeypatch.setattr(bench, "STEPS", 100)
    monkeypatch.setattr(
        sys, "argv", ["bench_muscle.py", "--repeats", "1", "--step", "0.005", "--json", str(file)]
    )
    assert bench.main() in (0, 1)
    rows = json.loads(file.read_text(encoding="utf-8"))
    assert list(rows) == [label for label, _, _, _ in bench.CASES]
    printed = capsys.readouterr().out
    for label, row in rows.items():
        assert label in printed
        assert row["failures"] == 0
        assert 0.0 < row["least"] <= row["median"] <= row["p95"]
        if "evaluations" in row:
            assert sum(row["evaluations"].values()) == row["steps"] == 1600
    label = "millard_2012, elastic"
    assert bench.verdict(label, rows[label] | {"failures": 1, "median": 0.0}) == "FAILED"
    assert "MISSED" in bench.verdict(label, rows[label] | {"median": 0.51})


def test_a_step_that_does_not_balance_has_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS / "speed")
    bench = importlib.import_module("bench_muscle")
    monkeypatch.setattr(bench, "STEPS", 4)
    motion = bench.prepare("millard_2012", "elastic", 2e-3)
    n = len(motion.params)

    def wrong(*arguments: Any) -> None:
        first, lengths, tension, counts = (arguments[i] for i in (3, 5, 7, 8))
        bench.run_elastic(*arguments)
        if first == 1:
            tension[first, 0] += 2e-8 * motion.params[0, 0]
            tension[first, 1] = np.nan
            counts[first, 2], counts[first, 3] = 11, -1
        assert len(lengths) == n

    assert bench.failures(motion, wrong, 2e-3)[0] == 4
    assert bench.failures(motion, bench.run_elastic, 2e-3)[0] == 0


JUMPING = """
<mujoco>
  <worldbody>
    <geom name="ball" type="sphere" size=".03" contype="0" conaffinity="0"/>
    <site name="side" pos="0 0 .05"/>
    <site name="a" pos="-.1 0 .01"/>
    <body><joint name="slide" type="slide" axis="0 0 1" range="-.08 .08" limited="true" damping="5"/>
      <geom size=".005" mass="1" contype="0" conaffinity="0"/><site name="b" pos=".1 .002 0"/></body>
  </worldbody>
  <tendon>
    <spatial name="t"><site site="a"/><geom geom="ball" sidesite="side"/><site site="b"/></spatial>
    <spatial name="u"><site site="a"/><geom geom="ball" sidesite="a"/><site site="b"/></spatial>
  </tendon>
  <actuator>
    <muscle name="m" tendon="t" lengthrange=".1 .3" force="10"/>
    <motor name="o" tendon="u" ctrlrange="0 1" ctrllimited="true"/>
  </actuator>
</mujoco>
"""


def test_the_table_of_models_tells_mujocos_jump_and_mjwraps_smooth_path(tmp_path: Path) -> None:
    model, file = tmp_path / "jumping.xml", tmp_path / "rows.json"
    model.write_text(JUMPING)
    arguments = [str(model), "--seconds", "0.2", "--samples", "21", "--bases", "0", "--json", str(file)]
    done = subprocess.run(
        [sys.executable, str(BENCHMARKS / "plugin" / "upgrade_models.py"), *arguments],
        cwd=tmp_path,
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    (row,) = json.loads(file.read_text())
    assert row["run"]["steps"] == row["run"]["wanted"] == 100
    assert (row["taken_over"], row["wrapped"]) == (1, 2)  # the tendon of the motor is compared, too
    assert {jump["program"] for jump in row["jumps"]} == {"MuJoCo"}
    assert "of 2 wrapped tendons 1 jump in MuJoCo" in done.stdout
    assert done.stdout.rstrip().endswith("| smooth |")
