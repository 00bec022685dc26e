"""The missing folder of an output is made, and nothing is left of it if the output does not come."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from cli_runs import ELBOW, run_here

import mjwrap as mw
from mjwrap.runs import load

TABLE = mw.Table(np.arange(2.0), ("a",), np.zeros((2, 1)))


@pytest.mark.parametrize(
    ("command", "option", "name"),
    [
        ("run", "--out", "t.sto"), ("run", "--csv", "t.csv"), ("run", "--plot", "p.png"), ("run", "--record", "r.rrd"),
        ("run", "--json", "j.json"), ("run", "--analysis", "a"), ("inspect", "--json", "j.json"),
        ("compare", "--csv", "c.csv"), ("compare", "--report", "r.html"), ("check", "--json", "j.json"),
    ],
)  # fmt: skip
def test_every_output_of_every_command(
    command: str, option: str, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    short = {
        "run": ["--duration", "0.01"], "inspect": ["--quick"], "check": ["--poses", "1", "--samples", "3"],
        "compare": ["--samples", "3", "--bases", "0", "--duration", "0"],
    }  # fmt: skip
    place = tmp_path / "out" / "deep" / name
    ran = run_here(command, capsys, ELBOW, *short[command], option, place)
    assert ran.code == 0, ran.err
    made = [path.name for path in place.parent.iterdir()]
    assert made
    assert all(each.startswith(name) for each in made)


def test_python_makes_them_too(tmp_path: Path) -> None:
    model = load(ELBOW)
    muscles = mw.MuscleSystem(model)
    data = mujoco.MjData(model)
    muscles.forward(data)
    mw.write_table(tmp_path / "a" / "b" / "t.csv", TABLE)
    with mw.Recorder(model, muscles, tmp_path / "c" / "r.rrd") as recorder:
        recorder.log(data)
    assert (tmp_path / "a" / "b" / "t.csv").is_file()
    assert (tmp_path / "c" / "r.rrd").is_file()


def fail_to_write(path: Path) -> None:
    mw.write_table(path, mw.Table(np.arange(2.0), ("a\tb",), np.zeros((2, 1))))


def fail_to_record(path: Path) -> None:
    model = load(ELBOW)
    with mw.Recorder(model, mw.MuscleSystem(model), path.with_suffix(".rrd")):
        raise KeyError


@pytest.mark.parametrize("fail", [fail_to_write, fail_to_record])
def test_nothing_is_left_after_an_error(fail: Callable[[Path], Any], tmp_path: Path) -> None:
    with pytest.raises((mw.TableError, KeyError)):
        fail(tmp_path / "new" / "deep" / "t.sto")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "old").mkdir()
    with pytest.raises((mw.TableError, KeyError)):
        fail(tmp_path / "old" / "deep" / "t.sto")
    assert list(tmp_path.rglob("*")) == [tmp_path / "old"]  # it was there before


def test_a_command_that_fails_leaves_no_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    outputs = [
        "--out",
        tmp_path / "o" / "t.sto",
        "--record",
        tmp_path / "o" / "r.rrd",
        "--plot",
        tmp_path / "p.docx",
    ]
    assert run_here("run", capsys, ELBOW, *outputs).code == 2
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_way_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "out").write_text("")
    ran = run_here("run", capsys, ELBOW, "--out", tmp_path / "out" / "deep" / "t.sto")
    assert ran.code == 2
    assert f"'{tmp_path / 'out'}' is not a folder" in ran.err
