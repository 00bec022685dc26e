"""The path error's Jacobian against finite differences, its block elimination, and Newton's init, step, terminate."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray

import mjwrap as mw
from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import config
from mjwrap.kernels.geometry import geodesics, stoermer
from mjwrap.kernels.spans import chain
from mjwrap.kernels.tangency import block_elimination, newton, path_error, tangency_error
from mjwrap.paths.scene import pack
from mjwrap.surfaces import Surface
from mjwrap.verification.scenes import random_scene

Array = NDArray[np.float64]
ROWS = ["c", "s", "cc", "sc", "css", "cscc", "csccs"]
# integrated geodesics too; their search for a start takes minutes where kernels are not compiled
KINDS = ROWS if config.DISABLE_JIT else [*ROWS, "e", "t", "set"]


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
    """Return h = [e.n_P, e.b_P, e'.n_Q, e'.b_Q] of every touched obstacle."""
    work = node.copy()
    tangency_error.evaluate(0, len(work), ends, work)
    columns = [lay.W_CP + 1, lay.W_CP + 2, lay.W_CQ + 1, lay.W_CQ + 2]
    return work[touched(work)][:, columns].ravel()


def touched(node: Array) -> NDArray[np.intp]:
    """Return which rows are touched; the second row of a torus is not, where no hollow is bridged."""
    return np.flatnonzero(node[:, lay.S_MODE] == lay.TOUCHED)


def displaced(node: Array, k: int, column: int, size: float) -> Array:
    """Return the rows with obstacle k moved by one natural variation."""
    moved = node.copy()
    slide, shift, turn, lengthen = (size * (i == column) for i in range(4))
    geodesics.displace(k, slide, shift, turn, lengthen, moved)
    return moved


def dense_jacobian(node: Array) -> Array:
    """Return dh / d(variations) of evaluated rows, four rows and columns for each obstacle, from the formulas."""
    rows = touched(node)
    J = np.zeros((4 * len(rows), 4 * len(rows)))
    for i, k in enumerate(rows):
        at = slice(4 * i, 4 * i + 4)
        n_slide, n_shift, b_slide, b_shift, b_turn = path_error.path_error_jacobian_at_P(k, node)
        J[4 * i, at] = n_slide, n_shift, 0.0, 0.0
        J[4 * i + 1, at] = b_slide, b_shift, b_turn, 0.0
        # sigma, y and v of Q as functions of the four variations
        a, da, r, dr = node[k, lay.W_JAC : lay.W_JAC + 4]
        sigma, y, v = np.array([1.0, 0.0, 0.0, 1.0]), np.array([0.0, a, r, 0.0]), np.array([0.0, da, dr, 0.0])
        n_slide, n_shift, b_slide, b_shift, b_turn = path_error.path_error_jacobian_at_Q(k, node)
        J[4 * i + 2, at] = n_slide * sigma + n_shift * y
        J[4 * i + 3, at] = b_slide * sigma + b_shift * y + b_turn * v
        if i + 1 < len(rows):
            behind, following = slice(4 * i + 4, 4 * i + 8), rows[i + 1]
            n_slide, n_shift, b_slide, b_shift = path_error.path_error_jacobian_of_next(k, following, node)
            J[4 * i + 2, behind] = n_slide, n_shift, 0.0, 0.0
            J[4 * i + 3, behind] = b_slide, b_shift, 0.0, 0.0
            n_slide, n_shift, b_slide, b_shift = path_error.path_error_jacobian_of_previous(
                following, k, node
            )
            J[4 * i + 4, at] = n_slide * sigma + n_shift * y
            J[4 * i + 5, at] = b_slide * sigma + b_shift * y
    return J


@pytest.mark.parametrize("kinds", KINDS)
def test_jacobian_is_the_derivative_of_the_path_error(kinds: str) -> None:
    """Central differences of h in every variation of every obstacle; their error falls with the square of the step."""
    rng = np.random.default_rng(13)
    for _ in range(50):
        node, ends = solved(rng, kinds)
        work = perturb(node, rng, 0.05)
        tangency_error.evaluate(0, len(work), ends, work)
        J = dense_jacobian(work)
        rows = touched(work)
        unit = work[rows][:, [lay.SIZE]].repeat(4, 1).ravel()
        unit[2::4] = 1.0  # turns in radians, the others in sizes of the surface
        errors = []
        for share in (2e-3, 1e-3):
            differences = np.zeros_like(J)
            for column in range(len(unit)):
                k, i = divmod(column, 4)
                size = share * unit[column]
                ahead, behind = (residual(displaced(work, rows[k], i, s * size), ends) for s in (1.0, -1.0))
                differences[:, column] = (ahead - behind) / (2.0 * share)
            errors.append(np.abs(differences - J * unit).max())
        scale = np.abs(J * unit).max()
        assert errors[1] <= errors[0] / 3.5 + 1e-9 * scale
        assert errors[1] <= 1e-3 * scale


@pytest.mark.parametrize("kinds", ROWS)
def test_block_elimination_solves_the_dense_system(kinds: str) -> None:
    """The step that the elimination leaves in the rows is the one of the whole Jacobian, J d = -h."""
    rng = np.random.default_rng(14)
    for _ in range(50):
        node, ends = solved(rng, kinds)
        work = perturb(node, rng, 0.05)
        tangency_error.evaluate(0, len(work), ends, work)
        h = work[:, [lay.W_CP + 1, lay.W_CP + 2, lay.W_CQ + 1, lay.W_CQ + 2]].ravel()
        J = dense_jacobian(work)
        assert block_elimination.solve_newton_system(0, len(work), work)
        d = work[:, lay.W_Y : lay.W_Y + 4].ravel()
        assert np.abs(J @ d + h).max() <= 1e-10 * (np.abs(J) @ np.abs(d) + np.abs(h)).max()


@pytest.mark.parametrize("kinds", ROWS)
def test_a_single_step_squares_the_error(kinds: str) -> None:
    """init evaluates the start; one step brings ||f|| down to a multiple of its square, in one evaluation."""
    rng = np.random.default_rng(15)
    for _ in range(50):
        node, ends = solved(rng, kinds)
        work = perturb(node, rng, 1e-4)
        square, evaluations = newton.init(0, len(work), ends, work, newton.NOT_EVALUATED)
        assert evaluations == 1
        assert not newton.terminate(square, 0, 1e-10, 25)
        moved, after, iterations, evaluations = newton.step(0, len(work), ends, work, square)
        assert (moved, iterations, evaluations) == (True, 1, 1)
        assert math.sqrt(after) <= 50.0 * square + 1e-12
        assert tangency_error.evaluate(0, len(work), ends, work) == after


def test_a_step_that_does_not_help_says_so() -> None:
    """From the fold e = -t the Newton step is nothing: no share of it reduces ||f||, and the old value is returned."""
    node, ends = folded()
    square, _ = newton.init(0, 1, ends, node, newton.NOT_EVALUATED)
    moved, after, iterations, evaluations = newton.step(0, 1, ends, node, square)
    assert (moved, after, iterations) == (False, square, 1)
    assert evaluations == newton.MAX_HALVINGS


def test_terminate() -> None:
    """The iteration ends when converged, out of iterations, or not finite."""
    assert newton.terminate(1e-20, 0, 1e-10, 25)
    assert newton.terminate(1.0, 25, 1e-10, 25)
    assert newton.terminate(math.nan, 0, 1e-10, 25)
    assert newton.terminate(math.inf, 0, 1e-10, 25)
    assert not newton.terminate(1.1e-20, 24, 1e-10, 25)


@pytest.mark.parametrize("kinds", ROWS)
def test_step_annuls_the_linearised_residual(kinds: str) -> None:
    """h(x + eps d) - h(x - eps d) over 2 eps equals -h(x), the error falling with eps squared, away from a solution."""
    rng = np.random.default_rng(11)
    for _ in range(50):
        node, ends = solved(rng, kinds)
        work = perturb(node, rng, 0.05)
        tangency_error.evaluate(0, len(work), ends, work)
        assert block_elimination.solve_newton_system(0, len(work), work)
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


def folded() -> tuple[Array, tuple[float, ...]]:
    """Return the row of a path that runs back on itself, e = -t and e' = -t, and the ends for the kernels."""
    sol = mw.solve_path((2, 0, -2.5), (-2, 0, -0.5), [mw.Obstacle(mw.Cylinder(1.0))])
    node = sol._node.copy()
    node[0, lay.S_T : lay.S_T + 3] *= -1.0
    node[0, lay.S_ARC] *= -1.0
    return node, (2.0, 0.0, -2.5, 0.0, 0.0, 0.0, -4.0, 0.0, 2.0)


def test_folded_path_is_not_accepted() -> None:
    """From the fold e = -t the residual h is zero; f is 2 sqrt 2 and the solver says that it is no solution."""
    node, ends = folded()
    assert np.abs(residual(node, ends)).max() < 1e-14
    error, _, _ = newton.newton(0, 1, ends, node, 1e-10, 25)
    assert error == pytest.approx(np.sqrt(8.0), abs=1e-12)


@pytest.mark.parametrize(
    "surface",
    [mw.Cylinder(0.05, 0.08), mw.Sphere(0.05), mw.EllipticCylinder((0.06, 0.04)), mw.Cone(0.06, 0.03, 0.1)],
)
def test_a_lone_wrap_is_the_path_that_newtons_method_finds(surface: Surface) -> None:
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
