"""Laws that every surface's geodesic, Darboux frame and Jacobi fields obey, by finite differences of second order."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import mjwrap as mw
from mjwrap.kernels import layout as lay
from mjwrap.kernels.geometry import geodesics
from mjwrap.kernels.geometry.dispatch import height, project
from mjwrap.surfaces import Surface
from mjwrap.surfaces.rows import write_surface

Array = NDArray[np.float64]
Variation = tuple[float, float, float, float]
CASES = 50


def _ellipsoid(rng: np.random.Generator) -> Surface:
    return mw.Ellipsoid(tuple(rng.uniform(0.02, 0.06, 3)))


def _torus(rng: np.random.Generator) -> Surface:
    major = rng.uniform(0.03, 0.08)
    return mw.Torus(major, major * rng.uniform(0.2, 0.7))


def _cone(rng: np.random.Generator) -> Surface:
    small, large = rng.uniform(0.02, 0.03), rng.uniform(0.035, 0.06)
    return mw.Cone(*((small, large) if rng.random() < 0.5 else (large, small)), rng.uniform(0.02, 0.06))


KINDS: dict[str, Callable[[np.random.Generator], Surface]] = {
    "cylinder": lambda rng: mw.Cylinder(rng.uniform(0.02, 0.06)),
    "sphere": lambda rng: mw.Sphere(rng.uniform(0.02, 0.06)),
    "ellipsoid": _ellipsoid,
    "elliptic cylinder": lambda rng: mw.EllipticCylinder(tuple(rng.uniform(0.02, 0.06, 2))),
    "torus": _torus,
    "cone": _cone,
    "capsule": lambda rng: mw.Capsule(rng.uniform(0.02, 0.06), rng.uniform(0.01, 0.06)),
}
OF_REVOLUTION = ["cylinder", "sphere", "torus", "cone", "capsule"]
ACCURACY = 1e-12  # promised for integrated geodesics and their fields, relative; closed forms are better


def row(make: Callable[[np.random.Generator], Surface], rng: np.random.Generator) -> Array:
    """Return a node with a random surface, pose and geodesic on it."""
    surface = make(rng)
    node = np.zeros((1, lay.ROW))
    write_surface(surface, node)
    node[0, lay.POS : lay.POS + 3] = rng.normal(size=3) * 0.1
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    node[0, lay.ROT : lay.ROT + 9] = turn.ravel()
    node[0, lay.S_P : lay.S_P + 3] = rng.normal(size=3) * 0.05
    if isinstance(surface, mw.Cone):
        node[0, lay.S_P + 2] = rng.uniform(-0.5, 0.5) * surface.half_length
    node[0, lay.S_T : lay.S_T + 3] = rng.normal(size=3)
    node[0, lay.S_ARC] = rng.uniform(0.2, 2.5) * node[0, lay.SIZE]
    geodesics.displace(0, 0.0, 0.0, 0.0, 0.0, node)
    return node


def variation(which: int, size: float) -> Variation:
    """Return the natural variation that moves one of the four ways only."""
    d = [0.0, 0.0, 0.0, 0.0]
    d[which] = size
    return d[0], d[1], d[2], d[3]


def evaluated(node: Array, d: Variation = (0.0, 0.0, 0.0, 0.0)) -> Array:
    """Return the evaluated row after a natural variation."""
    moved = node.copy()
    geodesics.displace(0, *d, moved)
    geodesics.geodesic(0, moved, 0.0, 0.0, 0.0)
    return moved[0]


def triple(values: Array, column: int) -> Array:
    return values[column : column + 3]


def second_order(quotient: Callable[[float], Array], exact: Array, scale: float) -> None:
    """Assert that a difference quotient tends to `exact`, its error falling with the square of the step."""
    coarse, fine = (np.abs(quotient(h) - exact).max() for h in (2e-3, 1e-3))
    assert coarse <= 0.05 * scale
    assert fine <= coarse / 3.5 + 1e-9 * scale  # 4 in the limit; rounding is 1e-16 / 1e-3


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> Callable[[np.random.Generator], Surface]:
    return KINDS[request.param]


def test_frames_are_orthonormal_on_the_surface(kind: Callable[[np.random.Generator], Surface]) -> None:
    rng = np.random.default_rng(1)
    for _ in range(CASES):
        node = row(kind, rng)
        at = evaluated(node)
        for t, n, b in ((lay.W_TP, lay.W_NP, lay.W_BP), (lay.W_TQ, lay.W_NQ, lay.W_BQ)):
            frame = np.array([triple(at, c) for c in (t, n, b)])
            assert np.abs(frame @ frame.T - np.eye(3)).max() < 1e-14
            assert np.linalg.det(frame) == pytest.approx(1.0, abs=1e-14)
        local = (triple(at, lay.W_Q) - triple(at, lay.POS)) @ at[lay.ROT : lay.ROT + 9].reshape(3, 3)
        nearest = np.array(project(node, 0, *local))
        assert np.abs(nearest[:3] - local).max() < 1e-15
        assert (
            np.abs(at[lay.ROT : lay.ROT + 9].reshape(3, 3) @ nearest[3:] - triple(at, lay.W_NQ)).max() < 1e-14
        )


def test_curve_is_a_unit_speed_geodesic(kind: Callable[[np.random.Generator], Surface]) -> None:
    """dQ/ds = t and dt/ds = -kappa n: no acceleration within the surface."""
    rng = np.random.default_rng(2)
    for _ in range(CASES):
        node = row(kind, rng)
        at, size = evaluated(node), node[0, lay.SIZE]

        def rate(column: int, h: float, node: Array = node, size: float = size) -> Array:
            step = h * size
            ahead, behind = (evaluated(node, (0, 0, 0, s * step)) for s in (1.0, -1.0))
            return (triple(ahead, column) - triple(behind, column)) / (2 * step)

        second_order(lambda h, f=rate: f(lay.W_Q, h), triple(at, lay.W_TQ), 1.0)
        second_order(lambda h, f=rate: f(lay.W_TQ, h), -at[lay.W_KQ] * triple(at, lay.W_NQ), 1.0 / size)


def test_normal_turns_with_the_shape_operator(kind: Callable[[np.random.Generator], Surface]) -> None:
    """dn along t is kappa t + tau b; the start shifted along b turns n_P by tau t + beta b."""
    rng = np.random.default_rng(3)
    for _ in range(CASES):
        node = row(kind, rng)
        at, size = evaluated(node), node[0, lay.SIZE]
        t, b = triple(at, lay.W_TP), triple(at, lay.W_BP)
        kappa, tau, beta = triple(at, lay.W_KP)

        def rate(which: int, h: float, node: Array = node, size: float = size) -> Array:
            ahead, behind = (evaluated(node, variation(which, sign * h * size)) for sign in (1.0, -1.0))
            return (triple(ahead, lay.W_NP) - triple(behind, lay.W_NP)) / (2 * h * size)

        second_order(lambda h, f=rate: f(0, h), kappa * t + tau * b, 1.0 / size)
        second_order(lambda h, f=rate: f(1, h), tau * t + beta * b, 1.0 / size)


def test_jacobi_fields_match_neighbouring_geodesics(kind: Callable[[np.random.Generator], Surface]) -> None:
    """Columns of dQ and db_Q in the natural variations (docs/derivation.md): shift carries a, turn carries r."""
    rng = np.random.default_rng(4)
    for _ in range(CASES):
        node = row(kind, rng)
        at, size = evaluated(node), node[0, lay.SIZE]
        a, da, r, dr = at[lay.W_JAC : lay.W_JAC + 4]
        t, n, b = (triple(at, c) for c in (lay.W_TQ, lay.W_NQ, lay.W_BQ))
        _, tau, beta = triple(at, lay.W_KQ)

        def rate(which: int, column: int, h: float, node: Array = node, size: float = size) -> Array:
            step = h * (size if which == 1 else 1.0)
            ahead, behind = (evaluated(node, variation(which, sign * step)) for sign in (1.0, -1.0))
            return (triple(ahead, column) - triple(behind, column)) / (2 * step)

        second_order(lambda h, f=rate: f(1, lay.W_Q, h), a * b, 1.0)
        second_order(lambda h, f=rate: f(2, lay.W_Q, h), r * b, size)
        second_order(lambda h, f=rate: f(1, lay.W_BQ, h), -a * beta * n - da * t, 1.0 / size)
        second_order(lambda h, f=rate: f(2, lay.W_BQ, h), -r * beta * n - dr * t, 1.0)
        assert a * dr - da * r == pytest.approx(1.0, abs=ACCURACY)  # the Wronskian of the Jacobi equation
        assert np.isfinite(tau)


@pytest.mark.parametrize("name", OF_REVOLUTION)
def test_clairaut_constant(name: str) -> None:
    """On a surface of revolution rho t_phi is constant along a geodesic."""
    rng = np.random.default_rng(5)
    for _ in range(CASES):
        at = evaluated(row(KINDS[name], rng))
        turn = at[lay.ROT : lay.ROT + 9].reshape(3, 3)
        spin = []
        for point, tangent in ((lay.W_P, lay.W_TP), (lay.W_Q, lay.W_TQ)):
            p, t = (triple(at, point) - triple(at, lay.POS)) @ turn, triple(at, tangent) @ turn
            spin.append(p[0] * t[1] - p[1] * t[0])
        assert spin[0] == pytest.approx(spin[1], abs=ACCURACY * 0.1)  # [m], radii are below 0.1


def test_heights_agree_with_projections(kind: Callable[[np.random.Generator], Surface]) -> None:
    """A point at distance d along the normal has the height d, to first order; the surface itself has none."""
    rng = np.random.default_rng(6)
    for _ in range(CASES):
        node = row(kind, rng)
        foot = np.array(project(node, 0, *node[0, lay.S_P : lay.S_P + 3]))
        assert abs(height(node, 0, *foot[:3])) < 1e-16

        def rate(h: float, node: Array = node, foot: Array = foot) -> Array:
            step = h * node[0, lay.SIZE]
            out = [height(node, 0, *(foot[:3] + sign * step * foot[3:])) for sign in (1.0, -1.0)]
            return np.array([(out[0] - out[1]) / (2 * step)])

        second_order(rate, np.ones(1), 1.0)


def test_least_curvature_and_field_along_the_way(kind: Callable[[np.random.Generator], Surface]) -> None:
    """What a geodesic is judged by is not better than at any point of it, up to the sampling of its steps."""
    rng = np.random.default_rng(7)
    for _ in range(CASES):
        node = row(kind, rng)
        arc = node[0, lay.S_ARC]
        node[0, lay.S_ARC] = arc * rng.uniform(1.0, 3.0)
        whole = evaluated(node)
        bends, fields = [], []
        for share in np.linspace(0.05, 1.0, 40):
            part = node.copy()
            part[0, lay.S_ARC] *= share
            at = evaluated(part)
            bends.append(at[lay.W_KQ])
            fields.append(at[lay.W_JAC + 2])
        if min(whole[lay.W_KP], whole[lay.W_KQ]) < 0.0:
            assert whole[lay.W_KMIN] < 0.0
        if min(fields) < -0.1 * node[0, lay.SIZE]:
            assert whole[lay.W_RMIN] <= 0.0
        if min(fields) > 0.0:
            assert whole[lay.W_RMIN] > 0.0
        if min(bends) > 0.0:
            assert whole[lay.W_KMIN] > 0.0
