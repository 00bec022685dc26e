"""Reasons for differences from OpenSim: each from numbers that show it, and none where they do not."""

from dataclasses import replace

import numpy as np
import pytest

import mjwrap as mw
from mjwrap.osim.verifying.imported import ImportedNumbers
from mjwrap.osim.verifying.lone_surfaces import closed_form_length
from mjwrap.osim.verifying.reasons import UNEXPLAINED, length_reason
from mjwrap.osim.verifying.reference import PoseNumbers
from mjwrap.osim.verifying.stops import Point, Touched, TouchingRoute

POSE = PoseNumbers({}, {}, None, {"m": 1.0}, {}, {}, {}, {}, {})
ENDS = Point("m_p1", np.array([0.1, -1.0, 0.0])), Point("m_p2", np.array([-0.1, -1.0, 0.3]))


def touched(surface=None, half=np.inf):
    contact = np.array([[0.1, 0.0, 0.1], [-0.1, 0.0, 0.2]])
    return Touched("w", surface or mw.Cylinder(0.1), np.zeros(3), np.eye(3), contact, half)


def route(surface, length=None):
    found = TouchingRoute("m", 0.0, [ENDS[0], surface, ENDS[1]])
    return replace(found, length=closed_form_length(found) if length is None else length)


def reason(pose=POSE, routes=(), touches=1, status=None, geodesic=None):
    statuses = {"m": status} if status else {}
    ours = ImportedNumbers({}, None, {"m": 1.002}, statuses, {}, {}, {}, {"m": touches}, {}, list(routes))
    return length_reason("m", pose, ours, 0.002, geodesic)


WRAPS = replace(POSE, wraps={"m": {"w": [0.2, 0.1, 0.0]}}, segments={"m": {"w": ["p1", "p2"]}})


def test_a_geodesic_that_nothing_confirms_is_not_explained():
    off = touched(mw.Ellipsoid((0.1, 0.1, 0.4)))
    assert reason(WRAPS, [route(off, 1.0)]).startswith(UNEXPLAINED)
    assert reason(WRAPS, [route(off, 1.0)], geodesic=lambda _: 1.001).startswith(UNEXPLAINED)
    assert reason(WRAPS, [route(off, 1.0)], geodesic=lambda _: None).startswith(UNEXPLAINED)
    wrong = route(touched())
    assert reason(WRAPS, [replace(wrong, length=wrong.length + 1e-6)]).startswith(UNEXPLAINED)


def test_a_closed_form_or_opensims_geodesic_confirms_mjwrap():
    assert "closed form" in reason(WRAPS, [route(touched())])
    off = route(touched(mw.Ellipsoid((0.1, 0.1, 0.4))), 1.0)
    assert "Scholz2015GeometryPath has mjwrap's length" in reason(
        WRAPS, [off], geodesic=lambda _: 1.0 + 1e-10
    )


def test_a_surface_that_acts_elsewhere_is_named():
    other = replace(WRAPS, segments={"m": {"w": ["p2", "p3"]}})
    assert reason(other, [route(touched())]) == (
        "w acts on another segment: in OpenSim between p2 and p3, in mjwrap between m_p1 and m_p2"
    )


@pytest.mark.parametrize(("half", "told"), [(0.15, True), (0.25, False)])
def test_a_contact_beyond_the_end_of_a_cylinder(half, told):
    surface = touched(half=half)
    found = reason(POSE, [route(surface, 1.0)])
    assert ("touches w 50 mm beyond the end of OpenSim's cylinder" in found) == told
    straight = replace(POSE, lengths={"m": float(np.linalg.norm(ENDS[0].pos - ENDS[1].pos))})
    without = "without it the path has OpenSim's length"
    assert (without in reason(straight, [route(surface, 1.0)])) == told
    assert without not in found
    assert "beyond" not in reason(WRAPS, [route(surface, 1.0)])  # OpenSim wraps it, too


def test_faults_of_opensims_own_path():
    short = replace(WRAPS, wraps={"m": {"w": [0.09, 0.1, 0.0]}})
    bent = replace(WRAPS, wraps={"m": {"w": [0.2, 0.1, 0.5]}})
    jumps = replace(WRAPS, slopes={"m": {"q": [0.01, 4.0]}})
    off = [route(touched(mw.Ellipsoid((0.1, 0.1, 0.4))), 1.0)]
    assert reason(short, off) == "OpenSim's arc is shorter than its own chord on w"
    assert "not taut: its straight line meets w at 30.0 degrees" in reason(bent, off)
    assert reason(jumps, off) == "OpenSim's length jumps by 0.40 mm as q moves by 0.0001"
    assert reason(short, off, status="inside") == "mjwrap has no path: inside"


def test_numbers_of_contacts_are_told_last():
    assert reason(WRAPS, touches=0) == "OpenSim wraps w; the geodesic has lifted off"
    assert reason(POSE) == "the geodesic touches a surface that OpenSim's path does not wrap"
    assert reason(WRAPS, touches=2) == "the geodesic touches 2 surfaces, OpenSim's path 1"
