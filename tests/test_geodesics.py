"""Laws that every surface's geodesic, Darboux frame and Jacobi fields obey, by finite differences of second order."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from mjwrap.kernels import geodesics
from mjwrap.kernels import layout as lay

Array = NDArray[np.float64]
Variation = tuple[float, float, float, float]
KINDS = {"cylinder": lay.CYLINDER, "sphere": lay.SPHERE}
CASES = 50


def row(kind: int, rng: np.random.Generator) -> Array:
    """Return a node with a random size, pose and geodesic on it."""
    node = np.zeros((1, lay.ROW))
    node[0, lay.KIND] = kind
    node[0, lay.DIM] = rng.uniform(0.02, 0.06)
    node[0, lay.POS : lay.POS + 3] = rng.normal(size=3) * 0.1
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    node[0, lay.ROT : lay.ROT + 9] = turn.ravel()
    node[0, lay.S_P : lay.S_P + 3] = rng.normal(size=3) * 0.05
    node[0, lay.S_T : lay.S_T + 3] = rng.normal(size=3)
    node[0, lay.S_ARC] = rng.uniform(0.2, 2.5) * node[0, lay.DIM]
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
def kind(request: pytest.FixtureRequest) -> int:
    return KINDS[request.param]


def test_frames_are_orthonormal_on_the_surface(kind: int) -> None:
    rng = np.random.default_rng(1)
    for _ in range(CASES):
        node = row(kind, rng)
        at = evaluated(node)
        for t, n, b in ((lay.W_TP, lay.W_NP, lay.W_BP), (lay.W_TQ, lay.W_NQ, lay.W_BQ)):
            frame = np.array([triple(at, c) for c in (t, n, b)])
            assert np.abs(frame @ frame.T - np.eye(3)).max() < 1e-14
            assert np.linalg.det(frame) == pytest.approx(1.0, abs=1e-14)
        local = (triple(at, lay.W_Q) - triple(at, lay.POS)) @ at[lay.ROT : lay.ROT + 9].reshape(3, 3)
        nearest = np.array(geodesics.project(node, 0, *local))
        assert np.abs(nearest[:3] - local).max() < 1e-15
        assert (
            np.abs(at[lay.ROT : lay.ROT + 9].reshape(3, 3) @ nearest[3:] - triple(at, lay.W_NQ)).max() < 1e-14
        )


def test_curve_is_a_unit_speed_geodesic(kind: int) -> None:
    """dQ/ds = t and dt/ds = -kappa n: no acceleration within the surface."""
    rng = np.random.default_rng(2)
    for _ in range(CASES):
        node = row(kind, rng)
        at, size = evaluated(node), node[0, lay.DIM]

        def rate(column: int, h: float, node: Array = node, size: float = size) -> Array:
            step = h * size
            ahead, behind = (evaluated(node, (0, 0, 0, s * step)) for s in (1.0, -1.0))
            return (triple(ahead, column) - triple(behind, column)) / (2 * step)

        second_order(lambda h, f=rate: f(lay.W_Q, h), triple(at, lay.W_TQ), 1.0)
        second_order(lambda h, f=rate: f(lay.W_TQ, h), -at[lay.W_KQ] * triple(at, lay.W_NQ), 1.0 / size)


def test_normal_turns_with_the_shape_operator(kind: int) -> None:
    """dn along t is kappa t + tau b; the start shifted along b turns n_P by tau t + beta b."""
    rng = np.random.default_rng(3)
    for _ in range(CASES):
        node = row(kind, rng)
        at, size = evaluated(node), node[0, lay.DIM]
        t, b = triple(at, lay.W_TP), triple(at, lay.W_BP)
        kappa, tau, beta = triple(at, lay.W_KP)

        def rate(which: int, h: float, node: Array = node, size: float = size) -> Array:
            ahead, behind = (evaluated(node, variation(which, sign * h * size)) for sign in (1.0, -1.0))
            return (triple(ahead, lay.W_NP) - triple(behind, lay.W_NP)) / (2 * h * size)

        second_order(lambda h, f=rate: f(0, h), kappa * t + tau * b, 1.0 / size)
        second_order(lambda h, f=rate: f(1, h), tau * t + beta * b, 1.0 / size)


def test_jacobi_fields_match_neighbouring_geodesics(kind: int) -> None:
    """Columns of method section 2 for Q and b_Q: shift along b carries a, turning about n carries r."""
    rng = np.random.default_rng(4)
    for _ in range(CASES):
        node = row(kind, rng)
        at, size = evaluated(node), node[0, lay.DIM]
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
        assert a * dr - da * r == pytest.approx(1.0, abs=1e-14)  # the Wronskian of the Jacobi equation
        assert np.isfinite(tau)


def test_clairaut_constant(kind: int) -> None:
    """On a surface of revolution rho t_phi is constant along a geodesic."""
    rng = np.random.default_rng(5)
    for _ in range(CASES):
        at = evaluated(row(kind, rng))
        turn = at[lay.ROT : lay.ROT + 9].reshape(3, 3)
        spin = []
        for point, tangent in ((lay.W_P, lay.W_TP), (lay.W_Q, lay.W_TQ)):
            p, t = (triple(at, point) - triple(at, lay.POS)) @ turn, triple(at, tangent) @ turn
            spin.append(p[0] * t[1] - p[1] * t[0])
        assert spin[0] == pytest.approx(spin[1], abs=1e-15)
