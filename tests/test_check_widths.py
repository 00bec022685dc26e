"""`check` finds exact derivatives exact and wrong ones wrong, however short a path's pieces are."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from mjwrap import MuscleSystem
from mjwrap.checking import check_model

# The middle point passes the first one at a distance of `gap`: the length is hypot(z, gap) + the rest.
MODEL = """
<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <site name="first" pos="{gap} 0 0"/>
    <body>
      <joint name="j" type="{kind}" axis="{axis}" range="-{most} {most}" limited="true"/>
      <geom size=".01" mass="1" contype="0" conaffinity="0"/>
      <site name="second" pos="0 {arm} 0"/><site name="last" pos="-.1 {arm} 0"/>
    </body>
  </worldbody>
  <tendon><spatial name="t"><site site="first"/><site site="second"/><site site="last"/></spatial></tendon>
  <actuator><muscle name="t" tendon="t" lengthrange=".05 .2"/></actuator>
</mujoco>
"""


@pytest.mark.parametrize("gap", [1e-2, 1e-3, 2e-4, 5e-5])
@pytest.mark.parametrize("kind", ["slide", "hinge"])
def test_exact_slopes_beside_short_segments_pass(gap: float, kind: str) -> None:
    arm = 0.0 if kind == "slide" else 0.05
    axis = "0 0 1" if kind == "slide" else "1 0 0"
    most = 2.0 * gap if kind == "slide" else 2.0 * gap / 0.05
    text = MODEL.format(gap=gap, kind=kind, axis=axis, arm=arm, most=most)
    if kind == "hinge":
        text = text.replace(f'name="first" pos="{gap} 0 0"', f'name="first" pos="{gap} {arm} 0"')
    model = mujoco.MjModel.from_xml_string(text)
    failed = [(check.name, check.worst) for check in check_model(model).checks if check.verdict == "FAIL"]
    assert failed == []


def test_a_wrong_slope_beside_a_short_segment_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    right = MuscleSystem.length_jacobian

    def wrong(self: MuscleSystem, data: mujoco.MjData) -> np.ndarray:
        return right(self, data) * (1.0 + 1e-6)

    monkeypatch.setattr(MuscleSystem, "length_jacobian", wrong)
    text = MODEL.format(gap=2e-4, kind="slide", axis="0 0 1", arm=0.0, most=4e-4)
    checks = check_model(mujoco.MjModel.from_xml_string(text)).checks
    assert "moment_arm" in {check.name for check in checks if check.verdict == "FAIL"}
