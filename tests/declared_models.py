"""A small arm with every kind of wrapping surface, to which tests add tendons, actuators and tuples."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco
import numpy as np
from mjcf_reading import Vector

ARM = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.002" {option}/>
  <worldbody>
    <site name="origin" pos="-0.01 0 0.2"/>
    <site name="elbow_side" pos="-0.05 0 0"/>
    <site name="elbow_inside" pos="0.005 0 0"/>
    <geom name="elbow" type="cylinder" size="0.025 0.04" zaxis="0 1 0" contype="0" conaffinity="0"/>
    <geom name="crate" type="box" size="0.01 0.01 0.01" pos="0 0 0.5" contype="0" conaffinity="0"/>
    <geom name="egg" type="ellipsoid" size="0.01 0.02 0.01" pos="0 0 0.6" contype="0" conaffinity="0"/>
    <body name="forearm">
      <joint name="elbow" axis="0 1 0" damping="0.5"/>
      <geom name="ulna" type="capsule" fromto="0.05 0 0 0.25 0 0" size="0.015" mass="1.2" contype="0" conaffinity="0"/>
      <site name="via" pos="0.04 0.005 -0.03"/>
      <site name="middle" pos="0.1 0 -0.025"/>
      <site name="ball_side" pos="0.17 0 -0.06"/>
      <geom name="ball" type="sphere" size="0.015" pos="0.17 0.002 -0.012" contype="0" conaffinity="0"/>
      <body name="hand" pos="0.25 0 0">
        <joint name="wrist" axis="0 0.8 0.6" damping="0.2"/>
        <geom name="palm" type="capsule" fromto="0 0 0 0.08 0 0" size="0.02" mass="0.4" contype="0" conaffinity="0"/>
        <geom name="wrist" type="cylinder" size="0.012 0.04" zaxis="0 1 0" contype="0" conaffinity="0"/>
        <site name="wrist_side" pos="0 0 -0.04"/>
        <site name="insertion" pos="0.05 0.003 -0.008"/>
      </body>
    </body>
  </worldbody>
  <tendon>{tendon}</tendon>
  <actuator>{actuator}</actuator>
  <custom>{custom}</custom>
</mujoco>
"""
EXTENSOR = """<spatial name="extensor">
  <site site="origin"/> <geom geom="elbow" sidesite="elbow_side"/> <site site="via"/> <site site="middle"/>
  <geom geom="ball" sidesite="ball_side"/> <site site="insertion"/></spatial>"""
PULLEYS = """<spatial name="extensor">
  <site site="origin"/> <geom geom="elbow" sidesite="elbow_side"/> <site site="via"/>
  <pulley divisor="2"/> <site site="via"/> <site site="middle"/> <geom geom="ball" sidesite="ball_side"/>
  <site site="insertion"/>
  <pulley divisor="3"/> <site site="via"/> <site site="insertion"/></spatial>"""
HOLDER = '<general name="extensor" tendon="extensor" dyntype="user" actdim="2" ctrlrange="0 1" ctrllimited="true"/>'
MUSCLE = '<muscle name="extensor" tendon="extensor" force="400" lengthrange="0.3 0.6"/>'
HILL = {"max_isometric_force": 600.0, "optimal_fiber_length": 0.12, "tendon_slack_length": 0.3}


def compiled(
    *, tendon: str = EXTENSOR, actuator: str = MUSCLE, custom: str = "", option: str = ""
) -> mujoco.MjModel:
    """Return the arm with these tendons, actuators, and contents of <custom>."""
    xml = ARM.format(tendon=tendon, actuator=actuator, custom=custom, option=option)
    return mujoco.MjModel.from_xml_string(xml)


def element(kind: str, name: str, prm: float | None = None) -> str:
    given = "" if prm is None else f' prm="{prm:g}"'
    return f'<element objtype="{kind}" objname="{name}"{given}/>'


ROW = [
    element("site", "origin"),
    element("geom", "elbow"),
    element("site", "elbow_side", 1),
    element("geom", "ball"),
    element("geom", "wrist"),
    element("site", "wrist_side", 1),
    element("site", "insertion"),
]


def numerics(
    values: dict[str, float | tuple[float, ...]] | dict[str, float], muscle: str = "m"
) -> tuple[str, str]:
    """Return the <numeric> definitions of parameters, and the elements that name them."""
    made, named = "", ""
    for key, value in values.items():
        data = " ".join(repr(float(x)) for x in np.atleast_1d(value))
        made += f'<numeric name="mjwrap_{muscle}_{key}" data="{data}"/>'
        named += element("numeric", f"mjwrap_{muscle}_{key}")
    return made, named


def declared(
    elements: Iterable[str] | str,
    values: dict[str, float | tuple[float, ...]] | dict[str, float] | None = None,
    law: str | None = None,
    muscle: str = "m",
    texts: dict[str, str] | None = None,
) -> str:
    """Return the contents of <custom> for one muscle."""
    made, named = numerics(values or {}, muscle)
    for key, words in {**({} if law is None else {"law": law}), **(texts or {})}.items():
        made += f'<text name="mjwrap_{muscle}_{key}" data="{words}"/>'
        named += element("text", f"mjwrap_{muscle}_{key}")
    return f'{made}<tuple name="mjwrap_{muscle}">{"".join(elements)}{named}</tuple>'


def tendon_jacobian(model: mujoco.MjModel, data: mujoco.MjData) -> Vector:
    """Return ten_J (ntendon, nv), dense; its row layout moved from data to model."""
    home = model if hasattr(model, "ten_J_rownnz") else data
    dense = np.zeros((model.ntendon, model.nv))
    columns = np.ravel(home.ten_J_colind)
    mujoco.mju_sparse2dense(dense, np.ravel(data.ten_J), home.ten_J_rownnz, home.ten_J_rowadr, columns)
    return dense
