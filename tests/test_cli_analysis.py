"""Tables in OpenSim's layout: a file for each quantity and joint, that mjwrap compare and OpenSim read back."""

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest
from cli_runs import ELBOW, run_here, said

import mjwrap as mw

# the files that OpenSim 4's MuscleAnalysis writes
KINDS = (
    "ActiveFiberForce", "ActiveFiberForceAlongTendon", "FiberActivePower", "FiberForce", "FiberLength",
    "FiberPassivePower", "FiberVelocity", "Length", "MomentArm_elbow_flexion", "Moment_elbow_flexion",
    "MuscleActuatorPower", "NormFiberVelocity", "NormalizedFiberLength", "PassiveFiberForce",
    "PassiveFiberForceAlongTendon", "PennationAngle", "PennationAngularVelocity", "TendonForce", "TendonLength",
    "TendonPower",
)  # fmt: skip
NAMES = ("TRIlong", "TRIlat", "TRImed", "BIClong", "BICshort", "BRA", "BRD")


@pytest.fixture
def made(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    """A folder with the states and the analysis of a run of the elbow."""
    files = ["--out", tmp_path / "states.sto", "--analysis", tmp_path / "e"]
    ran = run_here("run", capsys, ELBOW, "--duration", 0.2, "--excitation", "pulses:0.5,0.2", *files)
    assert (ran.code, said(ran)) == (0, [])
    found = sorted(path.name for path in tmp_path.glob("e_*"))
    assert found == [*(f"e_MuscleAnalysis_{kind}.sto" for kind in KINDS), "e_ProbeReporter_probes.sto"]
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
    for path in made.glob("e_MuscleAnalysis_*.sto"):
        ours, table = mw.read_table(path), opensim.TimeSeriesTable(str(path))
        assert tuple(table.getColumnLabels()) == ours.names == NAMES
        assert np.array_equal(np.array(table.getIndependentColumn()), ours.time)
        assert np.array_equal(table.getMatrix().to_numpy(), ours.values)
        assert opensim.Storage(str(path)).getSize() == len(ours.time)


def test_the_tables_agree_with_each_other(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Laws between columns that the kernels do not share: geometry of the fibre, balance, and rates by differences."""
    moving = ["--prescribe", "elbow_flexion=sine:0.5,1,1", "--excitation", "pulses:0.5,0.2"]
    ran = run_here(
        "run", capsys, ELBOW, "--duration", 0.3, "--sample", 0.002, *moving, "--analysis", tmp_path / "e"
    )
    assert ran.code == 0, ran.err
    tables = {kind: mw.read_table(tmp_path / f"e_MuscleAnalysis_{kind}.sto") for kind in KINDS}
    time = tables["Length"].time
    inner = slice(2, -2)
    rate = lambda kind: np.gradient(tables[kind].values, time, axis=0)[inner]  # noqa: E731
    angle = tables["PennationAngle"].values
    along = tables["FiberLength"].values * np.cos(angle)
    assert along + tables["TendonLength"].values == pytest.approx(tables["Length"].values, rel=1e-12)
    height = tables["FiberLength"].values * np.sin(angle)
    assert np.ptp(height, axis=0) == pytest.approx(0.0, abs=1e-15)
    assert angle[:, 0].min() > 0.1  # TRIlong is pennate
    scale = np.abs(tables["FiberVelocity"].values).max()
    assert rate("FiberLength") == pytest.approx(tables["FiberVelocity"].values[inner], abs=0.03 * scale)
    turning = tables["PennationAngularVelocity"].values
    assert rate("PennationAngle") == pytest.approx(turning[inner], abs=0.03 * np.abs(turning).max())
    total = tables["ActiveFiberForce"].values + tables["PassiveFiberForce"].values
    assert total == pytest.approx(tables["FiberForce"].values, rel=1e-12)
    assert total * np.cos(angle) == pytest.approx(
        tables["TendonForce"].values, rel=1e-9
    )  # the tendon is rigid
    for part in ("Active", "Passive"):
        force, speed = tables[f"{part}FiberForce"].values, tables["FiberVelocity"].values
        assert tables[f"Fiber{part}Power"].values == pytest.approx(-force * speed, rel=1e-9, abs=1e-12)
    arms, moments = tables["MomentArm_elbow_flexion"].values, tables["Moment_elbow_flexion"].values
    assert moments == pytest.approx(arms * tables["TendonForce"].values, rel=1e-12)


def test_the_probe_has_the_columns_of_opensims(made: Path) -> None:
    table = mw.read_table(made / "e_ProbeReporter_probes.sto")
    assert table.names == ("metabolics_TOTAL", "metabolics_BASAL", *(f"metabolics_{name}" for name in NAMES))
    muscles = table.values[:, 2:]
    assert muscles.min() >= 0.0  # the probe forbids negative power
    assert (muscles.mean(axis=0) > 0.1).all()
    assert table["metabolics_TOTAL"] == pytest.approx(
        muscles.sum(axis=1) + table["metabolics_BASAL"], rel=1e-12
    )
    assert table["metabolics_BASAL"] == pytest.approx(
        1.2 * mujoco.MjModel.from_xml_path(ELBOW).body_mass.sum()
    )


KNEE = """
<mujoco>
  <compiler angle="radian"/>
  <worldbody><body name="thigh"><joint name="hip" axis="0 1 0"/><geom size=".02" mass="1"/>
    <site name="a" pos="0 0 .1"/>
    <body name="shank" pos="0 0 -.4"><joint name="knee" axis="0 1 0" range="-2 0"/><geom size=".02" mass="1"/>
      <site name="b" pos="-.03 0 -.05"/>
      <body name="cap" pos=".05 0 0"><joint name="glide" type="slide" axis="0 0 1"/><geom size=".01" mass=".1"/>
        <site name="c"/></body></body></body></worldbody>
  <equality><joint joint1="glide" joint2="knee" polycoef="0 .03 .01 0 0"/></equality>
  <tendon><spatial name="quad"><site site="a"/><site site="c"/><site site="b"/></spatial></tendon>
  <actuator><muscle name="quad" tendon="quad" lengthrange=".3 .8"/></actuator>
</mujoco>
"""


def test_moment_arms_include_what_follows_the_coordinate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """OpenSim's moment arm is minus the slope of the length as the coordinate moves with all that is coupled to it."""
    model, states = tmp_path / "knee.xml", tmp_path / "states.csv"
    model.write_text(KNEE)
    angles = np.linspace(-1.5, -0.2, 41)
    glides = 0.03 * angles + 0.01 * angles**2
    rows = (f"{k},{a!r},{g!r}" for k, (a, g) in enumerate(zip(angles.tolist(), glides.tolist(), strict=True)))
    states.write_text("\n".join(["time,knee,glide", *rows]))
    ran = run_here("replay", capsys, states, "--model", model, "--analysis", tmp_path / "k")
    assert ran.code == 0, ran.err
    length = mw.read_table(tmp_path / "k_MuscleAnalysis_Length.sto")["quad"]
    arm = mw.read_table(tmp_path / "k_MuscleAnalysis_MomentArm_knee.sto")["quad"]
    slope = np.gradient(length, angles)
    assert arm[1:-1] == pytest.approx(-slope[1:-1], abs=2e-5)
    out = tmp_path / "run.csv"
    ran = run_here("replay", capsys, states, "--model", model, "--out", out, "--columns", "moment_arm")
    assert ran.code == 0, ran.err
    assert mw.read_table(out)["moment_arm:quad:knee"] == pytest.approx(arm, abs=1e-15)
    given = ["--states", states, "--moment-arms", f"knee={tmp_path / 'k_MuscleAnalysis_MomentArm_knee.sto'}"]
    small = ["--samples", 3, "--bases", 0, "--duration", 0, "--json"]
    told = json.loads(run_here("compare", capsys, model, *given, *small).out)["tables"]
    assert [abs(row["largest"]) < 1e-12 for row in told] == [True, True]
