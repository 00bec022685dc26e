"""A model with every kind of joint, coupled joints and muscles, and motions of models, for tests of inverse use."""

from __future__ import annotations

import mujoco
import numpy as np

import mjwrap as mw
from mjwrap.mjcf.couplings import CoupledJoints

Array = np.ndarray

# A free trunk, a ball hip, a knee whose shank slides with its angle, an ankle that follows the knee, and muscles with
# and without wrapping that cross all of them.
EVERY_JOINT = """
<mujoco>
  <option gravity="0 0 -9.81"/><compiler angle="radian"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <site name="anchor" pos=".3 .2 1.2"/>
    <body name="trunk" pos="0 0 1"><freejoint name="root"/>
      <geom type="box" size=".1 .15 .2" mass="20"/><site name="trunk_front" pos=".1 .05 -.1"/>
      <body name="thigh" pos="0 .1 -.25"><joint name="hip" type="ball" stiffness="7" damping=".4"/>
        <geom type="capsule" size=".05" fromto="0 0 0 0 0 -.4" mass="7"/>
        <site name="thigh_front" pos=".06 0 -.2"/>
        <body name="shank" pos="0 0 -.4">
          <joint name="knee" axis="0 1 0" armature=".02" damping=".3"/>
          <joint name="glide" type="slide" axis="0 0 1" stiffness="50"/>
          <geom type="capsule" size=".04" fromto="0 0 0 0 0 -.4" mass="3"/>
          <geom name="roll" type="cylinder" size=".045 .1" euler="1.5708 0 0"/>
          <site name="shank_front" pos=".05 0 -.08"/><site name="shank_back" pos="-.05 0 -.3"/>
          <site name="front" pos=".1 0 0"/>
          <body name="foot" pos="0 0 -.4"><joint name="ankle" axis="0 1 0" stiffness="3" springref=".1"/>
            <geom type="capsule" size=".03" fromto="-.05 0 0 .2 0 0" mass="1"/>
            <site name="heel" pos="-.06 0 -.01"/><site name="toe" pos=".18 .01 0"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <equality>
    <joint joint1="glide" joint2="knee" polycoef=".01 .03 -.02 .01 0"/>
    <joint joint1="ankle" joint2="knee" polycoef=".1 -.5 .2 0 .1"/>
  </equality>
  <tendon>
    <spatial name="rectus">
      <site site="trunk_front"/><geom geom="roll" sidesite="front"/><site site="shank_front"/>
    </spatial>
    <spatial name="gastrocnemius"><site site="thigh_front"/><site site="shank_back"/><site site="heel"/></spatial>
    <spatial name="string"><site site="anchor"/><site site="toe"/></spatial>
  </tendon>
  <actuator>
    <muscle name="rectus" tendon="rectus" force="900" lengthrange=".3 .7"/>
    <muscle name="gastrocnemius" tendon="gastrocnemius" force="700" lengthrange=".3 .7"/>
    <muscle name="string" tendon="string" force="300" lengthrange=".5 1.8"/>
  </actuator>
</mujoco>
"""


def every_joint() -> mujoco.MjModel:
    """Return the model above."""
    return mujoco.MjModel.from_xml_string(EVERY_JOINT)


def swaying(
    model: mujoco.MjModel, frames: int, seed: int, size: float = 0.3, duration: float = 1.0
) -> mw.Motion:
    """Return a smooth motion about qpos0, positions only: sines for all hinges and slides, quaternions that turn."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0.0, duration, frames)
    qpos = np.tile(model.qpos0, (frames, 1))
    for at in range(model.nq):
        wave = np.sin(2 * np.pi * rng.uniform(0.5, 1.2) * time / duration + rng.uniform(0, 6.3))
        qpos[:, at] += size * wave
    for row in qpos:
        mujoco.mj_normalizeQuat(model, row)
        CoupledJoints(model).place(row)
    return mw.Motion(time, qpos)


def moved(model: mujoco.MjModel, qpos: Array, dof: int, step: float) -> Array:
    """Return a pose (nq,) after a step along an independent degree of freedom, with its followers in place."""
    direction, found = np.zeros(model.nv), qpos.copy()
    direction[dof] = 1.0
    mujoco.mj_integratePos(model, found, direction, step)
    CoupledJoints(model).place(found)
    return found
