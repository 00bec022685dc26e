"""Laws of a taut string on bodies: balance of forces, power, virtual work, and lengths that their rates integrate to.

Each law is checked without mjwrap's own arithmetic: bodies' velocities, Jacobians and generalised forces are MuJoCo's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import mujoco
import numpy as np
import pytest
from mjcf_reading import MODELS, Vector, load
from random_models import ALL, SIMPLE, random_model, random_state

import mjwrap as mw

SEEDS = range(20)
PER_SEED = 3
ROUNDING = 1e-12  # sums of some hundred terms, relative to the sum of their magnitudes
STEP = 2e-4  # of the coarser difference quotient, for surfaces of 3 cm radius [rad, m]
EVERY = {"Cylinder", "Sphere", "Ellipsoid", "Capsule", "Cone", "EllipticCylinder", "Torus"}
PULLEY = """<mujoco><option gravity="0 0 0"/><worldbody>
  <site name="a" pos="-0.1 0 0"/> <site name="c" pos="0.1 0.05 0.02"/>
  <body pos="0 0 0"><joint type="ball" pos="0.05 0.01 0"/>
    <inertial pos="0.02 0.01 0.03" mass="1" diaginertia="0.01 0.01 0.01"/>
    <geom name="drum" type="cylinder" size="0.03 0.1" contype="0" conaffinity="0" pos="0 -0.01 0" euler="10 5 0"/>
    <site name="b" pos="0.1 0 0"/> <site name="side" pos="0 0.05 0"/>
    <body pos="0.1 0 0.1"><joint type="slide" axis="1 2 3"/><joint axis="1 -1 0.5"/>
      <inertial pos="0.01 0.02 0.03" mass="1" diaginertia="0.01 0.01 0.01"/>
      <geom name="ball" type="sphere" size="0.03" contype="0" conaffinity="0" pos="-0.01 0.04 -0.02"/>
      <site name="d" pos="-0.02 0.15 -0.05"/></body></body></worldbody>
  <tendon><spatial name="block">
    <site site="a"/> <geom geom="drum" sidesite="side"/> <site site="b"/>
    <pulley divisor="2"/> <site site="b"/> <geom geom="ball"/> <site site="d"/>
    <pulley divisor="3"/> <site site="c"/> <site site="d"/> </spatial></tendon>
  <actuator><muscle name="m" tendon="block" force="300" lengthrange="0.05 0.5" range="0.5 1.5"/></actuator></mujoco>"""


class Scene:
    """A model at one state, with its muscles on the branch that a jump from rest leads to."""

    def __init__(self, label: str, model: mujoco.MjModel, disturb: Callable[[mujoco.MjData], None]) -> None:
        self.label, self.model = label, model
        self.data, self.muscles = mujoco.MjData(model), mw.MuscleSystem(model)
        self.muscles.excitation[:] = np.linspace(0.3, 1.0, self.muscles.n)
        self.muscles.forward(self.data)
        disturb(self.data)
        self.muscles.forward(self.data)
        assert not self.muscles.status.any(), f"{label}: {self.muscles.report()}"
        mujoco.mj_forward(model, self.data)
        self.rest = self.data.qpos.copy()
        self.length, self.velocity = self.muscles.length.copy(), self.muscles.velocity.copy()
        self.tension = self.muscles.tension.copy()
        self.jacobian = self.muscles.length_jacobian(self.data)

    def wrenches(self) -> Vector:
        """What mjwrap writes to xfrc_applied: (nbody, 6), the world's reaction in row 0."""
        self.muscles.apply(self.data)
        wrench = self.data.xfrc_applied.copy()
        self.data.xfrc_applied[:] = 0.0
        return wrench

    @property
    def step(self) -> float:
        """Step of a difference quotient, in proportion to the smallest radius."""
        smallest = min(
            surface.size for declared in self.muscles.declarations for surface in declared.surfaces
        )
        return STEP * smallest / 0.03

    def moved(self, direction: Vector, size: float) -> tuple[Vector, list[int]]:
        """Lengths and contact counts of all muscles, `size` along a tangent direction (nv,) from the scene's pose."""
        self.data.qpos[:] = self.rest
        mujoco.mj_integratePos(self.model, self.data.qpos, direction, size)
        self.muscles.forward(self.data)
        self.data.qpos[:] = self.rest
        assert not self.muscles.status.any()
        return self.muscles.length.copy(), [
            len(self.muscles.contact_points(i)) for i in range(self.muscles.n)
        ]

    def errors(self, direction: Vector, rate: Vector) -> list[tuple[float, float]]:
        """Errors of central quotients, at a step and at half of it, of the muscles that keep their contacts."""
        quotients, contacts = [], []
        for size in (self.step, 0.5 * self.step):
            (ahead, there), (behind, here) = self.moved(direction, size), self.moved(direction, -size)
            quotients.append((ahead - behind) / (2 * size))
            contacts += [there, here]
        steady = [len(set(counts)) == 1 for counts in zip(*contacts, strict=True)]
        return [(a - r, b - r) for a, b, r, keep in zip(*quotients, rate, steady, strict=True) if keep]


def elbow(data: mujoco.MjData, rng: np.random.Generator) -> None:
    data.qpos[0], data.qvel[0] = rng.uniform(0.1, 2.2), rng.uniform(-3, 3)
    if len(data.act):
        data.act[:] = rng.uniform(0.1, 1, len(data.act))
    data.ctrl[:] = 1.0


def paper(data: mujoco.MjData, rng: np.random.Generator) -> None:
    data.qpos[:] = rng.uniform(-0.0014, 0.0014, len(data.qpos))
    data.qvel[:] = rng.uniform(-0.05, 0.05, len(data.qvel))
    data.act[:] = rng.uniform(0.1, 1)


def random_scenes(surfaces: tuple[str, ...]) -> Iterator[Scene]:
    for seed in SEEDS:
        model = random_model(seed, surfaces)
        rng = np.random.default_rng(1000 + seed)
        for k in range(PER_SEED):
            yield Scene(f"random {seed}.{k}", model, lambda data, m=model, r=rng: random_state(m, data, r))


def scenes() -> Iterator[Scene]:
    for stem in ("elbow", "elbow_conservative", "paper_case1", "paper_case2", "paper_two_cylinders"):
        model, _ = load(MODELS / stem.removesuffix("_conservative") / f"{stem}.xml")
        rng = np.random.default_rng(1)
        change = elbow if stem.startswith("elbow") else paper
        for k in range(4):
            yield Scene(f"{stem} {k}", model, lambda data, c=change, r=rng: c(data, r))
    pulley = mujoco.MjModel.from_xml_string(PULLEY)
    rng = np.random.default_rng(2)

    def turn(data: mujoco.MjData) -> None:
        random_state(pulley, data, rng, size=0.05)
        data.act[:] = 0.8

    for k in range(4):
        yield Scene(f"pulley {k}", pulley, turn)
    yield from random_scenes(SIMPLE)


@pytest.fixture(scope="module", params=["cylinders and spheres", "every surface"])
def all_scenes(request: pytest.FixtureRequest) -> list[Scene]:
    return list(scenes() if request.param == "cylinders and spheres" else random_scenes(ALL))


def test_the_scenes_cover_what_the_laws_are_about(all_scenes: list[Scene]) -> None:
    """More than 50 states; joints of every kind, the mocap body, world, rows of all surfaces occur on paths."""
    assert len(all_scenes) >= 50
    joints, holders, kinds, rows = set(), set(), set(), 0
    for scene in all_scenes:
        model = scene.model
        for i, declared in enumerate(scene.muscles.declarations):
            assert (scene.tension > 0).all()
            for body, _, _ in scene.muscles.forces(i):
                holders.add("mocap" if model.body_mocapid[body] >= 0 else "world" if body == 0 else "moving")
                first = int(model.body_jntadr[body])
                joints.update(model.jnt_type[first : first + int(model.body_jntnum[body])].tolist())
            kinds.update(type(surface).__name__ for surface in declared.surfaces)
            rows = max(rows, len(scene.muscles.contact_points(i)))
    assert joints == {int(kind) for kind in mujoco.mjtJoint.__members__.values()}
    assert holders == {"mocap", "world", "moving"}
    assert kinds in ({"Cylinder", "Sphere"}, EVERY)
    assert rows >= 6


def test_forces_and_moments_on_all_bodies_cancel(all_scenes: list[Scene]) -> None:
    for scene in all_scenes:
        wrench = scene.wrenches()
        force, arm = wrench[:, :3], scene.data.xipos
        shifted = np.cross(arm, force)
        moment = wrench[:, 3:] + shifted
        assert np.abs(force).sum() > 0
        assert np.abs(force.sum(0)).max() <= ROUNDING * np.abs(force).sum(), scene.label
        scale = np.abs(shifted).sum() + np.abs(wrench[:, 3:]).sum()
        assert np.abs(moment.sum(0)).max() <= ROUNDING * scale, scene.label


def test_each_muscles_own_forces_make_the_wrenches(all_scenes: list[Scene]) -> None:
    for scene in all_scenes:
        expected = np.zeros((scene.model.nbody, 6))
        for i in range(scene.muscles.n):
            for body, point, force in scene.muscles.forces(i):
                expected[body, :3] += force
                expected[body, 3:] += np.cross(point - scene.data.xipos[body], force)
        # a segment between two points of one body pulls it with nothing; forces() lists both of its ends
        assert np.abs(scene.wrenches() - expected).max() <= ROUNDING * np.abs(expected).sum(), scene.label


def test_power_on_all_bodies_is_minus_tension_times_lengthening(all_scenes: list[Scene]) -> None:
    for scene in all_scenes:
        wrench, power, scale = scene.wrenches(), 0.0, 0.0
        for body in range(scene.model.nbody):
            twist = np.zeros(6)  # angular, then linear at xipos, world axes
            kind = mujoco.mjtObj.mjOBJ_BODY
            mujoco.mj_objectVelocity(scene.model, scene.data, kind, body, twist, 0)
            terms = np.concatenate([wrench[body, 3:] * twist[:3], wrench[body, :3] * twist[3:]])
            power += float(terms.sum())
            scale += float(np.abs(terms).sum())
        assert abs(power + scene.tension @ scene.velocity) <= ROUNDING * scale, scene.label


def test_generalised_force_is_minus_tension_times_the_gradient_of_length(all_scenes: list[Scene]) -> None:
    for scene in all_scenes:
        wrench, found = scene.wrenches(), np.zeros(scene.model.nv)
        for body in range(scene.model.nbody):
            mujoco.mj_applyFT(
                scene.model,
                scene.data,
                wrench[body, :3],
                wrench[body, 3:],
                scene.data.xipos[body],
                body,
                found,
            )
        scale = np.abs(scene.tension[:, None] * scene.jacobian).sum()
        assert np.abs(found + scene.tension @ scene.jacobian).max() <= 1e-9 * scale, scene.label


def test_length_jacobian_is_that_of_the_points_it_pulls_at(all_scenes: list[Scene]) -> None:
    for scene in all_scenes:
        scene.muscles.forward(scene.data)
        for i in range(scene.muscles.n):
            row, point_jacobian = np.zeros(scene.model.nv), np.zeros((3, scene.model.nv))
            for body, point, force in scene.muscles.forces(i):
                mujoco.mj_jac(scene.model, scene.data, point_jacobian, None, point, body)
                row -= force @ point_jacobian / scene.tension[i]
            assert row == pytest.approx(scene.jacobian[i], abs=1e-9 * np.abs(scene.jacobian[i]).max()), (
                scene.label
            )


def check_second_order(errors: list[tuple[float, float]]) -> None:
    """Errors of difference quotients fall by four when the step is halved, each one of them.

    Quotients carry the lengths' rounding, 1e-16 / STEP = 1e-12, so errors below 1e-8 say nothing of the order. What is
    left is the cubic term, STEP^2 / 24 times the third derivative, largest where a short segment turns fast; it cancels
    in the value extrapolated from both steps.
    """
    coarse, fine = np.array(errors).T
    informative = np.abs(coarse) > 1e-8
    assert informative.sum() > 100
    ratio = coarse[informative] / fine[informative]
    assert ratio == pytest.approx(4.0, abs=0.2)
    assert np.median(ratio) == pytest.approx(4.0, abs=1e-3)
    assert np.abs((4.0 * fine - coarse) / 3.0).max() < 2e-6  # without the cubic term


def test_length_jacobian_is_the_derivative_of_length_at_second_order(all_scenes: list[Scene]) -> None:
    errors = []
    for scene in all_scenes:
        for dof, direction in enumerate(np.eye(scene.model.nv)):
            errors += scene.errors(direction, scene.jacobian[:, dof])
    assert len(errors) > 0.99 * sum(scene.muscles.n * scene.model.nv for scene in all_scenes)
    check_second_order(errors)


def test_velocity_is_the_rate_of_length_at_second_order(all_scenes: list[Scene]) -> None:
    """All joints move at once, so surfaces, origins and insertions translate and rotate. Per unit of joint speed."""
    errors = []
    for scene in all_scenes:
        speed = np.linalg.norm(scene.data.qvel)
        errors += scene.errors(scene.data.qvel / speed, scene.velocity / speed)
    assert len(errors) > 0.99 * sum(scene.muscles.n for scene in all_scenes)
    check_second_order(errors)


def test_velocity_is_the_jacobian_times_the_joint_velocities(all_scenes: list[Scene]) -> None:
    for scene in all_scenes:
        scale = np.abs(scene.jacobian) @ np.abs(scene.data.qvel)
        expected = scene.jacobian @ scene.data.qvel
        assert (np.abs(expected - scene.velocity) <= ROUNDING * scale).all(), scene.label


@pytest.mark.parametrize("seed", [1, 2, 5, 16])
def test_velocity_is_the_rate_of_length_along_a_simulated_motion(seed: int) -> None:
    """Lengths of a run under the muscles' own forces, RK4; the quotient over two steps against the velocity between.

    In these runs no contact comes or goes: there the second derivative of the length jumps, and the order with it.
    """
    worst, touched = [], set()
    for timestep in (1e-3, 5e-4):
        model = random_model(seed)
        model.opt.integrator = int(mujoco.mjtIntegrator.mjINT_RK4)
        model.opt.timestep = timestep
        data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
        muscles.excitation[:] = 0.05
        muscles.forward(data)
        random_state(model, data, np.random.default_rng(seed), size=0.01)
        lengths, velocities = [], []
        for _ in range(round(0.02 / timestep)):
            muscles.forward(data)
            lengths.append(muscles.length.copy())
            velocities.append(muscles.velocity.copy())
            touched.add(tuple(len(muscles.contact_points(i)) for i in range(muscles.n)))
            muscles.step(data)
        rate = (np.array(lengths[2:]) - np.array(lengths[:-2])) / (2 * timestep)
        error = rate - np.array(velocities[1:-1])
        stride = round(1e-3 / timestep)
        worst.append(np.sqrt(np.mean(error[stride - 1 :: stride] ** 2)))  # the same instants at both steps
    assert len(touched) == 1
    assert worst[0] / worst[1] == pytest.approx(4.0, abs=0.15)
