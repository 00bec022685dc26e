"""Messages of mjwrap run: positions outside a range, and the times of simulation and files."""

import json
from pathlib import Path

import pytest
from cli_runs import CASE2, ELBOW, run_here, said

SHORT = ("--duration", 0.01)
OUTSIDE = "mjwrap run: warning: 'elbow_flexion={}' lies outside the joint's range, 0 to 2.26893 rad"


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ("3", [f"{OUTSIDE.format('3')}; if degrees are meant, write 3deg"]),
        ("-0.1", [f"{OUTSIDE.format('-0.1')}; if degrees are meant, write -0.1deg"]),
        ("-6deg", [OUTSIDE.format("-0.10472")]),
        ("90deg", []),
        ("0", []),
        ("1.5", []),
    ],
)
@pytest.mark.filterwarnings("default")
def test_a_start_outside_the_range_is_told(
    value: str, told: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """As of an angle in degrees."""
    ran = run_here("run", capsys, ELBOW, *SHORT, "--qpos", f"elbow_flexion={value}")
    assert said(ran) == told


def test_a_joint_without_limits_has_no_outside(capsys: pytest.CaptureFixture[str]) -> None:
    ran = run_here("run", capsys, CASE2, *SHORT, "--qpos", "cylinder_y=0.001")
    assert (ran.code, said(ran)) == (0, [])


def test_files_are_not_counted_as_simulation(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A plot takes longer than a hundredth of a second of the elbow."""
    facts = json.loads(run_here("run", capsys, ELBOW, *SHORT, "--json").out)
    assert 0.0 <= facts["wall_files"] < facts["wall"]
    ran = run_here("run", capsys, ELBOW, *SHORT, "--plot", tmp_path / "p.png", "--json", tmp_path / "j.json")
    facts = json.loads((tmp_path / "j.json").read_text())
    assert facts["wall"] < facts["wall_files"]
    assert "s for the files" in ran.out
