"""Laws that every one of the paper's methods obeys, on the paper's scenes and on scenes with known paths."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from method_scenes import (
    AMPLITUDE,
    INSERTION,
    LENGTH,
    ORIGIN,
    ROWS,
    TIMES,
    TOL,
    Array,
    centre_y,
    contact_error,
    corner,
    exact_length,
    made_path,
    paper_problem,
)

import mjwrap as mw
from mjwrap.methods import METHODS, ChainProblem, MethodResult, iterate, make_solver, solve_chain
from mjwrap.surfaces import Surface

LABELS = [f"{method}-{'-'.join(str(value) for value in options.values())}" for method, options in ROWS]
every_row = pytest.mark.parametrize(("method", "options"), ROWS, ids=LABELS)
every_method = pytest.mark.parametrize("method", METHODS)


@every_row
@pytest.mark.parametrize("case", [1, 2])
def test_follows_the_papers_motion(case: int, method: str, options: dict[str, Any]) -> None:
    solver = make_solver(method, **options)
    x = paper_problem(case, 0.0).first_guess()
    wraps = 0
    for t in TIMES[:84]:  # one period; the paper solves lifted poses as well, with l < 0
        problem = paper_problem(case, t)
        outcome = iterate(solver, problem, x, TOL)
        x = problem.normalised(outcome.x)
        assert outcome.converged
        assert outcome.error <= TOL
        length, touches = exact_length(centre_y(case, t))
        g = problem.geometry(x)
        P, Q = g.P[0, 0] - [0.0, centre_y(case, t), 0.0], g.Q[0, 0] - [0.0, centre_y(case, t), 0.0]
        assert (x[4] > 0.0) == touches
        assert (P[0] * Q[1] - P[1] * Q[0] > 0.0) == touches  # the paper's criterion
        if touches:
            wraps += 1
            assert problem.length(x) == pytest.approx(length, rel=LENGTH)
    assert wraps == (84 if case == 1 else 56)  # case 2: sin 2πt > −1/2, two thirds of the time


@every_method
@pytest.mark.parametrize("stride", [1, 5, -5])
@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_lifts_off_and_touches_down(method: str, stride: int, mirror: float) -> None:
    """Case 2 at fine and coarse steps, both ways through time, over the cylinder and under it."""
    radius = 0.01
    start = (
        np.array([[radius, mirror * centre_y(2, TIMES[::stride][0]), -0.015]]),
        np.array([[0.0, mirror, 1.0]]) * math.sqrt(0.5),
        np.zeros(1),
        np.ones(1, dtype=bool),
    )
    for t in TIMES[::stride]:
        y = centre_y(2, t)
        centre = np.array([[0.0, mirror * y, 0.0]])
        path = solve_chain(method, ORIGIN, INSERTION, [mw.Cylinder(radius)], centre, np.eye(3)[None], start)
        length, touches = exact_length(y)
        assert path.converged
        assert path.active[0] == touches
        assert path.length == pytest.approx(length, rel=LENGTH)
        assert path.s[0] >= 0.0
        start = (path.P, path.t, path.s, path.active)


def test_all_methods_agree_over_two_cylinders_in_a_row() -> None:
    radius = 0.001
    tops = np.array([[0.0, radius, 0.0], [0.0, -radius, 0.0]])
    along = np.array([[-1.0, 0.0, 1.0]] * 2) * math.sqrt(0.5)
    rows: list[tuple[str, dict[str, Any]]] = [("nr", {"lam": 0.001}), ("bfgs", {}), ("broyden", {})]
    lengths, patterns = [], []
    for method, options in rows:
        start, found, touched = None, [], []
        for t in TIMES[:84:2]:
            first, second = math.sin(2.0 * math.pi * t), math.cos(2.0 * math.pi * (t + 0.24))
            centres = np.array([[0.0, 0.0015 * first, 0.0], [-0.005, 0.0015 * second, 0.0]])
            if start is None:
                start = (centres + tops, along, np.zeros(2), np.ones(2, dtype=bool))
            surfaces = [mw.Cylinder(radius), mw.Cylinder(radius)]
            path = solve_chain(
                method, ORIGIN, INSERTION, surfaces, centres, np.stack([np.eye(3)] * 2), start, **options
            )
            assert path.converged
            assert path.tangency_error <= TOL
            assert corner(path, centres) <= TOL
            start = (path.P, path.t, path.s, path.active)
            found.append(path.length)
            touched.append(path.active.tolist())
        lengths.append(found)
        patterns.append(touched)
    assert patterns[0] == patterns[1] == patterns[2]
    assert {tuple(pair) for pair in patterns[0]} == {
        (True, True),
        (True, False),
        (False, True),
        (False, False),
    }
    assert lengths[1] == pytest.approx(lengths[0], rel=LENGTH)
    assert lengths[2] == pytest.approx(lengths[0], rel=LENGTH)


def rate_17(problem: ChainProblem, x: Array, velocity: Array) -> float:
    d = problem.straights(problem.geometry(x))[0]
    e = d / np.linalg.norm(d, axis=1)[:, None]
    return float((e[0] - e[1]) @ velocity)


def rate_and_differences(residual: str, x: Array, t: float, h: float) -> tuple[float, float, Array]:
    """l̇ (17) of case 1 and the central difference of the length that the residual's own solutions have."""
    solver = make_solver("nr", lam=0.08)
    lengths = []
    for shifted in (t - h, t + h, t):
        problem = paper_problem(1, shifted, residual)
        outcome = iterate(solver, problem, x, TOL)
        assert outcome.converged
        x = problem.normalised(outcome.x)
        lengths.append(problem.length(x))
    velocity = np.array([0.0, AMPLITUDE[1] * 2.0 * math.pi * math.cos(2.0 * math.pi * t), 0.0])
    return rate_17(paper_problem(1, t), x, velocity), (lengths[1] - lengths[0]) / (2.0 * h), x


def test_rate_is_the_derivative_of_length() -> None:
    x = iterate(make_solver("broyden"), paper_problem(1, 0.0), paper_problem(1, 0.0).first_guess()).x
    errors = []
    for h in (2e-3, 1e-3):
        rate, difference, _ = rate_and_differences("tangency", x, 0.05, h)
        errors.append(abs(difference - rate))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.02)


def test_normals_and_binormals_alone_fold_the_path() -> None:
    """Fig. 8: h = 0 with e = −t at P: ‖f‖ = 2, for good, and l̇ is no derivative of the length any more."""
    x = np.array([math.pi / 3.0, -3.6, -math.sqrt(0.7), math.sqrt(0.3), 3.7])
    solver = make_solver("nr", lam=0.08)
    for t in TIMES[:84:4]:
        problem = paper_problem(1, t, "normals_binormals")
        outcome = iterate(solver, problem, x, TOL)
        x = problem.normalised(outcome.x)
        assert outcome.converged
        assert problem.tangency_error(x) == pytest.approx(2.0, abs=1e-9)
        g = problem.geometry(x)
        e = (g.P[0, 0] - ORIGIN) / np.linalg.norm(g.P[0, 0] - ORIGIN)
        assert e == pytest.approx(-g.t_P[0, 0], abs=1e-9)
    rate, difference, _ = rate_and_differences("normals_binormals", x, float(t), 1e-4)
    assert abs(rate - difference) > 0.01  # [m/s], of 0.057 at most


@every_method
def test_a_folded_path_is_not_reported_as_converged(method: str) -> None:
    folded = paper_problem(1, 0.0, "normals_binormals")
    x = iterate(make_solver("nr"), folded, np.array([math.pi / 3.0, -3.6, -0.84, 0.55, 3.7])).x
    g = folded.geometry(folded.normalised(x))
    scene = (ORIGIN, INSERTION, [mw.Cylinder(0.01)], np.zeros((1, 3)), np.eye(3)[None])
    start = (g.P[0], g.t_P[0], g.arc[0], np.ones(1, dtype=bool))
    path = solve_chain(method, *scene, start, residual="normals_binormals")
    assert path.residual_error <= TOL
    assert path.tangency_error == pytest.approx(2.0, abs=1e-9)
    assert not path.converged


@pytest.mark.parametrize(("method", "options"), [("nr", {"lam": 1e-6}), ("bfgs", {}), ("broyden", {})])
def test_finds_a_path_known_beforehand(method: str, options: dict[str, Any]) -> None:
    """A near start, for other tangent paths lie nearby; λ small beside the σ² of three surfaces in a row."""
    rng = np.random.default_rng(11)
    for _ in range(60):
        scene, exact = made_path(rng)
        n = len(exact.s)
        start = (
            exact.P + 0.01 * rng.normal(size=(n, 3)),
            exact.t + 0.01 * rng.normal(size=(n, 3)),
            exact.s * rng.uniform(0.98, 1.02, n),
            exact.active,
        )
        path = solve_chain(method, *scene, start, **options)
        assert path.converged
        assert path.tangency_error <= TOL
        assert path.active.all()
        assert path.length == pytest.approx(exact.length, rel=LENGTH)
        for name in ("P", "t", "Q", "s"):
            assert getattr(path, name) == pytest.approx(getattr(exact, name), abs=contact_error(scene, exact))


@every_method
def test_takes_in_a_surface_that_was_not_touched(method: str) -> None:
    """From the straight line, through one surface just deep enough to be on the right side of it."""
    rng = np.random.default_rng(12)
    for _ in range(20):
        origin, insertion = np.array([-3.0, 0.0, 0.0]), np.array([3.0, 0.0, 0.5])
        surface = mw.Sphere(1.0) if rng.random() < 0.5 else mw.Cylinder(1.0)
        position = np.array([[0.0, -rng.uniform(0.1, 0.9), 0.0]])
        nowhere = (np.zeros((1, 3)), np.zeros((1, 3)), np.zeros(1), np.zeros(1, dtype=bool))
        path = solve_chain(method, origin, insertion, [surface], position, np.eye(3)[None], nowhere)
        assert path.converged
        assert path.active[0]
        assert path.P[0, 1] > position[0, 1]
        away = solve_chain(
            method, origin, insertion, [surface], position - [0.0, 1.0, 0.0], np.eye(3)[None], nowhere
        )
        assert away.converged
        assert not away.active[0]
        assert away.length == pytest.approx(math.hypot(6.0, 0.5), rel=1e-15)
        assert away.iterations == away.evaluations == 0


@every_method
def test_solve_path_takes_the_method_by_name(method: str) -> None:
    obstacles = [
        mw.Obstacle(mw.Cylinder(0.03), pos=(-0.05, -0.01, 0.0), hint=(0.0, 0.03, 0.0)),
        mw.Obstacle(mw.Sphere(0.03), pos=(0.05, 0.01, 0.01), hint=(0.0, -0.03, 0.0)),
    ]
    ends = (-0.15, 0.0, 0.0), (0.15, 0.01, 0.02)
    newton = mw.solve_path(*ends, obstacles)
    other = mw.solve_path(*ends, obstacles, method=method, start=newton)
    assert newton.converged
    assert other.converged
    assert other.length == pytest.approx(newton.length, rel=LENGTH)
    assert other.evaluations > 0


def assert_finite(path: MethodResult) -> None:
    for name in ("P", "t", "s", "Q", "length", "tangency_error"):
        assert np.isfinite(getattr(path, name)).all(), name


@every_row
def test_running_out_of_iterations_is_a_status(method: str, options: dict[str, Any]) -> None:
    scene = (ORIGIN, INSERTION, [mw.Cylinder(0.01)], np.zeros((1, 3)), np.eye(3)[None])
    path = solve_chain(method, *scene, max_iterations=2, **options)
    assert not path.converged
    assert 2 <= path.iterations <= 4  # the second two after trying to do without the cylinder
    assert path.tangency_error > TOL
    assert_finite(path)


@every_row
@pytest.mark.parametrize("inside", [0.0, 0.003, 0.0099999])
def test_an_end_point_inside_is_a_status(method: str, options: dict[str, Any], inside: float) -> None:
    origin = np.array([inside, 0.0, -0.01])
    scene = (origin, INSERTION, [mw.Cylinder(0.01)], np.zeros((1, 3)), np.eye(3)[None])
    path = solve_chain(method, *scene, max_iterations=100, **options)
    assert not path.converged
    assert_finite(path)


@every_method
def test_a_first_guess_at_the_origin_is_a_status(method: str) -> None:
    scene = (np.array([0.01, 0.0, 0.0]), INSERTION, [mw.Cylinder(0.01)], np.zeros((1, 3)), np.eye(3)[None])
    path = solve_chain(method, *scene)
    assert not path.converged
    assert np.isfinite(path.P).all()
    assert path.iterations == 0


SCENE: Any = (ORIGIN, INSERTION, [mw.Cylinder(0.01)], np.zeros((1, 3)), np.eye(3)[None])


@pytest.mark.parametrize(
    ("method", "options", "message"),
    [
        ("newton", {}, "method must be one of nr, bfgs, broyden, not 'newton'"),
        ("nr", {"step": 1.0}, "has no option 'step'; options: lam, max_iterations, residual"),
        ("nr", {"lam": -0.1}, "lam must be a finite positive number, not -0.1"),
        ("bfgs", {"step": "line_search"}, "step must be 'armijo' or a finite positive number"),
        ("broyden", {"sigma1": math.nan}, "sigma1 must be a finite positive number, not nan"),
        ("broyden", {"residual": "h"}, "residual must be one of tangency, normals_binormals, not 'h'"),
    ],
)
def test_a_wrong_option_is_named(method: str, options: dict[str, Any], message: str) -> None:
    with pytest.raises(mw.GeometryError, match=message):
        solve_chain(method, *SCENE, **options)


def test_a_wrong_scene_is_named() -> None:
    with pytest.raises(mw.GeometryError, match=r"positions must have shape \(1, 3\), not \(2, 3\)"):
        solve_chain("nr", ORIGIN, INSERTION, [mw.Cylinder(0.01)], np.zeros((2, 3)), np.eye(3)[None])
    with pytest.raises(mw.GeometryError, match="origin must be finite"):
        solve_chain("nr", np.full(3, np.nan), *SCENE[1:])
    with pytest.raises(mw.GeometryError, match="support only Cylinder and Sphere, not Surface"):
        solve_chain("nr", ORIGIN, INSERTION, [Surface()], np.zeros((1, 3)), np.eye(3)[None])
    with pytest.raises(mw.GeometryError, match=r"start s must have shape \(1,\)"):
        start = (np.zeros((1, 3)), np.ones((1, 3)), np.zeros(2), np.ones(1, dtype=bool))
        solve_chain("nr", *SCENE, start=start)


def test_no_obstacle_is_a_straight_line() -> None:
    path = solve_chain("nr", ORIGIN, INSERTION, [], np.zeros((0, 3)), np.zeros((0, 3, 3)))
    assert path.converged
    assert path.length == np.linalg.norm(INSERTION - ORIGIN)
