"""Models with moving path points, for tests: a leg whose sites follow random splines of its joints, as in gait10."""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PPoly

Array = NDArray[np.float64]
JOINTS = ("hip", "knee", "sink")  # two hinges and a slide
LEG = """
<mujoco model="leg">
  <compiler autolimits="true" angle="radian"/>
  <option timestep="0.002" gravity="0 0 -9.81" integrator="{integrator}"/>
  <worldbody>
    <site name="pelvis" pos="0.06 0.02 0.45"/>
    <site name="back" pos="-0.05 0.01 0.4"/>
    <body name="thigh" pos="0 0 0.3">
      <joint name="hip" axis="0 1 0" damping="0.4" stiffness="3"/>
      <geom size=".05" mass="3" pos="0.02 0 -.1" contype="0" conaffinity="0"/>
      <geom name="condyle" type="cylinder" size=".03 .05" zaxis="0 1 0.1" pos="0.01 0 -.2" contype="0" conaffinity="0"
        mass="0"/>
      <geom name="egg" type="ellipsoid" size=".03 .035 .025" pos="0.01 0 -.02" contype="0" conaffinity="0" mass="0"/>
      <site name="front" pos="0.08 0 -.18"/>
      <body name="shank" pos="0 0 -.25">
        <joint name="knee" axis="0 1 0" damping="0.2" ref="0.1"/>
        <joint name="sink" type="slide" axis="0 0 1" damping="3" stiffness="400"/>
        <geom size=".04" mass="2" pos="0.02 0 -.2" contype="0" conaffinity="0"/>
        <site name="patella" pos="0.055 0.01 -.05"/>
        <site name="pes" pos="0.045 0.02 -.1"/>
        <site name="shin" pos="0.025 0.01 -.2"/>
      </body>
    </body>
  </worldbody>
  {more}
  <custom>
    <numeric name="force" data="60"/>
{custom}
  </custom>
</mujoco>
"""
BODY_PLACES = {
    "pelvis": (0.06, 0.02, 0.45), "back": (-0.05, 0.01, 0.4), "front": (0.08, 0.0, -0.18),
    "patella": (0.055, 0.01, -0.05), "pes": (0.045, 0.02, -0.1), "shin": (0.025, 0.01, -0.2),
}  # fmt: skip
REFERENCE = {"hip": 0.0, "knee": 0.1, "sink": 0.0}


@dataclass
class Leg:
    """A leg: `moving` has, by site and axis, the joint and the spline of its place; `custom` the declarations."""

    moving: dict[tuple[str, int], tuple[str, PPoly]] = field(default_factory=dict)
    custom: list[str] = field(default_factory=list)
    more: str = ""

    def move(self, site: str, axis: int, joint: str, rng: np.random.Generator, size: float = 0.01) -> None:
        """Let a site follow a joint along an axis by a random spline that is linear outside its knots."""
        spread = 0.03 if joint == "sink" else 1.0
        knots = REFERENCE[joint] + spread * (np.linspace(-1.2, 1.2, 6) + rng.uniform(-0.15, 0.15, 6))
        spline = CubicSpline(knots, rng.normal(scale=size, size=6))
        ends = np.array([knots[0], knots[-1]])
        value, slope = spline(ends), spline(ends, 1)
        first = [0.0, 0.0, slope[0], value[0] - slope[0] * 10.0]
        rows = np.column_stack([first, spline.c, [0.0, 0.0, slope[1], value[1]]])
        rows[-1] += BODY_PLACES[site][axis] - spline(REFERENCE[joint])
        self.moving[site, axis] = joint, PPoly(rows, np.array([knots[0] - 10.0, *knots, knots[-1] + 10.0]))

    def bend(self, site: str, axis: int, joint: str, *coefficients: float) -> None:
        """Let a site follow a joint along an axis by one polynomial around the reference pose, from the linear term."""
        rows = np.array([*coefficients[::-1], BODY_PLACES[site][axis]])[:, None]
        self.moving[site, axis] = joint, PPoly(rows, REFERENCE[joint] + np.array([0.0, 10.0]))

    def declare(self, name: str, *stops: str) -> None:
        """Declare a string that pulls with a constant times its activation along stops: sites, geoms, "geom:hint"."""
        kinds = {**dict.fromkeys(BODY_PLACES, "site"), "condyle": "geom", "egg": "geom"}
        rows: list[str] = []
        for stop in stops:
            place, _, hint = stop.partition(":")
            place, _, ranges = place.partition("?")
            rows.append(f'<element objtype="{kinds[place]}" objname="{place}"/>')
            rows += [f'<element objtype="site" objname="{hint}" prm="1"/>'] * bool(hint)
            for each in filter(None, ranges.split("?")):
                joint, low, high = each.split()
                key = f"{name}_{place}_{joint}_active_range"
                if not any(f'name="{key}"' in line for line in self.custom):
                    self.custom.append(f'<numeric name="{key}" data="{low} {high}"/>')
                rows.append(f'<element objtype="joint" objname="{joint}"/>')
                rows.append(f'<element objtype="numeric" objname="{key}"/>')
        self.custom.append(f'<numeric name="{name}_optimal_force" data="{40 + 7 * len(stops)}"/>')
        rows.append(f'<element objtype="numeric" objname="{name}_optimal_force"/>')
        self.custom.append(f'<tuple name="mjwrap_{name}">{"".join(rows)}</tuple>')

    def xml(self, integrator: str = "implicitfast") -> str:
        """Return the model's text."""
        lines = list(self.custom)
        for site in dict.fromkeys(site for site, _ in self.moving):
            rows = [f'<element objtype="site" objname="{site}"/>']
            for (moved, axis), (joint, spline) in self.moving.items():
                if moved == site:
                    lines.append(f'<numeric name="{site}_{axis}" data="{numbers(spline)}"/>')
                    rows.append(f'<element objtype="joint" objname="{joint}" prm="{axis}"/>')
                    rows.append(f'<element objtype="numeric" objname="{site}_{axis}"/>')
            lines.append(f'<tuple name="mjwrap_moving_{site}">{"".join(rows)}</tuple>')
        return LEG.format(integrator=integrator, more=self.more, custom="\n".join(lines))

    def model(self, integrator: str = "implicitfast") -> mujoco.MjModel:
        """Return the compiled model."""
        return mujoco.MjModel.from_xml_string(self.xml(integrator))

    def place(self, model: mujoco.MjModel, data: mujoco.MjData, site: str) -> Array:
        """Return the place of a site in the world by SciPy's splines and MuJoCo's body poses; data: with kinematics."""
        local = np.array(BODY_PLACES[site])
        for axis in range(3):
            if (site, axis) in self.moving:
                joint, spline = self.moving[site, axis]
                local[axis] = float(spline(data.joint(joint).qpos[0]))
        body = model.site_bodyid[model.site(site).id]
        return data.xpos[body] + data.xmat[body].reshape(3, 3) @ local


def numbers(spline: PPoly) -> str:
    """Return a spline as the numbers of a numeric."""
    origins, breaks = spline.x[:-1], spline.x[1:-1]
    rows = [len(origins), *breaks, *origins, *spline.c[::-1].T.ravel()]
    return " ".join(f"{x:.17g}" for x in rows)


def random_leg(seed: int, wraps: bool = True) -> Leg:
    """Return a leg with three strings: moving origin, via point and insertion, and a moving hint, beside wraps."""
    rng, leg = np.random.default_rng(seed), Leg()
    leg.move("patella", 0, "knee", rng)
    leg.move("patella", 2, "knee", rng)
    leg.move("patella", 1, "hip", rng, 0.004)
    leg.move("shin", 0, "sink", rng)
    leg.move("pelvis", 2, "hip", rng)
    leg.move("front", 0, "knee", rng, 0.004)
    around = ("condyle:front",) if wraps else ()
    over = ("egg:front",) if wraps else ()
    leg.declare("long", "pelvis", *over, "patella", "shin")
    leg.declare("short", "back", *around, "pes", "patella")
    leg.declare("both", "pelvis", *over, *around, "patella", "pes")
    return leg


def random_pose(model: mujoco.MjModel, rng: np.random.Generator) -> Array:
    """Return a pose of the leg within the ranges in which its strings have paths."""
    return np.array([rng.uniform(-0.7, 0.7), rng.uniform(-0.9, 0.9), rng.uniform(-0.02, 0.02)])
