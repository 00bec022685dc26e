"""Whether an end lies inside its surface is judged at poses that a motion can reach: couplings followed, keyframes."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import mjwrap as mw

CASES = 60
RADIUS = 0.02
# A via point on a slide that follows the knee: at qpos0, 0 m, it lies inside the cylinder; the coupling moves it out.
MODEL = """
<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <body name="shank">
      <joint name="knee" axis="0 0 1" range="0 1.5" limited="true"/>
      <geom size=".01" pos="0 -.3 0" mass="1" contype="0" conaffinity="0"/>
      <geom name="wrap" type="cylinder" size="{radius} .05" contype="0" conaffinity="0"/>
      <site name="insertion" pos="{x} -.25 0"/>
    </body>
    <body name="carriage">
      <joint name="slide" type="slide" axis="1 0 0" {limits}/>
      <geom size=".001" mass=".01" contype="0" conaffinity="0"/>
      <site name="via"/>
    </body>
    <site name="side" pos=".1 0 0"/>
  </worldbody>
  <tendon>
    <spatial name="m"><site site="via"/><geom geom="wrap" sidesite="side"/><site site="insertion"/></spatial>
  </tendon>
  <equality><joint joint1="slide" joint2="knee" polycoef="{c0} {c1} {c2} 0 0" active="{active}"/></equality>
  <actuator><muscle name="m" tendon="m" lengthrange=".1 .5"/></actuator>
  <keyframe>{keys}</keyframe>
</mujoco>
"""


def scene(c: tuple[float, float, float], *, active: bool = True, limits: str = 'range="-.2 .2" limited="true"',
          keys: str = "") -> str:  # fmt: skip
    return MODEL.format(
        radius=RADIUS, x=0.03, c0=c[0], c1=c[1], c2=c[2], active=str(active).lower(), limits=limits, keys=keys
    )


def share_inside(c: tuple[float, float, float]) -> float:
    """Share of the knee's range at which the coupling leaves the point inside."""
    q = np.linspace(0.0, 1.5, 2001)
    return float(np.mean(np.abs(c[0] + c[1] * q + c[2] * q * q) < RADIUS))


def test_couplings_decide_and_not_the_pose_that_they_exclude() -> None:
    rng, outside, inside = np.random.default_rng(20), 0, 0
    while outside + inside < CASES:
        c = tuple(rng.uniform(-1.0, 1.0, 3) * rng.choice([0.01, 0.08]))
        share, at_rest = share_inside(c), abs(c[0]) < RADIUS
        if 0.0 < share < 1.0:
            continue  # how much of a range may be inside is another rule
        native = mw.MuscleSystem(mujoco.MjModel.from_xml_string(scene(c))).native
        assert bool(native) == (share == 1.0), (c, native)
        assert at_rest == (share == 1.0)
        outside, inside = outside + (share == 0.0), inside + (share == 1.0)
    assert min(outside, inside) >= 5


@pytest.mark.parametrize("limits", ["", 'range="-.2 .2" limited="true"'])
def test_an_inactive_coupling_decides_nothing(limits: str) -> None:
    c = (0.05, 0.005, 0.0)
    assert not mw.MuscleSystem(mujoco.MjModel.from_xml_string(scene(c, limits=limits))).native
    off = mw.MuscleSystem(mujoco.MjModel.from_xml_string(scene(c, active=False, limits=limits)))
    assert "inside it at the reference pose" in off.native["m"]


def test_a_keyframe_outside_shows_that_a_motion_may_begin_there() -> None:
    c = (0.05, 0.0, 0.0)
    outside, within = '<key name="a" qpos="0 .06"/>', '<key name="b" qpos="0 .01"/>'
    for keys, native in ((outside, False), (within, True), (outside + within, False)):
        model = mujoco.MjModel.from_xml_string(
            scene(c, active=False, keys=keys, limits='range=".05 .2" limited="true"')
        )
        assert bool(mw.MuscleSystem(model).native) == native, keys
