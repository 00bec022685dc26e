"""Parts of the paper's methods: residual, derivatives, one step of each, line searches."""

from __future__ import annotations

import math

import numpy as np
import pytest
from method_scenes import Array, exact_jacobian, paper_problem, random_problem

from mjwrap.methods import make_solver
from mjwrap.methods.broyden import Broyden, BroydenState
from mjwrap.methods.linesearch import armijo, derivative_free


def test_first_guess_has_the_papers_residual() -> None:
    problem = paper_problem(1, 0.0)
    assert np.linalg.norm(problem(problem.first_guess())) == pytest.approx(
        1.7086, abs=5e-5
    )  # as printed there


@pytest.mark.parametrize("residual", ["tangency", "normals_binormals"])
def test_jacobian_is_the_derivative_of_the_residual(residual: str) -> None:
    rng = np.random.default_rng(7)
    for _ in range(50):
        problem, x = random_problem(rng, residual)
        exact = exact_jacobian(problem, x)
        errors = [np.abs(problem.jacobian(x, step) - exact).max() for step in (1e-3, 5e-4)]
        assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)
        # the default step, 1e-6 √‖x‖: rounding of 1e-16 over it
        assert np.abs(problem.jacobian(x) - exact).max() < 2e-9


def test_length_of_the_direction_does_not_matter() -> None:
    rng = np.random.default_rng(8)
    for _ in range(50):
        problem, x = random_problem(rng, "tangency")
        y = x.reshape(-1, 5).copy()
        y[:, 2:4] *= rng.uniform(0.1, 10.0, (len(y), 1))
        assert problem(y.ravel()) == pytest.approx(problem(x), abs=1e-14)
        assert problem(problem.normalised(y.ravel())) == pytest.approx(problem(x), abs=1e-14)


def test_geodesics_lie_on_their_surfaces_and_run_along_their_normals() -> None:
    rng = np.random.default_rng(9)
    h = 1e-4
    for _ in range(50):
        problem, x = random_problem(rng, "tangency")
        steps = np.tile([0.0, 0.0, 0.0, 0.0, 1.0], problem.n) / np.repeat(problem.radii, 5)
        g = problem.geometry(problem.normalised(x) + h * np.array([[-1.0], [0.0], [1.0]]) * steps)
        tangent = (g.Q[2] - g.Q[0]) / (2.0 * h)
        bend = (g.t_Q[2] - g.t_Q[0]) / (2.0 * h)
        assert tangent == pytest.approx(g.t_Q[1], abs=h * h)  # unit speed
        assert bend - (bend * g.n_Q[1]).sum(axis=1)[:, None] * g.n_Q[1] == pytest.approx(0.0, abs=h * h)
        assert np.linalg.norm(g.t_P, axis=2) == pytest.approx(1.0, abs=1e-14)
        assert (g.t_P * g.n_P).sum(axis=2) == pytest.approx(0.0, abs=1e-14)


def test_unknowns_and_contacts_are_two_ways_of_saying_the_same() -> None:
    rng = np.random.default_rng(10)
    for _ in range(50):
        problem, x = random_problem(rng, "tangency")
        g = problem.geometry(problem.normalised(x))
        again = problem.geometry(problem.unknowns(g.P[0], g.t_P[0], g.arc[0]))
        for name in ("P", "t_P", "Q", "t_Q", "n_Q", "arc"):
            assert getattr(again, name) == pytest.approx(getattr(g, name), abs=1e-14)


def test_evaluations_are_counted_one_by_one() -> None:
    problem = paper_problem(1, 0.0)
    x = problem.first_guess()
    problem(x)
    problem.jacobian(x)
    problem.length(x)
    assert problem.evaluations == 11


def test_newton_raphson_takes_the_damped_normal_equations_step() -> None:
    problem = paper_problem(1, 0.1)
    solver = make_solver("nr", lam=0.3)
    first = solver.init(problem, problem.first_guess())
    second = solver.advance(problem, first)
    J = np.vstack([exact_jacobian(problem, first.x), math.sqrt(0.3) * np.eye(5)])
    step = np.linalg.lstsq(J, -np.concatenate([first.residual, np.zeros(5)]), rcond=None)[0]
    assert second.x - first.x == pytest.approx(step, abs=1e-8)


def test_bfgs_meets_the_secant_equation() -> None:
    problem = paper_problem(1, 0.1)
    solver = make_solver("bfgs")
    first = solver.init(problem, problem.first_guess())
    second = solver.advance(problem, first)
    assert first.gradient == pytest.approx(
        2.0 * exact_jacobian(problem, first.x).T @ first.residual, abs=1e-8
    )
    s, y = second.x - first.x, second.gradient - first.gradient
    assert s @ y > 0.0
    assert second.H @ y == pytest.approx(s, abs=1e-12)
    assert np.linalg.eigvalsh(second.H).min() > 0.0


def test_broyden_meets_the_secant_equation_and_keeps_its_row_space() -> None:
    problem = paper_problem(1, 0.1)
    solver = Broyden()
    state = solver.init(problem, problem.first_guess())
    null = np.array([0.0, 0.0, *state.x[2:4], 0.0])
    for _ in range(3):
        new = solver.advance(problem, state)
        assert isinstance(new, BroydenState)
        assert new.L @ (new.x - state.x) == pytest.approx(new.residual - state.residual, abs=1e-12)
        assert (new.x - state.x) @ null == pytest.approx(0.0, abs=1e-8)
        state = new


def test_armijo_takes_the_first_step_that_descends_enough() -> None:
    def residual(x: Array) -> Array:
        return np.array([math.tanh(x[0])])

    x, a, b = np.array([0.5]), 0.382, 0.618
    phi, slope = math.tanh(0.5) ** 2, -8.0 * math.tanh(0.5) / math.cosh(0.5) ** 2
    accepted = armijo(residual, x, np.array([-4.0]), phi, slope, a, b)
    assert accepted is not None
    alpha = (accepted[0][0] - 0.5) / -4.0
    k = round(math.log(alpha) / math.log(b))
    assert k > 0
    assert alpha == pytest.approx(b**k)
    for i in range(k + 1):
        step = b**i
        enough = math.tanh(0.5 - 4.0 * step) ** 2 <= phi + a * step * slope
        assert enough == (i == k)
    assert armijo(residual, x, np.array([4.0]), phi, slope, a, b) is None


def test_derivative_free_search_obeys_its_two_conditions() -> None:
    def residual(x: Array) -> Array:
        return np.array([math.atan(x[0])])

    def search(x: float, d: float, k: int) -> tuple[Array, Array] | None:
        return derivative_free(
            residual, np.array([x]), np.array([d]), abs(math.atan(x)), k, 0.001, 0.001, 0.9, 0.5
        )

    full = search(1.0, -1.0, 50)
    assert full is not None
    assert full[0][0] == pytest.approx(0.0)
    halved = search(2.0, -20.0, 50)  # α = 1 lands at −18, 1/2 at −8, 1/4 at −3, 1/8 at −0.5
    assert halved is not None
    assert halved[0][0] == pytest.approx(-0.5)
    early = search(2.0, -8.0, 0)  # η₀ = 1 lets ‖f‖ grow: −6 is taken at once
    assert early is not None
    assert early[0][0] == pytest.approx(-6.0)
    assert derivative_free(residual, np.array([2.0]), np.array([1e6]), 0.1, 10**9, 1.0, 1.0, 0.9, 0.9) is None
