"""Hints in rows: a path passes each ring on the side of its hint, and says where no path does."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import mjwrap as mw
from mjwrap.surfaces import Surface
from mjwrap.verification.certificate import Case, findings
from mjwrap.verification.random_scenes import Maker
from mjwrap.verification.ring_sides import lone_ring, passes_as_hinted, spread

ROWS = 15  # of each kind


@pytest.mark.parametrize("letters", ["te", "tect", "ttt", "ctpt"])
def test_a_path_passes_the_rings_of_a_row_as_their_hints_say(letters: str) -> None:
    """Every scene has such a path. One in three used to pass some ring on the other side, converged."""
    maker, rng = Maker(letters, 11, 0), np.random.default_rng(12)
    for k in range(ROWS):
        scene = maker.scene(True)
        near = scene.hinted("good")
        assert near is not None
        for row in (near, spread(near, rng)):
            sol = mw.solve_path(scene.origin, scene.insertion, row)
            assert sol.converged, k
            assert findings([Case.of(scene.origin, scene.insertion, row, sol)]) == [""]
            assert passes_as_hinted(sol, row), k


def test_a_cold_start_in_a_row_of_rings_is_the_warm_path_of_a_sweep() -> None:
    """Three rings on a line and two drums; the rings move sideways, until the straight line misses their holes."""

    def row(shift: float) -> list[mw.Obstacle]:
        across = (np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0)  # the rings' axes along x
        rings = [
            mw.Obstacle(mw.Torus(0.03, 0.006), (x, way * shift, 0.0), across, hint=(0.0, -0.024 * way, 0.0))
            for x, way in ((0.1, 1.0), (0.3, -1.0), (0.5, 1.0))
        ]
        drums = [
            mw.Obstacle(mw.Cylinder(0.02), (0.2, -0.05, 0.0), hint=(0.0, -0.03, 0.0)),
            mw.Obstacle(mw.Ellipsoid((0.03, 0.02, 0.04)), (0.4, 0.05, 0.0), hint=(0.0, 0.03, 0.0)),
        ]
        return [rings[0], drums[0], rings[1], drums[1], rings[2]]

    warm = None
    for shift in np.linspace(0.0, 0.15, 31):
        obstacles = row(shift)
        warm = mw.solve_path((0.0, 0.0, 0.0), (0.6, 0.0, 0.0), obstacles, start=warm)
        cold = mw.solve_path((0.0, 0.0, 0.0), (0.6, 0.0, 0.0), obstacles)
        assert warm.converged
        assert cold.converged
        assert cold.length == pytest.approx(warm.length, abs=1e-9), shift
        assert passes_as_hinted(cold, obstacles)
    assert sum(contact.active for contact in cold.contacts) >= 3


def test_a_string_through_a_flat_ring_touches_it_twice() -> None:
    """It dives through the hole under the near part of the tube and over the far one."""
    a, b = np.array([-0.0694, -0.1296, -0.0171]), np.array([0.0853, 0.0379, 0.0383])
    path = mw.solve_path(a, b, [mw.Obstacle(mw.Torus(0.03753, 0.012726), hint=(0.025, 0.007, 0.005))])
    assert path.converged
    (contact,) = path.contacts
    assert len(contact.touches) == 2
    assert contact.touches[0] == replace(contact, touches=())
    assert contact.second is contact.touches[1]
    before, behind = contact.touches[0].P, contact.touches[1].Q
    assert before is not None
    assert behind is not None
    assert before[2] < 0.0 < behind[2]
    row = [mw.Obstacle(mw.Torus(0.03753, 0.012726))]
    assert findings([Case.of(a, b, row, path)]) == [""]


def test_touches_of_points_and_free_surfaces() -> None:
    path = mw.solve_path(
        (-0.3, 0.0, 0.0),
        (0.3, 0.0, 0.0),
        [mw.ViaPoint((0.0, 0.1, 0.0)), mw.Obstacle(mw.Sphere(0.02), (0.1, -0.3, 0.0))],
    )
    via, free = path.contacts
    assert [len(via.touches), len(free.touches)] == [1, 0]
    assert free.second is None


# ------------------------------------------------------------------------------------- what a path says


@pytest.mark.parametrize(
    ("surface", "hint", "met"),
    [
        (mw.Sphere(0.1), (0.0, 0.1, 0.0), True),
        (mw.Sphere(0.1), (0.0, -0.1, 0.0), False),  # a string slips off to the shorter way
        (
            mw.Sphere(0.1),
            (0.0, 0.02, 0.0),
            True,
        ),  # inside the sphere: the point of the surface above it counts
        (mw.Cylinder(0.1), (0.0, -0.1, 0.0), True),
        (mw.Ellipsoid((0.1, 0.1, 1.0)), (0.0, -0.1, 0.0), True),
        (mw.Capsule(0.1, 0.5), (0.0, -0.1, 0.0), True),
        (mw.Cone(0.1, 0.05, 0.5), (0.0, -0.1, 0.0), True),
        (mw.EllipticCylinder((0.1, 0.09)), (0.0, -0.1, 0.0), True),
    ],
)
def test_a_path_says_whether_it_meets_the_hint(surface: Surface, hint: tuple[float, ...], met: bool) -> None:
    path = mw.solve_path((-0.3, 0.05, 0.0), (0.3, 0.05, 0.0), [mw.Obstacle(surface, hint=hint)])
    assert path.converged
    assert path.hints_met == [met]
    point = path.contacts[0].P
    assert point is not None
    assert np.sign(point[1]) == (np.sign(hint[1]) if met else -np.sign(hint[1]))


def test_hints_are_met_where_a_warm_string_is_on_another_side_only_if_it_is_not() -> None:
    """The hint of a drum at a cold start, and the same drum with a string that was drawn over its other side."""
    drum = mw.Obstacle(mw.Cylinder(0.1), hint=(0.0, 0.1, 0.0))
    over = mw.solve_path((-0.3, 0.0, 0.0), (0.3, 0.0, 0.0), [drum])
    under = mw.solve_path((-0.3, 0.0, 0.0), (0.3, 0.0, 0.0), [replace(drum, hint=(0.0, -0.1, 0.0))])
    assert over.hints_met == under.hints_met == [True]
    moved = mw.solve_path((-0.3, 0.0, 0.0), (0.3, 0.0, 0.0), [drum], start=under.branch)
    assert moved.length == under.length
    assert moved.hints_met == [False]


SLIPPING = """<mujoco><worldbody>
<site name="o" pos="-.3 .05 0"/><site name="i" pos=".3 .05 0"/><site name="below" pos="0 -.1 0"/>
<geom name="ball" type="sphere" size=".1" contype="0" conaffinity="0"/>
<body><joint type="slide"/><geom size=".01" mass="1" contype="0" conaffinity="0"/></body></worldbody>
<tendon><spatial name="m"><site site="o"/><geom geom="ball" {side}/><site site="i"/></spatial></tendon>
<actuator><muscle name="m" tendon="m" lengthrange=".5 1"/></actuator></mujoco>"""


@pytest.mark.parametrize(("side", "unmet"), [('sidesite="below"', ["ball"]), ("", [])])
def test_a_system_and_the_plugin_name_the_geoms_whose_hint_is_not_met(side: str, unmet: list[str]) -> None:
    spec = mujoco.MjSpec.from_string(SLIPPING.format(side=side))
    model = spec.compile()
    muscles, data = mw.MuscleSystem(model), mujoco.MjData(model)
    muscles.forward(data)
    assert muscles.unmet_hints(0) == unmet
    assert list(muscles.hints_met) == [not unmet]
    installed = mw.install(spec)
    there = mujoco.MjData(installed)
    mujoco.mj_forward(installed, there)
    assert mw.plugin.Muscles(there).unmet_hints(0) == unmet


def test_a_lone_ring_meets_its_hint_and_says_so() -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        origin, insertion, row = lone_ring(rng)
        path = mw.solve_path(origin, insertion, row)
        assert path.hints_met == [True]
        assert passes_as_hinted(path, row)
        free = mw.solve_path(origin, insertion, [replace(row[0], hint=None)])
        assert not passes_as_hinted(free, row)
