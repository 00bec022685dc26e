"""benchmarks/paper/table1.py meets its targets and refuses bad arguments."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from method_scenes import TIMES, TOL, centre_y, exact_length

ROOT = Path(__file__).resolve().parent.parent


def test_benchmark_meets_its_targets(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "benchmarks" / "paper")
    runs: Any = importlib.import_module("table1_runs")
    best_of_paper = {1: 10_100, 2: 10_264}
    for case in (1, 2):
        newton = runs.production_row(case, 1)
        broyden = runs.paper_row(case, runs.paper.TABLE[-1], False)
        for row in (newton, broyden):
            assert row.failures == 0
            assert row.tangency_error <= TOL
            assert row.length_error_cm <= 1.5e-10
        assert newton.n_f <= 1000
        assert broyden.n_f <= best_of_paper[case]
        for t in TIMES[::10]:
            assert runs.paper.closed_form(case, t) == pytest.approx(
                exact_length(centre_y(case, t)), rel=1e-15
            )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--repeats", "0"], "argument --repeats: must be a whole number of at least 1, not '0'"),
        (["--json", "no/such/folder/x.json"], "argument --json: cannot write 'no/such/folder/x.json'"),
        (["--json", "."], "argument --json: '.' is a folder"),
        (["--plot", "x.txt"], "argument --plot: must end in .png, .svg or .pdf"),
    ],
)
def test_benchmark_refuses_bad_arguments_in_one_line(
    arguments: list[str], message: str, tmp_path: Path
) -> None:
    script = ROOT / "benchmarks" / "paper" / "table1.py"
    done = subprocess.run(
        [sys.executable, script, *arguments],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert message in done.stderr
    assert done.stdout == ""
    assert not list(tmp_path.iterdir())
