"""The judge of paths, tried where the truth is known: geodesics built by hand, and each of them spoilt in one way."""

from typing import NamedTuple

import numpy as np
import pytest

from mjwrap.comparison.judge_geodesic import Fault, Judgement, closed_form_length, judge, judge_held
from mjwrap.verification.scenes import rotation

Array = np.ndarray


class Path(NamedTuple):
    """A path over one surface, in its frame: ends, contact points, arc, turn about a cylinder's axis."""

    cylinder: bool
    radius: float
    a: Array
    b: Array
    p: Array
    q: Array
    arc: float
    turn: float

    def judged(self, touched: bool = True) -> Judgement:
        a, b, p, q = (x[None] for x in (self.a, self.b, self.p, self.q))
        return judge(self.cylinder, self.radius, a, b, np.array([touched]), p, q)

    @property
    def length(self) -> float:
        return float(np.linalg.norm(self.p - self.a) + self.arc + np.linalg.norm(self.b - self.q))


def built(cylinder: bool, rng: np.random.Generator, angle: float | None = None) -> Path:
    """Return a true geodesic: a helix or great circle, and straight ends along its tangents."""
    radius, (l1, l2) = rng.uniform(0.01, 0.1), rng.uniform(0.01, 0.3, 2)
    start = rng.uniform(-np.pi, np.pi)
    if cylinder:
        slope, sense = rng.uniform(-1.2, 1.2), rng.choice([-1.0, 1.0])
        reach = np.arctan(l1 * np.cos(slope) / radius) + np.arctan(l2 * np.cos(slope) / radius)
        turned = rng.uniform(0.01, 2 * np.pi - 0.01) if angle is None else angle

        def place(phi: float) -> tuple[Array, Array]:
            round_axis = np.array([-np.sin(phi), np.cos(phi), 0.0]) * sense
            normal = np.array([np.cos(phi), np.sin(phi), 0.0])
            return normal, np.cos(slope) * round_axis + np.sin(slope) * np.array([0.0, 0.0, 1.0])

        n_p, t_p = place(start)
        n_q, t_q = place(start + sense * turned)
        arc = radius * turned / np.cos(slope)
        p, q = radius * n_p, radius * n_q + np.array([0.0, 0.0, arc * np.sin(slope)])
        return Path(True, radius, p - l1 * t_p, q + l2 * t_q, p, q, arc, sense * (turned + reach))
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    n, t = frame[:, 0], frame[:, 1]
    rest = np.pi - np.arctan(l1 / radius) - np.arctan(l2 / radius)  # beyond it a shorter way exists
    turned = rng.uniform(0.01, 0.98) * rest if angle is None else angle
    n_q, t_q = np.cos(turned) * n + np.sin(turned) * t, np.cos(turned) * t - np.sin(turned) * n
    return Path(
        False,
        radius,
        radius * n - l1 * t,
        radius * n_q + l2 * t_q,
        radius * n,
        radius * n_q,
        radius * turned,
        0.0,
    )


kinds = pytest.mark.parametrize("cylinder", [True, False], ids=["cylinder", "sphere"])


@kinds
def test_a_true_geodesic_is_found_true(cylinder: bool) -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        path = built(cylinder, rng)
        found = path.judged()
        assert found.fault[0] == Fault.NONE
        assert found.arc[0] == pytest.approx(path.arc, rel=1e-9)
        assert found.turn[0] == pytest.approx(path.turn, rel=1e-9)
        back = path._replace(a=path.b, b=path.a, p=path.q, q=path.p).judged()
        assert back.fault[0] == Fault.NONE
        assert back.turn[0] == pytest.approx(-path.turn, rel=1e-9)
        assert back.middle[0] == pytest.approx(
            found.middle[0] * ([1, 1, 0] if cylinder else [1, 1, 1]), abs=1e-9
        )


@kinds
def test_the_closed_form_has_the_length_of_a_true_geodesic(cylinder: bool) -> None:
    rng = np.random.default_rng(2)
    for _ in range(200):
        path = built(cylinder, rng)
        if abs(path.turn) < 2 * np.pi:
            found = closed_form_length(
                cylinder, path.radius, path.a[None], path.b[None], int(np.sign(path.turn) or 1)
            )
            assert found[0] == pytest.approx(path.length, rel=1e-12)


@kinds
def test_each_way_to_spoil_a_path_is_named(cylinder: bool) -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        path = built(cylinder, rng, angle=rng.uniform(0.3, 0.6)) if cylinder else built(cylinder, rng)
        radius, size = path.radius, 1e-7 * path.radius
        outward = path.p * ([1, 1, 0] if cylinder else [1, 1, 1]) / radius
        tangent = (path.p - path.a) / np.linalg.norm(path.p - path.a)
        across = np.cross(tangent, outward)
        spoilt = {
            Fault.CORNER: path._replace(a=path.a + 1e-6 * np.linalg.norm(path.p - path.a) * outward),
            Fault.OFF_SURFACE: path._replace(p=path.p + size * outward),
            Fault.NON_FINITE: path._replace(b=path.b * np.nan),
        }
        for fault, bad in spoilt.items():
            assert bad.judged().fault[0] == fault
        # sideways: the path meets the surface tangentially, but what lies on the surface is no geodesic
        sideways = path._replace(a=path.a + 1e-4 * np.linalg.norm(path.p - path.a) * across)
        assert sideways.judged().fault[0] in (Fault.NOT_GEODESIC, Fault.CORNER)


@kinds
def test_straight_paths_pass_clear_or_through(cylinder: bool) -> None:
    rng = np.random.default_rng(4)
    for _ in range(100):
        path = built(cylinder, rng, angle=0.2 if cylinder else None)
        found = path.judged(touched=False)
        assert found.fault[0] == Fault.THROUGH
        chord = path.b - path.a
        assert found.middle[0] @ chord * (not cylinder) == pytest.approx(0.0, abs=1e-12)
        depth = path.radius - np.linalg.norm(found.middle[0])
        assert found.measure[0] == pytest.approx(depth, abs=1e-12)
        lift = found.middle[0] / np.linalg.norm(found.middle[0]) * (depth + 1e-6)
        clear = path._replace(a=path.a + lift, b=path.b + lift).judged(touched=False)
        assert clear.fault[0] == Fault.NONE
        barely = path._replace(a=path.a + 0.999 * lift, b=path.b + 0.999 * lift).judged(touched=False)
        assert (barely.fault[0] == Fault.THROUGH) == (0.001 * (depth + 1e-6) > 1e-6)


@kinds
def test_an_end_point_inside_has_no_path(cylinder: bool) -> None:
    path = built(cylinder, np.random.default_rng(5))
    inside = path._replace(a=0.5 * path.p)
    for touched in (True, False):
        found = inside.judged(touched)
        assert found.fault[0] == Fault.ENDPOINT_INSIDE
        assert found.measure[0] > 0.4 * path.radius if not cylinder else found.measure[0] > 0.0


def test_the_long_way_round_a_sphere_is_a_saddle() -> None:
    """It is tangential and geodesic; only a look at its neighbours tells that a string would slip off."""
    rng = np.random.default_rng(6)
    for _ in range(100):
        short = built(False, rng)
        radius, l1 = short.radius, float(np.linalg.norm(short.p - short.a))
        l2 = float(np.linalg.norm(short.b - short.q))
        rest = np.pi - np.arctan(l1 / radius) - np.arctan(l2 / radius)
        n, t = short.p / radius, (short.p - short.a) / l1
        turned = rest + rng.uniform(0.01, 0.5)
        n_q, t_q = np.cos(turned) * n + np.sin(turned) * t, np.cos(turned) * t - np.sin(turned) * n
        long = short._replace(q=radius * n_q, b=radius * n_q + l2 * t_q, arc=radius * turned)
        found = long.judged()
        assert found.fault[0] == Fault.LONG_WAY
        # turn the plane of the path a little about the line through its ends: it gets shorter
        assert closed_form_length(False, radius, long.a[None], long.b[None])[0] < long.length


def test_a_path_inside_a_surface_has_one_contact_point_and_a_corner() -> None:
    a, b, touch = np.array([0.005, 0.0, 0.1]), np.array([0.005, 0.0, -0.1]), np.array([0.02, 0.0, 0.0])
    found = Path(True, 0.02, a, b, touch, touch, 0.0, 0.0).judged()
    assert found.fault[0] == Fault.INSIDE


@pytest.mark.parametrize("cylinder", [True, False])
def test_a_held_path_is_right_only_where_it_is_shortest(cylinder: bool) -> None:
    """Reflected at the surface by construction; then each way of spoiling it is told from the others."""
    rng = np.random.default_rng(9)
    for _ in range(100):
        radius, angle = rng.uniform(0.01, 0.1), rng.uniform(-3, 3)
        n = np.array([np.cos(angle), np.sin(angle), 0.0])
        along = np.array([-n[1], n[0], rng.uniform(-1, 1)])
        depth = rng.uniform(0.1, 2.0)
        p = radius * n + (np.array([0.0, 0.0, 0.3]) if cylinder else 0.0)
        if not cylinder:
            turn = rotation(rng.normal(size=4))
            n, along, p = turn @ n, turn @ along, turn @ p
        a, b = (
            p + rng.uniform(0.05, 0.3) * (depth * n - along),
            p + rng.uniform(0.05, 0.3) * (depth * n + along),
        )
        yes, no = np.array([True]), np.array([False])

        def fault(a: Array, b: Array, touched: Array, p: Array, q: Array, radius: float = radius) -> Fault:
            return Fault(
                int(judge_held(cylinder, radius, a[None], b[None], touched, p[None], q[None]).fault[0])
            )

        assert fault(a, b, yes, p, p) == Fault.NONE
        assert fault(a, b, no, p, p) == Fault.BESIDE
        assert fault(a, b, yes, (1 + 1e-6) * p, (1 + 1e-6) * p) == Fault.OFF_SURFACE
        assert fault(a, b, yes, p, p + 1e-6) == Fault.OFF_SURFACE
        assert fault(a, b + 1e-6 * along, yes, p, p) == Fault.UNEVEN
        assert fault(a, b + 1e-6 * n, yes, p, p) == Fault.UNEVEN
        assert fault(2 * p - a, 2 * p - b, yes, p, p) == Fault.UNEVEN  # from within
        assert fault(a, 0.5 * p, no, p, p) == Fault.NONE  # an end inside


def test_turn_tells_windings_apart() -> None:
    """From the same end points: straight, once round, and the other way round."""
    a, b, radius = np.array([[0.05, 0.04, 0.0]]), np.array([[-0.05, 0.04, 0.0]]), 0.02
    none = np.array([False])
    straight = judge(True, radius, a, b, none, a, a).turn[0]
    assert straight == pytest.approx(2 * np.arctan2(0.05, 0.04))
    under = closed_form_length(True, radius, a, b, -1)[0]
    assert under > closed_form_length(True, radius, a, b, 1)[0] == pytest.approx(0.1)
    # contact points of the way below the axis, by symmetry
    reach = np.hypot(0.05, 0.04)
    angle = np.arctan2(0.04, 0.05) - np.arccos(radius / reach)
    p = np.array([[radius * np.cos(angle), radius * np.sin(angle), 0.0]])
    found = judge(True, radius, a, b, ~none, p, p * [[-1.0, 1.0, 1.0]])
    assert found.fault[0] == Fault.NONE
    assert straight - found.turn[0] == pytest.approx(2 * np.pi)
