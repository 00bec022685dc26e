"""Random tendon models, each in metres and in millimetres: lengths times 1000, with all that has lengths in it."""

from __future__ import annotations

import numpy as np

MILLIMETRES = 1000.0


def scaled_twins(seed: int) -> tuple[str, str]:
    """Return the same random model in metres and in millimetres; masses [kg], times [s] and angles stay."""
    return scaled_model(seed, 1.0), scaled_model(seed, MILLIMETRES)


def scaled_model(seed: int, unit: float) -> str:
    """Return a random model of two or three joints with two tendons; unit: its unit of length, per metre."""
    rng = np.random.default_rng(seed)

    def numbers(*values: float, power: int = 1) -> str:
        return " ".join(repr(float(x) * unit**power) for x in values)

    def point(reach: float) -> str:
        return numbers(*rng.uniform(-reach, reach, 3))

    def geom(name: str, at: tuple[float, ...]) -> str:
        kind, turn = rng.choice(["sphere", "cylinder"]), rng.uniform(-180.0, 180.0, 3)
        size = numbers(rng.uniform(0.015, 0.03), 0.05)
        euler = " ".join(f"{x:.6f}" for x in turn)
        return (
            f'<geom name="{name}" type="{kind}" size="{size}" pos="{numbers(*at)}" euler="{euler}" contype="0" '
            'conaffinity="0" mass="0"/>'
        )

    def joint(name: str, kind: str) -> str:
        axis = " ".join(f"{x:.6f}" for x in rng.normal(size=3))
        if kind == "hinge":
            low, high = sorted(rng.uniform(-100.0, 100.0, 2))
            damping = numbers(0.1, power=2)
            return f'<joint name="{name}" axis="{axis}" range="{low:.4f} {high + 10.0:.4f}" damping="{damping}"/>'
        reach = numbers(-0.04, 0.05)
        return f'<joint name="{name}" type="slide" axis="{axis}" range="{reach}" damping="1"/>'

    def ball(mass: float, *at: float) -> str:
        shape = f'size="{numbers(0.02)}" pos="{numbers(*at)}"'
        return f'<geom type="sphere" {shape} mass="{mass}" contype="0" conaffinity="0"/>'

    kinds = ["hinge", rng.choice(["hinge", "slide"])]
    sides = [rng.choice(["", 'sidesite="side"', 'sidesite="within"']) for _ in range(2)]
    return f"""
<mujoco>
  <compiler angle="degree" autolimits="true"/>
  <option gravity="0 0 {-9.81 * unit!r}" timestep="0.001"/>
  <worldbody>
    {geom("first", (0.0, 0.0, 0.0))}
    <site name="o1" pos="{numbers(-0.08, rng.uniform(-0.03, 0.03), rng.uniform(0.0, 0.06))}"/>
    <site name="o2" pos="{numbers(*rng.uniform(0.04, 0.09, 3))}"/>
    <site name="side" pos="{point(0.06)}"/><site name="within" pos="{point(0.003)}"/>
    <body name="upper">{joint("j0", kinds[0])}
      {ball(0.8, 0.1, 0.0, 0.0)}
      {geom("second", (0.1, 0.0, 0.0))}
      <site name="via" pos="{numbers(0.06, rng.uniform(-0.03, 0.03), -0.05)}"/>
      <body name="lower" pos="{numbers(0.1, 0.0, 0.0)}">{joint("j1", kinds[1])}
        {ball(0.5, 0.0, 0.0, -0.1)}
        <site name="i1" pos="{numbers(rng.uniform(0.03, 0.08), rng.uniform(-0.03, 0.03), -0.03)}"/>
        <site name="i2" pos="{numbers(rng.uniform(-0.06, 0.06), 0.05, -0.06)}"/>
      </body>
    </body>
  </worldbody>
  <tendon>
    <spatial name="t1"><site site="o1"/><geom geom="first" {sides[0]}/><site site="via"/>
      <geom geom="second"/><site site="i1"/></spatial>
    <spatial name="t2"><site site="o2"/><geom geom="first" {sides[1]}/><site site="i2"/></spatial>
  </tendon>
  <actuator>
    <muscle name="m1" tendon="t1" lengthrange="{numbers(0.05, 0.5)}" force="{numbers(50.0)}"/>
    <muscle name="m2" tendon="t2" lengthrange="{numbers(0.05, 0.5)}" force="{numbers(20.0)}"/>
  </actuator>
</mujoco>"""
