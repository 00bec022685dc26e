"""A range of a joint that only degrees explain is refused wherever it is given, with what to write instead."""

from __future__ import annotations

import re

import mujoco
import numpy as np
import pytest
from cli_runs import ELBOW, run_here

import mjwrap as mw

WHEEL = """
<mujoco>
  <worldbody>
    <site name="a" pos="0 0 .2"/>
    <body><joint name="axle" axis="0 1 0"/><joint name="rail" type="slide" range="0 1"/>
      <geom size=".05"/><site name="b" pos=".03 0 0"/></body>
  </worldbody>
  <tendon><spatial name="t"><site site="a"/><site site="b"/></spatial></tendon>
  <actuator><muscle name="m" tendon="t" lengthrange=".1 .3" force="10"/></actuator>
</mujoco>
"""


def test_degrees_as_a_range_in_python_are_refused() -> None:
    model = mujoco.MjModel.from_xml_path(ELBOW)
    told = r"range of joint 'elbow_flexion': 0 to 90 rad are 14.3 turns.*if degrees.*write np\.radians\(\(0, 90\)\)"
    with pytest.raises(mw.ModelError, match=told):
        mw.curves(model, "elbow_flexion", span=(0, 90))
    with pytest.raises(mw.ModelError, match=told):
        mw.length_ranges(mw.MuscleSystem(model), ranges={"elbow_flexion": (0.0, 90.0)})
    right = mw.curves(model, "elbow_flexion", span=tuple(np.radians((0, 90))), samples=3)
    assert right.at[-1] == pytest.approx(np.pi / 2)


def test_ranges_of_wheels_and_slides_are_free() -> None:
    model = mujoco.MjModel.from_xml_string(WHEEL)
    assert mw.curves(model, "axle", span=(-6.0, 6.0), samples=3).at[-1] == 6.0
    assert mw.curves(model, "rail", span=(-6.0, 6.0), samples=3).at[-1] == 6.0
    with pytest.raises(mw.ModelError, match=r"28\.6 turns; if degrees"):
        mw.curves(model, "axle", span=(-90.0, 90.0))


@pytest.mark.parametrize(
    "words",
    [
        ("plot", "--joint", "elbow_flexion", "-o", "{out}", "--range", "0,90"),
        ("inspect", "--range", "elbow_flexion=0,90"),
    ],
)
def test_what_the_error_says_to_write_is_accepted(
    words: tuple[str, ...], tmp_path: object, capsys: pytest.CaptureFixture[str]
) -> None:
    name, *rest = (word.format(out=f"{tmp_path}/curves.png") for word in words)
    ran = run_here(name, capsys, ELBOW, *rest)
    assert ran.code == 2
    found = re.search(r"if degrees are meant, write (\S+)$", ran.err.strip())
    assert found, ran.err
    assert run_here(name, capsys, ELBOW, *rest[:-1], found[1]).code == 0


@pytest.mark.parametrize(
    "given", ["elbow_flexion=sine:90,1", "elbow_flexion=constant:90", "elbow_flexion=90"]
)
def test_the_angle_of_a_pattern_is_quoted_as_it_was_written(
    given: str, capsys: pytest.CaptureFixture[str]
) -> None:
    ran = run_here("run", capsys, ELBOW, "--prescribe", given)
    assert ran.code == 2
    assert f"'{given}': 90 rad are 14.3 turns" in ran.err
    assert "write 90deg" in ran.err
