"""The unit in which the angles of a table are read is told unless its header gives it."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli_runs import CASE2, ELBOW, run_here, said

TAKEN = "are taken as radians, because its header does not say inDegrees=yes"
ROWS = "time,{name}\n0,0.1\n1,{last}\n"


@pytest.mark.parametrize(
    ("header", "told"), [("", True), ("# inDegrees=yes\n", False), ("# inDegrees=no\n", False)]
)
def test_the_unit_is_told_where_it_is_not_given(
    header: str, told: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table, out = tmp_path / "motion.csv", tmp_path / "states.csv"
    table.write_text(header + ROWS.format(name="elbow_flexion", last="1.5"))
    ran = run_here("run", capsys, ELBOW, "--duration", "0.01", "--prescribe", table, "--out", out)
    assert (TAKEN in ran.out) == told
    again = run_here("replay", capsys, table, "--model", ELBOW, "--out", tmp_path / "o.csv")
    assert (TAKEN in again.out) == told
    own = run_here("replay", capsys, out, "--model", ELBOW, "--out", tmp_path / "o2.csv")
    assert (own.code, TAKEN in own.out) == (0, False)


def test_slides_have_no_unit_to_tell(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "motion.csv"
    table.write_text(ROWS.format(name="cylinder_y", last="0.1"))
    assert TAKEN not in run_here("run", capsys, CASE2, "--duration", "0.01", "--prescribe", table).out


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize(("last", "warned"), [("2.3", False), ("2.5", True), ("5", True)])
def test_a_motion_outside_the_range_is_warned_of(
    last: str, warned: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The elbow's range ends at 2.269 rad; a measured motion may leave it a little."""
    table = tmp_path / "motion.csv"
    table.write_text(ROWS.format(name="elbow_flexion", last=last))
    for words in (
        ("run", ELBOW, "--duration", "0.01", "--prescribe", table),
        ("replay", table, "--model", ELBOW, "--out", tmp_path / "o.csv"),
    ):
        ran = run_here(words[0], capsys, *words[1:])
        assert ran.code == 0
        lines = [line for line in said(ran) if "outside the range of joint 'elbow_flexion'" in line]
        assert len(lines) == int(warned)
        assert all(f"reaches {last} rad at time 1 s" in line for line in lines)
