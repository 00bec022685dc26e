"""Ends inside a surface: the substitute path is continuous with the path outside, and has an exact gradient.

The foot point of an end is the surface point nearest to it, so an end is put at a height over a random point, along the
normal there. Everything is measured against differences of lengths.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from custom_shapes import MAKERS, RADII
from derivative_scenes import SURFACES, exponential, times
from numpy.typing import NDArray

import mjwrap as mw
from mjwrap.kernels.layout import AS_WRITTEN
from mjwrap.kernels.spans.end_inside import NO_SUBSTITUTE
from mjwrap.plugin import excitations, read
from mjwrap.verification.scenes import nearest, outward

Array = NDArray[np.float64]
CUSTOM = "u"
KINDS = "".join(SURFACES) + CUSTOM
DEEPEST = 0.003  # [m] less than half of the smallest radius of curvature of these surfaces
TOLERANCE = 1e-10


class Scene:
    """An end at a height over a surface, a far end, and perhaps a second obstacle on the way."""

    def __init__(self, rng: np.random.Generator, letter: str, second: bool = False) -> None:
        shape = mw.Ellipsoid(RADII) if letter == CUSTOM else SURFACES[letter](rng)
        self.surface = MAKERS["implicit ellipsoid by hand"]() if letter == CUSTOM else shape
        self.pos, self.quat = rng.normal(size=3) * 0.01, rng.normal(size=4)
        self.far = np.r_[0.3, 0.05, -0.04] * rng.uniform(0.8, 1.2, 3)
        here = mw.Obstacle(shape, tuple(self.pos), tuple(self.quat))
        towards = rng.normal(size=3) * 0.05
        self.point = nearest(here, self.pos + towards)[0]
        self.normal = outward(here, self.point)[0]
        self.others = [mw.Obstacle(mw.Sphere(0.03), (0.18, 0.0, 0.01))] if second else []

    def solve(
        self,
        at: float,
        move: Array | None = None,
        share: float = 0.0,
        *,
        back: bool = False,
        start: Any = None,
    ) -> mw.PathSolution:
        """Solve with the end at a height, moved by a share of move (9,): of the end, then the surface's twist."""
        move = np.zeros(9) if move is None else share * move
        end = self.point + at * self.normal + move[:3]
        quat = times(exponential(move[6:]), self.quat / np.linalg.norm(self.quat))
        row = [mw.Obstacle(self.surface, tuple(self.pos + move[3:6]), tuple(quat)), *self.others]
        if back:
            return mw.solve_path(self.far, end, row[::-1], start=start)
        return mw.solve_path(end, self.far, row, start=start)

    def rate(self, sol: mw.PathSolution, move: Array, *, back: bool = False) -> float:
        twists = np.zeros((1 + len(self.others), 6))
        twists[-1 if back else 0] = move[3:]
        ends = (np.zeros(3), move[:3]) if back else (move[:3], np.zeros(3))
        return sol.speed(*ends, twists)


def scenes(letter: str, count: int, second: bool = False) -> list[tuple[Scene, np.random.Generator]]:
    rng = np.random.default_rng(ord(letter) + 1000 * second)
    return [(Scene(rng, letter, second), rng) for _ in range(count)]


@pytest.mark.parametrize("second", [False, True])
@pytest.mark.parametrize("letter", KINDS)
def test_the_rate_is_the_derivative_of_the_length(letter: str, second: bool) -> None:
    """Of second order: the error of central differences is a quarter with half the step; for either end of the path."""
    errors, orders, touched = [], [], set()
    for scene, rng in scenes(letter, 25, second):
        at, move, back = -rng.uniform(1e-4, DEEPEST), rng.normal(size=9), bool(rng.integers(2))
        move[6:] *= 10.0
        sol = scene.solve(at, back=back)
        assert sol.status == mw.Status.ENDPOINT_INSIDE
        assert sol.tangency_error <= TOLERANCE
        touched.add(sol.contacts[-1 if back else 0].active)
        rate = scene.rate(sol, move, back=back)
        near = [scene.solve(at, move, s, back=back, start=sol) for s in (4e-6, -4e-6, 2e-6, -2e-6)]
        found = [(near[i].length - near[i + 1].length) / h - rate for i, h in ((0, 8e-6), (2, 4e-6))]
        errors.append(abs(4.0 * found[1] - found[0]) / 3.0)
        if abs(found[0]) > 1e-8:
            orders.append(np.log2(abs(found[0] / found[1])))
        wrench = sol.wrenches(2.0)
        assert np.abs(wrench.sum(0)).max() < 1e-14
    assert touched == {True, False}
    assert len(errors) > 15
    assert max(errors) < 2e-8
    assert np.median(orders) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("letter", KINDS)
def test_length_and_gradient_are_continuous_where_an_end_goes_in(letter: str) -> None:
    """Outside, the straight segment of a wrapped end turns with the square root of the height."""
    eps = 1e-9
    wraps = 0
    for scene, _ in scenes(letter, 25):
        above = scene.solve(eps)
        if not above.converged:
            continue
        below = scene.solve(-eps, start=above)
        assert below.converged  # as little inside as six digits may put an end that lies on the surface
        wraps += below.contacts[0].active
        assert abs(below.length - above.length) < 3.0 * eps
        for axis in np.eye(9)[:6]:
            assert abs(scene.rate(above, axis) - scene.rate(below, axis)) < 3.0 * np.sqrt(2.0 * eps / 0.006)
        again = scene.solve(eps, start=below)
        assert again.length == pytest.approx(above.length, abs=1e-14)
        bound = AS_WRITTEN * scene.surface.size
        near, deep = scene.solve(-0.99 * bound, start=below), scene.solve(-1.01 * bound, start=below)
        assert (near.status, deep.status) == (mw.Status.CONVERGED, mw.Status.ENDPOINT_INSIDE)
        assert abs(deep.length - near.length) < 0.1 * bound
        for axis in np.eye(9)[:6]:
            assert abs(scene.rate(deep, axis) - scene.rate(near, axis)) < 1e-5
    assert wraps > 5


@pytest.mark.parametrize("letter", KINDS)
def test_nothing_jumps_on_the_way_down(letter: str) -> None:
    """A step changes the length by what the rates at both of its ends allow, kinks included."""
    for scene, _ in scenes(letter, 5):
        heights = np.linspace(2.0 * DEEPEST, -DEEPEST, 301)
        move, sol, length, rate = np.r_[scene.normal, np.zeros(6)], None, [], []
        for at in heights.tolist():
            sol = scene.solve(at, start=sol)
            assert sol.status in (mw.Status.CONVERGED, mw.Status.ENDPOINT_INSIDE)
            length.append(sol.length)
            rate.append(scene.rate(sol, move))
        l, m, step = np.array(length), np.array(rate), heights[0] - heights[1]
        between = np.abs(np.diff(l) + 0.5 * step * (m[1:] + m[:-1]))
        assert between.max() < 0.5 * step * np.abs(np.diff(m)).max() + 1e-12
        assert np.abs(np.diff(m)).max() < 0.15


@pytest.mark.parametrize(
    "surface", [mw.Ellipsoid((0.05, 0.03, 0.04)), mw.Capsule(0.03, 0.04), mw.Torus(0.05, 0.02)]
)
def test_nothing_stands_in_where_both_ends_are_inside_one_surface_whose_wraps_are_searched_for(
    surface: Any,
) -> None:
    at = 0.0 if not isinstance(surface, mw.Torus) else 0.05
    ends = (at + 0.0, 0.0, 0.012), (at + 0.0, 0.005, -0.013)
    sol = mw.solve_path(*ends, [mw.Obstacle(surface)])
    assert sol.status == mw.Status.ENDPOINT_INSIDE
    assert sol.tangency_error == NO_SUBSTITUTE


@pytest.mark.parametrize(
    "surface", [mw.Ellipsoid((0.03, 0.05, 0.04)), mw.Capsule(0.03, 0.04)], ids=["ellipsoid", "capsule"]
)
def test_nothing_is_searched_for_where_no_path_can_be(surface: Any) -> None:
    """A cold start with an end inside evaluates the substitute path only, and finds what a warm start follows."""
    rng = np.random.default_rng(5)
    obstacle = mw.Obstacle(surface)
    for _ in range(40):
        place = nearest(obstacle, rng.normal(size=3) * 0.1)[0]
        normal, far = outward(obstacle, place)[0], np.r_[0.25, 0.1, 0.05] * rng.choice([-1.0, 1.0], 3)
        outside = mw.solve_path(place + 1e-4 * normal, far, [obstacle])
        cold = mw.solve_path(place - 1e-4 * normal, far, [obstacle])
        warm = mw.solve_path(place - 1e-4 * normal, far, [obstacle], start=outside)
        assert cold.status == warm.status == mw.Status.ENDPOINT_INSIDE
        assert cold.length == pytest.approx(outside.length, abs=1e-3)
        assert cold.length <= warm.length + 1e-9
        assert cold.evaluations <= 5


@pytest.mark.parametrize("back", [False, True])
def test_an_end_inside_a_surface_further_on_is_on_the_path_over_that_surface_alone(back: bool) -> None:
    """What comes between the end and the surface that contains it has no string to touch."""
    drum, further = (
        mw.Obstacle(mw.Ellipsoid((0.03, 0.05, 0.04))),
        mw.Obstacle(mw.Sphere(0.01), (0.0, 0.2, 0.0)),
    )
    rng, found = np.random.default_rng(6), 0
    for _ in range(40):
        place = nearest(drum, rng.normal(size=3) * 0.1)[0]
        inside, far = place - 0.002 * outward(drum, place)[0], np.r_[0.25, -0.1, 0.05]
        row = [drum, further]
        ends = (inside, far) if back else (far, inside)
        alone = mw.solve_path(*ends, [drum])
        path = mw.solve_path(*ends, row[::-1] if back else row)
        if path.status == mw.Status.ENDPOINT_INSIDE and path.tangency_error < NO_SUBSTITUTE:
            assert path.length == pytest.approx(alone.length, abs=1e-9)
            found += any(contact.active for contact in path.contacts)
    assert found > 5


def test_an_end_deep_inside_goes_straight_through_to_where_it_leaves() -> None:
    """Towards the far end the way through is MuJoCo's straight line; both ends may be inside."""
    ball = [mw.Obstacle(mw.Sphere(0.05))]
    sol = mw.solve_path((0.04, 0.0, 0.0), (0.3, 0.0, 0.0), ball)
    assert sol.status == mw.Status.ENDPOINT_INSIDE
    assert sol.length == pytest.approx(0.26, abs=1e-15)
    sol = mw.solve_path((-0.04, 0.0, 0.0), (0.04, 1e-3, 0.0), ball)
    around = 0.05 * (np.pi - np.arctan2(1e-3, 0.04))
    assert sol.length == pytest.approx(around, abs=1e-15)


RIDE = """<mujoco><option gravity="0 0 0" timestep="{step}" integrator="RK4"/><worldbody>
  <body name="surface"><joint name="turn" axis="0 0.6 0.8" stiffness="0.2"/>
    <inertial pos="0 0 0" mass="1" diaginertia=".01 .01 .01"/>
    <geom name="surface" {geom} contype="0" conaffinity="0" mass="0"/></body>
  <body name="rider" pos="-0.051 0.006 0.003">
    <joint name="x" type="slide" axis="1 0 0" stiffness="400"/>
    <joint name="y" type="slide" axis="0 1 0" stiffness="40"/>
    <inertial pos="0 0 0" mass="0.2" diaginertia=".01 .01 .01"/> <site name="end"/></body>
  <site name="far" pos="0.2 0.05 0.02"/></worldbody>
  <custom><numeric name="mjwrap_optimal_force" data="3"/><tuple name="mjwrap_string">
    <element objtype="site" objname="end"/> <element objtype="geom" objname="surface"/>
    <element objtype="site" objname="far"/> <element objtype="numeric" objname="mjwrap_optimal_force"/></tuple></custom>
</mujoco>"""
GEOMS = {
    "cylinder": 'type="cylinder" size="0.05 0.2"',
    "sphere": 'type="sphere" size="0.05"',
    "ellipsoid": 'type="ellipsoid" size="0.05 0.048 0.06"',
    "capsule": 'type="capsule" size="0.05 0.2"',
}


@pytest.mark.parametrize("geom", GEOMS)
def test_energy_is_kept_through_the_surface_and_the_plugin_moves_alike(geom: str) -> None:
    """A string of constant tension T has the energy T l; an end rides in and out of the surface, which it turns."""
    xml = RIDE.format(step=2e-4, geom=GEOMS[geom])
    model = mujoco.MjModel.from_xml_string(xml)
    data, muscles = mujoco.MjData(model), mw.MuscleSystem(model)
    installed = mw.install(mujoco.MjSpec.from_string(xml))
    twin = mujoco.MjData(installed)
    muscles.excitation[:] = 1.0
    excitations(twin)["string"][:] = 1.0
    data.qvel[:] = twin.qvel[:] = (0.0, 0.1, 0.1)
    energies, lengths, crossed, inside, before = [], [], 0, 0, 0
    for k in range(3000):
        if k % 10 == 0:
            muscles.forward(data)
            code = int(muscles.status[0])
            assert code in (mw.Status.CONVERGED, mw.Status.ENDPOINT_INSIDE)
            assert not muscles.held[0]
            crossed += code != before
            before = code
            inside += code == mw.Status.ENDPOINT_INSIDE
            mujoco.mj_forward(model, data)
            mujoco.mj_energyPos(model, data)
            mujoco.mj_energyVel(model, data)
            energies.append(sum(data.energy) + 3.0 * muscles.length[0])
            lengths.append(muscles.length[0])
            pull = np.zeros(model.nv)
            jacobian = muscles.length_jacobian(data)
            for body, point, force in muscles.forces(0):
                mujoco.mj_applyFT(model, muscles.poses(data), force, np.zeros(3), point, body, pull)
            assert np.abs(pull + 3.0 * jacobian[0]).max() < 1e-13
        muscles.step(data)
        mujoco.mj_step(installed, twin)
    assert crossed >= 4
    assert 20 < inside < 280
    assert np.ptp(energies) < 2e-5 * 3.0 * np.ptp(lengths)  # the force has a cusp at the surface
    assert np.array_equal(data.qpos, twin.qpos)
    assert read(twin).failures[0] == muscles.failures[0] > 0


@pytest.mark.parametrize(
    "surface",
    [mw.Ellipsoid((0.05, 0.02, 0.05)), mw.Ellipsoid((0.05, 0.034, 0.05)), mw.EllipticCylinder((0.05, 0.02)),
     mw.EllipticCylinder((0.05, 0.034))],
)  # fmt: skip
def test_nothing_jumps_where_the_nearest_point_changes_sides(surface: Any) -> None:
    """Half way to the middle plane of a flat solid the substitute path ends; the length is held from there."""
    last, sol, held = None, None, 0
    for y in np.linspace(0.019, -0.019, 761):
        sol = mw.solve_path((-0.005, y, 0.003), (0.3, 0.1, 0.02), [mw.Obstacle(surface)], start=sol)
        known = sol.converged or sol.tangency_error < NO_SUBSTITUTE
        held += not known
        if known and last is not None:
            assert abs(sol.length - last) < 2.0 * 5e-5, y
        last = sol.length if known else None
    assert held > 50
