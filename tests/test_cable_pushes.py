"""Cables that push, joints that leave their ranges, and cables that MuJoCo pulls along another route."""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import pytest
from cli_runs import ELBOW, ROOT, run_here

from mjwrap.checking.mistakes import Mistake, possible_mistakes
from mjwrap.runs import RunSettings
from mjwrap.runs.simulation import Simulation
from mjwrap.system import CableSystem

FINGER = str(ROOT / "models" / "finger" / "finger.xml")
MOTOR = """
<mujoco>
  <default><geom contype="0" conaffinity="0"/><joint damping=".01"/></default>
  <worldbody>
    <geom name="pulley" type="cylinder" size=".01 .02" zaxis="0 1 0"/>
    <site name="s0" pos="-.1 0 .012"/><site name="side" pos="0 0 .03"/>
    <body>
      <joint name="j1" axis="0 1 0" range="-10 90"/>
      <geom type="capsule" fromto="0 0 0 .05 0 0" size=".006" mass=".02"/>
      <site name="s1" pos=".03 0 .012"/>
    </body>
  </worldbody>
  <tendon>
    <spatial name="t1"><site site="s0"/><geom geom="pulley" sidesite="side"/><site site="s1"/></spatial>
  </tendon>
  <actuator>{}</actuator>
</mujoco>
"""


@pytest.mark.parametrize(
    ("actuator", "control", "pushes", "pulls_never"),
    [
        ('<motor name="m" tendon="t1" gear="10" ctrlrange="0 1"/>', 0.5, 5.0, True),
        ('<motor name="m" tendon="t1" gear="-10" ctrlrange="0 1"/>', 0.5, 0.0, False),
        ('<motor name="m" tendon="t1" gear="-10" ctrlrange="-1 0"/>', -0.5, 5.0, True),
        ('<motor name="m" tendon="t1" gear="10" ctrlrange="-1 1"/>', 0.5, 5.0, False),
        ('<motor name="m" tendon="t1" gear="10" ctrlrange="-1 1"/>', -0.5, 0.0, False),
        ('<motor name="m" tendon="t1" gear="10"/>', 0.5, 5.0, False),
        ('<general name="m" tendon="t1" gainprm="-4" ctrlrange="0 1"/>', 0.5, 0.0, False),
        ('<general name="m" tendon="t1" gainprm="4" ctrlrange="0 1" forcerange="-1 0"/>', 0.5, 0.0, False),
        ('<general name="m" tendon="t1" gainprm="4" ctrlrange="0 1" forcerange="0 1"/>', 0.5, 1.0, True),
        ('<position name="m" tendon="t1" kp="50" ctrlrange="0 1"/>', 0.2, 3.5, False),
    ],
)  # fmt: skip
@pytest.mark.parametrize("mode", ["python", "transmission"])
def test_a_cable_that_pushes_is_named(
    actuator: str,
    control: float,
    pushes: float,
    pulls_never: bool,
    mode: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = tmp_path / "hand.xml"
    file.write_text(MOTOR.format(actuator))
    settings = RunSettings(mode=mode, duration=0.02, excitation=[f"m=constant:{control}"])
    simulation = Simulation(str(file), settings)
    simulation.begin()
    simulation.advance()
    found = simulation.pushes.found()
    assert found == ({"m": pytest.approx(pushes, rel=0.02)} if pushes else {})
    assert ("m with up to" in simulation.pushes.told()) == bool(pushes)
    muscles = CableSystem(mujoco.MjModel.from_xml_path(str(file)))
    mistakes = [each for each in possible_mistakes(muscles) if each.kind == Mistake.PUSHES]
    assert [each.element for each in mistakes] == (["cable 'm'"] if pulls_never else [])
    if pulls_never and "motor" in actuator:
        (gear,) = re.findall(r'write (gear="[-0-9.]+")', mistakes[0].remedy)
        mended = re.sub(r'gear="[-0-9.]+"', gear, file.read_text())
        again = CableSystem(mujoco.MjModel.from_xml_string(mended))
        assert not [each for each in possible_mistakes(again) if each.kind == Mistake.PUSHES]
    if mode == "python":
        ran = run_here("run", capsys, file, "--duration", "0.02", "--excitation", f"m=constant:{control}")
        assert ("cables that pushed, as a string cannot: m with up to" in ran.out) == bool(pushes)


@pytest.mark.filterwarnings("default")
def test_a_run_gives_the_range_that_a_joint_has_left(capsys: pytest.CaptureFixture[str]) -> None:
    told = run_here("run", capsys, FINGER, "--duration", "0.01", "--prescribe", "mcp=2.5").out
    assert re.search(r"mcp 143\.2°, outside its range of -11\.5° to 74\.5°", told)
    assert "outside" not in run_here("run", capsys, FINGER, "--duration", "0.01").out


@pytest.mark.filterwarnings("default")
def test_compare_says_which_cables_have_another_route_in_mujoco(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.html"
    words = ("--bases", "1", "--samples", "3", "--duration", "0.01", "--report", page)
    told = run_here("compare", capsys, FINGER, *words).out
    assert "has another route, or no tendon, for fdp, extensor: the motions must differ" in told
    assert "no tendon, for fdp, extensor: the motions must differ" in page.read_text()
    assert "must differ" not in run_here("compare", capsys, ELBOW, *words).out
    assert "must differ" not in page.read_text()


@pytest.mark.filterwarnings("default")
def test_a_level_above_the_range_of_a_servo_is_not_called_percents(
    capsys: pytest.CaptureFixture[str],
) -> None:
    told = run_here(
        "run", capsys, FINGER, "--duration", "0.01", "--excitation", "fdp=constant:1", "fds=constant:50"
    ).err
    servo, motor = (line for line in told.splitlines() if "range of control" in line)
    assert "'fdp' reaches 1, outside its range of control, 0.07 to 0.14, and is clipped to it" in servo
    assert "units of its actuator" in servo
    assert "percents" not in servo
    assert "'fds' reaches 50" in motor
    assert "if these are percents, divide them by 100" in motor
