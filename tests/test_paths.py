"""Solutions judged from outside: exact references, an independent certificate, a slow string, laws of motion."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from reference_paths import reference_scene

import mjwrap as mw
from mjwrap.surfaces import Surface
from mjwrap.verification.scenes import SURFACES, Array, check_path, height, outward, random_scene

EXACT = 1e-12  # relative: what the references are good for (closed forms are met by them to 1e-16)
SCENES = ["a_cyl", "b_sphere", "c_ellipsoid", "d_torus", "e3_mixed", "f_cyl01", "f_cyl02", "f_cyl04"]


def surface_of(kind: str, dims: list[float]) -> Surface:
    return mw.Ellipsoid((dims[0], dims[1], dims[2])) if kind == "ellipsoid" else SURFACES[kind](*dims)


def obstacles_of(scene: dict, pose: dict) -> list[mw.Obstacle]:
    return [
        mw.Obstacle(surface_of(s["kind"], s["dims"]), tuple(pos), tuple(quat), tuple(s["hint"]))
        for s, pos, quat in zip(scene["surfaces"], pose["pos"], pose["quat"], strict=True)
    ]


@pytest.mark.parametrize("warm", [True, False])
@pytest.mark.parametrize("name", SCENES)
def test_exact_lengths(name: str, warm: bool) -> None:
    scene = reference_scene(name)
    sol = None
    for pose in scene["poses"]:
        row = obstacles_of(scene, pose)
        sol = mw.solve_path(pose["origin"], pose["insertion"], row, start=sol if warm else None)
        assert sol.converged
        assert sol.tangency_error <= 1e-10
        assert sol.length == pytest.approx(pose["length"], rel=EXACT)
        arcs = [contact.arc_length for contact in sol.contacts]
        assert arcs == pytest.approx(pose["arc_lengths"], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("warm", [True, False])
@pytest.mark.parametrize("name", SCENES)
def test_exact_lengths_in_one_sweep(name: str, warm: bool) -> None:
    scene = reference_scene(name)
    poses = scene["poses"]
    origin, insertion, pos, quat, exact = (
        np.array([pose[key] for pose in poses]) for key in ("origin", "insertion", "pos", "quat", "length")
    )
    sweep = mw.solve_sweep(origin, insertion, obstacles_of(scene, poses[0]), pos, quat, warm=warm)
    assert sweep.converged
    assert sweep.tangency_error.max() <= 1e-10
    assert np.abs(sweep.length / exact - 1.0).max() < EXACT


@pytest.mark.parametrize("hints", [True, False])
@pytest.mark.parametrize("kinds", ["c", "s", "cc", "cs", "ccc", "csc", "ccccc", "cscsc"])
def test_random_scenes_are_solved_and_certified(kinds: str, hints: bool) -> None:
    """Every claim of a converged solution is checked from its contact points alone, by code of the tests' own."""
    rng = np.random.default_rng(21)
    converged = 0
    for _ in range(60):
        origin, insertion, row = random_scene(rng, kinds, hints)
        sol = mw.solve_path(origin, insertion, row)
        assert np.isfinite(sol.length)
        if sol.converged:
            converged += 1
            check_path(origin, insertion, row, sol)
    assert converged >= 59  # with spheres and opposed hints a handful in ten thousand end as NOT_MINIMAL


def string_length(points: Array, row: list[mw.Obstacle], passes: int) -> float:
    """Return the length of a string that is pulled tight: neighbours averaged, nodes pushed out of the surfaces."""
    nodes = points.copy()
    for _ in range(passes):
        for first in (1, 2):
            inner = slice(first, -1, 2)
            nodes[inner] = 0.5 * (nodes[first - 1 : -2 : 2] + nodes[first + 1 :: 2][: len(nodes[inner])])
            for obstacle in row:
                depth = np.minimum(height(obstacle, nodes[inner]), 0.0)
                nodes[inner] -= depth[:, None] * outward(obstacle, nodes[inner])
    return float(np.linalg.norm(np.diff(nodes, axis=0), axis=1).sum())


@pytest.mark.slow
@pytest.mark.parametrize("kinds", ["s", "cs", "sc", "scs"])
def test_a_slow_string_stays(kinds: str) -> None:
    """A polyline on the path, shaken sideways and pulled tight again, ends at its length: it is a local minimum."""
    rng = np.random.default_rng(22)
    for _ in range(3):
        origin, insertion, row = random_scene(rng, kinds, hints=False)
        sol = mw.solve_path(origin, insertion, row)
        assert sol.converged
        smooth = sol.points(sol.length / 120)
        shaken = smooth.copy()
        shaken[1:-1] += 1e-3 * np.sin(np.linspace(0, np.pi, len(smooth) - 2))[:, None] * rng.normal(size=3)
        pulled = string_length(shaken, row, 6000)
        # chords of a polyline cut at most h^2 / 24 R^2 of an arc: with h = l / 120 and R >= 0.01 m below 3e-3
        assert pulled == pytest.approx(sol.length, rel=3e-3)
        assert pulled == pytest.approx(string_length(smooth, row, 6000), rel=1e-4)


def moving_scene(
    rng: np.random.Generator, kinds: str
) -> tuple[Array, Array, list[mw.Obstacle], Array, Array, Array]:
    """Return a scene that all obstacles take part in, and random velocities and twists."""
    while True:
        origin, insertion, row = random_scene(rng, kinds, hints=True)
        sol = mw.solve_path(origin, insertion, row)
        if sol.converged and all(contact.arc_length > 2e-3 for contact in sol.contacts):
            return (
                origin,
                insertion,
                row,
                rng.normal(size=3),
                rng.normal(size=3),
                rng.normal(size=(len(row), 6)),
            )


def turned(quat: tuple[float, ...], omega: Array, time: float) -> Array:
    """Return the quaternion after rotating with the world angular velocity omega for a time."""
    angle = float(np.linalg.norm(omega)) * time
    axis = omega / np.linalg.norm(omega)
    w, v = np.cos(angle / 2), np.sin(angle / 2) * axis
    a, u = quat[0], np.array(quat[1:])
    return np.r_[w * a - v @ u, w * u + a * v + np.cross(v, u)]


@pytest.mark.parametrize("kinds", ["c", "s", "e", "l", "k", "t", "p", "cc", "csc", "cccc", "ek", "lp", "stc"])
def test_speed_is_the_rate_of_length(kinds: str) -> None:
    """l̇ (17) with translating and rotating surfaces against central differences of l, observed order two."""
    rng = np.random.default_rng(23)
    for _ in range(50):
        origin, insertion, row, u, v, twists = moving_scene(rng, kinds)
        sol = mw.solve_path(origin, insertion, row)
        speed = sol.speed(u, v, twists)

        def length(time: float, scene: tuple = (origin, insertion, row, u, v, twists, sol)) -> float:
            a, b, obstacles, du, dv, tw, start = scene
            moved = [
                mw.Obstacle(
                    o.surface, tuple(o.pos + time * w[:3]), tuple(turned(o.quat, w[3:], time)), o.hint
                )
                for o, w in zip(obstacles, tw, strict=True)
            ]
            result = mw.solve_path(a + time * du, b + time * dv, moved, start=start, tol=1e-13)
            assert result.tangency_error < 1e-9
            return result.length

        quotients = [(length(h) - length(-h)) / (2 * h) for h in (5e-5, 2.5e-5)]
        coarse, fine = (abs(quotient - speed) for quotient in quotients)
        assert fine <= coarse / 3.0 + 1e-10 * abs(speed) + 1e-11  # rounding of l over h
        extrapolated = (4.0 * quotients[1] - quotients[0]) / 3.0  # the term in h^2 cancels
        assert abs(extrapolated - speed) <= 3e-4 * max(abs(speed), 0.1)


@pytest.mark.parametrize("kinds", ["c", "s", "e", "l", "k", "t", "p", "csc", "ccccc", "ek", "lp", "stc"])
def test_forces_balance_and_do_the_work_of_the_tension(kinds: str) -> None:
    rng = np.random.default_rng(24)
    for _ in range(50):
        origin, insertion, row, u, v, twists = moving_scene(rng, kinds)
        sol = mw.solve_path(origin, insertion, row)
        tension = rng.uniform(1, 1000)
        wrench = sol.wrenches(tension)
        assert np.abs(wrench.sum(axis=0)).max() <= 1e-12 * tension
        power = wrench[0, :3] @ u + wrench[-1, :3] @ v
        for (force, moment), obstacle, twist in zip(wrench[1:-1].reshape(-1, 2, 3), row, twists, strict=True):
            power += force @ twist[:3] + (moment - np.cross(obstacle.pos, force)) @ twist[3:]
        scale = tension * (np.linalg.norm(u) + np.linalg.norm(v) + np.abs(twists).sum())
        assert abs(power + tension * sol.speed(u, v, twists)) <= 1e-12 * scale


def lift_off(steps: int, amplitude: float = 2.0) -> tuple[NDArray, NDArray]:
    """Return the paper's case 2 (a cylinder that leaves the string and comes back) as cylinder heights and poses."""
    y = amplitude * np.sin(np.linspace(0.0, 4.0 * np.pi, steps))
    pos = np.zeros((steps, 1, 3))
    pos[:, 0, 1] = y
    return y, pos


@pytest.mark.parametrize("steps", [41, 401, 4001])
def test_lift_off_and_touchdown_are_continuous(steps: int) -> None:
    """Length follows the closed form of the side it is on through every lift-off, at coarse and fine steps."""
    y, pos = lift_off(steps)
    sweep = mw.solve_sweep(
        (2, 0, -2.5),
        (-2, 0, -0.5),
        [mw.Obstacle(mw.Cylinder(1.0))],
        pos,
        [1.0, 0, 0, 0] * np.ones((steps, 1, 4)),
    )
    back = mw.solve_sweep(
        (2, 0, -2.5),
        (-2, 0, -0.5),
        [mw.Obstacle(mw.Cylinder(1.0))],
        pos[::-1],
        [1.0, 0, 0, 0] * np.ones((steps, 1, 4)),
    )
    assert sweep.converged
    assert back.converged
    # closed form (2D tangents unrolled; obstacle-set method, Garner & Pandy 2000), the string on top
    rho = np.hypot(2.0, y)
    free = np.sqrt(rho**2 - 1.0)
    arc = np.pi + 2 * np.arctan2(y, 2.0) - 2 * np.arctan2(free, 1.0)
    flat = np.where(arc > 0, 2 * free + arc, 4.0)
    assert np.abs(sweep.length - np.hypot(flat, 2.0)).max() < 1e-11
    assert np.abs(sweep.length - back.length[::-1]).max() < 1e-11


def test_moment_arm_is_continuous_through_lift_off() -> None:
    """The force on the cylinder goes to zero at lift-off, and its steps shrink with the step of the motion."""
    largest = []
    for steps in (101, 201, 401):
        y, _ = lift_off(steps)
        sol, pushes = None, []
        for height_now in y:
            sol = mw.solve_path(
                (2, 0, -2.5), (-2, 0, -0.5), [mw.Obstacle(mw.Cylinder(1.0), (0, height_now, 0))], start=sol
            )
            assert sol.converged
            pushes.append(sol.wrenches(1.0)[1, 1])
        largest.append(np.abs(np.diff(pushes)).max())
    assert largest[1] < 0.6 * largest[0]
    assert largest[2] < 0.6 * largest[1]


def test_a_cylinder_driven_through_the_string_in_one_step_is_noticed() -> None:
    ends = (2, 0, -2.5), (-2, 0, -0.5)
    above = mw.solve_path(*ends, [mw.Obstacle(mw.Cylinder(1.0), (0, -1.5, 0))])
    assert not above.contacts[0].active
    jumped = mw.solve_path(*ends, [mw.Obstacle(mw.Cylinder(1.0), (0, 1.5, 0))], start=above)
    slowly = above
    for y in np.linspace(-1.5, 1.5, 301):
        slowly = mw.solve_path(*ends, [mw.Obstacle(mw.Cylinder(1.0), (0, y, 0))], start=slowly)
    assert jumped.contacts[0].active
    assert jumped.length == pytest.approx(slowly.length, rel=EXACT)
    assert not mw.solve_path(*ends, [mw.Obstacle(mw.Cylinder(1.0), (0, 1.5, 0))]).contacts[0].active


def test_hint_chooses_the_side_and_none_takes_the_shorter() -> None:
    ends = (2, 0.2, 0), (-2, 0.2, 0)
    lengths = {}
    for hint in (None, (0, 1, 0), (0, -1, 0)):
        sol = mw.solve_path(*ends, [mw.Obstacle(mw.Cylinder(1.0), hint=hint)])
        assert sol.converged
        lengths[hint] = sol.length
    assert lengths[None] == lengths[(0, 1, 0)] < lengths[(0, -1, 0)]


def test_a_hint_beside_both_end_points_leads_the_long_way_round() -> None:
    """Both ends lie on one side of a thin cylinder: the string goes round the other, as MuJoCo's side site asks."""
    ends = (0.00203496, 0.01186028, 0.0090163), (0.00688629, 0.01398002, -0.02209643)
    hint = (-0.00632128, -0.007225, 0.0015128)
    sol = mw.solve_path(*ends, [mw.Obstacle(mw.Cylinder(0.008), hint=hint)])
    assert sol.converged
    assert sol.length == pytest.approx(0.06347266, abs=1e-8)  # closed form, swept angle 5.995 rad


def test_a_sphere_is_passed_the_shorter_way_whatever_the_hint() -> None:
    """The way round over the top is longest there: a string slips off it, so it is never an answer."""
    for hint in (None, (0, 1, 0), (0, -1, 0)):
        sol = mw.solve_path((0.15, -0.02, 0), (-0.15, -0.02, 0), [mw.Obstacle(mw.Sphere(0.05), hint=hint)])
        assert sol.converged
        assert sol.contacts[0].P is not None
        assert sol.contacts[0].P[1] < 0.0


def test_via_points_split_the_path() -> None:
    via = (0.0, 1.5, 0.3)
    row = [
        mw.Obstacle(mw.Cylinder(0.5), (1, 0.7, 0)),
        mw.ViaPoint(via),
        mw.Obstacle(mw.Sphere(0.4), (-1, 0.8, 0.2)),
    ]
    whole = mw.solve_path((2, 0, -0.5), (-2, 0, 0), row)
    first = mw.solve_path((2, 0, -0.5), via, row[:1])
    second = mw.solve_path(via, (-2, 0, 0), row[2:])
    assert whole.converged
    assert whole.length == pytest.approx(first.length + second.length, rel=1e-15)
    assert whole.contacts[1].active
    assert whole.contacts[1].arc_length == 0.0
    assert np.abs(whole.wrenches(7.0).sum(axis=0)).max() < 1e-13
    velocity = np.array([0.3, -0.2, 0.5])
    twist = np.zeros((3, 6))
    twist[1, :3] = velocity
    assert whole.speed((0, 0, 0), (0, 0, 0), twist) == pytest.approx(-velocity @ whole.wrenches(1.0)[2, :3])


def test_points_run_along_the_path() -> None:
    sol = mw.solve_path((2, 0, -2.5), (-2, 0, -0.5), [mw.Obstacle(mw.Cylinder(1.0))])
    for spacing in (0.5, 0.05, 0.005):
        points = sol.points(spacing)
        gaps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        assert gaps.max() <= spacing * (1 + 1e-12)
        assert sol.length - spacing**2 < gaps.sum() <= sol.length * (1 + 1e-14)
    assert np.array_equal(sol.points()[[0, -1]], [[2, 0, -2.5], [-2, 0, -0.5]])


def test_same_input_gives_the_same_bits() -> None:
    rng = np.random.default_rng(25)
    for _ in range(20):
        origin, insertion, row = random_scene(rng, "cscc", hints=True)
        before = mw.solve_path(origin, insertion, row)
        mw.solve_path(insertion, origin, row)
        after = mw.solve_path(origin, insertion, row)
        assert before.length == after.length
        again = [mw.solve_path(origin + 1e-3, insertion, row, start=before).length for _ in range(2)]
        assert again[0] == again[1]


@pytest.mark.parametrize("surface", [mw.Cylinder(1.0), mw.Sphere(1.0)])
def test_an_end_point_inside_has_a_status_and_a_finite_length(surface: mw.Cylinder | mw.Sphere) -> None:
    start = mw.solve_path((2, 0, 0), (-2, 0, 0.1), [mw.Obstacle(surface)])
    for guess in (None, start):
        sol = mw.solve_path((0.5, 0.1, 0), (-2, 0, 0.1), [mw.Obstacle(surface)], start=guess)
        assert sol.status == mw.Status.ENDPOINT_INSIDE
        assert not sol.converged
        assert np.isfinite(sol.length)
        assert np.isfinite(sol.tangency_error)
        assert np.isfinite(sol.wrenches(1.0)).all()
    back = mw.solve_path((2, 0, 0), (-2, 0, 0.1), [mw.Obstacle(surface)], start=sol)
    assert back.converged
    assert back.length == pytest.approx(start.length, rel=EXACT)


def test_length_and_force_are_continuous_where_an_end_point_comes_to_lie_on_the_surface() -> None:
    row = [mw.Obstacle(mw.Cylinder(1.0))]
    at = mw.solve_path((1.0, 0.0, -2.5), (-2, 0.3, -0.5), row)
    assert at.converged
    for gap in (1e-14, 1e-12, 1e-10, 1e-8, 1e-6):
        near = mw.solve_path((1.0 + gap, 0.0, -2.5), (-2, 0.3, -0.5), row)
        assert near.converged
        assert near.length == pytest.approx(at.length, abs=2.0 * gap)
        assert np.abs(near.wrenches(1.0) - at.wrenches(1.0)).max() < 10.0 * np.sqrt(
            gap
        )  # tangent: sqrt(2 gap)


def test_a_sweep_goes_on_after_poses_without_a_path() -> None:
    x = np.concatenate([np.linspace(2, 0.5, 30), np.linspace(0.5, 2, 30)])
    origin = np.stack([x, np.full(60, 0.1), np.zeros(60)], axis=1)
    pos, quat = np.zeros((60, 1, 3)), np.tile([1.0, 0, 0, 0], (60, 1, 1))
    sweep = mw.solve_sweep(origin, (-2, 0, 0), [mw.Obstacle(mw.Cylinder(1.0), hint=(0, -1, 0))], pos, quat)
    inside = np.hypot(x, 0.1) < 1.0
    assert (sweep.status[inside] == mw.Status.ENDPOINT_INSIDE).all()
    assert (sweep.status[~inside] == mw.Status.CONVERGED).all()
    assert np.isfinite(sweep.length).all()
    assert sweep.length[~inside] == pytest.approx(sweep.length[::-1][~inside], rel=EXACT)


GOOD = mw.Obstacle(mw.Cylinder(1.0))


def wrong(value: Any) -> Any:
    """Return a value of a type that the call does not take."""
    return value


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: mw.Cylinder(0.0), "radius must be finite and positive"),
        (lambda: mw.Cylinder(-1.0), "radius"),
        (lambda: mw.Sphere(float("nan")), "Sphere: radius"),
        (lambda: mw.Sphere(wrong("big")), "Sphere: radius"),
        (lambda: mw.Obstacle(wrong(1.0)), "surface must be"),
        (lambda: mw.Obstacle(mw.Sphere(1.0), (0, 0)), "pos must have shape"),
        (lambda: mw.Obstacle(mw.Sphere(1.0), quat=(0, 0, 0, 0)), "quat must not be zero"),
        (lambda: mw.Obstacle(mw.Sphere(1.0), hint=(0, np.inf, 0)), "hint must be finite"),
        (lambda: mw.ViaPoint((0, 0, wrong(None))), "ViaPoint: pos"),
        (lambda: mw.solve_path((0, 0), (1, 0, 0)), "origin must have shape"),
        (lambda: mw.solve_path((0, 0, np.nan), (1, 0, 0)), "origin must be finite"),
        (lambda: mw.solve_path((3, 0, 0), (-3, 0, 0), [wrong("cylinder")]), r"obstacles\[0\]"),
        (lambda: mw.solve_path((3, 0, 0), (-3, 0, 0), [GOOD], tol=0.0), "tol must be"),
        (
            lambda: mw.solve_path((3, 0, 0), (-3, 0, 0), [GOOD], method="magic"),
            "method must be one of newton",
        ),
        (lambda: mw.solve_path((3, 0, 0), (-3, 0, 0), [GOOD], lam=1.0), "no options"),
        (
            lambda: mw.solve_path((3, 0, 0), (-3, 0, 0), [GOOD], start=mw.solve_path((0, 0, 0), (1, 0, 0))),
            "different obst",
        ),
        (
            lambda: mw.solve_sweep((3, 0, 0), (-3, 0, 0), [GOOD], np.zeros((5, 3)), np.zeros((5, 4))),
            "pos must have",
        ),
        (
            lambda: mw.solve_sweep((3, 0, 0), (-3, 0, 0), [GOOD], np.zeros((5, 1, 3)), np.zeros((5, 1, 4))),
            "quat",
        ),
        (
            lambda: mw.solve_path((3, 0, 0), (-3, 0, 0)).speed((0, 0, 0), (0, 0, 0), np.zeros((2, 6))),
            "twists",
        ),
        (lambda: mw.solve_path((3, 0, 0), (-3, 0, 0)).points(0.0), "spacing"),
        (lambda: mw.solve_path((3, 0, 0), (-3, 0, 0)).wrenches(np.nan), "tension"),
    ],
)
def test_bad_input_is_named(call: Any, message: str) -> None:
    with pytest.raises(mw.GeometryError, match=message):
        call()
