"""Closed forms that judge between paths over one cylinder or sphere, beside lengths by hand and mjwrap's paths."""

import numpy as np
import pytest

import mjwrap as mw
from mjwrap.osim.verifying.lone_surfaces import closed_form_length
from mjwrap.osim.verifying.stops import Point, Touched, TouchingRoute


def route(surface, ends, middle, turn=None, pos=(0.0, 0.0, 0.0)):
    turn = np.eye(3) if turn is None else turn
    touched = Touched("s", surface, np.array(pos), turn, np.array([middle, middle], dtype=float), np.inf)
    start, end = (Point("p", turn @ np.array(e, dtype=float) + pos) for e in ends)
    return TouchingRoute("m", 0.0, [start, touched, end])


def test_half_a_turn_round_a_cylinder_is_a_helix_of_half_a_turn():
    # tangents of length 1 at x = ±0.1 and half a circle of radius 0.1 between; the rise is spread over all of it
    flat = 2.0 + 0.1 * np.pi
    ends = [(0.1, -1.0, 0.0), (-0.1, -1.0, 0.3)]
    assert closed_form_length(route(mw.Cylinder(0.1), ends, (0.0, 0.1, 0.15))) == pytest.approx(
        np.hypot(flat, 0.3), rel=1e-15
    )


def test_the_side_decides_the_way_round():
    ends = [(0.3, 0.05, 0.0), (-0.3, 0.05, 0.0)]
    over = closed_form_length(route(mw.Cylinder(0.1), ends, (0.0, 0.1, 0.0)))
    under = closed_form_length(route(mw.Cylinder(0.1), ends, (0.0, -0.1, 0.0)))
    far = np.hypot(0.3, 0.05)
    tangents, spent = 2.0 * np.sqrt(far**2 - 0.01), 2.0 * np.arccos(0.1 / far)
    above = np.pi - 2.0 * np.arctan2(0.05, 0.3)
    assert over == pytest.approx(tangents + 0.1 * (above - spent), rel=1e-14)
    assert under == pytest.approx(tangents + 0.1 * (2.0 * np.pi - above - spent), rel=1e-14)
    assert under != pytest.approx(over, abs=0.05)


def test_a_sphere_is_a_circle_in_the_plane_of_ends_and_centre():
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    ends = [(0.1, -1.0, 0.0), (-0.1, -1.0, 0.0)]
    found = closed_form_length(route(mw.Sphere(0.1), ends, (0.0, 0.1, 0.0), turn, (1.0, 2.0, 3.0)))
    assert found == pytest.approx(2.0 + 0.1 * np.pi, rel=1e-14)


@pytest.mark.parametrize("surface", [mw.Cylinder(0.04), mw.Sphere(0.05)], ids=["cylinder", "sphere"])
def test_it_is_the_length_of_solved_paths(surface):
    rng = np.random.default_rng(7)
    compared = 0
    while compared < 30:
        ends = rng.uniform(-0.2, 0.2, (2, 3))
        if min(np.linalg.norm(ends[:, :2], axis=1)) < 0.08:
            continue
        path = mw.solve_path(ends[0], ends[1], [mw.Obstacle(surface)])
        contact = path.contacts[0]
        if contact.P is None or contact.Q is None:
            continue
        middle = 0.5 * (contact.P + contact.Q)
        assert closed_form_length(route(surface, ends, middle)) == pytest.approx(path.length, abs=1e-12)
        compared += 1


def test_others_have_no_closed_form():
    ends = [(0.3, 0.05, 0.0), (-0.3, 0.05, 0.0)]
    assert closed_form_length(route(mw.Ellipsoid((0.1, 0.1, 0.2)), ends, (0.0, 0.1, 0.0))) is None
    inside = [(0.01, 0.0, 0.0), (-0.3, 0.05, 0.0)]
    assert closed_form_length(route(mw.Cylinder(0.1), inside, (0.0, 0.1, 0.0))) is None
    pair = route(mw.Cylinder(0.1), ends, (0.0, 0.1, 0.0))
    twice = TouchingRoute("m", 0.0, [pair.stops[0], pair.stops[1], pair.stops[1], pair.stops[2]])
    assert closed_form_length(twice) is None
