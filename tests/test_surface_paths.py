"""Paths over one surface of every shape: ends that lie on it or in it, its own ends, and shapes that equal others."""

from __future__ import annotations

import itertools
from itertools import pairwise

import numpy as np
import pytest

import mjwrap as mw
from mjwrap.kernels import layout
from mjwrap.surfaces import Surface
from mjwrap.verification.scenes import (
    LETTERS,
    Array,
    check_path,
    height,
    local,
    nearest,
    outward,
    random_scene,
)

EXACT = 1e-12  # relative: two ways to the same path
NAMES = {"c": "cylinder", "s": "sphere", "e": "ellipsoid", "l": "elliptic cylinder"}
NAMES |= {"k": "cone", "t": "torus", "p": "capsule"}
every_surface = pytest.mark.parametrize("letter", LETTERS, ids=NAMES.__getitem__)


def crossing(rng: np.random.Generator, letter: str) -> tuple[Array, Array, mw.Obstacle]:
    """Return end points and one surface that the string between them touches over 5 mm."""
    while True:
        origin, insertion, row = random_scene(rng, letter, hints=False)
        sol = mw.solve_path(origin, insertion, row)
        if sol.converged and sol.contacts[0].arc_length > 5e-3:
            return origin, insertion, row[0]


# ------------------------------------------------------------------------------------- end points at a surface

ABOVE = (2e-3, 1e-6, 1e-9, 1e-12, 0.0)  # distances from the surface [m]
PINNED = 1e-7  # an end nearer to its contact counts as lying on the surface [m]
both_starts = pytest.mark.parametrize("warm", [False, True], ids=["cold", "warm"])


def landing(rng: np.random.Generator, letter: str) -> tuple[Array, Array, Array, mw.Obstacle]:
    """Return a point (3,) of a surface, the normal there, an end point elsewhere and the surface."""
    _, insertion, obstacle = crossing(rng, letter)
    foot = nearest(obstacle, obstacle.pos + rng.normal(size=3) * (0.02, 0.02, 0.05))
    return foot[0], outward(obstacle, foot)[0], insertion, obstacle


@both_starts
@pytest.mark.parametrize("last", [False, True], ids=["origin", "insertion"])
@every_surface
def test_an_end_point_that_comes_to_lie_on_a_surface_has_a_path(letter: str, last: bool, warm: bool) -> None:
    """Lengths change by no more than the end moves: the shortest path, and one that stays on its branch, do so.

    A first segment shorter than PINNED has no direction that the certificate could tell.
    """
    rng = np.random.default_rng(31)
    for _ in range(15):
        foot, normal, other, obstacle = landing(rng, letter)
        sols: list[mw.PathSolution] = []
        for distance in ABOVE:
            end = foot + distance * normal
            ends = (other, end) if last else (end, other)
            sols.append(mw.solve_path(*ends, [obstacle], start=sols[-1] if warm and sols else None))
            assert sols[-1].converged
            touch = sols[-1].contacts[0]
            contact = (touch.second or touch).Q if last else touch.P
            if contact is None or np.linalg.norm(contact - end) > PINNED:
                check_path(*ends, [obstacle], sols[-1])
        for (above, below), (before, after) in zip(pairwise(ABOVE), pairwise(sols), strict=True):
            assert abs(after.length - before.length) <= above - below + 1e-12


@both_starts
@every_surface
def test_an_end_point_that_sinks_into_a_surface_has_a_status_and_a_length(letter: str, warm: bool) -> None:
    """The length goes on without a jump, is finite however deep, and once outside again there is a path again."""
    rng = np.random.default_rng(31)
    for _ in range(15):
        foot, normal, insertion, obstacle = landing(rng, letter)
        outside = mw.solve_path(foot + 1e-9 * normal, insertion, [obstacle])
        assert outside.converged
        last = outside
        for depth in (1e-9, 1e-6, 2e-3):
            last = mw.solve_path(foot - depth * normal, insertion, [obstacle], start=last if warm else None)
            # an end that six digits may have put inside lies on the surface
            on_it = depth < layout.AS_WRITTEN * obstacle.surface.size
            assert last.status == (mw.Status.CONVERGED if on_it else mw.Status.ENDPOINT_INSIDE)
            assert np.isfinite(last.length)
            assert np.isfinite(last.wrenches(1.0)).all()
            if depth == 1e-9:
                assert abs(last.length - outside.length) <= 2e-9 + 1e-12  # the end moved by this
        back = mw.solve_path(foot + 1e-9 * normal, insertion, [obstacle], start=last if warm else None)
        assert back.converged
        assert back.length == pytest.approx(outside.length, rel=EXACT)


# ------------------------------------------------------------------------------------- surfaces of finite length


def cut(surface: Surface, half: float) -> Surface:
    """Return a surface that ends at z = half and -half."""
    match surface:
        case mw.Cylinder():
            return mw.Cylinder(surface.radius, half)
        case mw.EllipticCylinder():
            return mw.EllipticCylinder(surface.radii, half)
        case mw.Cone():
            middle, slope, _ = surface.dims
            return mw.Cone(middle - slope * half, middle + slope * half, half)
    raise TypeError(f"{surface!r} has no ends")


@pytest.mark.parametrize("letter", "clk", ids=NAMES.__getitem__)
def test_a_contact_beyond_the_end_of_a_surface_has_a_status(letter: str) -> None:
    """The path is that of the unbounded surface, exactly; beyond the end at any point of the geodesic it is named.

    At a cold start a way round that keeps within the ends is taken instead, where there is one.
    """
    rng = np.random.default_rng(32)
    inside = 0
    for _ in range(40):
        origin, insertion, obstacle = crossing(rng, letter)
        whole = mw.solve_path(origin, insertion, [obstacle])
        points = whole.points(1e-5)
        touching = points[np.abs(height(obstacle, points)) < 1e-9]  # chords of 10 um sag less
        reach = float(np.abs(local(obstacle, touching)[:, 2]).max())
        for share in (0.5, 0.99, 1.01, 2.0):
            if isinstance(obstacle.surface, mw.Cone) and share * reach >= obstacle.surface.half_length:
                continue
            short = mw.Obstacle(cut(obstacle.surface, share * reach), obstacle.pos, obstacle.quat)
            for start in (None, whole):
                sol = mw.solve_path(origin, insertion, [short], start=start)
                if start is None and sol.converged and share < 1.0:
                    assert sol.length > whole.length
                    check_path(origin, insertion, [short], sol)
                    continue
                assert sol.length == pytest.approx(whole.length, rel=EXACT)
                assert sol.status == (mw.Status.CONVERGED if share > 1.0 else mw.Status.OUT_OF_RANGE)
                inside += share > 1.0
    assert inside > 40


@pytest.mark.parametrize("count", [1, 2])
def test_without_a_hint_a_path_in_range_is_found_where_there_is_one(count: int) -> None:
    """No hint leads to a path within the ends of all surfaces where none was found without; many are found so."""
    rng = np.random.default_rng(41)
    refused = rescued = 0
    for _ in range(150):
        origin, insertion, row = random_scene(rng, "".join(rng.choice(list("clk"), count)), hints=False)
        ends = [
            mw.Obstacle(cut(o.surface, half), o.pos, o.quat)
            for o, half in zip(row, rng.uniform(0.005, 0.04, count), strict=True)
        ]
        sol = mw.solve_path(origin, insertion, ends)
        whole = mw.solve_path(origin, insertion, row)
        rescued += sol.converged and sol.length > whole.length * (1.0 + 1e-9)
        if sol.status != mw.Status.OUT_OF_RANGE:
            continue
        refused += 1
        for angles in itertools.product(np.arange(4) * 0.5 * np.pi, repeat=count):
            hinted = [
                mw.Obstacle(o.surface, o.pos, o.quat, (0.01 * np.cos(a), 0.01 * np.sin(a), 0.0))
                for o, a in zip(ends, angles, strict=True)
            ]
            assert not mw.solve_path(origin, insertion, hinted).converged
    assert refused > 5
    assert rescued > 0


# ------------------------------------------------------------------------------------- surfaces that equal others

EQUAL = {
    "ellipsoid, sphere": lambda r: (mw.Ellipsoid((r, r, r)), mw.Sphere(r)),
    "elliptic cylinder, cylinder": lambda r: (mw.EllipticCylinder((r, r)), mw.Cylinder(r)),
    "long capsule, cylinder": lambda r: (mw.Capsule(r, 0.3), mw.Cylinder(r)),
}


# A hint beside a bounded surface chooses a half plane to start in, beside a cylinder the way round.
PAIRS = [(pair, hints) for pair in EQUAL for hints in (False, True) if not (hints and "capsule" in pair)]


@pytest.mark.parametrize(("pair", "hints"), PAIRS)
def test_shapes_that_are_equal_have_equal_paths(pair: str, hints: bool) -> None:
    rng = np.random.default_rng(38)
    letter, touched = "s" if "sphere" in pair else "c", 0
    for _ in range(100):
        origin, insertion, row = random_scene(rng, letter, hints)
        place = row[0]
        sols = [
            mw.solve_path(origin, insertion, [mw.Obstacle(surface, place.pos, place.quat, place.hint)])
            for surface in EQUAL[pair](place.surface.dims[0])
        ]
        assert sols[0].status == sols[1].status
        assert sols[0].length == pytest.approx(sols[1].length, rel=EXACT)
        touched += sols[0].contacts[0].arc_length > 0.0
    assert touched > 30


def test_a_string_on_a_cap_of_a_capsule_is_that_on_a_sphere() -> None:
    rng = np.random.default_rng(39)
    touched = 0
    for _ in range(100):
        origin, insertion, row = random_scene(rng, "s", hints=False)
        ball = row[0]
        sphere = mw.solve_path(origin, insertion, row)
        P, Q = sphere.contacts[0].P, sphere.contacts[0].Q
        if not sphere.converged or P is None or Q is None:
            continue
        axis = -(P + Q - 2.0 * np.array(ball.pos))  # away from the middle of the contact
        if np.linalg.norm(axis) < 0.5 * ball.surface.size:  # contact beyond the seam
            continue
        axis /= np.linalg.norm(axis)
        quat = (1.0 + axis[2], -axis[1], axis[0], 0.0)  # turns z to the axis
        half = rng.uniform(0.01, 0.03)
        capsule = mw.Obstacle(mw.Capsule(ball.surface.size, half), tuple(ball.pos + half * axis), quat)
        sol = mw.solve_path(origin, insertion, [capsule])
        if sol.status == mw.Status.ENDPOINT_INSIDE:
            continue
        assert sol.converged
        assert sol.length == pytest.approx(sphere.length, rel=EXACT)
        touched += 1
    assert touched > 20


def test_a_slender_cone_is_between_two_cylinders() -> None:
    """Its string is longer than one round the cylinder inside it, and shorter than one round the cylinder outside it.

    The string over the outer cylinder stays between the heights of its ends, and clears the cone.
    """
    rng = np.random.default_rng(40)
    for _ in range(60):
        origin, insertion, obstacle = crossing(rng, "c")
        radius, slope, half = obstacle.surface.size, 1.001e-3, 0.2
        surface = mw.Cone(radius + slope * half, radius - slope * half, half)
        cone = mw.Obstacle(surface, obstacle.pos, obstacle.quat)
        sol = mw.solve_path(origin, insertion, [cone])
        assert sol.converged
        check_path(origin, insertion, [cone], sol)
        top = local(cone, sol.points(1e-3))[:, 2].max()
        bottom = local(cone, np.array([origin, insertion]))[:, 2].min()
        thin, thick = (
            mw.solve_path(
                origin, insertion, [mw.Obstacle(mw.Cylinder(radius - slope * z), obstacle.pos, obstacle.quat)]
            ).length
            for z in (top + 1e-6, bottom)
        )
        assert thin < sol.length < thick
        assert thick - thin < slope * (top - bottom) * 2.0 * np.pi  # it grows by its turn per radius
