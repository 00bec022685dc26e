"""`mjwrap inspect` lists couplings, moving and conditional points and ligaments; commands on models without muscles."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_runs import run_here
from osim_models import model_file

import mjwrap as mw

KNEE = """<mujoco><worldbody>
  <body><joint name="lead" axis="0 0 1" range="-50 80"/><geom size=".1"/>
  <body><joint name="follow" axis="0 0 1"/><geom size=".1"/></body></body></worldbody>
  <equality><joint joint1="follow" joint2="lead" polycoef="0 .5 0 0 0"/></equality></mujoco>"""


def test_the_parts_of_the_leg(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The numbers are those of models/leg/leg.osim."""
    file, values = tmp_path / "leg.xml", tmp_path / "leg.json"
    mw.import_osim("mjwrap:leg").save(file)
    told = run_here("inspect", capsys, file, "--quick", "--json", values).out
    found = json.loads(values.read_text())
    led = {each["joint"]: each["follows"][0]["joint"] for each in found["couplings"]}
    assert led == {"knee_translation1": "knee_flexion", "knee_translation2": "knee_flexion"}
    assert found["couplings"][0]["follows"][0]["range"] == [0.0, 2.0]
    assert "knee_translation1 follows knee_flexion (0 to 2), " in told
    assert {each["site"] for each in found["moving_points"]} == {"rectus_femoris-P3", "vasti-P2"}
    axes = [(axis["axis"], axis["joint"]) for each in found["moving_points"] for axis in each["axes"]]
    assert axes == 2 * [("x", "knee_flexion"), ("y", "knee_flexion")]
    (point,) = found["conditional_points"]
    assert (point["site"], point["muscle"]) == ("rectus_femoris-P2", "rectus_femoris")
    (where,) = point["where"]
    assert where["range"] == pytest.approx([1.35, 2.4], abs=2e-5)
    assert "rectus_femoris-P2 of rectus_femoris: only in knee_flexion (1.35 to 2.4)" in told
    (ligament,) = found["ligaments"]
    assert ligament["ligament"] == "posterior_capsule"
    assert f"posterior_capsule: 420 N, {1e3 * ligament['resting_length']:.4g} mm at rest" in told


def test_a_model_of_couplings_only(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "knee.xml"
    file.write_text(KNEE)
    ran = run_here("inspect", capsys, file)
    assert ran.code == 0
    assert "no muscles and no actuators on spatial tendons" in ran.out
    assert "1 coupling:\n  follow follows lead (-0.8727 to 1.396), 1 piece" in ran.out


@pytest.mark.parametrize("name", ["BouncingBall_HuntCrossley", "StationDefinedFrames_Basic"])
def test_commands_on_a_model_without_muscles(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "model.xml"
    ran = run_here("import", capsys, model_file(name), "-o", file)
    assert f"next:      mjwrap run {file} --duration 1" in ran.out
    ran = run_here("run", capsys, file, "--duration", "0.01")
    assert ran.code == 0
    assert "the model declares no muscle for mjwrap; MuJoCo alone simulated it" in ran.out
    for command in ("inspect", "check", "compare"):
        ran = run_here(command, capsys, file)
        assert ran.code == 2
        assert "the model has no muscles" in ran.err
    joint = "ball_ty" if "Ball" in name else "none"
    ran = run_here("plot", capsys, file, "--joint", joint, "-o", tmp_path / "p.png")
    assert ran.code == 2
    wanted = "no muscle or cable with a path" if joint == "ball_ty" else "no hinge or slide 'none'"
    assert wanted in ran.err
    with pytest.raises(mw.ModelError, match="the model declares no muscle for mjwrap"):
        mw.load(file)
