"""Elliptic cylinders of any aspect, against mpmath: arcs, geodesics, paths, tangency; windings that are kept."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from numpy.typing import NDArray

import mjwrap as mw
from mjwrap.kernels import layout as lay
from mjwrap.kernels.geometry import geodesics
from mjwrap.kernels.geometry.elliptic_cylinder import ellipse_arc
from mjwrap.kernels.tangency.tangency_error import POINT_ROUNDING
from mjwrap.surfaces.rows import write_surface
from mjwrap.verification.scenes import check_path

Array = NDArray[np.float64]
ASPECTS = (1.0, 1.5, 7.0, 20.0, 50.0, 100.0, 1000.0)
DIGITS = 40
CASE = Path(__file__).resolve().parents[2] / "shared" / "cases" / "30_wound_elliptic_cylinder" / "move.json"
CASES = 50


def exact_arc(a: float, b: float, start: Any, stop: Any) -> Any:
    """Return the length of (a cos w, b sin w) from w = start to stop, with its sign, by mpmath's elliptic integral."""
    square = mp.mpf(a) ** 2

    def measured(w: Any) -> Any:
        return mp.mpf(b) * mp.ellipe(w, 1 - square / mp.mpf(b) ** 2)

    return measured(stop) - measured(start)


def radii(rng: np.random.Generator, aspect: float) -> tuple[float, float]:
    long = rng.uniform(0.01, 0.05)
    return (long, long / aspect) if rng.random() < 0.5 else (long / aspect, long)


@pytest.mark.parametrize("aspect", ASPECTS)
def test_arcs_and_geodesics_are_exact_to_rounding(aspect: float) -> None:
    """A geodesic's end differs by the rounding of its arc alone, a few units in the last place of the longer radius."""
    rng = np.random.default_rng(11)
    with mp.workdps(DIGITS):
        for _ in range(CASES):
            a, b = radii(rng, aspect)
            start, turn = rng.uniform(-3.0, 3.0), rng.uniform(-9.0, 9.0)
            arc = exact_arc(a, b, mp.mpf(start), mp.mpf(start) + mp.mpf(turn))
            assert ellipse_arc(a, b, start, turn) == pytest.approx(float(abs(arc)), rel=1e-14)
            node = np.zeros((1, lay.ROW))
            write_surface(mw.EllipticCylinder((a, b)), node)
            node[0, lay.ROT : lay.ROT + 9 : 4] = 1.0
            c, s = math.cos(start), math.sin(start)
            rate = math.hypot(a * s, b * c)
            node[0, lay.S_P : lay.S_P + 2] = a * c, b * s
            node[0, lay.S_T : lay.S_T + 2] = -a * s / rate, b * c / rate
            node[0, lay.S_ARC] = float(arc)
            geodesics.geodesic(0, node, 0.0, 0.0, 0.0)
            stop = mp.mpf(start) + mp.mpf(turn)
            exact = np.array([float(a * mp.cos(stop)), float(b * mp.sin(stop))])
            assert np.linalg.norm(node[0, lay.W_Q : lay.W_Q + 2] - exact) < 4e-15 * (
                abs(float(arc)) + max(a, b)
            )
            assert node[0, lay.W_ANGLE] == pytest.approx(turn, abs=4e-15 * aspect * (1.0 + abs(turn)))


def scene(rng: np.random.Generator, aspect: float) -> tuple[Array, Array, mw.Obstacle]:
    """Return ends at least half the longer radius apart from the axis, and an upright elliptic cylinder."""
    a, b = radii(rng, aspect)
    ends = []
    while len(ends) < 2:
        x = rng.normal(size=3) * np.array([a, b, 0.02]) * rng.uniform(1.2, 4.0)
        if (x[0] / a) ** 2 + (x[1] / b) ** 2 > 1.5:
            ends.append(x)
    return ends[0], ends[1], mw.Obstacle(mw.EllipticCylinder((a, b)))


def exact_length(origin: Array, insertion: Array, sides: tuple[float, float], sweep: float) -> Any:
    """Return the length of the path that sweeps the angle in the affine image, from tangents and arc [m]."""
    a, b = map(mp.mpf, sides)
    x, y, p, q = (mp.mpf(float(v)) for v in (*origin[:2], *insertion[:2]))
    way = 1 if sweep > 0.0 else -1
    first = mp.atan2(y / b, x / a) + way * mp.acos(1 / mp.hypot(x / a, y / b))
    last = mp.atan2(q / b, p / a) - way * mp.acos(1 / mp.hypot(p / a, q / b))
    whole = mp.atan2(q / b, p / a) - mp.atan2(y / b, x / a)
    last += 2 * mp.pi * mp.nint((mp.mpf(sweep) - whole) / (2 * mp.pi))
    flat = abs(exact_arc(sides[0], sides[1], first, last))
    flat += mp.hypot(x - a * mp.cos(first), y - b * mp.sin(first))
    flat += mp.hypot(p - a * mp.cos(last), q - b * mp.sin(last))
    return mp.hypot(flat, mp.mpf(float(insertion[2])) - mp.mpf(float(origin[2])))


def turned(path: mw.PathSolution, turns: int) -> Array:
    branch = path.branch
    branch[0, 1] += 2.0 * math.pi * turns
    return branch


@pytest.mark.parametrize("aspect", ASPECTS)
def test_lengths_are_exact_and_tangency_is_within_the_stated_bound(aspect: float) -> None:
    """|e - t| <= 1e-10 + δ (1 / λ + κ), with exact tangents at the path's contact points (docs/derivation.md)."""
    rng, touched = np.random.default_rng(12), 0
    with mp.workdps(DIGITS):
        while touched < CASES:
            origin, insertion, obstacle = scene(rng, aspect)
            path = mw.solve_path(origin, insertion, [obstacle])
            path = mw.solve_path(origin, insertion, [obstacle], start=turned(path, int(rng.integers(-2, 3))))
            assert path.converged
            if not path.contacts[0].active:
                continue
            touched += 1
            check_path(origin, insertion, [obstacle], path)
            a, b = obstacle.surface.dims[:2]
            sides = a, b
            exact = exact_length(origin, insertion, sides, path.branch[0, 1])
            assert abs(mp.mpf(path.length) / exact - 1) < 4e-15
            contact = path.contacts[0]
            for end, point in ((origin, contact.P), (insertion, contact.Q)):
                assert point is not None
                away = point - end
                e = away / np.linalg.norm(away)
                c, s = mp.mpf(point[0]) / sides[0] ** 2, mp.mpf(point[1]) / sides[1] ** 2
                miss = abs(float((e[0] * c + e[1] * s) / mp.hypot(c, s)))
                bend = 1.0 / (sides[0] * sides[1] * float(mp.hypot(c, s)) ** 3) / (sides[0] * sides[1])
                assert miss <= 1e-10 + POINT_ROUNDING * (1.0 / np.linalg.norm(away) + bend)


def test_a_wound_string_keeps_its_winding_however_the_motion_is_cut() -> None:
    """Wound by up to 2.5 turns over aspects 2 to 100, moved and turned a little in 1 to 100 steps."""
    rng, moved = np.random.default_rng(13), 0
    while moved < CASES:
        origin, insertion, obstacle = scene(rng, math.exp(rng.uniform(math.log(2.0), math.log(100.0))))
        start = mw.solve_path(origin, insertion, [obstacle])
        start = mw.solve_path(origin, insertion, [obstacle], start=turned(start, int(rng.integers(1, 3))))
        if not start.contacts[0].active:
            continue
        moved += 1
        size = min(obstacle.surface.dims[:2])
        shifts, twist = rng.normal(size=(2, 3)) * 0.03 * size, rng.normal(size=3) * 0.2 * size
        lengths = []
        for steps in (1, 2, 3, 10, 100):
            path = start
            for share in np.linspace(0.0, 1.0, steps + 1)[1:]:
                quat = (1.0, *(0.5 * share * twist))
                row = [mw.Obstacle(obstacle.surface, quat=quat)]
                path = mw.solve_path(
                    origin + share * shifts[0], insertion + share * shifts[1], row, start=path
                )
                assert path.converged
            lengths.append(path.length)
        assert max(lengths) - min(lengths) < 1e-13
        assert abs(path.branch[0, 1] - start.branch[0, 1]) < 1.5


@pytest.mark.skipif(not CASE.is_file(), reason="needs the shared cases beside the checkout")
def test_the_case_of_a_wound_string_is_kept_in_any_number_of_steps() -> None:
    """Wound 1.5 turns over aspect 7; it was lost in 1, 3, 10 and 100 steps (0.3008 m) and kept in 2 (0.4325 m)."""
    case, lengths = json.loads(CASE.read_text()), []
    surface = mw.EllipticCylinder((case["dims"][0], case["dims"][1]))
    for poses in case["steps"].values():
        path: Any = np.array(case["start_branch"])
        for pose in poses:
            row = [mw.Obstacle(surface, pose["pos"][0], pose["quat"][0], case["hint"])]
            path = mw.solve_path(pose["origin"], pose["insertion"], row, start=path)
            assert path.converged
        lengths.append(path.length)
    assert len(lengths) >= 5
    assert lengths == pytest.approx([0.4325] * len(lengths), abs=5e-5)
    assert np.ptp(lengths) < 1e-10
