"""The search that judges the solver: exact references are among its paths, and it finds what closed forms know."""

from __future__ import annotations

import importlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from reference_paths import reference_scene

import mjwrap as mw
from mjwrap.verification.certificate import Case, findings
from mjwrap.verification.scenes import SURFACES, random_scene
from mjwrap.verification.shapes import Array


@pytest.fixture
def search() -> Any:
    return importlib.import_module("mjwrap.verification.multistart")


def scene_of(scene: dict[str, Any], pose: dict[str, Any]) -> tuple[Array, Array, list[mw.Obstacle]]:
    """Return origin, insertion and obstacles, without hints, of one reference pose."""
    row = []
    for s, pos, quat in zip(scene["surfaces"], pose["pos"], pose["quat"], strict=True):
        dims = [s["dims"]] if s["kind"] == "ellipsoid" else s["dims"]
        row.append(mw.Obstacle(SURFACES[s["kind"]](*dims), tuple(pos), tuple(quat)))
    return np.array(pose["origin"]), np.array(pose["insertion"]), row


@pytest.mark.parametrize("name", ["a_cyl", "b_sphere", "c_ellipsoid", "d_torus"])
def test_the_exact_path_is_among_those_over_one_surface(search: Any, name: str) -> None:
    """Directly minimised paths (spectral curves, IPOPT) on the hint's side; others may be shorter."""
    scene = reference_scene(name)
    for pose in scene["poses"][::10]:
        origin, insertion, row = scene_of(scene, pose)
        cases = search.paths_over_one(origin, insertion, row[0])
        good = [case for case, reason in zip(cases, findings(cases), strict=True) if not reason]
        best = min(good, key=lambda case: abs(case.length - pose["length"]))
        assert best.length == pytest.approx(pose["length"], rel=1e-12)
        assert sum(s for _, _, s in best.contacts[0]) == pytest.approx(pose["arc_lengths"][0], rel=1e-8)


@pytest.mark.parametrize("name", ["e3_mixed", "f_cyl02"])
def test_no_path_found_over_a_row_is_shorter_than_it_can_be(search: Any, name: str) -> None:
    """The exact path is a minimum on its side: the search finds it, or another true path that is shorter."""
    scene = reference_scene(name)
    for pose in scene["poses"][::20]:
        origin, insertion, row = scene_of(scene, pose)
        found = search.shortest(origin, insertion, row, np.random.default_rng(1))
        assert found is not None
        assert found.length <= pose["length"] * (1.0 + 1e-12)
        assert found.length >= np.linalg.norm(insertion - origin)


def closed_form(origin: Array, insertion: Array, obstacle: mw.Obstacle, side: float) -> float:
    """Return the length of the way round an upright cylinder on one side, tangents and arc seen along the axis."""
    assert isinstance(obstacle.surface, mw.Cylinder)
    a, b = (x - obstacle.pos for x in (origin, insertion))
    radius = obstacle.surface.radius
    far = [float(np.hypot(x[0], x[1])) for x in (a, b)]
    sweep = (side * (np.arctan2(b[1], b[0]) - np.arctan2(a[1], a[0]))) % (2.0 * np.pi)
    arc = sweep - sum(np.arccos(radius / x) for x in far)
    assert arc >= 0.0
    flat = radius * arc + sum(np.sqrt(x * x - radius**2) for x in far)
    return float(np.hypot(flat, b[2] - a[2]))


def test_both_ways_round_a_cylinder_are_found(search: Any) -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        origin, insertion = np.array([-0.1, 0.003, 0.02]), np.array([0.12, -0.004, -0.03])
        obstacle = mw.Obstacle(mw.Cylinder(rng.uniform(0.01, 0.04)), (*rng.uniform(-0.005, 0.005, 2), 0.0))
        lengths = sorted(case.length for case in search.paths_over_one(origin, insertion, obstacle))
        exact = sorted(closed_form(origin, insertion, obstacle, side) for side in (1.0, -1.0))
        assert lengths == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("letter", ["e", "p", "t"])
def test_rays_and_strings_agree_on_the_shortest(search: Any, letter: str) -> None:
    """Two searches that share nothing but the polish: strings find nothing shorter than the shortest ray's path."""
    rng = np.random.default_rng(3)
    rows = importlib.import_module("mjwrap.verification.multistart_rows")
    same = 0
    for _ in range(8):
        origin, insertion, row = random_scene(rng, letter, hints=False)
        rays = search.accepted(search.paths_over_one(origin, insertion, row[0]))
        strings = search.accepted(rows.paths_over_row(origin, insertion, row, rng))
        if (
            rays is None or strings is None
        ):  # nodes are too coarse for a thin tube; a torus may have to be bridged
            continue
        if len(strings.contacts[0]) < 2:  # rays know nothing of bridged hollows
            assert strings.length >= rays.length * (1.0 - 1e-12)
        same += strings.length == pytest.approx(rays.length, rel=1e-9)
    assert same >= 5


def test_a_longer_answer_is_improved(search: Any) -> None:
    """A row of five whose third cylinder is passed on the wrong side: searching windows of it finds the right one."""
    row = [mw.Obstacle(mw.Cylinder(0.03), (0.1 * (k + 1), -0.02 * (-1) ** k, 0.0)) for k in range(5)]
    origin, insertion = np.array([0.0, 0.001, -0.02]), np.array([0.6, 0.0, 0.03])
    best = search.shortest(origin, insertion, row, np.random.default_rng(4))
    assert best is not None
    hinted = list(row)
    hinted[2] = replace(row[2], hint=(0.0, -0.03, 0.0))
    wrong = mw.solve_path(origin, insertion, hinted)
    assert wrong.converged
    assert wrong.length > best.length * (1.0 + 1e-3)
    start = Case.of(origin, insertion, row, wrong)
    found = search.accepted(search.improved(start, np.random.default_rng(5)))
    assert found is not None
    assert found.length == pytest.approx(best.length, rel=1e-12)
