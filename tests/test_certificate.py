"""The judge of paths is judged: it accepts paths made from geodesics and names every way to be wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mjwrap as mw
from mjwrap.surfaces import Surface
from mjwrap.verification.arcs import arcs_of, slow_arc
from mjwrap.verification.certificate import Case, findings, grouped, laid_out, stiffness
from mjwrap.verification.perturbation import lowest, stiffness_by_differences
from mjwrap.verification.scenes import random_surface
from mjwrap.verification.shapes import SHAPES, Array, Shape, dot, sizes, unit

LETTERS = "cselktp"
NAMES = {
    "c": "cylinder",
    "s": "sphere",
    "e": "ellipsoid",
    "l": "elliptic cylinder",
    "k": "cone",
    "t": "torus",
    "p": "capsule",
}
CASES = 20  # of each kind in a test


@pytest.fixture(params=LETTERS, ids=[NAMES[letter] for letter in LETTERS])
def letter(request: pytest.FixtureRequest) -> str:
    return request.param


def points_on(rng: np.random.Generator, surface: Surface, count: int) -> tuple[Shape, Array, Array]:
    """Return a surface's shape, its sizes, and random points of it, within its ends."""
    shape, d = SHAPES[type(surface)], sizes(surface)
    start = rng.normal(size=(count, 3)) * 0.05
    start[:, 2] = np.clip(start[:, 2], -0.04, 0.04)
    return shape, d, shape.nearest(d, shape.nearest(d, start))


def sideways(n: Array, rng: np.random.Generator) -> Array:
    """Return random unit tangents to unit normals."""
    side: Array = np.cross(n, rng.normal(size=n.shape))
    return unit(side)


def grazing(rng: np.random.Generator, letter: str, turn: float = 0.6) -> Case:
    """Return a path made from a geodesic, its ends on the tangents.

    The geodesic turns by `turn` at most, counted with the largest curvature of the surface, and the straight ends
    are short enough to hold it: 1/L of each exceeds what the geodesic's own curvature K s could take away.
    """
    while True:
        surface = random_surface(rng, letter)
        shape, d, points = points_on(rng, surface, 1)
        n = shape.normal(d, points)[0]
        t = sideways(n, rng)
        if shape.bending(d, points[0], t) < 5.0:  # nearly along a cylinder, or in a hollow
            continue
        most = float(shape.bend(d))
        s = rng.uniform(0.3, 1.0) * turn / most
        arcs = arcs_of(shape, d[None], points, t[None], np.array([s]))
        if arcs.bending[0] < 1.0 or arcs.reach[0] > 0.07:
            continue
        quat = rng.normal(size=4)
        quat /= np.linalg.norm(quat)
        lengths = rng.uniform(0.2, 0.5, 2) / (most * turn)
        return path_along(surface, tuple(quat), tuple(rng.normal(size=3) * 0.1), points[0], t, s, lengths)


def path_along(
    surface: Surface,
    quat: tuple[float, ...],
    pos: tuple[float, ...],
    P: Array,
    t: Array,
    s: float,
    lengths: Array,
) -> Case:
    """Return the path whose geodesic leaves P along t over s (in the surface's frame), with straight ends."""
    obstacle = mw.Obstacle(surface, pos, quat)
    Q, far, _ = slow_arc(surface, P, t, s) if s > 0.0 else (P, t, None)
    far = unit(far)
    turn = _matrix(quat)
    first, last = turn @ P + pos, turn @ Q + pos
    origin, insertion = first - lengths[0] * (turn @ t), last + lengths[1] * (turn @ far)
    return Case(origin, insertion, [obstacle], [[(first, last, s)]], float(lengths.sum() + s))


def _matrix(quat: tuple[float, ...]) -> Array:
    """Return the rotation of a quaternion by turning the axes with it: q v q*."""
    w, v = quat[0], np.array(quat[1:])
    return np.stack([e + 2.0 * np.cross(v, np.cross(v, e) + w * e) for e in np.eye(3)], 1)


def touch(case: Case) -> tuple[Array, Array, float]:
    return case.contacts[0][0]


def reason(case: Case) -> str:
    return findings([case])[0]


# ------------------------------------------------------------------------------------------ geometry


def test_normals_and_shape_operators_are_derivatives(letter: str) -> None:
    """Height falls off along the normal, and the normal turns as W says: differences of second order."""
    rng = np.random.default_rng(1)
    for _ in range(CASES):
        surface = random_surface(rng, letter)
        shape, d, P = points_on(rng, surface, 10)
        assert np.abs(shape.height(d, P)).max() < 1e-15
        n = shape.normal(d, P)
        h = 1e-6
        slope = np.stack(
            [(shape.height(d, P + h * e) - shape.height(d, P - h * e)) / (2 * h) for e in np.eye(3)], -1
        )
        rough = (h * float(shape.bend(d))) ** 2
        assert slope == pytest.approx(n, abs=1e-9 + rough)  # rounding of 0.1 m over h, then order two
        turned = np.stack(
            [(shape.normal(d, P + h * e) - shape.normal(d, P - h * e)) / (2 * h) for e in np.eye(3)], -1
        )
        flat = np.eye(3) - n[..., :, None] * n[..., None, :]
        W = shape.shape_operator(d, P)
        size = np.abs(W).max()
        if not isinstance(surface, mw.Capsule):  # across a seam its curvature jumps
            assert flat @ turned @ flat == pytest.approx(W, abs=1e-5 * size)
        t = sideways(n, rng)
        assert shape.bending(d, P, t) == pytest.approx(np.einsum("ki,kij,kj->k", t, W, t), abs=1e-12 * size)
        principal = np.linalg.eigvalsh(W + 1e6 * n[..., :, None] * n[..., None, :])[:, :2]
        assert shape.gauss(d, P) == pytest.approx(principal.prod(1), abs=1e-8 * size**2)


def test_the_nearest_point_lies_along_the_normal(letter: str) -> None:
    rng = np.random.default_rng(2)
    for _ in range(CASES):
        surface = random_surface(rng, letter)
        shape, d, P = points_on(rng, surface, 20)
        farthest = (
            0.05 if shape.convex else 0.5 / shape.bend(d)
        )  # in a torus' hole the other side comes nearer
        outside = P + rng.uniform(0.0, farthest, (20, 1)) * shape.normal(d, P)
        nearest = shape.nearest(d, outside)
        offset = outside - nearest
        size = shape.height(d, outside)
        assert np.linalg.norm(offset, axis=1) == pytest.approx(size, abs=1e-15)
        assert offset == pytest.approx(size[:, None] * shape.normal(d, nearest), abs=1e-12)
        level = shape.level(d, outside)
        assert ((level >= -1e-15) & (level <= size + 1e-15)).all()


def test_geodesics_agree_with_a_slow_integration(letter: str) -> None:
    """Closed forms and collocation against SciPy's DOP853 at a tolerance of 1e-13."""
    rng = np.random.default_rng(3)
    for _ in range(CASES // 2):
        surface = random_surface(rng, letter)
        shape, d, P = points_on(rng, surface, 3)
        t = sideways(shape.normal(d, P), rng)
        s = rng.uniform(0.0, 4.0, 3) / shape.bend(d)
        arcs = arcs_of(shape, np.repeat(d[None], 3, axis=0), P, t, s)
        for k in range(3):
            Q, far, jacobi = slow_arc(surface, P[k], t[k], s[k])
            # a few hundred steps at 1e-13, and beside a capsule's seams one of 1e-12 m without error control
            assert arcs.Q[k] == pytest.approx(Q, abs=2e-11)
            assert arcs.t[k] == pytest.approx(far, abs=1e-9)
            assert arcs.jacobi[k] * [1, 0.01, 100, 1] == pytest.approx(jacobi * [1, 0.01, 100, 1], abs=1e-8)
        assert np.abs(shape.height(d, arcs.Q)).max() < 1e-12
        assert dot(arcs.t, arcs.t) == pytest.approx(np.ones(3), abs=1e-11)


# ------------------------------------------------------------------------------------------- verdicts


def test_a_path_made_from_a_geodesic_stands(letter: str) -> None:
    rng = np.random.default_rng(4)
    cases = [grazing(rng, letter) for _ in range(CASES)]
    assert findings(cases) == [""] * CASES


def test_a_path_that_begins_beside_its_surface_stands(letter: str) -> None:
    """The direction of its first segment is known to no more than its rounding: 1e-3 rad of 1e-12 m.

    A bend where the arc is left, or an arc that ends elsewhere, is found all the same.
    """
    rng = np.random.default_rng(19)
    for first in (1e-9, 1e-10, 1e-12):
        for _ in range(CASES):
            case = grazing(rng, letter)
            P, Q, s = touch(case)
            near = replace(case, origin=P + first * unit(case.origin - P))
            assert reason(moved(near, (P, Q, s))) == ""
            assert reason(moved(near, (P, Q, s * (1.0 + 1e-5)))).startswith("no geodesic")
            aside = np.cross(case.insertion - Q, rng.normal(size=3))
            bent = replace(near, insertion=case.insertion + 1e-3 * aside)
            assert reason(moved(bent, (P, Q, s))).startswith(("no geodesic", "not tangent"))


def test_a_folded_path_is_refuted(letter: str) -> None:
    """The string arrives from the other side and turns back: tangent, but against its own direction."""
    rng = np.random.default_rng(5)
    for _ in range(CASES):
        case = grazing(rng, letter)
        P = touch(case)[0]
        assert reason(replace(case, origin=2.0 * P - case.origin)).startswith("folded")


def test_wrong_figures_are_refuted(letter: str) -> None:
    rng = np.random.default_rng(6)
    for _ in range(CASES):
        case = grazing(rng, letter)
        P, Q, s = touch(case)
        n = Q - P + rng.normal(size=3)
        off = 1e-9 * n / np.linalg.norm(n)
        assert reason(replace(case, length=case.length * (1.0 + 1e-9))).startswith("length")
        assert reason(replace(case, length=np.nan)) == "not finite"
        assert (
            reason(replace(case, contacts=[[(P, Q, -s)]], length=case.length - 2 * s))
            == "negative arc length"
        )
        assert reason(moved(case, (P, Q, s * (1.0 + 1e-5)))).startswith("no geodesic")
        assert reason(moved(case, (P + off, Q + off, s))).startswith(("off surface", "no geodesic"))


def moved(case: Case, contact: tuple[Array, Array, float]) -> Case:
    """Return a case with another contact, its length made to fit."""
    P, Q, s = contact
    length = np.linalg.norm(P - case.origin) + s + np.linalg.norm(case.insertion - Q)
    return replace(case, contacts=[[contact]], length=float(length))


def test_a_kink_is_refuted(letter: str) -> None:
    """The string leaves Q, or meets P, 1e-6 rad off the geodesic's tangent, along the surface."""
    rng = np.random.default_rng(7)
    for _ in range(CASES):
        case = grazing(rng, letter)
        P, Q, s = touch(case)
        touches, _, _ = laid_out(0, case)
        grouped([case], touches)
        side = np.cross(touches[0].tangents[1], touches[0].normals[1])
        bent = replace(case, insertion=case.insertion + 1e-6 * np.linalg.norm(case.insertion - Q) * side)
        assert reason(moved(bent, (P, Q, s))).startswith("not tangent")
        up = touches[0].normals[0]
        bent = replace(case, origin=case.origin + 1e-6 * np.linalg.norm(case.origin - P) * up)
        assert reason(moved(bent, (P, Q, s))).startswith("not tangent")


def test_an_entered_surface_is_refuted(letter: str) -> None:
    """The straight segment from end to end passes below the surface; the answer says that it does not touch."""
    rng = np.random.default_rng(8)
    for _ in range(CASES):
        case = grazing(rng, letter)
        straight = float(np.linalg.norm(case.insertion - case.origin))
        assert reason(replace(case, contacts=[[]], length=straight)).startswith("penetrating")


@pytest.mark.parametrize("letter", ["c", "s", "p"])
def test_the_long_way_round_is_refuted(letter: str) -> None:
    """The same ends of the same geodesic, but the arc that is claimed is the rest of the closed circle."""
    rng = np.random.default_rng(9)
    for _ in range(CASES):
        radius = rng.uniform(0.01, 0.04)
        surface = {"c": mw.Cylinder(radius), "s": mw.Sphere(radius), "p": mw.Capsule(radius, 0.02)}[letter]
        angle = rng.uniform(0.2, 0.8)
        P, t = np.array([radius, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
        case = path_along(
            surface, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), P, t, radius * angle, np.full(2, 0.02)
        )
        assert reason(case) == ""
        first, last, s = touch(case)
        assert reason(moved(case, (first, last, 2 * np.pi * radius - s))).startswith("folded")


def test_paths_that_are_not_minimal_are_refuted() -> None:
    """A string over the wrong side of a sphere, past its pole, and over the long axis of an ellipsoid slips off."""
    upright, centre = (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    along = np.array([0.0, 1.0, 0.0])
    rng = np.random.default_rng(10)
    for _ in range(CASES):
        radius = rng.uniform(0.01, 0.04)
        P = np.array([radius, 0.0, 0.0])
        angle = rng.uniform(1.0, 1.1) * np.pi
        past = path_along(mw.Sphere(radius), upright, centre, P, along, angle * radius, np.full(2, 0.03))
        assert reason(past).startswith("not minimal: conjugate point")
        # shorter than half a circle, but the centre lies on the far side of the chord of the ends
        over = path_along(
            mw.Sphere(radius), upright, centre, P, along, 0.9 * np.pi * radius, np.full(2, 3 * radius)
        )
        assert reason(over).startswith("not minimal: stiffness")
        long = rng.uniform(2.0, 3.0) * radius
        ends = np.full(2, 0.15)
        tip, s = np.array([long, 0.0, 0.0]), 0.3 * radius
        far, heading, _ = slow_arc(mw.Ellipsoid((long, radius, radius)), tip, -along, s)
        ridge = path_along(mw.Ellipsoid((long, radius, radius)), upright, centre, far, -heading, 2 * s, ends)
        assert reason(ridge).startswith("not minimal: stiffness")


def test_a_string_that_would_lift_off_is_refuted() -> None:
    """On the inner equator of a torus the surface bends away from the string: a geodesic, but no string lies on it."""
    surface = mw.Torus(0.05, 0.02)
    P, t = np.array([0.03, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    case = path_along(surface, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), P, t, 0.02, np.full(2, 1e-4))
    assert reason(case).startswith("lifts off")


def test_a_segment_that_enters_the_surface_it_has_left_is_refuted() -> None:
    """Over the near side of a lying torus and down into its hole: the string runs into the far side."""
    surface = mw.Torus(0.05, 0.01)
    P, t = np.array([-0.05, 0.0, 0.01]), np.array([1.0, 0.0, 0.0])
    case = path_along(surface, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), P, t, 0.002, np.array([0.03, 0.15]))
    assert reason(case).startswith("penetrating")
    Q = touch(case)[1]
    short = replace(case, insertion=Q + (case.insertion - Q) * 0.3)  # it ends inside the hole
    assert reason(moved(short, touch(case))) == ""


def test_a_contact_beyond_the_end_is_refuted() -> None:
    rng = np.random.default_rng(11)
    for surface in (
        mw.Cylinder(0.02, 0.05),
        mw.EllipticCylinder((0.02, 0.03), 0.05),
        mw.Cone(0.03, 0.01, 0.05),
    ):
        for z in (-0.06, 0.06):
            shape, d = SHAPES[type(surface)], sizes(surface)
            P = shape.nearest(d, np.array([[0.0, 0.03, z]]))[0]
            t = unit(np.array([1.0, 0.0, 0.0]))
            case = path_along(
                surface, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), P, t, 0.005, rng.uniform(0.01, 0.02, 2)
            )
            assert reason(case).startswith("beyond the end")


def test_every_case_of_a_batch_has_its_own_verdict() -> None:
    rng = np.random.default_rng(12)
    good = [grazing(rng, letter) for letter in LETTERS]
    mixed = [
        case
        for pair in zip(good, [replace(x, length=0.9 * x.length) for x in good], strict=True)
        for case in pair
    ]
    assert [bool(word) for word in findings(mixed)] == [False, True] * len(good)
    straight = Case(np.zeros(3), np.ones(3), [], [], float(np.sqrt(3.0)))
    assert findings([straight, replace(straight, length=1.8)])[0] == ""
    assert findings([]) == []


# ----------------------------------------------------------------------------------- second variation


def test_the_stiffness_is_the_second_derivative_of_length(letter: str) -> None:
    """Jacobi fields and segments against lengths measured between points that are shifted sideways."""
    rng = np.random.default_rng(13)
    for _ in range(5):
        case = grazing(rng, letter, turn=1.2)
        touches, _, _ = laid_out(0, case)
        grouped([case], touches)
        a, _, r, _ = touches[0].jacobi
        over = np.array([[1.0, 0.0], [a, r / touches[0].s]])  # shifts of P and Q from (x, w)
        inverse = np.linalg.inv(over)
        H = inverse.T @ stiffness(touches) @ inverse
        shaken = stiffness_by_differences(case)
        assert shaken == pytest.approx(H, abs=1e-3 * np.abs(H).max())
        assert lowest(shaken) == pytest.approx(lowest(H), abs=1e-3)
