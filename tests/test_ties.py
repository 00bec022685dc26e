"""Ties and kinks: poses at which no path has a continuous moment arm, which is nobody's fault."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

import mjwrap as mw
from mjwrap.checking import check_model
from mjwrap.comparison import PoseComparison, compare_poses, verdict

CASE = Path(__file__).resolve().parents[2] / "shared" / "cases" / "23_tie_verdict" / "tie.xml"
# The straight line passes through the ball's centre in the middle of both sweeps.
TIE = """
<mujoco>
  <worldbody>
    <geom name="ball" type="sphere" size="{radius}" pos="0 0 .4" contype="0" conaffinity="0"/>
    <site name="a" pos="0 0 {above}"/><site name="side" pos=".3 {turn} .4"/>
    <body name="load"><joint name="x" type="slide" axis="1 0 0" range="-.1 .1"/>
      <joint name="y" type="slide" axis="0 1 0" range="-.1 .1"/>
      <geom type="sphere" size=".02" mass="1" contype="0" conaffinity="0"/><site name="b"/></body>
  </worldbody>
  <tendon><spatial name="t"><site site="a"/><geom geom="ball" {side}/><site site="b"/></spatial></tendon>
  <actuator><muscle name="m" tendon="t" lengthrange=".5 1.5" force="10"/></actuator>
</mujoco>
"""
# Along the slide, site b passes through site a.
THROUGH = """
<mujoco>
  <worldbody>
    <site name="a" pos=".05 0 0"/><site name="c" pos=".05 .2 .03"/>
    <body name="load"><joint name="x" type="slide" axis="1 0 0" range="-.05 .15"/>
      <geom type="sphere" size=".02" mass="1" contype="0" conaffinity="0"/><site name="b"/></body>
  </worldbody>
  <tendon><spatial name="t"><site site="c"/><site site="a"/><site site="b"/></spatial></tendon>
  <actuator><muscle name="m" tendon="t" lengthrange=".1 .5" force="10"/></actuator>
</mujoco>
"""
# Along the slide, site b leaves the geom that the string has to meet, and has to come back to it.
HELD = """
<mujoco>
  <worldbody>
    <geom name="ring" type="{kind}" size=".05 .2" contype="0" conaffinity="0"/>
    <site name="within" pos=".001 .002 0"/><site name="a" pos=".2 .02 .01"/>
    <body name="load"><joint name="x" type="slide" axis="1 0 0" range=".01 .13"/>
      <geom type="sphere" size=".02" mass="1" contype="0" conaffinity="0"/><site name="b" pos="0 .01 .01"/></body>
  </worldbody>
  <tendon><spatial name="t"><site site="a"/><geom geom="ring" sidesite="within"/><site site="b"/></spatial></tendon>
  <actuator><muscle name="m" tendon="t" lengthrange=".05 .5" force="10"/></actuator>
</mujoco>
"""


def compared(text: str, samples: int = 41) -> PoseComparison:
    return compare_poses(mujoco.MjModel.from_xml_string(text), samples=samples, bases=2)


def told(found: PoseComparison) -> tuple[str, str]:
    (summary,) = found.muscles.values()
    return verdict(summary, found.jumps)


@pytest.mark.parametrize("side", ["", 'sidesite="side"'])
def test_a_tie_of_equally_long_ways_round_a_sphere_is_nobodys_fault(side: str) -> None:
    rng = np.random.default_rng(23)
    ties = 0
    for _ in range(25):
        sizes = {
            "radius": rng.uniform(0.05, 0.15),
            "above": rng.uniform(0.7, 1.2),
            "turn": rng.uniform(-0.3, 0.3),
        }
        found = compared(TIE.format(side=side, **sizes), 21)
        (summary,) = found.muscles.values()
        assert (found.at_fault, summary.counts["UNEXPLAINED"]) == (0, 0)
        right, why = told(found)
        assert right in ("both", "mjwrap", "mjwrap in motion")
        if summary.ties:
            assert "passes through a sphere's centre: all ways round are equally long" in why
            assert summary.counts["OTHER_BRANCH"] == summary.ties
        ties += summary.ties
        for jump in found.jumps:
            assert jump.program == "MuJoCo" or jump.cause
    assert ties > 0 or not side  # without a side site both programs choose the same plane


def test_the_case_of_a_tie_is_the_other_way_round_and_check_passes() -> None:
    if not CASE.exists():
        pytest.skip("the small case 23_tie_verdict is not beside this repository")
    model = mujoco.MjModel.from_xml_path(str(CASE))
    found = compare_poses(model, samples=41, bases=8)
    (summary,) = found.muscles.values()
    assert summary.counts["UNEXPLAINED"] == 0
    assert summary.counts["OTHER_BRANCH"] == summary.ties == 4
    assert found.at_fault == 0
    assert told(found)[0] != "MuJoCo"
    checks = check_model(model, poses=3, samples=41)
    assert checks.failed == []
    (jumps,) = (check for check in checks.checks if check.name == "jumps")
    assert any("not counted" in remark and "equally long" in remark for remark in jumps.remarks)


def test_a_stop_that_passes_through_another_one_is_a_kink_of_both() -> None:
    found = compared(THROUGH, 40)
    right, why = told(found)
    assert (right, found.at_fault) == ("both", 0)
    assert {jump.program for jump in found.jumps} == {"MuJoCo", "mjwrap"}
    for jump in found.jumps:
        assert abs(jump.slope) == pytest.approx(2.0, abs=1e-6)
        assert jump.at == pytest.approx(0.05, abs=1e-9)
        assert jump.cause
    assert "MuJoCo and mjwrap jumps by up to 2e+03 mm where two of its stops coincide" in why
    assert check_model(mujoco.MjModel.from_xml_string(THROUGH), poses=3, samples=41).failed == []


def test_no_derivative_at_the_kink_itself_is_nobodys_fault() -> None:
    """A pose exactly at the kink, where MuJoCo gives a segment of no length a direction of its own."""
    found = compare_poses(
        mujoco.MjModel.from_xml_string(THROUGH), samples=41, bases=0
    )  # 41 samples: b is at a in the middle
    (summary,) = found.muscles.values()
    assert summary.counts["KINK"] + summary.counts["AGREE"] == summary.poses
    assert found.at_fault == 0


@pytest.mark.parametrize("kind", ["sphere", "cylinder"])
def test_an_end_that_leaves_the_geom_in_which_the_string_is_held_is_a_kink(kind: str) -> None:
    text = HELD.format(kind=kind)
    found = compared(text, 61)
    assert found.at_fault == 0
    assert {jump.program for jump in found.jumps} >= {"mjwrap"}
    assert all(jump.cause for jump in found.jumps)
    assert told(found)[0] == "both"
    assert check_model(mujoco.MjModel.from_xml_string(text), poses=3, samples=61).failed == []


def test_a_jump_of_one_program_alone_has_no_excuse(monkeypatch: pytest.MonkeyPatch) -> None:
    """The moment arm of mjwrap jumps beside the kink that both have."""
    sound = mw.MuscleSystem.length_jacobian

    def torn(self: mw.MuscleSystem, data: mujoco.MjData) -> np.ndarray:
        return sound(self, data) * (1.0 + 1e-3 * (data.qpos[0] > 0.1003))

    monkeypatch.setattr(mw.MuscleSystem, "length_jacobian", torn)
    found = compared(THROUGH)
    bad = [jump for jump in found.jumps if not jump.cause]
    assert {(jump.program, round(jump.at, 4)) for jump in bad} == {("mjwrap", 0.1003)}
    assert told(found)[0] == "MuJoCo"


# One load on three slides for each tendon, as in MuJoCo's own tests of wrapping; the line to load 0 hits every geom's
# centre or axis, and the end of its slide lies on the surface.
LOADS = """
<mujoco>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>{loads}</worldbody>
  <tendon>{tendons}</tendon>
  <actuator>{muscles}</actuator>
</mujoco>
"""
LOAD = """<site name="a{n}" pos="{x} 0 1"/><geom name="g{n}" {shape} pos="{x} 0 .5"/><site name="s{n}" pos="{s} 0 .5"/>
<body pos="{x} 0 .15"><joint name="x{n}" type="slide" axis="1 0 0" range="-.25 .25"/>
  <joint name="y{n}" type="slide" axis="0 1 0" range="-.25 .25"/>
  <joint name="z{n}" type="slide" axis="0 0 1" range="-.25 .25"/><geom size=".05"/><site name="b{n}"/></body>"""


@pytest.mark.parametrize("shape", ['size=".1"', 'type="cylinder" size=".05 .2" zaxis="0 1 .2"'])
def test_nobody_is_blamed_on_loads_hung_over_geoms(shape: str) -> None:
    sides = {0: "", 1: 'sidesite="s1"', 2: 'sidesite="s2"'}  # none, outside, inside
    places = {0: (0.0, 0.0), 1: (0.4, 0.52), 2: (-0.4, -0.44)}
    text = LOADS.format(
        loads="".join(LOAD.format(n=n, x=x, s=s, shape=shape) for n, (x, s) in places.items()),
        tendons="".join(
            f'<spatial name="t{n}"><site site="a{n}"/><geom geom="g{n}" {side}/><site site="b{n}"/></spatial>'
            for n, side in sides.items()
        ),
        muscles="".join(f'<muscle name="m{n}" tendon="t{n}" lengthrange=".1 2" force="9"/>' for n in sides),
    )
    model = mujoco.MjModel.from_xml_string(text)
    found = compare_poses(model, samples=41, bases=2)
    assert found.at_fault == 0
    for name, summary in found.muscles.items():
        jumps = [jump for jump in found.jumps if jump.muscle == name]
        assert verdict(summary, jumps).right != "MuJoCo"
        assert all(jump.cause for jump in jumps if jump.program == "mjwrap")
    assert check_model(model, poses=5, samples=41).failed == []
