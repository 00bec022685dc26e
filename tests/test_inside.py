"""Paths that are held inside: the shortest that meet a sphere or cylinder, MuJoCo's side site inside the geom."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize

import mjwrap as mw
from mjwrap.verification.scenes import rotation

Array = NDArray[np.float64]
SURFACES = {"sphere": mw.Sphere, "cylinder": mw.Cylinder}
EXACT = 1e-14  # of a length below one metre


def norm(x: ArrayLike) -> float:
    return float(np.linalg.norm(x))


def random_scene(rng: np.random.Generator, kind: str) -> tuple[Array, Array, mw.Obstacle]:
    """Return two points and an obstacle, of all sizes from a hundredth to a hundred times the radius."""
    radius = 10.0 ** rng.uniform(-3, 0)
    pos = rng.normal(size=3)
    origin, insertion = (pos + rng.normal(size=3) * radius * 10.0 ** rng.uniform(-2, 2) for _ in range(2))
    return (
        origin,
        insertion,
        mw.Obstacle(SURFACES[kind](radius), tuple(pos), tuple(rng.normal(size=4)), inside=True),
    )


def shortest(origin: Array, insertion: Array, obstacle: mw.Obstacle) -> float:
    """Return the least |A - P| + |P - B| over the surface, by a general minimiser from several starts [m]."""
    frame, pos, radius = rotation(obstacle.quat), np.array(obstacle.pos), obstacle.surface.size
    sphere = isinstance(obstacle.surface, mw.Sphere)
    scale = max(norm(origin - pos), norm(insertion - pos))

    def length(x: Array) -> float:
        if sphere:
            local = radius * np.array(
                [np.cos(x[0]) * np.cos(x[1]), np.sin(x[0]) * np.cos(x[1]), np.sin(x[1])]
            )
        else:
            local = np.array([radius * np.cos(x[0]), radius * np.sin(x[0]), scale * x[1]])
        point = pos + frame @ local
        return float(norm(point - origin) + norm(point - insertion)) / scale

    starts = itertools.product((-2.0, 0.0, 2.0), (-0.5, 0.5))
    return scale * min(minimize(length, start, options={"gtol": 1e-9}).fun for start in starts)


@pytest.mark.parametrize("kind", SURFACES)
def test_a_corner_is_where_a_general_minimiser_finds_it(kind: str) -> None:
    rng = np.random.default_rng(61)
    corners = 0
    while corners < 60:
        origin, insertion, obstacle = random_scene(rng, kind)
        path = mw.solve_path(origin, insertion, [obstacle])
        if not path.contacts[0].active:
            continue
        corners += 1
        least = shortest(origin, insertion, obstacle)
        assert path.length <= least * (1 + EXACT)
        assert path.length == pytest.approx(least, rel=1e-9)  # what the minimiser's differences leave


@pytest.mark.parametrize("kind", SURFACES)
def test_every_path_is_found_and_reflected(kind: str) -> None:
    """P lies on the surface, both segments outside and at one angle to the normal; straight paths meet the solid."""
    rng = np.random.default_rng(62)
    seen = {True: 0, False: 0}
    for _ in range(3000):
        origin, insertion, obstacle = random_scene(rng, kind)
        path = mw.solve_path(origin, insertion, [obstacle])
        assert path.converged
        assert path.iterations <= 20
        radius, frame = obstacle.surface.size, rotation(obstacle.quat)
        flat = np.diag([1.0, 1.0, 0.0 if kind == "cylinder" else 1.0])
        a, b = (flat @ frame.T @ (x - obstacle.pos) / radius for x in (origin, insertion))
        (contact,) = path.contacts
        seen[contact.active] += 1
        step = b - a
        nearest = a + np.clip(-a @ step / (step @ step), 0, 1) * step
        reach = max(norm(a), norm(b))
        if not contact.active:
            assert norm(nearest) <= 1 + 1e-14 * reach
            assert path.length == pytest.approx(norm(insertion - origin), rel=EXACT)
            continue
        assert norm(nearest) >= 1 - 1e-14 * reach
        assert contact.P is not None
        assert np.array_equal(contact.P, np.array(contact.Q))
        assert contact.arc_length == 0.0
        n = flat @ frame.T @ (contact.P - obstacle.pos) / radius
        assert norm(n) == pytest.approx(1.0, abs=1e-13 * (1 + norm(obstacle.pos) / radius))
        e, f = contact.P - origin, insertion - contact.P
        rounding = 1e-15 * (1 + reach * radius + norm(obstacle.pos)) / min(norm(e), norm(f))
        e, f, n = e / norm(e), f / norm(f), frame @ n
        assert -e @ n == pytest.approx(f @ n, abs=1e-12 + 10 * rounding)
        assert f @ n >= -1e-12 - 10 * rounding
        assert norm(np.cross(e - f, n)) < 1e-12 + 10 * rounding
    assert min(seen.values()) > 300


@pytest.mark.parametrize("kind", SURFACES)
def test_lengths_are_continuous_and_moment_arms_where_the_path_comes_to_touch(kind: str) -> None:
    """Along a line that crosses the solid and leaves it; convex, as a least length over a convex set is."""
    t = np.linspace(-2.0, 2.0, 4001)
    obstacle = mw.Obstacle(SURFACES[kind](0.5), inside=True)
    origin, insertion = np.array([-1.0, 0.2, 0.1]), np.array([1.2, 0.3, -0.2])
    pos = np.stack([0.05 + 0.0 * t, t, 0.02 * t], axis=1)[:, None]
    sweep = mw.solve_sweep(origin, insertion, [obstacle], pos, np.tile([1.0, 0, 0, 0], (len(t), 1, 1)))
    assert sweep.converged
    slope = np.diff(sweep.length) / np.diff(t)
    assert np.diff(slope).min() > -1e-11  # rounding of lengths over the step
    assert np.diff(slope).max() < 0.01  # no kink: the slope's own change over a step
    straight = np.isclose(sweep.length, norm(insertion - origin), rtol=1e-15)
    assert 0.15 < straight.mean() < 0.4


@pytest.mark.parametrize("kind", SURFACES)
@pytest.mark.parametrize("height", [1e-3, 1e-6, 1e-9, 1e-12, 0.0, -1e-12, -1e-3])
def test_an_end_point_at_the_surface(kind: str, height: float) -> None:
    """Length is continuous as it enters; the segment that vanishes keeps the direction that it has in the limit."""
    obstacle = mw.Obstacle(SURFACES[kind](0.5), inside=True)
    origin, insertion = np.array([0.5 + height, 0.0, 0.0]), np.array([1.0, 0.3, 0.1])
    path = mw.solve_path(origin, insertion, [obstacle])
    assert path.converged
    assert path.length == pytest.approx(norm(insertion - origin), abs=3 * abs(height) + 1e-15)
    assert path.contacts[0].active == (height > 0.0)
    pull = path.wrenches(1.0)[0, :3]
    assert norm(pull) == pytest.approx(1.0, abs=1e-12)
    away = (insertion - origin) / norm(insertion - origin)
    if height > 0.0:
        away = away * [-1.0, 1.0, 1.0]  # towards the surface first: mirrored
    assert np.abs(pull - away).max() < 2 * abs(height) / 0.5 + 1e-7


@pytest.mark.parametrize("kind", SURFACES)
def test_in_line_with_the_centre(kind: str) -> None:
    """On one side the path goes there and back; with the centre between them it is straight."""
    obstacle = mw.Obstacle(SURFACES[kind](0.5), (0.1, 0.2, 0.3), inside=True)
    origin, middle = np.array([1.1, 0.2, 0.3]), np.array(obstacle.pos)
    assert mw.solve_path(origin, origin, [obstacle]).length == pytest.approx(1.0, rel=EXACT)
    beyond = middle + 3.0 * (origin - middle)
    assert mw.solve_path(origin, beyond, [obstacle]).length == pytest.approx(3.0, rel=EXACT)
    assert mw.solve_path(origin, 2.0 * middle - beyond, [obstacle]).length == pytest.approx(4.0, rel=EXACT)


def test_it_stands_between_fixed_points() -> None:
    held = mw.Obstacle(mw.Sphere(0.1), (0.3, 0.5, 0.0), inside=True)
    wrapped = mw.Obstacle(mw.Sphere(0.1), (0.6, -0.02, 0.0))
    ends = np.zeros(3), np.array([1.0, 0.0, 0.0])
    path = mw.solve_path(*ends, [held, mw.ViaPoint((0.5, 0.0, 0.0)), wrapped])
    halves = mw.solve_path(ends[0], (0.5, 0, 0), [held]), mw.solve_path((0.5, 0, 0), ends[1], [wrapped])
    assert path.length == halves[0].length + halves[1].length
    assert (
        mw.solve_path(*ends, [held, mw.ViaPoint((0.5, 0.0, 0.0)), wrapped], start=path).length == path.length
    )
    points = path.points(0.01)
    assert np.abs(points - np.array(path.contacts[0].P)).max(axis=1).min() < 1e-15
    for row in ([held, wrapped], [wrapped, held], [held, held]):
        with pytest.raises(mw.GeometryError, match="must be end points or via points"):
            mw.solve_path(*ends, row)


@pytest.mark.parametrize(
    "surface", [mw.Ellipsoid((0.1, 0.1, 0.1)), mw.Cylinder(0.1, 1.0), mw.Torus(0.2, 0.1)]
)
def test_other_surfaces_cannot_hold(surface: mw.Ellipsoid | mw.Cylinder | mw.Torus) -> None:
    with pytest.raises(mw.GeometryError, match="only a Sphere or an infinite Cylinder"):
        mw.Obstacle(surface, inside=True)


def test_the_papers_methods_know_tangents_only() -> None:
    held = mw.Obstacle(mw.Cylinder(0.1), (0.3, 0.5, 0.0), inside=True)
    with pytest.raises(mw.GeometryError, match="method 'nr' cannot hold a path inside"):
        mw.solve_path((0, 0, 0), (1, 0, 0), [held], method="nr")
