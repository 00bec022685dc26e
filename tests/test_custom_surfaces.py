"""Laws of surfaces that a user wrote: nearest points, heights, geodesics, Darboux frames, Jacobi fields."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from custom_shapes import (
    MAKERS,
    RADII,
    RADIUS,
    RING,
    TUBE,
    Array,
    charted_ellipsoid,
    creased,
    cylinder,
    ellipsoid,
    followed,
    place,
    random_rows,
    ring,
    rolled,
    sphere,
    torus,
)

import mjwrap as mw
from mjwrap.kernels import layout as lay
from mjwrap.kernels.geometry import geodesics, user_surface
from mjwrap.surfaces.codegen.lanes import cosine, sine
from mjwrap.surfaces.user import CustomSurface, ImplicitSurface, ParametricSurface

CASES = 30
ACCURACY = 1e-12  # promised for geodesics and their fields, relative
GEODESIC = slice(lay.W_P, lay.W_BP)  # points, tangents and normals at both ends


@pytest.fixture(params=MAKERS)
def surface(request: pytest.FixtureRequest) -> CustomSurface:
    return MAKERS[request.param]()


def triple(values: Array, column: int) -> Array:
    return values[column : column + 3]


def moved(node: Array, which: int, size: float) -> Array:
    """Return the evaluated row after a natural variation: slid along t, shifted along b, turned, or lengthened."""
    one = node.copy()
    point = triple(one[0], lay.S_P)
    normal = np.array(user_surface.custom_project(0, one, *point)[3:])
    t = triple(one[0], lay.S_T).copy()
    b = np.cross(t, normal)
    if which < 2:
        found = np.array(user_surface.custom_project(0, one, *(point + size * (t, b)[which])))
        one[0, lay.S_P : lay.S_P + 3], normal = found[:3], found[3:]
    elif which == 2:
        t = t + size * b
    else:
        one[0, lay.S_ARC] += size
    t -= (t @ normal) * normal
    one[0, lay.S_T : lay.S_T + 3] = t / np.linalg.norm(t)
    return followed(one)[0]


def rate(node: Array, which: int, column: int, step: float) -> Array:
    """Return the central difference of a column triple by a natural variation."""
    ahead, behind = (triple(moved(node, which, sign * step), column) for sign in (1.0, -1.0))
    return (ahead - behind) / (2.0 * step)


def second_order(quotient: Callable[[float], Array], exact: Array, scale: float, unit: float) -> None:
    """Assert that a difference quotient tends to `exact`, its error falling with the square of the step."""
    coarse, fine = (np.abs(quotient(h * unit) - exact).max() for h in (2e-3, 1e-3))
    assert coarse <= 0.05 * scale
    assert fine <= coarse / 3.5 + 2e-9 * scale  # 4 in the limit; rounding is 1e-12 / 1e-3


# ------------------------------------------------------------------------------- points and heights


def test_points_are_projected_onto_the_surface_along_its_normal(surface: CustomSurface) -> None:
    rng = np.random.default_rng(1)
    node = random_rows(surface, CASES, rng)
    for k in range(CASES):
        point = triple(node[k], lay.S_P)
        there = np.array(user_surface.custom_project(k, node, *point))
        assert np.abs(there[:3] - point).max() < 1e-16
        assert np.linalg.norm(there[3:]) == pytest.approx(1.0, abs=1e-15)
        off = rng.uniform(-0.5, 0.5) * surface.size
        q = point + off * there[3:]
        found = np.array(user_surface.custom_project(k, node, *q))
        assert np.linalg.norm(q - found[:3]) <= abs(off) + 1e-15
        assert np.abs(np.cross(q - found[:3], found[3:])).max() < 2e-9 * surface.size
        assert user_surface.custom_height(k, node, *found[:3]) == pytest.approx(0.0, abs=1e-16)


def test_heights_are_distances_to_first_order(surface: CustomSurface) -> None:
    rng = np.random.default_rng(2)
    node = random_rows(surface, CASES, rng)
    for k in range(CASES):
        point = triple(node[k], lay.S_P)
        normal = np.array(user_surface.custom_project(k, node, *point)[3:])
        for off in (1e-3 * surface.size, -1e-3 * surface.size):
            assert user_surface.custom_height(k, node, *(point + off * normal)) == pytest.approx(
                off, rel=5e-3
            )


def test_anywhere_a_point_and_a_height_are_found(surface: CustomSurface) -> None:
    """Centre, axes, far away: finite, on the surface, and with the sign of the side."""
    rng = np.random.default_rng(3)
    node = random_rows(surface, 1, rng)
    points = [
        np.zeros(3),
        *np.eye(3) * 0.01,
        *rng.normal(size=(100, 3)) * 0.05,
        *rng.normal(size=(50, 3)) * 10.0,
    ]
    for point in points:
        found = np.array(user_surface.custom_project(0, node, *point))
        height = user_surface.custom_height(0, node, *point)
        assert np.isfinite(found).all()
        assert math.isfinite(height)
        assert abs(user_surface.custom_height(0, node, *found[:3])) < 1e-12 * max(1.0, np.abs(point).max())
    if math.isfinite(surface.dims[0]):
        assert height > 0.0


def test_a_closed_surface_knows_a_sphere_that_holds_it(surface: CustomSurface) -> None:
    node = random_rows(surface, 300, np.random.default_rng(4))
    farthest = np.linalg.norm(node[:, lay.S_P : lay.S_P + 3], axis=1).max()
    open_ended = any(word in repr(surface) for word in ("rolled", "waist"))
    assert math.isinf(surface.dims[0]) == open_ended
    assert farthest <= surface.dims[0]


# ------------------------------------------------------------------------------------------ geodesics


def test_frames_are_orthonormal_on_the_surface(surface: CustomSurface) -> None:
    node = followed(random_rows(surface, CASES, np.random.default_rng(5)))
    for k in range(CASES):
        for p, t, n in ((lay.W_P, lay.W_TP, lay.W_NP), (lay.W_Q, lay.W_TQ, lay.W_NQ)):
            point, tangent, normal = (triple(node[k], c) for c in (p, t, n))
            there = np.array(user_surface.custom_project(k, node, *point))
            assert np.abs(there[:3] - point).max() < 1e-16
            assert np.abs(there[3:] - normal).max() < 1e-14
            assert abs(tangent @ normal) < 1e-15
            assert np.linalg.norm(tangent) == pytest.approx(1.0, abs=1e-15)


def test_curve_is_a_unit_speed_geodesic(surface: CustomSurface) -> None:
    """dQ/ds = t and dt/ds = -kappa n: no acceleration within the surface."""
    rng = np.random.default_rng(6)
    for _ in range(CASES):
        node = random_rows(surface, 1, rng)
        at, size = moved(node, 3, 0.0), surface.size
        second_order(lambda h, n=node: rate(n, 3, lay.W_Q, h), triple(at, lay.W_TQ), 1.0, size)
        bend = -at[lay.W_KQ] * triple(at, lay.W_NQ)
        second_order(lambda h, n=node: rate(n, 3, lay.W_TQ, h), bend, 1.0 / size, size)


def test_normal_turns_with_the_shape_operator(surface: CustomSurface) -> None:
    """dn along t is kappa t + tau b; the start shifted along b turns n_P by tau t + beta b."""
    rng = np.random.default_rng(7)
    for _ in range(CASES):
        node = random_rows(surface, 1, rng)
        at, size = moved(node, 3, 0.0), surface.size
        t = triple(at, lay.W_TP)
        b = np.cross(t, triple(at, lay.W_NP))
        kappa, tau, beta = triple(at, lay.W_KP)
        for which, turn in ((0, kappa * t + tau * b), (1, tau * t + beta * b)):
            second_order(lambda h, n=node, w=which: rate(n, w, lay.W_NP, h), turn, 1.0 / size, size)


def test_jacobi_fields_match_neighbouring_geodesics(surface: CustomSurface) -> None:
    """Columns of method section 2 for Q and t_Q: shift along b carries a, turning about n carries r."""
    rng = np.random.default_rng(8)
    for _ in range(CASES):
        node = random_rows(surface, 1, rng)
        at, size = moved(node, 3, 0.0), surface.size
        a, da, r, dr = at[lay.W_JAC : lay.W_JAC + 4]
        t, n = triple(at, lay.W_TQ), triple(at, lay.W_NQ)
        b, tau = np.cross(t, n), at[lay.W_KQ + 1]
        for which, unit, field, turn in ((1, size, a, da), (2, 1.0, r, dr)):
            second_order(
                lambda h, x=node, w=which: rate(x, w, lay.W_Q, h), field * b, max(size / unit, 1.0), unit
            )
            tilt = turn * b - field * tau * n
            second_order(lambda h, x=node, w=which: rate(x, w, lay.W_TQ, h), tilt, 1.0 / unit, unit)
        assert a * dr - da * r == pytest.approx(1.0, abs=ACCURACY)  # the Wronskian of the Jacobi equation


def test_back_along_a_geodesic_is_where_it_came_from(surface: CustomSurface) -> None:
    node = followed(random_rows(surface, CASES, np.random.default_rng(9)))
    back = node.copy()
    back[:, lay.S_P : lay.S_P + 3] = node[:, lay.W_Q : lay.W_Q + 3]
    back[:, lay.S_T : lay.S_T + 3] = node[:, lay.W_TQ : lay.W_TQ + 3]
    back[:, lay.S_ARC] *= -1.0
    followed(back)
    assert (
        np.abs(back[:, lay.W_Q : lay.W_Q + 3] - node[:, lay.W_P : lay.W_P + 3]).max() < 2.0 * ACCURACY * 0.05
    )
    assert np.abs(back[:, lay.W_TQ : lay.W_TQ + 3] - node[:, lay.W_TP : lay.W_TP + 3]).max() < 2.0 * ACCURACY
    # r of the way back is minus r of the way there, a and r' change places
    for there, here in ((0, 3), (3, 0)):
        assert np.abs(back[:, lay.W_JAC + there] - node[:, lay.W_JAC + here]).max() < 5.0 * ACCURACY
    assert np.abs(back[:, lay.W_JAC + 2] + node[:, lay.W_JAC + 2]).max() < 5.0 * ACCURACY * surface.size
    assert np.abs(back[:, lay.W_RMIN] - 1.0).max() < 2.0  # over |s|: near 1 for short arcs, not near -1


def test_a_crease_of_high_order_is_crossed() -> None:
    """Where derivatives of fourth order are infinite steps get short, and ten times the error is left."""
    node = followed(
        random_rows(ImplicitSurface(creased, (0.06, 0.05, 0.04)), CASES, np.random.default_rng(9))
    )
    back = node.copy()
    back[:, lay.S_P : lay.S_P + 3] = node[:, lay.W_Q : lay.W_Q + 3]
    back[:, lay.S_T : lay.S_T + 3] = node[:, lay.W_TQ : lay.W_TQ + 3]
    back[:, lay.S_ARC] *= -1.0
    followed(back)
    crossed = node[:, lay.W_P : lay.W_P + 2] * node[:, lay.W_Q : lay.W_Q + 2] < 0.0
    assert crossed.any(axis=1).sum() > 5
    assert (
        np.abs(back[:, lay.W_Q : lay.W_Q + 3] - node[:, lay.W_P : lay.W_P + 3]).max() < 10.0 * ACCURACY * 0.05
    )


def test_no_arc_is_its_own_end(surface: CustomSurface) -> None:
    node = random_rows(surface, 1, np.random.default_rng(10))
    node[0, lay.S_ARC] = 0.0
    at = followed(node)[0]
    assert np.array_equal(triple(at, lay.W_P), triple(at, lay.W_Q))
    assert at[lay.W_JAC : lay.W_JAC + 4].tolist() == [1.0, 0.0, 0.0, 1.0]
    assert at[lay.W_RMIN] == 1.0
    assert at[lay.W_KMIN] == at[lay.W_KP]


def test_a_hollow_between_convex_ends_is_noticed() -> None:
    """Along a tube over its waist: a string would bridge it. The profile's curvature there is 0.006 * 60**2 = 21.6."""
    node = random_rows(MAKERS["waist"](), 1, np.random.default_rng(11))
    node[0, lay.S_P : lay.S_P + 3] = 0.0, -0.004, 0.025 + 0.006 * math.cos(0.24)
    slope = 0.36 * math.sin(0.24)
    node[0, lay.S_T : lay.S_T + 3] = np.array([0.0, 1.0, slope]) / math.hypot(1.0, slope)
    for arc, least in ((0.008, 15.0), (0.13, -21.6)):
        node[0, lay.S_ARC] = arc
        at = followed(node)[0]
        assert at[lay.W_KP] > 0.0
        assert at[lay.W_KQ] > 0.0
        assert abs(at[lay.W_Q]) < 1e-14  # by symmetry
        assert at[lay.W_KMIN] > least if least > 0.0 else at[lay.W_KMIN] < 0.7 * least
        assert at[lay.W_KMIN] > -22.0


def test_a_conjugate_point_is_noticed() -> None:
    node = random_rows(ImplicitSurface(sphere, 0.04), 1, np.random.default_rng(12))
    for turn, passed in ((0.9, False), (1.1, True)):
        node[0, lay.S_ARC] = turn * math.pi * RADIUS
        assert (followed(node)[0, lay.W_RMIN] < 0.0) == passed


@pytest.mark.parametrize(
    "make", [lambda: MAKERS["parametric cylinder"](), lambda: ImplicitSurface(cylinder, (0.04, 0.04, 0.2))]
)
def test_leaving_the_range_of_validity_is_noticed(make: Callable[[], CustomSurface]) -> None:
    node = random_rows(make(), 1, np.random.default_rng(13))
    node[0, lay.S_P : lay.S_P + 3] = RADIUS, 0.0, 0.19
    node[0, lay.S_T : lay.S_T + 3] = 0.0, 0.6, 0.8
    for arc, left in ((0.01, False), (0.02, True), (-0.2, False)):
        node[0, lay.S_ARC] = arc
        user_surface.custom_geodesic(0, node)
        assert node[0, lay.W_ANGLE] == float(left)
        assert node[0, lay.W_Q + 2] == pytest.approx(0.19 + 0.8 * arc, abs=1e-14)  # found all the same


def test_a_geodesic_that_never_ends_is_given_up() -> None:
    node = random_rows(MAKERS["bean"](), 1, np.random.default_rng(14))
    node[0, lay.S_ARC] = 1e6
    assert not np.isfinite(followed(node)[0, lay.W_Q])


# ------------------------------------------------------------------------------------------- agreement


def built_in(surface: mw.Sphere | mw.Cylinder | mw.Ellipsoid | mw.Torus, node: Array) -> Array:
    """Return rows for a built-in surface with the same geodesics."""
    node = node.copy()
    node[:, lay.KIND] = surface.kind
    node[:, lay.DIM : lay.DIM + len(surface.dims)] = surface.dims
    for k in range(len(node)):
        geodesics.geodesic(k, node, 0.0, 0.0, 0.0)
    return node


def same(one: Array, other: Array, size: float) -> None:
    points = slice(lay.W_P, lay.W_Q + 3), size
    turns = slice(lay.W_TP, lay.W_NQ + 3), 1.0
    curvatures = slice(lay.W_KP, lay.W_KQ + 3), 1.0 / size
    for part, scale in (points, turns, curvatures):
        assert np.abs(one[:, part] - other[:, part]).max() < 2.0 * ACCURACY * scale
    for i, scale in enumerate((1.0, 1.0 / size, size, 1.0)):
        assert np.abs(one[:, lay.W_JAC + i] - other[:, lay.W_JAC + i]).max() < 2.0 * ACCURACY * scale


BUILT_IN = {
    "sphere": (lambda: ImplicitSurface(sphere, 0.04), mw.Sphere(RADIUS)),
    "cylinder": (lambda: ImplicitSurface(cylinder, (0.04, 0.04, 0.3)), mw.Cylinder(RADIUS)),
    "rolled cylinder": (MAKERS["parametric cylinder"], mw.Cylinder(RADIUS)),
    "ellipsoid": (MAKERS["implicit ellipsoid"], mw.Ellipsoid(RADII)),
    "torus": (MAKERS["parametric torus"], mw.Torus(RING, TUBE)),
    "torus by hand": (MAKERS["parametric torus by hand"], mw.Torus(RING, TUBE)),
    "implicit torus": (MAKERS["implicit torus"], mw.Torus(RING, TUBE)),
}


@pytest.mark.parametrize("name", BUILT_IN)
def test_geodesics_are_those_of_the_built_in_surface(name: str) -> None:
    make, other = BUILT_IN[name]
    node = followed(random_rows(make(), 100, np.random.default_rng(15)))
    same(node, built_in(other, node), other.size)


def test_chart_and_level_set_of_one_ellipsoid_agree() -> None:
    chart = ParametricSurface(charted_ellipsoid, (0.0, math.tau), (-1.3, 1.3))
    node = random_rows(ImplicitSurface(ellipsoid, (0.06, 0.04, 0.03)), 300, np.random.default_rng(16))
    other = place(chart, node.copy())
    followed(other)
    within = [k for k in range(len(node)) if other[k, lay.W_ANGLE] == 0.0]
    assert len(within) > 150
    same(followed(node)[within], other[within], min(RADII))


@pytest.mark.parametrize("name", ["ellipsoid", "rolled cylinder", "torus", "implicit torus"])
def test_paths_are_those_of_the_built_in_surface(name: str) -> None:
    make, other = BUILT_IN[name]
    rng = np.random.default_rng(17)
    for _ in range(20):
        side = rng.normal(size=3)
        side *= 0.12 / np.linalg.norm(side)
        origin, insertion, quat = (
            side + rng.normal(size=3) * 0.01,
            rng.normal(size=3) * 0.01 - side,
            rng.normal(size=4),
        )
        paths = [
            mw.solve_path(origin, insertion, [mw.Obstacle(s, quat=tuple(quat))]) for s in (make(), other)
        ]
        if all(path.converged for path in paths):
            assert paths[0].length == pytest.approx(paths[1].length, rel=1e-12)


def test_sine_and_cosine_for_vector_lanes() -> None:
    rng = np.random.default_rng(18)
    quarters = np.arange(-40, 41) * (0.25 * math.pi)
    for x in [*quarters, *rng.uniform(-10.0, 10.0, 2000), *rng.uniform(-1e5, 1e5, 2000)]:
        assert abs(sine(x) - math.sin(x)) < 2.3e-16
        assert abs(cosine(x) - math.cos(x)) < 2.3e-16
    assert math.isnan(sine(math.inf))


def test_the_functions_of_the_shapes_say_the_same() -> None:
    """The charts of the test lie on its level sets: what the comparisons above rest on."""
    for u, v in np.random.default_rng(19).uniform(0.0, math.tau, (50, 2)):
        assert ring(*torus(u, v)) == pytest.approx(0.0, abs=1e-16)
        assert ellipsoid(*charted_ellipsoid(u, v)) == pytest.approx(0.0, abs=1e-14)
        assert cylinder(*rolled(u, v)) == pytest.approx(0.0, abs=1e-16)
