"""The optimisation of activations: optimality, other solvers, hard problems, special problems solved by hand."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from quadratic_programs import by_daqp, by_least_squares, moment_matrix, random_programs

from mjwrap.inverse.static_optimization import programs as whole
from mjwrap.inverse.static_optimization.programs import solve
from mjwrap.kernels.optimization import cholesky, line_search, lu
from mjwrap.kernels.optimization.problem import NON_FINITE, SOLVED

SIZES = [(6, 3), (62, 27), (80, 14)]
HARD = [
    (reserve, load, orders)
    for reserve in (1e-3, 1e-2, 0.1, 1.0, 10.0)
    for load in (1, 10, 100)
    for orders in (0, 6)
]


def one(arms, strength, wanted, *, weights=None, reserve: Any = 1.0, low=None, high=None):
    """Return the programs of a single frame."""
    arms = np.asarray(arms, dtype=float)[None]
    n, k = arms.shape[1:]
    return whole.Programs(
        arms, np.zeros((1, n)), np.asarray(strength, dtype=float)[None], np.asarray(wanted, dtype=float)[None],
        np.ones(n) if weights is None else np.asarray(weights, dtype=float),
        np.full(k, reserve) if np.ndim(reserve) == 0 else np.asarray(reserve, dtype=float),
        (np.zeros(n) if low is None else np.asarray(low, dtype=float))[None],
        (np.ones(n) if high is None else np.asarray(high, dtype=float))[None],
    )  # fmt: skip


def optimality(programs, found, t):
    """Return the largest violation of the optimality conditions of a frame, written out with dense matrices."""
    matrix = moment_matrix(programs, t)
    a, r = found.activation[t], found.reserve[t]
    balance = np.abs(matrix @ a + r - programs.wanted[t])
    scale = np.abs(matrix) @ np.abs(a) + np.abs(r) + np.abs(programs.wanted[t])
    pull = matrix.T @ (r / programs.reserves**2)
    size = programs.weights * a + np.abs(matrix).T @ (np.abs(r) / programs.reserves**2)
    slope = programs.weights * a - pull
    low, high = a <= programs.low[t], a >= programs.high[t]
    slope[low] = np.minimum(slope[low], 0.0)
    slope[high] = np.maximum(slope[high], 0.0)
    # reserves are known to 1e-13 of the terms of their balance, and the pull that follows from them accordingly
    rounding = np.abs(matrix).T @ (1e-13 * scale / programs.reserves**2)
    off = np.maximum(np.abs(slope) - rounding, 0.0) / (size + 1e-300)
    return max(off.max(), (balance / scale).max())


@pytest.mark.parametrize(("reserve", "load", "orders"), HARD)
@pytest.mark.parametrize(("muscles", "rows"), SIZES)
def test_every_frame_is_solved(muscles, rows, reserve, load, orders):
    given = random_programs(
        [muscles, load, orders], 20, muscles, rows, load=load, reserve=reserve, weight_orders=orders
    )
    found = solve(given)
    assert (found.status == SOLVED).all()
    assert found.residual.max() <= 1e-10
    assert max(optimality(given, found, t) for t in range(20)) <= 1e-10
    assert ((found.activation >= given.low) & (found.activation <= given.high)).all()


@pytest.mark.slow
@pytest.mark.parametrize("load", [1, 10, 100])
def test_a_whole_body_is_solved(load):
    given = random_programs([load], 6, 414, 71, load=load, reserve=1e-3, weight_orders=6)
    found = solve(given)
    assert (found.status == SOLVED).all()
    assert found.residual.max() <= 1e-10


@pytest.mark.parametrize(("muscles", "rows"), SIZES)
def test_equal_to_daqp(muscles, rows):
    compared = 0
    for reserve, load, orders in HARD:
        given = random_programs(
            [muscles, load, orders], 4, muscles, rows, load=load, reserve=reserve, weight_orders=orders
        )
        found = solve(given)
        for t in range(4):
            other = by_daqp(given, t)
            if other is not None:
                compared += 1
                np.testing.assert_allclose(found.activation[t], other, rtol=0, atol=1e-9)
    assert compared >= 0.85 * 4 * len(HARD)  # DAQP itself fails on a few with the smallest reserves


@pytest.mark.parametrize(("load", "orders"), [(1, 0), (1, 6), (10, 0), (100, 6)])
@pytest.mark.parametrize("reserve", [0.1, 1.0, 10.0])
def test_equal_to_bounded_least_squares(reserve, load, orders):
    given = random_programs([7, load, orders], 5, 40, 12, load=load, reserve=reserve, weight_orders=orders)
    found = solve(given)
    for t in range(5):
        # BVLS works on a matrix whose condition is that of A / ρ over the least weight's root: ten of its digits hold
        np.testing.assert_allclose(found.activation[t], by_least_squares(given, t), rtol=0, atol=1e-9)


def test_one_muscle_by_hand():
    """min a² + r² with 3 a + r = 2: a = 3 · 2 / (1 + 9)."""
    found = solve(one([[0.03]], [100.0], [2.0]))
    assert found.activation[0, 0] == pytest.approx(0.6, rel=1e-14)
    assert found.reserve[0, 0] == pytest.approx(0.2, rel=1e-14)
    assert not found.infeasible[0]


def test_saturated_by_hand():
    """A muscle of 3 N m against 5: it is fully active, the reserve gives the rest, and that is proved to be needed."""
    found = solve(one([[0.03]], [100.0], [5.0], reserve=0.01))
    assert found.activation[0, 0] == 1.0
    assert found.reserve[0, 0] == pytest.approx(2.0, rel=1e-14)
    assert found.infeasible[0]


def test_antagonist_stays_at_its_bound():
    found = solve(one([[0.03], [-0.03]], [100.0, 100.0], [1.0], low=[0.0, 0.05]))
    assert found.activation[0, 1] == 0.05
    assert found.activation[0, 0] == pytest.approx(3.0 * (1.0 + 0.15) / 10.0, rel=1e-14)


@pytest.mark.parametrize("reserve", [1e-3, 1.0])
def test_muscle_without_strength_and_coordinate_without_muscle(reserve):
    arms = [[0.03, 0.0, 0.01], [0.02, 0.0, -0.04], [0.05, 0.0, 0.02]]
    found = solve(one(arms, [800.0, 500.0, 0.0], [4.0, -7.0, 2.0], reserve=reserve))
    assert found.status[0] == SOLVED
    assert found.activation[0, 2] == 0.0
    assert found.reserve[0, 1] == -7.0
    assert found.infeasible[0]


def test_equal_bounds_fix_an_activation():
    found = solve(one([[0.03], [0.02]], [100.0, 100.0], [2.0], low=[0.3, 0.0], high=[0.3, 1.0]))
    assert found.activation[0, 0] == 0.3
    assert found.activation[0, 1] == pytest.approx(2.0 * (2.0 - 0.9) / 5.0, rel=1e-14)


def test_reserve_without_cost_takes_everything():
    found = solve(one([[0.03, 0.02]], [100.0], [2.0, 1.0], reserve=[np.inf, 1.0]))
    assert found.activation[0, 0] == pytest.approx(2.0 / 5.0, rel=1e-14)
    np.testing.assert_allclose(found.reserve[0], [2.0 - 1.2, 1.0 - 0.8], rtol=1e-14)


def test_nothing_to_do_and_no_muscle():
    assert not solve(one([[0.03]], [100.0], [0.0])).activation.any()
    empty = solve(one(np.zeros((0, 2)), np.zeros(0), [1.0, 2.0]))
    np.testing.assert_array_equal(empty.reserve, [[1.0, 2.0]])
    assert solve(one(np.zeros((2, 0)), np.ones(2), np.zeros(0))).status[0] == SOLVED


def test_forces_at_zero_activation_are_subtracted():
    given = random_programs([9], 3, 12, 5)
    force = np.random.default_rng(9).uniform(-50.0, 200.0, (3, 12))
    moved = replace(
        given, force=force, wanted=given.wanted + np.einsum("tnk,tn->tk", given.moment_arms, force)
    )
    np.testing.assert_allclose(solve(moved).activation, solve(given).activation, rtol=0, atol=1e-11)


@pytest.mark.parametrize("field", ["moment_arms", "force", "strength", "wanted"])
def test_numbers_that_are_not_finite_are_a_status(field):
    given = random_programs([3], 4, 6, 3)
    values = getattr(given, field).copy()
    values[2].flat[0] = np.nan
    given = replace(given, **{field: values})
    found = solve(given)
    np.testing.assert_array_equal(found.status, [SOLVED, SOLVED, NON_FINITE, SOLVED])


@pytest.mark.parametrize("frames", [1, whole.CHUNK, 3 * whole.CHUNK + 5])
def test_threads_do_not_change_a_bit(frames):
    given = random_programs([frames], frames, 30, 9, load=3)
    results = [solve(given, jobs) for jobs in (1, 2, 5)]
    for name in ("activation", "reserve", "residual", "iterations"):
        assert len({getattr(found, name).tobytes() for found in results}) == 1


def test_reach_is_what_the_muscles_can_do():
    """Infeasible is what a linear programme calls so, over loads about the limit."""
    from scipy.optimize import linprog

    seen = set()
    for load in np.linspace(0.5, 40.0, 12):
        given = random_programs([11], 1, 8, 2, load=float(load), reserve=1e-3)
        matrix = moment_matrix(given, 0)
        inside = linprog(np.zeros(8), A_eq=matrix, b_eq=given.wanted[0], bounds=(0, 1)).status == 0
        assert bool(solve(given).infeasible[0]) is not inside
        seen.add(inside)
    assert seen == {True, False}


# -------------------------------------------------------------------------------- parts of the method


def newton_matrix(seed, muscles=20, rows=8):
    given = random_programs([seed], 1, muscles, rows)
    pattern, order = whole.make_pattern(whole.used_entries(given.moment_arms))
    matrix = moment_matrix(given, 0)[order]
    scaled = np.array(
        [
            matrix[pattern.row[e], m]
            for m in range(muscles)
            for e in range(pattern.start[m], pattern.start[m + 1])
        ]
    )
    return pattern, matrix, scaled


@pytest.mark.parametrize("seed", range(5))
def test_both_linear_solvers_equal_a_dense_one(seed):
    pattern, matrix, scaled = newton_matrix(seed)
    rng = np.random.default_rng(seed)
    free = np.sort(rng.choice(20, 11, replace=False)).astype(np.int64)
    weights = 10.0 ** rng.uniform(-1, 1, 20)
    right = rng.normal(size=8)
    dense = np.eye(8) + (matrix[:, free] / weights[free]) @ matrix[:, free].T
    expected = np.linalg.solve(dense, right)
    hessian, found = np.zeros((8, 8)), np.zeros(8)
    cholesky.assemble(pattern, scaled, weights, free, 11, hessian)
    np.testing.assert_allclose(np.tril(hessian), np.tril(dense), rtol=1e-13, atol=1e-13)
    assert cholesky.factorize(pattern.first, hessian) > 0.0
    cholesky.solve(pattern.first, hessian, right, found)
    np.testing.assert_allclose(dense @ found, right, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found, expected, rtol=1e-7)
    also = np.zeros(8)
    assert lu.solve_augmented(pattern, scaled, weights, free, 11, right, np.zeros((28, 29)), also)
    np.testing.assert_allclose(also, expected, rtol=1e-7)


def test_lu_keeps_digits_that_cholesky_loses():
    """Two almost parallel muscles over two coordinates: the condition of H is 1e18; exact rational arithmetic tells."""
    from fractions import Fraction

    arms = np.array([[3.0e7, 1.0e7], [3.0e7, 1.0e7 + 1.0]])
    pattern, order = whole.make_pattern(np.ones((2, 2), dtype=np.bool_))
    scaled = arms[:, order].ravel()
    right = np.array([1.0, -3.0])
    g = [[Fraction(float(x)) for x in column] for column in arms[:, order]]
    h = [[sum(c[i] * c[j] for c in g) + (i == j) for j in range(2)] for i in range(2)]
    det = h[0][0] * h[1][1] - h[0][1] ** 2
    exact = [(h[1][1] - h[0][1] * -3) / det, (h[0][0] * -3 - h[0][1]) / det]
    free, found = np.arange(2), np.zeros(2)
    assert lu.solve_augmented(pattern, scaled, np.ones(2), free, 2, right, np.zeros((4, 5)), found)
    np.testing.assert_allclose(found, [float(x) for x in exact], rtol=1e-6)
    hessian = np.zeros((2, 2))
    cholesky.assemble(pattern, scaled, np.ones(2), free, 2, hessian)
    assert cholesky.factorize(pattern.first, hessian) < 1e-10


def test_elimination_order_of_two_legs_has_no_fill():
    """A trunk and two legs, whose dofs stand after it: from the leaves to the root, the legs stay apart."""
    used = np.zeros((6, 7), dtype=np.bool_)
    for m, dofs in enumerate([[0, 1, 2], [1, 2, 3], [2, 3], [0, 4, 5], [4, 5, 6], [5, 6]]):
        used[m, dofs] = True
    pattern, order = whole.make_pattern(used)
    assert sorted(order) == list(range(7))
    coupled = used.astype(int).T @ used.astype(int) > 0
    filled = sum(i - first for i, first in enumerate(pattern.first))
    pairs = int(np.triu(coupled, 1).sum())
    assert filled <= pairs + 2


@pytest.mark.parametrize("seed", range(10))
def test_derivative_along_a_step_is_that_of_the_dual_function(seed):
    rng = np.random.default_rng(seed)
    n, k = 12, 4
    matrix, load, weights = rng.normal(size=(k, n)), 3.0 * rng.normal(size=k), rng.uniform(0.5, 2.0, n)
    low, high = np.zeros(n), np.ones(n)
    y, step = rng.normal(size=k), rng.normal(size=k)

    def dual(t):
        point = y + t * step
        z = matrix.T @ point / weights
        a = np.clip(z, low, high)
        return 0.5 * point @ point - load @ point + (weights * (z * a - 0.5 * a * a)).sum()

    z, dz = matrix.T @ y / weights, matrix.T @ step / weights
    at_start = step @ (y + matrix @ np.clip(z, low, high) - load)
    for t in (0.13, 0.57, 0.9):
        value, _ = line_search.derivative(weights, low, high, z, dz, at_start, step @ step, t)
        h = 1e-6
        assert value == pytest.approx((dual(t + h) - dual(t - h)) / (2 * h), abs=1e-7)
    if at_start < 0.0:
        t = line_search.step_length(weights, low, high, z, dz, at_start, step @ step)
        assert 0.0 < t <= 1.0
        assert dual(t) < dual(0.0)
