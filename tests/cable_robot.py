"""A platform on cables with an arm below: actuators of every kind on spatial tendons, whose wraps MuJoCo has exactly.

A winch with a servo and a brake on one tendon over a fixed drum, a tackle with pulleys, a muscle over a moving ball, a
leash whose tendon limits forces; a free, a ball and a hinge joint; sensors of tendons and actuators.
"""

import mujoco
import numpy as np

CABLES = """<mujoco><option timestep="0.002"/>
  <worldbody>
    <site name="left" pos="-1 0 1.2"/> <site name="right" pos="1 0 1.2"/> <site name="front" pos="0 1 1.3"/>
    <site name="back" pos="0 -1 1.3"/> <site name="over" pos="-0.6 0 1.3"/>
    <geom name="drum" type="cylinder" size="0.1 0.2" pos="-0.6 0 1" zaxis="0 1 0" contype="0" conaffinity="0"/>
    <body name="platform" pos="0 0 0.4"><freejoint/>
      <geom type="box" size="0.15 0.15 0.03" mass="2" contype="0" conaffinity="0"/>
      <site name="p_left" pos="-0.15 0 0.02"/> <site name="p_right" pos="0.15 0 0.02"/>
      <site name="p_front" pos="0 0.15 0.02"/> <site name="p_back" pos="0 -0.15 0.02"/>
      <geom name="ball" type="sphere" size="0.05" pos="0.1 0 -0.05" contype="0" conaffinity="0"/>
      <site name="outside" pos="0.2 0 -0.1"/>
      <body name="arm" pos="0 0 -0.05"><joint type="ball" damping="0.05"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.5" contype="0" conaffinity="0"/>
        <site name="a" pos="0.02 0 -0.2"/>
        <body name="hand" pos="0 0 -0.3"><joint axis="0 1 0" damping="0.02"/>
          <geom type="capsule" fromto="0 0 0 0.1 0 -0.1" size="0.02" mass="0.2" contype="0" conaffinity="0"/>
          <site name="h" pos="0.1 0 -0.05"/>
        </body>
      </body>
    </body>
  </worldbody>
  <tendon>
    <spatial name="winch"><site site="left"/><geom geom="drum" sidesite="over"/><site site="p_left"/></spatial>
    <spatial name="tackle"><site site="right"/><site site="p_right"/>
      <pulley divisor="2"/><site site="front"/><site site="p_front"/>
      <pulley divisor="2"/><site site="back"/><site site="p_back"/></spatial>
    <spatial name="flexor"><site site="p_right"/><geom geom="ball" sidesite="outside"/><site site="h"/></spatial>
    <spatial name="leash" actuatorfrcrange="-0.4 0.4"><site site="front"/><site site="a"/></spatial>
  </tendon>
  <actuator>
    <position name="winch" tendon="winch" kp="200" kv="20" gear="2" ctrlrange="0.5 4"/>
    <damper name="brake" tendon="winch" kv="5" ctrlrange="0 1"/>
    <general name="tackle" tendon="tackle" dyntype="filter" dynprm="0.05" gainprm="-30" actearly="true"/>
    <muscle name="flexor" tendon="flexor" force="30" lengthrange="0.2 0.6" gear="1.5"/>
    <motor name="leash" tendon="leash" gear="-2" ctrlrange="0 1"/>
  </actuator>
  <sensor>
    <actuatorpos actuator="winch" cutoff="1.5"/><tendonpos tendon="winch" cutoff="2"/><tendonvel tendon="winch"/>
    <tendonactuatorfrc tendon="winch"/><actuatorfrc actuator="flexor"/><actuatorvel actuator="flexor"/>
    <actuatorpos actuator="leash"/><tendonpos tendon="flexor"/>
  </sensor></mujoco>"""


def drive(data: mujoco.MjData) -> None:
    """Move all controls."""
    wave = np.sin(np.array([5.0, 0.0, 7.0, 20.0, 9.0]) * data.time + 0.3)
    data.ctrl[:] = np.array([2.0, 0.5, 1.0, 0.5, 0.0]) + np.array([0.3, 0.0, 1.0, 0.5, 0.5]) * wave
