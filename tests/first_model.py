"""A first model of an arm, as a beginner writes it, in which each mistake is one small edit."""

from __future__ import annotations

import mujoco

ARM = """
<mujoco model="arm">
  <compiler angle="degree"/>
  <default><geom contype="0" conaffinity="0"/><joint damping=".3"/></default>
  <worldbody>
    <geom name="table" type="box" size=".5 .5 .01" pos="0 0 .4"/>
    <body name="upper_arm" pos="0 0 1">
      <geom name="humerus" type="capsule" fromto="0 0 -.02 0 0 -.28" size=".015"/>
      <geom name="elbow_wrap" type="cylinder" size=".022 .04" pos="0 0 -.3" zaxis="0 1 0"/>
      <geom name="sling" type="sphere" size=".001" pos=".029 0 -.2"/>
      <site name="origin" pos=".03 0 -.05"/>
      <site name="via" pos=".032 0 -.12"/>
      <site name="elbow_side" pos=".05 0 -.3"/>
      <site name="triceps_origin" pos="-.03 0 -.05"/>
      <site name="back" pos="-.05 0 -.3"/>
      <body name="forearm" pos="0 0 -.3">
        <joint name="elbow" axis="0 -1 0" range="0 130"/>
        <geom name="ulna" type="capsule" fromto="0 0 -.03 0 0 -.25" size=".015"/>
        <site name="insertion" pos=".022 0 -.08"/>
        <site name="triceps_insertion" pos="-.025 0 -.06"/>
      </body>
    </body>
    <body name="wheel" pos="1 0 0"><joint name="axle" axis="0 1 0"/><geom size=".1"/></body>
  </worldbody>
  <actuator/>
  <custom>
    <numeric name="BIC_max_isometric_force" data="600"/>
    <numeric name="BIC_optimal_fiber_length" data=".11"/>
    <numeric name="BIC_tendon_slack_length" data=".2"/>
    <numeric name="sling_torus_size" data=".012 .004"/>
    <numeric name="TRI_optimal_force" data="100"/>
    <tuple name="mjwrap_BIC">
      <element objtype="site" objname="origin"/>
      <element objtype="site" objname="via"/>
      <element objtype="geom" objname="sling"/>
      <element objtype="numeric" objname="sling_torus_size"/>
      <element objtype="geom" objname="elbow_wrap"/>
      <element objtype="site" objname="elbow_side" prm="1"/>
      <element objtype="site" objname="insertion"/>
      <element objtype="numeric" objname="BIC_max_isometric_force"/>
      <element objtype="numeric" objname="BIC_optimal_fiber_length"/>
      <element objtype="numeric" objname="BIC_tendon_slack_length"/>
    </tuple>
    <tuple name="mjwrap_TRI">
      <element objtype="site" objname="triceps_origin"/>
      <element objtype="geom" objname="elbow_wrap"/>
      <element objtype="site" objname="back" prm="1"/>
      <element objtype="site" objname="triceps_insertion"/>
      <element objtype="numeric" objname="TRI_optimal_force"/>
    </tuple>
  </custom>
</mujoco>
"""
Edit = tuple[str, str]  # a text that the model contains, and what the mistake makes of it


def edited(*edits: Edit) -> str:
    """Return the model with each text replaced, everywhere."""
    text = ARM
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new)
    return text


def listed(kind: str, name: str, more: str = "") -> str:
    """Return an element of a tuple as the model writes it."""
    return f'<element objtype="{kind}" objname="{name}"{more}/>'


def compiled(*edits: Edit) -> mujoco.MjModel:
    """Return the edited model."""
    return mujoco.MjModel.from_xml_string(edited(*edits))
