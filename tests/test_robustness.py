"""The robustness and motion benchmarks: their scenes, their counts, and that a wrong answer cannot pass."""

from __future__ import annotations

import importlib
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mjwrap as mw
from mjwrap.verification import cases, random_scenes
from mjwrap.verification.certificate import findings, rotation
from mjwrap.verification.scenes import gap, height

BENCHMARKS = Path(__file__).resolve().parent.parent / "benchmarks"


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Any]:
    monkeypatch.syspath_prepend(BENCHMARKS / "robustness")
    return importlib.import_module


@pytest.mark.parametrize("name", ["cylinder", "torus", "cone", "5 mixed"])
@pytest.mark.parametrize("backwards", [True, False])
def test_scenes_are_what_they_say(name: str, backwards: bool) -> None:
    """Ends outside, nothing overlapping; scenes made backwards have a true path, and hints near it."""
    maker = random_scenes.Maker(name, 7, 0)
    for _ in range(5):
        scene = maker.scene(backwards)
        ends = np.array([scene.origin, scene.insertion])
        assert min(height(o, ends).min() for o in scene.obstacles) > 0.9e-3
        for k, o in enumerate(scene.obstacles):
            assert all(gap(o, other) > 0.0 for other in scene.obstacles[k + 1 :])
        assert (scene.known is not None) == (scene.good is not None) == backwards
        if not backwards:
            continue
        assert scene.known is not None
        assert scene.good is not None
        assert findings([scene.known]) == [""]
        for o, contacts, hint in zip(scene.obstacles, scene.known.contacts, scene.good, strict=True):
            P, Q, s = contacts[0]
            nearest = min(np.linalg.norm(rotation(o.quat) @ hint + o.pos - x) for x in (P, Q, 0.5 * (P + Q)))
            assert nearest < s + 1e-3


def test_scenes_depend_on_the_seed_alone() -> None:
    first, again, other = (random_scenes.Maker("3 mixed", seed, 0).scene(True) for seed in (1, 1, 2))
    assert first.obstacles == again.obstacles
    assert np.array_equal(first.insertion, again.insertion)
    assert first.obstacles != other.obstacles


def test_a_chunk_counts_every_scene(bench: Callable[[str], Any]) -> None:
    robustness = bench("robustness")
    name, tallies, saved = robustness.run_chunk(("sphere", 3, 0, 10, 4, ("good", "random", "none")))
    assert name == "sphere"
    for kind, tally in tallies.items():
        assert tally.scenes == 10
        assert sum(tally.status.values()) == 10
        assert tally.wrong == 0
        assert tally.searched == (4 if kind == "none" else 0)
    assert tallies["none"].compared == 10
    assert saved == []


def lie(change: Callable[[mw.PathSolution], None]) -> Callable[..., mw.PathSolution]:
    """Return a solver whose answers are changed after the fact."""
    honest = mw.solve_path

    def solve(*args: Any, **options: Any) -> mw.PathSolution:
        sol = honest(*args, **options)
        change(sol)
        return sol

    return solve


def fold(sol: mw.PathSolution) -> None:
    sol.contacts = [c if c.P is None else replace(c, arc_length=c.arc_length + 0.01) for c in sol.contacts]
    sol.length += 0.01 * sum(c.active for c in sol.contacts)


def forget(sol: mw.PathSolution) -> None:
    sol.contacts = [mw.paths.Contact(False, None, None, 0.0) for _ in sol.contacts]
    sol.length = float(np.linalg.norm(np.subtract(sol._insertion, sol._origin)))


def lose(sol: mw.PathSolution) -> None:
    sol.length = float("nan")


@pytest.mark.parametrize(
    ("change", "count"), [(fold, "refuted"), (forget, "penetrating"), (lose, "not_finite")]
)
def test_a_false_claim_is_counted_and_saved(
    bench: Callable[[str], Any], monkeypatch: pytest.MonkeyPatch, change: Any, count: str
) -> None:
    robustness = bench("robustness")
    monkeypatch.setattr(robustness.mw, "solve_path", lie(change))
    _, tallies, saved = robustness.run_chunk(("sphere", 3, 0, 10, 0, ("good",)))
    assert getattr(tallies["good"], count) == 10
    assert tallies["good"].wrong == 10
    assert len(saved) == 10


def test_an_exception_is_counted(bench: Callable[[str], Any], monkeypatch: pytest.MonkeyPatch) -> None:
    robustness = bench("robustness")

    def fail(*_: Any) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(robustness.mw, "solve_path", fail)
    _, tallies, saved = robustness.run_chunk(("sphere", 3, 0, 4, 0, ("random",)))
    assert tallies["random"].exceptions == tallies["random"].wrong == len(saved) == 4


def test_a_longer_answer_is_counted(bench: Callable[[str], Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """A solver that always goes round a cylinder the wrong way is told so by the search and by the known path."""
    robustness = bench("robustness")
    honest = mw.solve_path

    def stubborn(origin: Any, insertion: Any, obstacles: Any) -> mw.PathSolution:
        sols = [
            honest(origin, insertion, [replace(obstacles[0], hint=h)]) for h in ((0.01, 0, 0), (-0.01, 0, 0))
        ]
        return max(sols, key=lambda sol: sol.length)

    monkeypatch.setattr(robustness.mw, "solve_path", stubborn)
    _, tallies, saved = robustness.run_chunk(("cylinder", 3, 0, 10, 10, ("none",)))
    assert tallies["none"].longer >= 5
    assert tallies["none"].wrong == 0
    assert all(case["reason"].startswith("LONGER") for case in saved)


def test_saved_scenes_come_back_to_the_last_bit() -> None:
    for name in ("torus", "cone", "capsule", "5 mixed"):
        scene = random_scenes.Maker(name, 5, 0).scene(True)
        row = scene.hinted("good")
        assert row is not None
        text = json.dumps(cases.describe(scene.origin, scene.insertion, row))
        origin, insertion, obstacles = cases.restore(json.loads(text))
        assert obstacles == row
        assert np.array_equal(origin, scene.origin)
        assert np.array_equal(insertion, scene.insertion)


def test_velocities_of_a_motion_are_its_derivatives(bench: Callable[[str], Any]) -> None:
    motions = bench("motions")
    motion = motions.random_motion(random_scenes.Maker("3 mixed", 5, 0))
    h = 1e-5
    for tau in (0.3, 2.0, 5.5):
        a, b, pos, quat = motion.poses(np.array([tau - h, tau, tau + h]))
        start, end, twists = motion.velocities(tau)
        assert (a[2] - a[0]) / (2 * h) == pytest.approx(start, abs=1e-9)
        assert (b[2] - b[0]) / (2 * h) == pytest.approx(end, abs=1e-9)
        assert (pos[2] - pos[0]) / (2 * h) == pytest.approx(twists[:, :3], abs=1e-9)
        for k, spin in enumerate(twists[:, 3:]):
            rate = (rotation(quat[2, k]) - rotation(quat[0, k])) / (2 * h) @ rotation(quat[1, k]).T
            assert [rate[2, 1], rate[0, 2], rate[1, 0]] == pytest.approx(spin, abs=1e-8)


def test_a_motion_of_a_cylinder_has_no_faults(bench: Callable[[str], Any]) -> None:
    name, report, _ = bench("motion").run_job(("cylinder", 1, 0, 301))
    assert name == "cylinder"
    assert report.counts["poses"] == 301
    assert report.faults == []


def test_a_jump_is_found_where_the_path_goes_on(
    bench: Callable[[str], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A solver that changes to the other side of a cylinder half way through the motion."""
    motions, checks = bench("motions"), bench("motion_checks")
    row = [mw.Obstacle(mw.Cylinder(0.03), hint=(0.0, 0.03, 0.0))]
    shifts = np.zeros((3, 3, 3, 2))
    shifts[0, 2, 0, 1] = 0.02
    ends = np.array([-0.1, 0.001, 0.0]), np.array([0.1, 0.001, 0.01])
    motion = motions.Motion(*ends, row, shifts, np.eye(3)[2:], np.zeros((1, 3, 2)))
    honest = mw.solve_path

    def fickle(origin: Any, insertion: Any, obstacles: Any, start: Any = None) -> mw.PathSolution:
        other = replace(obstacles[0], hint=(0.0, -0.03 if origin[2] > 0.0123 else 0.03, 0.0))
        return honest(origin, insertion, [other])

    tau = np.linspace(0.0, 2.0 * np.pi, 401)
    steady, jumping = checks.Report(), checks.Report()
    assert checks.no_jumps(checks.follow(motion, tau), steady) == 0
    assert steady.faults == []
    monkeypatch.setattr(checks.mw, "solve_path", fickle)
    checks.no_jumps(checks.follow(motion, tau), jumping)
    assert [fault["what"] for fault in jumping.faults] == ["jumps", "jumps"]
    assert np.sin([fault["tau"] for fault in jumping.faults]) * 0.02 == pytest.approx([0.0123] * 2, abs=1e-6)
