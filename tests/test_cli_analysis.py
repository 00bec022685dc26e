"""Tables in OpenSim's layout: a file for each quantity and joint, that mjwrap compare and OpenSim read back."""

import json
from pathlib import Path

import numpy as np
import pytest
from cli_runs import ELBOW, run_here, said

import mjwrap as mw

NAMES = ("TRIlong", "TRIlat", "TRImed", "BIClong", "BICshort", "BRA", "BRD")


@pytest.fixture
def made(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    """A folder with the states and the analysis of a run of the elbow."""
    files = ["--out", tmp_path / "states.sto", "--analysis", tmp_path / "e"]
    ran = run_here("run", capsys, ELBOW, "--duration", 0.2, "--excitation", "pulses:0.5,0.2", *files)
    assert (ran.code, said(ran)) == (0, [])
    kinds = ("FiberLength", "Length", "MomentArm_elbow_flexion", "TendonForce")
    found = sorted(path.name for path in tmp_path.glob("e_*"))
    assert found == [f"e_MuscleAnalysis_{kind}.sto" for kind in kinds]
    return tmp_path


def test_compare_reads_what_a_run_leaves(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """MuJoCo's own tendons of this model have the same lengths and moment arms, but for rounding."""
    given = ["--states", made / "states.sto", "--lengths", made / "e_MuscleAnalysis_Length.sto"]
    given += ["--moment-arms", f"elbow_flexion={made / 'e_MuscleAnalysis_MomentArm_elbow_flexion.sto'}"]
    small = ["--samples", 3, "--bases", 0, "--duration", 0, "--json"]
    rows = json.loads(run_here("compare", capsys, ELBOW, *given, *small).out)["tables"]
    assert {(row["muscle"], row["program"], row["quantity"]) for row in rows} == {
        (name, program, quantity)
        for name in NAMES for program in ("MuJoCo", "mjwrap") for quantity in ("length", "moment arm")
    }  # fmt: skip
    for row in rows:
        assert abs(row["largest"]) < 1e-12
        assert abs(row["table"]) > 1e-4


def test_a_replay_writes_the_same(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    states = made / "states.sto"
    ran = run_here("replay", capsys, states, "--model", ELBOW, "--analysis", made / "again")
    assert ran.code == 0, ran.err
    run = mw.read_table(states)
    for kind, name in (("Length", "length"), ("TendonForce", "tension"), ("FiberLength", "fiber_length")):
        tables = [mw.read_table(made / f"{start}_MuscleAnalysis_{kind}.sto") for start in ("e", "again")]
        assert tables[0].names == NAMES
        assert tables[0].values == pytest.approx(tables[1].values, rel=1e-12)
        assert np.array_equal(tables[0]["BRA"], run[f"{name}:BRA"])


def test_opensim_reads_it(made: Path) -> None:
    opensim = pytest.importorskip("opensim")
    for path in made.glob("e_*.sto"):
        ours, table = mw.read_table(path), opensim.TimeSeriesTable(str(path))
        assert tuple(table.getColumnLabels()) == ours.names == NAMES
        assert np.array_equal(np.array(table.getIndependentColumn()), ours.time)
        assert np.array_equal(table.getMatrix().to_numpy(), ours.values)
        assert opensim.Storage(str(path)).getSize() == len(ours.time)
