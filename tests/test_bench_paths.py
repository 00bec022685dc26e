"""The path benchmark: its scenes, its solvers, its arithmetic, and that a failure cannot look fast."""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from numba.core import config as numba_config
from reference_paths import reference_scene

import mjwrap as mw

SCENES = ["1 cylinder", "1 sphere", "1 ellipsoid", "1 torus", "3 mixed", "5 mixed"]
SCENES += [f"{n} cylinders" for n in (2, 4, 8, 16, 32, 64)]
BENCHMARKS = Path(__file__).resolve().parent.parent / "benchmarks"
config: Any = numba_config
compiled = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="about compiled kernels")


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(BENCHMARKS / "speed")
    return importlib.import_module("bench_paths")


@pytest.fixture
def scenes(bench: Any) -> Any:
    return importlib.import_module("path_scenes")


@pytest.mark.parametrize(
    ("reference", "name"),
    [
        ("b_sphere", "1 sphere"),
        ("c_ellipsoid", "1 ellipsoid"),
        ("d_torus", "1 torus"),
        ("e3_mixed", "3 mixed"),
        ("f_cyl01", "1 cylinder"),
        ("f_cyl02", "2 cylinders"),
        ("f_cyl04", "4 cylinders"),
    ],
)
def test_scenes_are_those_of_the_exact_references(scenes: Any, reference: str, name: str) -> None:
    exact = reference_scene(reference)
    poses = exact["poses"]
    scene = scenes.SCENES[name](len(poses))
    pos, quat = scene.motion()
    assert scene.name == name
    assert pos == pytest.approx(np.array([pose["pos"] for pose in poses]), abs=1e-15)
    assert quat == pytest.approx(np.array([pose["quat"] for pose in poses]), abs=1e-15)
    assert scene.insertion == pytest.approx(poses[0]["insertion"], abs=1e-15)
    assert scene.origin == pytest.approx(poses[0]["origin"], abs=1e-15)
    for surface, hint, described in zip(scene.surfaces, scene.hints, exact["surfaces"], strict=True):
        assert type(surface).__name__.lower() == described["kind"]
        assert list(surface.dims[: len(described["dims"])]) == described["dims"]
        assert hint.tolist() == described["hint"]
    sweep = mw.solve_sweep(scene.origin, scene.insertion, scene.obstacles(), pos, quat)
    assert sweep.converged
    assert sweep.length == pytest.approx([pose["length"] for pose in poses], rel=1e-12)


@pytest.mark.parametrize("name", SCENES)
def test_every_surface_of_every_scene_is_touched_throughout(scenes: Any, name: str) -> None:
    scene = scenes.SCENES[name](41)
    assert scene.name == name
    pos, quat = scene.motion()
    for j in range(scene.poses):
        row = [
            mw.Obstacle(surface, pos[j, k], quat[j, k], scene.hints[k])
            for k, surface in enumerate(scene.surfaces)
        ]
        sol = mw.solve_path(scene.origin, scene.insertion, row)
        assert sol.converged
        assert all(contact.active for contact in sol.contacts)


def test_the_list_of_scenes_is_the_one_that_the_tests_go_through(scenes: Any) -> None:
    assert list(scenes.SCENES) == SCENES


@compiled
@pytest.mark.parametrize(
    "name", ["1 cylinder", "1 sphere", "1 ellipsoid", "1 torus", "3 mixed", "5 mixed", "2 cylinders"]
)
def test_every_solver_finds_the_same_lengths(bench: Any, scenes: Any, name: str) -> None:
    """A short run: lengths of all solvers agree, MuJoCo's over one surface, OpenSim's where it is installed."""
    scene = scenes.SCENES[name](211)
    rows, missing = bench.time_scene(scene, repeats=2)
    assert len(rows) + len(missing) == 6
    assert ("MuJoCo tendon" in rows) == (name in ("1 cylinder", "1 sphere"))
    for solver, row in rows.items():
        assert row["failures"] == 0
        assert row["poses"] == 2 * scene.poses
        assert math.isfinite(row["median"])
        if solver != "mjwrap unaided":
            assert row["length_difference"] < 1e-9
            assert row["shorter"] == 0
    assert rows["mjwrap warm"]["ratio"] == 1.0
    assert rows["mjwrap warm"]["tangency_error"] <= 1e-10
    assert [rows[solver]["allocations"] for solver in rows if solver.startswith("mjwrap")] == [0, 0, 0]


@pytest.mark.parametrize("name", ["1 sphere", "3 mixed", "2 cylinders"])
def test_opensims_cold_start_has_forgotten_the_last_pose(bench: Any, scenes: Any, name: str) -> None:
    """Its lengths are those of systems built anew with the pose as their default, bit for bit; warm ones are not."""
    pytest.importorskip("opensim")
    solver = importlib.import_module("path_opensim").OpenSimScholz
    scene = scenes.SCENES[name](31)
    lengths = {warm: solver(scene, warm).sweep().length for warm in (True, False)}
    anew = solver(scene, True)
    model, _, coordinates = anew.with_path
    fresh = []
    for heights in scene.y.tolist():
        for coordinate, height in zip(coordinates, heights, strict=True):
            coordinate.setDefaultValue(height)
        state = model.initSystem()
        model.realizePosition(state)
        fresh.append(anew.path.getLength(state))
    assert lengths[False].tolist() == fresh
    assert lengths[True].tolist() != fresh


def test_long_rows_run_over_fewer_poses_of_opensim(bench: Any, scenes: Any) -> None:
    pytest.importorskip("opensim")
    solver = importlib.import_module("path_opensim").OpenSimScholz
    scene = scenes.cylinders(32, 81)
    warm, cold = solver(scene, True).at, solver(scene, False).at
    assert warm.tolist() == list(range(11))
    assert len(cold) == 11
    assert (cold[0], cold[-1]) == (0, 80)


@compiled
def test_allocations_inside_a_loop_are_counted(bench: Any) -> None:
    count = importlib.import_module("path_solvers").count_allocations
    none, each = (numba.njit(function) for function in (sum_up, sum_up_arrays))
    for function in (none, each):
        function(3)
    assert [count(lambda n=n: each(n)) for n in (0, 5, 10)] == [0, 5, 10]
    assert [count(lambda n=n: none(n)) for n in (0, 5, 10)] == [0, 0, 0]


def sum_up(n: int) -> float:
    total = 0.0
    for k in range(n):
        total += k
    return total


def sum_up_arrays(n: int) -> float:
    total = 0.0
    for k in range(n):
        total += np.full(k + 1, 2.0).sum()
    return total


def test_operations_are_counted(bench: Any) -> None:
    flops = importlib.import_module("count_flops")
    x, y = flops.counted([3.0, 4.0])
    answers = []

    def work() -> None:
        size = flops.counting_math.sqrt(x * x + y**2)  # 2 mul, 1 add, 1 sqrt
        answers.append(2.0 - -size / y + abs(1.0 - size))  # 3 add, 1 div
        answers.append(flops.counting_math.atan2(3.0 * size, max(size, 1.0)))  # 1 mul, 1 call

    assert flops._during(work) == {"mul": 3, "add": 4, "sqrt": 1, "div": 1, "call": 1}
    assert answers == [2.0 + 5.0 / 4.0 + 4.0, math.atan2(15.0, 5.0)]


def test_operations_of_a_pose_add_up(bench: Any, scenes: Any) -> None:
    """A pose takes at least one evaluation of each geodesic and less than a hundred, on four surfaces as on one."""
    flops = importlib.import_module("count_flops")
    for scene in (scenes.cylinders(1, 101), scenes.cylinders(4, 101)):
        found = flops.counts(scene)
        assert set(found) == {"Cylinder", "pose"}
        assert found["Cylinder"]["call"] == 2  # sine and cosine of the angle
        for name in ("add", "mul", "call"):
            assert 1.0 <= found["pose"][name] / (scene.n * found["Cylinder"][name]) < 100.0


@compiled
def test_timed_kernels_compute_what_they_would_untimed(bench: Any, scenes: Any) -> None:
    """What makes one call wait for another changes no bit of the rows."""
    profile = importlib.import_module("path_profile")
    scene = scenes.three_mixed(11)
    at = profile.solved(scene)
    node, first = at.node, at.touched[0]
    assert {type(scene.surfaces[at.owner[k]]) for k in at.touched} == {mw.Cylinder, mw.Ellipsoid, mw.Torus}
    profile.tangency_error.evaluate(0, len(node), at.ends, node)
    before, info = node.copy(), np.zeros((1, profile.layout.INFO))
    profile._evaluations(3, first, profile.NOTHING, at.ends, node)
    profile._minima(3, first, profile.NOTHING, node)
    for k in at.touched:
        profile._geodesics(3, k, profile.NOTHING, 0.0, node)
    profile.tangency_error.evaluate(0, len(node), at.ends, node)
    assert np.array_equal(node, before)
    profile._solutions(3, profile.NOTHING, at.outside, node, info)
    path = slice(profile.layout.S_MODE, profile.layout.S_MODE + profile.layout.STATE)
    assert node[:, path] == pytest.approx(before[:, path], rel=1e-12, abs=1e-15)


class Fake:
    """A fast solver that is wrong at the poses that it is told to be wrong at."""

    def __init__(
        self, sweeps: Any, name: str, time: float, length: Any, failed: Any, other_side: bool = False
    ) -> None:
        self.name, self.against, self.other_side = name, "mjwrap warm", other_side
        at = np.arange(len(length))
        self.run = sweeps.Sweep(time, np.full(15, time), np.array(length), np.array(failed), at)

    def sweep(self) -> Any:
        return self.run


def test_a_failure_is_counted(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    sweeps = importlib.import_module("path_sweep")
    good, none = [1.0, 1.1, 1.2], [False] * 3
    fakes = [
        Fake(sweeps, "mjwrap warm", 0.5, good, none),
        Fake(sweeps, "says so", 0.1, good, [False, True, False]),
        Fake(sweeps, "silently longer", 0.1, [1.0, 1.1 + 1e-6, 1.2], none),
        Fake(sweeps, "silently shorter", 0.1, [1.0, 1.1 - 1e-6, 1.2], none),
        Fake(sweeps, "no number", 0.1, [1.0, math.nan, 1.2], none),
        Fake(sweeps, "part of it", 0.1, [1.0, 1.1], none[:2]),
        Fake(sweeps, "free, longer", 0.1, [1.0, 1.1 + 1e-6, 1.2], none, True),
        Fake(sweeps, "free, shorter", 0.1, [1.0, 1.1 - 1e-6, 1.2], none, True),
    ]
    monkeypatch.setattr(bench, "solvers", lambda scene: (fakes, {}))
    rows, _ = bench.time_scene(None, repeats=4)
    assert {name: (row["failures"], row["poses"], row["shorter"]) for name, row in rows.items()} == {
        "mjwrap warm": (0, 12, 0),
        "says so": (4, 12, 0),
        "silently longer": (4, 12, 0),
        "silently shorter": (4, 12, 0),
        "no number": (4, 12, 0),
        "part of it": (0, 8, 0),
        "free, longer": (4, 12, 0),
        "free, shorter": (0, 12, 4),
    }
    assert rows["says so"]["ratio"] == pytest.approx(0.2)


def timed(*medians: float, failures: int = 0, allocations: int = 0) -> dict[str, Any]:
    """A row of figures with these medians, one per repeat."""
    return {
        "median": float(np.median(medians)),
        "median_each": list(medians),
        "failures": failures,
        "allocations": allocations,
    }


def run_of(mine: dict[str, Any], mine_cold: dict[str, Any], **peer: dict[str, Any]) -> dict[str, Any]:
    """A scene's rows; peer: of OpenSim's path, warm and cold."""
    return {
        "mjwrap warm": mine,
        "mjwrap cold": mine_cold,
        **{f"OpenSim {key}": row for key, row in peer.items()},
    }


@pytest.fixture
def states(bench: Any) -> Any:
    """A function from scenes to the states of their targets."""
    targets = importlib.import_module("path_targets")
    return lambda scenes: [verdict.state for verdict in targets.judge(scenes)]


def test_a_pace_is_judged_within_repeats(states: Any) -> None:
    mine = timed(1.0, 2.0, 3.0)
    # medians over all repeats would say 9.5 times and 20 times; within repeats it is 10 and 19
    rows = run_of(mine, mine, warm=timed(12.0, 19.0, 30.0), cold=timed(40.0, 38.0, 57.0))
    assert states({"3 mixed": rows}) == ["met", "MISSED", "met", "met"]
    assert states({"2 cylinders": rows})[-2:] == ["met", "met"]


def test_a_failure_of_mjwrap_misses_the_targets_that_it_touches(states: Any) -> None:
    mine, wrong = timed(1.0), timed(1.0, failures=1)
    peers = {"warm": timed(50.0), "cold": timed(50.0)}
    assert states({"1 torus": run_of(mine, mine, **peers)}) == ["met"] * 5
    assert states({"1 torus": run_of(wrong, mine, **peers)}) == ["MISSED", "met", "MISSED", "met", "MISSED"]
    assert states({"1 torus": run_of(mine, wrong, **peers)}) == ["met", "MISSED", "met", "met", "MISSED"]


def test_a_missing_or_failing_peer_meets_nothing(states: Any) -> None:
    mine = timed(1.0)
    assert states({"1 sphere": run_of(mine, mine, warm=timed(50.0))}) == ["met", "OPEN", "met", "met"]
    peers = {"warm": timed(50.0), "cold": timed(math.nan)}
    assert states({"1 sphere": run_of(mine, mine, **peers)}) == ["met", "MISSED", "met", "met"]


@pytest.mark.parametrize(("name", "limit"), [("1 ellipsoid", 1.5), ("1 torus", 3.0)])
def test_one_surface_has_a_limit(states: Any, name: str, limit: float) -> None:
    peers = {"warm": timed(500.0), "cold": timed(500.0)}
    for took, state in ((limit, "met"), (limit + 0.001, "MISSED"), (math.nan, "MISSED")):
        assert states({name: run_of(timed(took), timed(1.0), **peers)})[2] == state


def test_the_cost_of_a_row_is_judged_by_its_worst(states: Any) -> None:
    def table(eight: float) -> dict[str, Any]:
        times = {"1 cylinder": 1.0, "8 cylinders": eight, "64 cylinders": 32.0}
        peers = {"warm": timed(500.0), "cold": timed(500.0)}
        return {name: run_of(timed(time), timed(time), **peers) for name, time in times.items()}

    assert states(table(9.6))[2:] == ["met"] * 3
    assert states(table(9.7))[2:] == ["MISSED", "met", "met"]
    scenes = table(8.0)
    scenes["64 cylinders"]["mjwrap warm"]["failures"] = 1
    assert states(scenes)[2:] == ["MISSED", "met", "MISSED"]
    scenes["64 cylinders"]["mjwrap warm"].update(failures=0, allocations=3)
    assert states(scenes)[2:] == ["met", "MISSED", "met"]
