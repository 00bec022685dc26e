"""Models whose joints follow others by the pieces of a spline, and what these pieces are, for tests."""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike

import mjwrap as mw
from mjwrap.mjcf.couplings import CoupledJoints

Array = np.ndarray


def text(values: Array) -> str:
    """Return numbers in full precision."""
    return " ".join(repr(float(value)) for value in np.ravel(values))


@dataclass
class Spline:
    """A smooth piecewise quartic function of one variable, drawn at random: knots (P − 1,), pieces in x itself."""

    knots: Array
    pieces: list[Polynomial] = field(default_factory=list)

    @classmethod
    def random(cls, rng: np.random.Generator, size: float, low: float, high: float, count: int) -> Spline:
        """Return a spline of `count` pieces with knots in a range and continuous second derivatives."""
        knots = np.sort(rng.uniform(low, high, count - 1))
        while count > 2 and np.diff(knots).min() < 0.05 * (high - low) / count:
            knots = np.sort(rng.uniform(low, high, count - 1))
        width = high - low
        first = Polynomial(rng.uniform(-size, size, 4) / width ** np.arange(4))
        pieces = [first]
        for knot in knots:
            step = Polynomial([-knot, 1.0]) ** 3 * (rng.uniform(-size, size) / width**3)
            pieces.append(pieces[-1] + step)
        return cls(knots, pieces)

    @classmethod
    def through(cls, x: ArrayLike, y: ArrayLike) -> Spline:
        """Return the natural cubic spline through points, which goes on linearly outside."""
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        h, slope = np.diff(x), np.diff(y) / np.diff(x)
        matrix, right = np.eye(len(x)), np.zeros(len(x))
        for i in range(1, len(x) - 1):
            matrix[i, i - 1 : i + 2] = h[i - 1], 2.0 * (h[i - 1] + h[i]), h[i]
            right[i] = 6.0 * (slope[i] - slope[i - 1])
        bend = np.linalg.solve(matrix, right)
        pieces = []
        for i, start in enumerate(x[:-1]):
            c = [
                y[i],
                slope[i] - h[i] * (2 * bend[i] + bend[i + 1]) / 6,
                bend[i] / 2,
                (bend[i + 1] - bend[i]) / (6 * h[i]),
            ]
            pieces.append(Polynomial(c)(Polynomial([-start, 1.0])))
        ends = [
            Polynomial([p(at) - at * p.deriv()(at), p.deriv()(at)])
            for p, at in ((pieces[0], x[0]), (pieces[-1], x[-1]))
        ]
        return cls(x, [ends[0], *pieces, ends[1]])

    def piece(self, x: float) -> int:
        """Return the number of the piece that holds at x."""
        return int(np.count_nonzero(self.knots <= x))

    def __call__(self, x: float, derivative: int = 0) -> float:
        """Return the value or a derivative at x."""
        piece = self.pieces[self.piece(x)]
        return float((piece.deriv(derivative) if derivative else piece)(x))

    def at_rest(self, rest: float, factor: float = 1.0) -> list[Array]:
        """Return c₀ to c₄ of every piece in x − rest, less the value at rest: a follower whose qpos0 is that value."""
        start, shifted = self(rest), Polynomial([rest, 1.0])
        found = []
        for piece in self.pieces:
            c = np.zeros(5)
            moved = np.asarray((piece(shifted) - start).coef, dtype=np.float64) * factor
            c[: len(moved)] = moved
            found.append(c)
        return found


def pieces_xml(
    follower: str, leader: str, spline: Spline, rest: float, kind: str = "joint", timestep: float = 1e-3
) -> tuple[str, str]:
    """Return the equalities of a coupling and its `<custom>` elements; for kind "tendon" names are tendons'."""
    active = spline.piece(rest)
    equalities = "".join(
        f'<{kind} name="{follower}_{p}" {kind}1="{follower}" {kind}2="{leader}" polycoef="{text(c)}" '
        f'active="{"true" if p == active else "false"}" solref="{2 * timestep} 1" solimp=".9999 .9999 .001 .5 2"/>'
        for p, c in enumerate(spline.at_rest(rest))
    )
    elements = "".join(
        f'<element objtype="equality" objname="{follower}_{p}"/>' for p in range(len(spline.pieces))
    )
    knots = f'<numeric name="mjwrap_coupling_{follower}_knots" data="{text(spline.knots)}"/>'
    listed = f'<element objtype="numeric" objname="mjwrap_coupling_{follower}_knots"/>'
    if len(spline.pieces) == 1:
        knots = listed = ""
    return equalities, f'{knots}<tuple name="mjwrap_coupling_{follower}">{elements}{listed}</tuple>'


# A floor for contacts, and a box that comes to rest on it.
FLOOR = """
    <geom name="floor" type="plane" size="3 3 .1" pos="0 0 .17"/>
    <body name="box" pos="1 1 .2"><freejoint/><geom type="box" size=".1 .1 .03" mass="1"/></body>
"""
# A thigh and a shank that slides and turns with the knee's angle, as in gait10; a patella that follows by two steps;
# a wheel that follows a sum of two hinges.
KNEE = """
<mujoco>
  <option timestep="{timestep}" integrator="{integrator}" gravity="0 0 -9.81"><flag contact="disable"/></option>
  <compiler angle="radian"/>
  <worldbody>
    <body name="thigh" pos="0 0 1"><joint name="hip" axis="0 1 0"/>
      <geom type="capsule" size=".05" fromto="0 0 0 0 0 -.4" mass="7"/>
      <site name="hip_site" pos=".06 0 -.05"/>
      <body name="shank" pos="0 0 -.4">
        <joint name="slide_x" type="slide" axis="1 0 0" ref="{x}"/>
        <joint name="slide_z" type="slide" axis="0 0 1" ref="{z}"/>
        <joint name="knee" axis="0 1 0" ref="{knee}"/><joint name="twist" axis="0 0 1" ref="{twist}"/>
        <geom type="capsule" size=".04" fromto="0 0 0 0 0 -.4" mass="3"/>
        <site name="shank_site" pos=".05 0 -.1"/>
        <body name="foot" pos="0 0 -.4"><joint name="ankle" axis="0 1 0"/>
          <geom type="capsule" size=".03" fromto="0 0 0 .2 0 0" mass="1"/></body>
      </body>
      <body name="patella" pos=".06 0 -.38"><joint name="glide" type="slide" axis="0 0 1" ref="{glide}"/>
        <geom size=".02" mass=".2"/><site name="patella_site"/></body>
    </body>
    <body name="wheel" pos="0 .5 1"><joint name="wheel" axis="0 1 0" ref="{wheel}"/>
      <geom type="capsule" size=".02" fromto="0 0 0 .1 0 0" mass=".5"/></body>
  {floor}</worldbody>
  <tendon>
    <fixed name="wheel_only"><joint joint="wheel" coef="1"/></fixed>
    <fixed name="hip_and_ankle"><joint joint="hip" coef=".7"/><joint joint="ankle" coef="-.4"/></fixed>
    {tendon}
  </tendon>
  <equality>{equalities}</equality>
  <custom>{custom}</custom>
  {actuator}
</mujoco>
"""
MUSCLE = (
    '<spatial name="quad_tendon"><site site="hip_site"/><site site="patella_site"/><site site="shank_site"/></spatial>',
    '<actuator><muscle name="quad" tendon="quad_tendon" force="400" ctrllimited="true" ctrlrange="0 1" '
    'lengthrange=".2 .7"/></actuator>',
)


def gait_knee(timestep: float, integrator: str) -> Knee:
    """Return a knee whose shank slides like that of the models of human gait: some centimetres, over 11 and 6 knots."""
    angle = np.radians([-120, -100, -80, -60, -40, -20, -10, 11, 20, 28, 90])
    x = [-0.003, 0.002, 0.004, 0.004, 0.002, -0.001, -0.003, -0.005, -0.0055, -0.0056, -0.0055]
    coarse = np.radians([-120, -70, -30, -20, -10, 90])
    z = [-0.028, -0.013, -0.004, -0.0026, -0.0016, -0.001]
    given = {"slide_x": Spline.through(angle, x), "slide_z": Spline.through(coarse, z)}
    return knee(1, timestep, integrator, given=given)


@dataclass
class Knee:
    """The model, and the splines of its couplings by follower: what they depend on is in `leaders`."""

    xml: str
    splines: dict[str, Spline]
    leaders: dict[str, dict[str, float]]

    @property
    def model(self) -> mujoco.MjModel:
        return mujoco.MjModel.from_xml_string(self.xml)

    def follow(self, model: mujoco.MjModel, qpos: Array) -> Array:
        """Return a pose with the followers in place, computed from the splines alone."""
        found = qpos.copy()
        for follower, spline in self.splines.items():
            x = sum(w * float(found[model.joint(n).qposadr[0]]) for n, w in self.leaders[follower].items())
            found[model.joint(follower).qposadr[0]] = spline(x)
        return found

    def set_active(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Set the active piece of every coupling from the present pose, in Python."""
        for follower, spline in self.splines.items():
            x = sum(
                w * float(data.qpos[model.joint(n).qposadr[0]]) for n, w in self.leaders[follower].items()
            )
            first = "wheel_only" if follower == "wheel" else follower
            for p in range(len(spline.pieces)):
                data.eq_active[model.equality(f"{first}_{p}").id] = p == spline.piece(x)


def knee(
    seed: int = 0,
    timestep: float = 1e-3,
    integrator: str = "RK4",
    muscle: bool = False,
    floor: bool = False,
    wheel: bool = True,
    given: dict[str, Spline] | None = None,
    counts: tuple[int, ...] = (9, 12, 7, 8, 10),
    size: float = 0.02,
) -> Knee:
    """Return a random knee: slides and a twist of the knee's angle, the patella of a slide, the wheel of a sum."""
    rng = np.random.default_rng(seed)
    rest = float(rng.uniform(-1.5, 0.0))
    splines = {
        "slide_x": Spline.random(rng, size, -2.0, 0.5, counts[0]),
        "slide_z": Spline.random(rng, size, -2.0, 0.5, counts[1]),
        "twist": Spline.random(rng, 5 * size, -2.0, 0.5, counts[2]),
    }
    splines |= given or {}
    z = splines["slide_z"]
    reach = [z(x) for x in np.linspace(-2.0, 0.5, 60)]
    splines["glide"] = Spline.random(rng, size, min(reach), max(reach), counts[3])
    splines["wheel"] = Spline.random(rng, 10 * size, -0.6, 0.6, counts[4])
    one = {"slide_x": "knee", "slide_z": "knee", "twist": "knee", "glide": "slide_z"}
    leaders = {name: {leader: 1.0} for name, leader in one.items()} | {"wheel": {"hip": 0.7, "ankle": -0.4}}
    refs = {name: splines[name](rest) for name in ("slide_x", "slide_z", "twist")}
    refs |= {"glide": splines["glide"](refs["slide_z"]), "wheel": splines["wheel"](0.0)}
    parts = [
        pieces_xml(n, "knee", splines[n], rest, timestep=timestep) for n in ("slide_x", "slide_z", "twist")
    ]
    parts.append(pieces_xml("glide", "slide_z", splines["glide"], refs["slide_z"], timestep=timestep))
    if not wheel:
        del splines["wheel"], leaders["wheel"]
    parts += (
        []
        if not wheel
        else [pieces_xml("wheel_only", "hip_and_ankle", splines["wheel"], 0.0, "tendon", timestep=timestep)]
    )
    tendon, actuator = MUSCLE if muscle else ("", "")
    xml = KNEE.format(
        timestep=timestep, integrator=integrator, tendon=tendon, actuator=actuator, floor=FLOOR * floor,
        x=refs["slide_x"], z=refs["slide_z"], knee=rest, twist=refs["twist"], glide=refs["glide"], wheel=refs["wheel"],
        equalities="".join(part[0] for part in parts), custom="".join(part[1] for part in parts),
    )  # fmt: skip
    return Knee(xml, splines, leaders)


def installed(made: Knee) -> mujoco.MjModel:
    return mw.install(mujoco.MjSpec.from_string(made.xml))


def start(made: Knee, model: mujoco.MjModel, seed: int = 0) -> mujoco.MjData:
    """Return data at the default pose, with the leaders moving fast and the followers with them."""
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    couplings = CoupledJoints(made.model)
    k = len(couplings.independent)
    speed = rng.uniform(-3.0, 3.0, k)
    speed[list(couplings.independent).index(int(model.joint("knee").dofadr[0]))] = rng.choice([-6.0, 6.0])
    data.qvel[:] = couplings.matrix(data.qpos) @ speed
    return data
