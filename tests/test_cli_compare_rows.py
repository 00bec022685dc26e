"""The rows of mjwrap compare --csv: both programs' figures, what is left out, and the tables of another program."""

import csv
from pathlib import Path

import mujoco
import numpy as np
import pytest
from cli_runs import ELBOW, run_here

import mjwrap as mw

TWO = """
<mujoco>
  <worldbody>
    <site name="a" pos="0 0 .3"/>
    <body>
      <joint name="hip" axis="0 1 0" range="-30 30" limited="true"/>
      <geom name="pin" type="cylinder" size=".03 .05" euler="90 0 0" pos=".05 0 0" mass="1"/>
      <site name="side" pos="-.1 0 0"/><site name="b" pos=".02 0 -.3"/>
      <body pos="0 0 -.3">
        <joint name="knee" axis="0 1 0" range="-30 30" limited="true"/>
        <geom size=".01" pos="0 0 -.2" mass="1"/>
        <site name="c" pos=".03 0 -.1"/>
      </body>
    </body>
  </worldbody>
  <tendon>
    <spatial name="short"><site site="a"/><geom geom="pin" sidesite="side"/><site site="b"/></spatial>
    <spatial name="long"><site site="a"/><site site="c"/></spatial>
  </tendon>
  <actuator>
    <muscle name="short" tendon="short" lengthrange=".3 .8"/><muscle name="long" tendon="long" lengthrange=".3 .8"/>
  </actuator>
</mujoco>
"""


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_rows_have_both_programs_figures_and_leave_out_what_says_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "two.xml").write_text(TWO)
    options = [
        tmp_path / "two.xml",
        "--samples",
        9,
        "--bases",
        2,
        "--duration",
        0,
        "--csv",
        tmp_path / "c.csv",
    ]
    ran = run_here("compare", capsys, *options)
    assert ran.code == 0, ran.err
    some = rows_of(tmp_path / "c.csv")
    assert "--csv-all" in ran.out
    assert run_here("compare", capsys, *options, "--csv-all").code == 0
    every = rows_of(tmp_path / "c.csv")
    assert len(every) == 2 * 9 * (2 * 3 + 1)  # muscles, poses, two joints around three poses and random poses
    assert {row["outcome"] for row in every} == {"AGREE"}
    # the knee does not move the short muscle; further poses say nothing new
    assert some == [
        row for row in every if row["base"] == "0" and (row["motion"], row["muscle"]) != ("knee", "short")
    ]

    model = mujoco.MjModel.from_xml_string(TWO)
    data = mujoco.MjData(model)

    def length(row: dict[str, str], further: float) -> float:
        mujoco.mj_resetData(model, data)
        data.joint(row["motion"]).qpos = float(row["at"]) + further
        mujoco.mj_forward(model, data)
        return float(data.ten_length[model.tendon(row["muscle"]).id])

    h = 1e-5
    for row in (row for row in some if row["motion"] in ("hip", "knee")):
        arm = (length(row, -h) - length(row, h)) / (2.0 * h)
        assert row["about"] == row["motion"]
        for program in ("mujoco", "mjwrap"):
            assert float(row[f"length_{program}"]) == pytest.approx(length(row, 0.0), abs=1e-12)
            assert float(row[f"moment_arm_{program}"]) == pytest.approx(arm, abs=1e-9)  # O(h²) m


def test_given_tables_have_a_file_of_their_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    time = np.linspace(0.0, 1.0, 5)
    states = mw.Table(time, ("elbow_flexion",), 0.2 + time[:, None])
    lengths = mw.Table(time, ("BRA",), 0.1 + 0.01 * time[:, None])
    mw.write_table(tmp_path / "s.sto", states)
    mw.write_table(tmp_path / "l.sto", lengths)
    given = ["--states", tmp_path / "s.sto", "--lengths", tmp_path / "l.sto", "--csv", tmp_path / "c.csv"]
    ran = run_here("compare", capsys, ELBOW, *given, "--samples", 3, "--bases", 0, "--duration", 0)
    assert ran.code == 0, ran.err
    rows = rows_of(tmp_path / "c_tables.csv")
    assert str(tmp_path / "c_tables.csv") in ran.out
    assert [(row["muscle"], row["quantity"], row["about"]) for row in rows] == [("BRA", "length", "")] * 5
    assert [float(row["time"]) for row in rows] == time.tolist()
    assert [float(row["table"]) for row in rows] == lengths["BRA"].tolist()
    model = mujoco.MjModel.from_xml_path(ELBOW)
    data = mujoco.MjData(model)
    for k, row in enumerate(rows):
        data.qpos[0] = 0.2 + time[k]
        mujoco.mj_forward(model, data)
        (tendon,) = (model.actuator_trnid[i, 0] for i in range(model.nu) if model.actuator(i).name == "BRA")
        for program in ("mujoco", "mjwrap"):
            assert float(row[program]) == pytest.approx(data.ten_length[tendon], abs=1e-12)


def test_csv_all_without_a_table_is_a_mistake(capsys: pytest.CaptureFixture[str]) -> None:
    ran = run_here("compare", capsys, ELBOW, "--csv-all")
    assert (ran.code, len(ran.err.splitlines())) == (2, 1)
    assert "--csv" in ran.err
