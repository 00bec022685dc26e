"""The block-tridiagonal Newton step against finite differences of the residual, and how the iteration behaves."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

import mjwrap as mw
from mjwrap.kernels import layout as lay
from mjwrap.kernels.geometry import geodesics, stoermer
from mjwrap.kernels.spans import chain
from mjwrap.kernels.tangency import newton
from mjwrap.paths.scene import pack
from mjwrap.verification.scenes import random_scene

Array = NDArray[np.float64]
ROWS = ["c", "s", "cc", "sc", "css", "cscc", "csccs"]


def solved(rng: np.random.Generator, kinds: str) -> tuple[Array, tuple[float, ...]]:
    """Return rows of a solved scene in which every obstacle is touched, and the ends for the kernels."""
    while True:
        origin, insertion, row = random_scene(rng, kinds, hints=True)
        sol = mw.solve_path(origin, insertion, row)
        if sol.converged and all(c.active and c.arc_length > 2e-3 for c in sol.contacts):
            node = pack(row)
            node[:] = sol._node
            return node, (*origin, 0.0, 0.0, 0.0, *(insertion - origin))


def perturb(node: Array, rng: np.random.Generator, size: float) -> Array:
    moved = node.copy()
    for k in range(len(node)):
        radius = node[k, lay.DIM]
        slide, shift, turn, lengthen = size * rng.normal(size=4) * (radius, radius, 1.0, radius)
        geodesics.displace(k, slide, shift, turn, lengthen, moved)
    return moved


def residual(node: Array, ends: tuple[float, ...]) -> Array:
    """Return h = [e.n_P, e.b_P, e'.n_Q, e'.b_Q] of every obstacle."""
    work = node.copy()
    newton.evaluate(0, len(work), ends, work)
    columns = [lay.W_CP + 1, lay.W_CP + 2, lay.W_CQ + 1, lay.W_CQ + 2]
    return work[:, columns].ravel()


@pytest.mark.parametrize("kinds", ROWS)
def test_step_annuls_the_linearised_residual(kinds: str) -> None:
    """h(x + eps d) - h(x - eps d) over 2 eps equals -h(x), the error falling with eps squared, away from a solution."""
    rng = np.random.default_rng(11)
    for _ in range(50):
        node, ends = solved(rng, kinds)
        work = perturb(node, rng, 0.05)
        newton.evaluate(0, len(work), ends, work)
        assert newton.step(0, len(work), work)
        step = work[:, lay.W_Y : lay.W_Y + 4].copy()
        scale = 0.1 / max(1.0, np.abs(step / work[:, [lay.DIM]]).max(), np.abs(step[:, 2]).max())

        def quotient(
            eps: float, work: Array = work, step: Array = step, ends: tuple[float, ...] = ends
        ) -> Array:
            sides = []
            for sign in (1.0, -1.0):
                moved = work.copy()
                for k in range(len(moved)):
                    slide, shift, turn, lengthen = sign * eps * step[k]
                    geodesics.displace(k, slide, shift, turn, lengthen, moved)
                sides.append(residual(moved, ends))
            return (sides[0] - sides[1]) / (2 * eps)

        wanted = -residual(work, ends)
        coarse, fine = (np.abs(quotient(e) - wanted).max() for e in (scale, scale / 2))
        assert fine <= coarse / 3.5 + 1e-9
        assert fine <= 0.1 * np.abs(wanted).max() + 1e-9


@pytest.mark.parametrize("kinds", ROWS)
def test_convergence_is_quadratic(kinds: str) -> None:
    """From a disturbed solution the error of an undamped iteration goes down as a multiple of its own square."""
    rng = np.random.default_rng(12)
    for _ in range(20):
        node, ends = solved(rng, kinds)
        work = perturb(node, rng, 1e-3)
        errors = []
        for _ in range(5):
            error, _, _ = newton.newton(0, len(work), ends, work, 1e-15, 1)
            errors.append(error)
        small = [(a, b) for a, b in itertools.pairwise(errors) if 1e-7 < a < 1e-3]
        assert all(b <= 50.0 * a * a + 1e-13 for a, b in small)
        assert errors[-1] < 1e-12


def test_folded_path_is_not_accepted() -> None:
    """From the fold e = -t the residual h is zero; f is 2 sqrt 2 and the solver says that it is no solution."""
    sol = mw.solve_path((2, 0, -2.5), (-2, 0, -0.5), [mw.Obstacle(mw.Cylinder(1.0))])
    node = sol._node.copy()
    node[0, lay.S_T : lay.S_T + 3] *= -1.0
    node[0, lay.S_ARC] *= -1.0
    ends = (2.0, 0.0, -2.5, 0.0, 0.0, 0.0, -4.0, 0.0, 2.0)
    assert np.abs(residual(node, ends)).max() < 1e-14
    error, _, _ = newton.newton(0, 1, ends, node, 1e-10, 25)
    assert error == pytest.approx(np.sqrt(8.0), abs=1e-12)


@pytest.mark.parametrize(
    "surface",
    [mw.Cylinder(0.05, 0.08), mw.Sphere(0.05), mw.EllipticCylinder((0.06, 0.04)), mw.Cone(0.06, 0.03, 0.1)],
)
def test_a_lone_wrap_is_the_path_that_newtons_method_finds(surface: mw.Surface) -> None:
    """Step after step of a motion that winds, lifts off and slides off the end of the surface: `direct` or not."""
    # an elliptic cylinder's geodesics are integrated, with this estimate of the error; the others' are closed forms
    bound = stoermer.TOLERANCE if isinstance(surface, mw.EllipticCylinder) else 1e-12
    seen: list[tuple[int, float]] = []
    direct, iterated = (pack([mw.Obstacle(surface)]) for _ in range(2))
    info = np.zeros((2, lay.INFO))
    for time in np.linspace(0.0, 1.0, 400):
        high = 0.03 * np.sin(9.0 * time)
        a = np.array([0.13 * np.cos(2.0 + 9.0 * time), 0.13 * np.sin(2.0 + 9.0 * time), high])
        b = np.array([0.11 + 0.03 * np.sin(20.0 * time), -0.02, 0.06 * np.sin(5.0 * time)])
        for row, node in enumerate((direct, iterated)):
            ends = (*a, *b)
            chain.solve_chain(0, 1, *ends, node, 1e-10, row == 0, info, row)  # pyright: ignore[reportCallIssue]
        assert info[0, lay.I_STATUS] == info[1, lay.I_STATUS]
        seen.append((int(info[0, lay.I_STATUS]), float(direct[0, lay.S_MODE])))
        if seen[-1][0] != lay.CONVERGED:
            for node in (direct, iterated):
                node[0, lay.S_MODE] = lay.COLD
            continue
        assert info[0, lay.I_ERROR] <= 1e-10
        assert abs(info[0, lay.I_LENGTH] - info[1, lay.I_LENGTH]) <= bound
        assert direct[0, lay.S_MODE] == iterated[0, lay.S_MODE]
        if not isinstance(surface, mw.Sphere):  # which has no sides
            assert abs(direct[0, lay.S_SWEEP] - iterated[0, lay.S_SWEEP]) <= 1e-8
    assert {mode for status, mode in seen if status == lay.CONVERGED} == {lay.FREE, lay.TOUCHED}
