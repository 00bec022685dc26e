"""Gradient, stiffness and sliding contacts of a path, against difference quotients of solutions and against its laws.

Quotients of solutions carry the solver's rounding over the step; their own error is of second order.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from derivative_scenes import Array, Case, make_case, random_case

import mjwrap as mw
from mjwrap.kernels import layout
from mjwrap.paths import ContactVelocity

# Rows of obstacles, by the letters of `derivative_scenes.random_obstacle`.
ROWS = [
    "c",
    "s",
    "e",
    "y",
    "t",
    "k",
    "p",
    "cc",
    "sc",
    "csc",
    "cvs",
    "b",
    "etk",
    "ypvte",
    "bk",
    "C",
    "S",
    "SvcvC",
]
CASES = 50
STEP = 5e-4  # of the coarser quotient: 2.5e-5 m and 5e-4 rad
FLOOR = 1e-9  # of quotients at half of it: what the tangency error of 1e-13 leaves
ROUNDING = 1e-12  # of a Hessian, relative to its largest entry: some hundred terms


@functools.cache
def cases(kinds: str) -> list[tuple[Case, Array]]:
    """Return random paths with a random direction each, along which they stay away from slipping off a surface.

    A string that is about to slip runs away, ends elsewhere and leaves no quotient: contacts may move at 1 m/s.
    """
    rng = np.random.default_rng(31)
    found = []
    while len(found) < CASES:
        case = random_case(rng, kinds)
        direction = case.motion(rng)
        sides = [case.solve(direction, h) for h in (-4 * STEP, 4 * STEP)]
        if not all(case.same_contacts(side) for side in sides):
            continue
        if np.abs(points(sides[1].contacts) - points(sides[0].contacts)).max() < 8 * STEP:
            found.append((case, direction))
    return found


def points(contacts: Sequence[mw.Contact | ContactVelocity]) -> Array:
    """Return P, Q and arc length of every contact with an obstacle or via point, (m, 7), or their rates."""
    touches = [c for contact in contacts for c in (contact, contact.second) if c is not None]
    return np.array([np.r_[c.P, c.Q, c.arc_length] for c in touches])  # type: ignore[arg-type]


def check_second_order(quotient: Callable[[float], Array], exact: Array) -> float:
    """Assert that a difference quotient meets its limit and that its error falls by four with half the step.

    Returns the observed ratio, or NaN where rounding hides it.
    """
    coarse, fine = (float(np.abs(quotient(h) - exact).max()) for h in (STEP, STEP / 2))
    assert fine <= coarse / 3.0 + FLOOR
    assert fine <= 1e-2 * float(np.abs(exact).max()) + FLOOR
    return coarse / fine if coarse > 100 * FLOOR else np.nan


def gradient_rate(case: Case, direction: Array) -> Array:
    """Return the rate of the gradient along a direction, from the stiffness: twists do not commute."""
    rate = case.sol.stiffness_times(direction)
    rate[:, 3:] -= 0.5 * np.cross(case.sol.gradient()[:, 3:], direction[:, 3:])
    return rate


@pytest.mark.parametrize("kinds", ROWS)
def test_gradient_is_what_speed_and_wrenches_say(kinds: str) -> None:
    """Two other sums over the same segments; wrenches have moments about the world's origin, and pull."""
    for case, direction in cases(kinds):
        gradient = case.sol.gradient()
        speed = case.sol.speed(direction[0, :3], direction[-1, :3], direction[1:-1])
        assert (gradient * direction).sum() == pytest.approx(speed, abs=1e-14 * np.abs(direction).sum())
        about_world = gradient.copy()
        about_world[:, 3:] += np.cross(case.places(), gradient[:, :3])
        assert np.abs(about_world + case.sol.wrenches(1.0)).max() < 1e-14


@pytest.mark.parametrize("kinds", ROWS)
def test_stiffness_is_the_rate_of_the_gradient(kinds: str) -> None:
    ratios = []
    for case, direction in cases(kinds):

        def quotient(h: float, case: Case = case, direction: Array = direction) -> Array:
            return (case.moved(direction, h).gradient() - case.moved(direction, -h).gradient()) / (2 * h)

        ratios.append(check_second_order(quotient, gradient_rate(case, direction)))
    assert np.nanmedian(ratios) == pytest.approx(4.0, abs=0.05)
    assert np.isfinite(ratios).sum() > CASES // 3


@pytest.mark.parametrize("kinds", ROWS)
def test_stiffness_is_the_second_derivative_of_length_along_rotation_vectors(kinds: str) -> None:
    """No gradient enters here: second differences of l itself, at larger steps, for its rounding counts twice.

    One number's error has no fixed sign, and changes by any factor where two of its terms cancel; most do not.
    """
    ratios = []
    for case, direction in cases(kinds):
        along, matrix = direction.ravel(), case.sol.stiffness()
        exact, scale = along @ matrix @ along, np.abs(along) @ np.abs(matrix) @ np.abs(along)
        errors, middle = [], case.sol.length
        for h in (4 * STEP, 2 * STEP):
            sides = case.moved(direction, h).length, case.moved(direction, -h).length
            errors.append(abs((sides[0] - middle + (sides[1] - middle)) / h**2 - exact))
        rounding = 1e-15 / (2 * STEP) ** 2  # four lengths of some 0.5 m, sums of several terms each
        assert errors[1] <= 5e-3 * scale + rounding
        if errors[0] > 100 * rounding:
            ratios.append(errors[0] / errors[1])
    assert len(ratios) > CASES // 4
    assert np.median(ratios) == pytest.approx(4.0, abs=0.05)


@pytest.mark.parametrize("kinds", ROWS)
def test_wrenches_change_as_the_stiffness_says(kinds: str) -> None:
    """d(wrench) = -(df, dm + u x f + c x df): their moments are about the world's origin, from which c moves with u."""
    for case, direction in cases(kinds):
        rate, force, place = gradient_rate(case, direction), case.sol.gradient()[:, :3], case.places()
        exact = -rate
        exact[:, 3:] -= np.cross(direction[:, :3], force) + np.cross(place, rate[:, :3])

        def quotient(h: float, case: Case = case, direction: Array = direction) -> Array:
            sides = case.moved(direction, h), case.moved(direction, -h)
            return (sides[0].wrenches(1.0) - sides[1].wrenches(1.0)) / (2 * h)

        check_second_order(quotient, exact)


@pytest.mark.parametrize("kinds", ROWS)
def test_contact_velocities_are_the_rates_of_the_contacts(kinds: str) -> None:
    ratios = []
    for case, direction in cases(kinds):
        rates = case.sol.contact_velocities(direction[0, :3], direction[-1, :3], direction[1:-1])
        exact = points(rates)

        def quotient(h: float, case: Case = case, direction: Array = direction) -> Array:
            sides = case.moved(direction, h), case.moved(direction, -h)
            return (points(sides[0].contacts) - points(sides[1].contacts)) / (2 * h)

        ratios.append(check_second_order(quotient, exact))
    assert np.nanmedian(ratios) == pytest.approx(4.0, abs=0.05)


@pytest.mark.parametrize("kinds", ROWS)
def test_stiffness_is_symmetric_and_times_is_its_product(kinds: str) -> None:
    for case, direction in cases(kinds):
        matrix = case.sol.stiffness()
        scale = ROUNDING * np.abs(matrix).max()
        assert np.abs(matrix - matrix.T).max() <= scale
        product = (matrix @ direction.ravel()).reshape(-1, 6)
        assert np.abs(case.sol.stiffness_times(direction) - product).max() <= scale


def test_stiffness_is_symmetric_where_the_path_is_only_just_converged() -> None:
    """The tangency error that is left must not show as an asymmetry."""
    rng = np.random.default_rng(37)
    for _ in range(CASES):
        case = random_case(rng, "csc")
        direction = case.motion(rng)
        sol = mw.solve_path(case.origin + 1e-3 * direction[0, :3], case.insertion, case.row, tol=1e-4)
        assert sol.converged
        matrix = sol.stiffness()
        assert np.abs(matrix - matrix.T).max() <= ROUNDING * np.abs(matrix).max()


@pytest.mark.parametrize("kinds", ROWS)
def test_moving_everything_alike_changes_nothing(kinds: str) -> None:
    """Translated, the gradient stays; rotated, it turns along by (w x f, w x m), in rotation vectors m x w / 2 more."""
    rng = np.random.default_rng(38)
    for case, _ in cases(kinds):
        shift = np.zeros((case.slots, 6))
        shift[:, :3] = rng.normal(size=3)
        scale = ROUNDING * np.abs(case.sol.stiffness()).max()
        assert np.abs(case.sol.gradient()[:, :3].sum(axis=0)).max() < 1e-14
        assert np.abs(case.sol.stiffness_times(shift)).max() <= scale
        spin = np.zeros((case.slots, 6))
        spin[:, 3:] = omega = rng.normal(size=3)
        spin[:, :3] = np.cross(omega, case.places())
        gradient = case.sol.gradient()
        assert abs((gradient * spin).sum()) < 1e-14
        turned = np.c_[np.cross(omega, gradient[:, :3]), 0.5 * np.cross(omega, gradient[:, 3:])]
        assert np.abs(case.sol.stiffness_times(spin) - turned).max() <= scale


def test_a_straight_path_has_the_stiffness_of_a_taut_string() -> None:
    """Across a segment of length L it is 1/L between its ends, along it zero; an obstacle beside it takes no part."""
    rng = np.random.default_rng(39)
    for _ in range(CASES):
        a, b = rng.normal(size=3), rng.normal(size=3)
        aside = mw.Obstacle(mw.Sphere(0.01), tuple(a + b + 5.0))
        matrix = mw.solve_path(a, b, [aside]).stiffness().reshape(3, 6, 3, 6)
        size = float(np.linalg.norm(b - a))
        across = (np.eye(3) - np.outer(b - a, b - a) / size**2) / size
        assert matrix[2, :3, 2, :3] == pytest.approx(across, abs=1e-14 / size)
        assert matrix[0, :3, 2, :3] == pytest.approx(-across, abs=1e-14 / size)
        assert not matrix[1].any()
        assert not matrix[:, :, 1].any()
        assert not matrix[:, 3:].any()


def test_a_cylinder_in_the_plane_is_solved_by_hand() -> None:
    """Ends at (d, 0) and (-d, 0), the string over the top of a unit cylinder, straight for sqrt(d^2 - 1) at either end.

    Across that segment the end feels one over its length. Along the axis, out of the plane, the unrolled string is
    straight: 1 / l. About its axis the cylinder turns freely under the string.
    """
    for d in (1.1, 1.5, 3.0):
        sol = mw.solve_path((d, 0, 0), (-d, 0, 0), [mw.Obstacle(mw.Cylinder(1.0), hint=(0, 1, 0))])
        free = np.sqrt(d * d - 1.0)
        matrix = sol.stiffness().reshape(3, 6, 3, 6)
        across = np.array([1.0 / d, free / d, 0.0])
        assert matrix[0, :3, 0, :3] @ across == pytest.approx(across / free, abs=1e-13)
        assert matrix[0, 2, 0, 2] == pytest.approx(1.0 / sol.length, rel=1e-13)
        assert matrix[0, 2, 2, 2] == pytest.approx(-1.0 / sol.length, rel=1e-13)
        assert np.abs(matrix[:, :, 1, 5]).max() < 1e-14


def sphere_by_hand(d: float, angle: float) -> tuple[float, float]:
    """Return d2l/dz2 and d2l/dzdw of a string over a unit sphere, its ends at distance d from the centre.

    l = sum of sqrt(d^2 - 1) - acos(1 / d) over both ends + the angle between them as seen from the centre. Lifted out
    of the plane by z and w, the ends are further away by z^2 / 2d and w^2 / 2d, and the angle grows by
    (z^2 + w^2) cot(angle) / 2 d^2 - z w / (d^2 sin(angle)), from the product of their directions.
    """
    return (np.sqrt(d * d - 1.0) + 1.0 / np.tan(angle)) / d**2, -1.0 / (d**2 * np.sin(angle))


@pytest.mark.parametrize(("d", "angle"), [(1.3, 2.0), (2.0, 2.5), (1.05, 1.0), (3.0, np.pi - 1e-4)])
def test_a_sphere_is_solved_by_hand(d: float, angle: float) -> None:
    """The last case is a string close to slipping: opposite the centre the angle's derivatives grow beyond bounds."""
    ends = (d, 0.0, 0.0), (d * np.cos(angle), d * np.sin(angle), 0.0)
    sol = mw.solve_path(*ends, [mw.Obstacle(mw.Sphere(1.0))], tol=1e-14)
    matrix = sol.stiffness().reshape(3, 6, 3, 6)
    own, other = sphere_by_hand(d, angle)
    assert matrix[0, 2, 0, 2] == pytest.approx(own, rel=1e-11)
    assert matrix[2, 2, 2, 2] == pytest.approx(own, rel=1e-11)
    assert matrix[0, 2, 2, 2] == pytest.approx(other, rel=1e-11)


def test_at_touchdown_the_stiffness_across_jumps_and_sideways_does_not() -> None:
    """A string that just touches a sphere is held by it along the normal, so that its end feels one part only.

    Across the normal it is as loose as before. The contact's rates are finite, of the path that touches.
    """
    for depth in (1e-5, 1e-7, 1e-9):
        ends = (1.5, 1.0 - depth, 0.0), (-2.5, 1.0 - depth, 0.0)
        sol = mw.solve_path(*ends, [mw.Obstacle(mw.Sphere(1.0))])
        free = mw.solve_path(*ends)
        assert sol.contacts[0].active
        held, loose = sol.stiffness()[:3, :3], free.stiffness()[:3, :3]
        assert loose[1, 1] == pytest.approx(1 / 4.0, rel=1e-12)
        assert held[1, 1] == pytest.approx(1 / 1.5, rel=2 * depth)
        assert held[2, 2] == pytest.approx(1 / 4.0, rel=5 * depth)
        rate = sol.contact_velocities((0, -1, 0), (0, 0, 0))[0]
        assert rate.P is not None
        assert rate.P[0] == pytest.approx(1 / 1.5, rel=5 * depth)
        assert rate.arc_length == pytest.approx(1 / 1.5, rel=5 * depth)


def test_via_points_split_the_stiffness() -> None:
    rng = np.random.default_rng(40)
    for _ in range(CASES):
        case = random_case(rng, "cvs")
        via = np.array(case.row[1].pos)
        parts = make_case(case.origin, via, case.row[:1]), make_case(via, case.insertion, case.row[2:])
        total = np.zeros((5, 6, 5, 6))
        for part, first in zip(parts, (0, 2), strict=True):
            slots = slice(first, first + 3)
            total[slots, :, slots] += part.sol.stiffness().reshape(3, 6, 3, 6)
        whole = case.sol.stiffness()
        assert np.abs(whole - total.reshape(30, 30)).max() <= ROUNDING * np.abs(whole).max()
        velocity = rng.normal(size=6)
        rate = case.sol.contact_velocities((0, 0, 0), (0, 0, 0), np.outer([0, 1, 0], velocity))[1]
        assert rate.P is not None
        assert np.array_equal(rate.P, velocity[:3])


UNIT = [mw.Obstacle(mw.Cylinder(1.0))]


def test_an_end_point_on_the_surface_has_a_gradient_and_no_stiffness() -> None:
    on = mw.solve_path((1.0, 0.0, -2.5), (-2, 0.3, -0.5), UNIT)
    near = mw.solve_path(
        (1.0 + 1e-11, 0.0, -2.5), (-2, 0.3, -0.5), UNIT
    )  # less than 2e-12 high it lies on the surface
    assert np.abs(on.gradient() - near.gradient()).max() < 1e-5
    assert np.isfinite(near.stiffness()).all()
    for call in (on.stiffness, lambda: on.contact_velocities((0, 0, 0), (0, 0, 0))):
        with pytest.raises(mw.GeometryError, match="segment that leaves the origin has zero length"):
            call()
    twice = [mw.ViaPoint((1, 0, 0)), mw.ViaPoint((1, 0, 0))]
    with pytest.raises(mw.GeometryError, match="leaves via point 0 has zero length"):
        mw.solve_path((0, 0, 0), (3, 0, 0), twice).stiffness()


def test_a_contact_about_to_slip_has_no_stiffness() -> None:
    """Where a sphere's centre lies on the chord every great circle is as long, and the string may slip round it."""
    with pytest.raises(mw.GeometryError, match="contact with obstacle 0 could slip sideways"):
        mw.solve_path((3, 0, 0), (-3, 0, 0), [mw.Obstacle(mw.Sphere(1.0), hint=(0, 1, 0))]).stiffness()


def test_a_contact_on_a_line_that_the_string_follows_has_no_velocity() -> None:
    """No closed surface has one for more than an instant, so the curvature is taken away by hand."""
    sol = mw.solve_path((2, 0, -2.5), (-2, 0, -0.5), UNIT)
    sol._node[0, layout.W_KQ] = 0.0
    assert np.isfinite(sol.stiffness()).all()
    with pytest.raises(mw.GeometryError, match="surface of obstacle 0 is flat along the path"):
        sol.contact_velocities((0, 0, 1), (0, 0, 0))


def test_a_path_that_was_not_found_has_no_derivatives() -> None:
    sol = mw.solve_path((0.5, 0.1, 0), (-2, 0, 0.1), UNIT)
    calls = (
        sol.gradient,
        sol.stiffness,
        lambda: sol.stiffness_times(np.zeros((3, 6))),
        lambda: sol.contact_velocities((0, 0, 0), (0, 0, 0)),
    )
    for call in calls:
        with pytest.raises(mw.PathError, match="lies inside the surface"):
            call()


def test_bad_directions_are_named() -> None:
    sol = mw.solve_path((2, 0, 0), (-2, 0, 0), UNIT)
    for bad in (np.zeros((2, 6)), np.full((3, 6), np.nan)):
        with pytest.raises(mw.GeometryError, match=r"direction must be finite and have shape \(3, 6\)"):
            sol.stiffness_times(bad)
    with pytest.raises(mw.GeometryError, match="twists must have shape"):
        sol.contact_velocities((0, 0, 0), (0, 0, 0), np.zeros((2, 6)))
