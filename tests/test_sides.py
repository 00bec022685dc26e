"""Sides that hold at every pose: lengths from the pose alone, beside closed forms, laws, and what OpenSim does."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mjwrap as mw
from mjwrap.surfaces import Surface

Vector = np.ndarray[Any, np.dtype[np.float64]]
OSIM: dict[str, Any] = json.loads(
    (Path(__file__).parent / "data/osim/sides.json").read_text(encoding="utf-8")
)
POSES = 60
KINDS = ["cylinder", "elliptic cylinder", "cone", "sphere", "ellipsoid", "capsule", "torus"]
ROWS = [
    ["cylinder", "cylinder"], ["cylinder", "sphere", "elliptic cylinder"], ["ellipsoid", "capsule"],
    ["cone", "ellipsoid"], ["torus", "cylinder"],
]  # fmt: skip


def surface(kind: str, rng: np.random.Generator) -> Surface:
    r = float(rng.uniform(0.015, 0.03))
    made = {
        "cylinder": mw.Cylinder(r),
        "elliptic cylinder": mw.EllipticCylinder((r, r * rng.uniform(0.4, 1.5))),
        "cone": mw.Cone(0.6 * r, 0.5 * r, 0.5),
        "sphere": mw.Sphere(r),
        "ellipsoid": mw.Ellipsoid((r, 0.8 * r, 4.0 * r)),
        "capsule": mw.Capsule(r, 0.05),
        "torus": mw.Torus(0.04, 0.012),
    }
    return made[kind]


def turned(rng: np.random.Generator) -> Vector:
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def motion(rng: np.random.Generator, centre: float, poses: int = POSES) -> Vector:
    """Return a smooth motion (T, 3) around a point of the x axis [m]."""
    t = np.linspace(0.0, 0.7, poses)[:, None, None] * np.array([1.0, 2.0, 3.0])
    waves = rng.uniform(-0.05, 0.05, (3, 3)) * np.sin(2.0 * math.pi * t + rng.uniform(0.0, 6.3, (3, 3)))
    return np.array([centre, 0.0, 0.0]) + waves.sum(axis=2)


def scene(kinds: list[str], rng: np.random.Generator) -> tuple[list[mw.Obstacle], Vector, Vector]:
    """Return a row of obstacles that do not overlap, and motions of both ends around it."""
    far = 0.16 * (len(kinds) + 1) / 2
    row = []
    for i, kind in enumerate(kinds):
        place = np.array([0.16 * (i + 1) - far, 0.0, 0.0]) + rng.uniform(-0.01, 0.01, 3)
        # axes across the row, so that endless surfaces do not meet
        axis = np.array([rng.uniform(-0.1, 0.1), *rng.normal(size=2)])
        axis[1:] *= 1.0 / np.linalg.norm(axis[1:])
        quat = turned(rng) if len(kinds) == 1 else across(axis)
        row.append(
            mw.Obstacle(
                surface(kind, rng), pos=tuple(place), quat=tuple(quat), side=tuple(rng.normal(size=3))
            )
        )
    return row, motion(rng, -far), motion(rng, far)


def across(axis: Vector) -> Vector:
    """Return the quaternion that turns z into a direction."""
    axis = axis / np.linalg.norm(axis)
    q = np.array([1.0 + axis[2], -axis[1], axis[0], 0.0])
    return q / np.linalg.norm(q)


def over_cylinder(a: Vector, b: Vector, radius: float, side: float) -> float:
    """Return the length over a cylinder about z that never crosses the half plane away from the azimuth `side`."""
    angles = [(math.atan2(p[1], p[0]) - side + math.pi) % (2.0 * math.pi) - math.pi for p in (a, b)]
    roots = [math.sqrt(p[0] ** 2 + p[1] ** 2 - radius**2) for p in (a, b)]
    arc = abs(angles[1] - angles[0]) - sum(math.atan2(root, radius) for root in roots)
    if arc <= 0.0:
        return float(np.linalg.norm(b - a))
    return math.hypot(sum(roots) + radius * arc, b[2] - a[2])


@pytest.mark.parametrize("warm", [False, True])
def test_a_cylinder_is_passed_without_crossing_the_half_plane(warm: bool) -> None:
    """Ends anywhere around it, also such that the string winds by more than half a turn."""
    rng, long, start = np.random.default_rng(0), 0, None
    for _ in range(300):
        side, radius = rng.uniform(-math.pi, math.pi), rng.uniform(0.01, 0.03)
        obstacle = mw.Obstacle(
            mw.Cylinder(radius), side=(0.1 * math.cos(side), 0.1 * math.sin(side), rng.uniform(-1.0, 1.0))
        )
        azimuth, far, rise = (
            rng.uniform(-math.pi, math.pi, 2),
            rng.uniform(0.035, 0.2, 2),
            rng.uniform(-0.1, 0.1, 2),
        )
        a, b = (
            np.array([f * math.cos(t), f * math.sin(t), z])
            for t, f, z in zip(azimuth, far, rise, strict=True)
        )
        path = mw.solve_path(a, b, [obstacle], start=start)
        assert path.converged
        assert path.hints_met == [True]
        assert path.length == pytest.approx(over_cylinder(a, b, radius, side), abs=1e-12)
        long += abs(path._node[0, 25]) > math.pi  # S_SWEEP
        start = path if warm else None
    assert long > 20


@pytest.mark.parametrize("kinds", [*([kind] for kind in KINDS), *ROWS], ids=" ".join)
def test_warm_is_cold(kinds: list[str]) -> None:
    """The length is a function of the pose, whatever was solved before."""
    rng, touched = np.random.default_rng(1), 0
    for _ in range(4):
        row, a, b = scene(kinds, rng)
        start = None
        for here, there in zip(a, b, strict=True):
            warm, cold = mw.solve_path(here, there, row, start=start), mw.solve_path(here, there, row)
            assert warm.status == cold.status
            assert not warm.converged or warm.length == pytest.approx(cold.length, abs=1e-9)
            touched += warm.converged and any(contact.active for contact in warm.contacts)
            start = warm if warm.converged else None
    assert touched > 40


@pytest.mark.parametrize("kind", KINDS)
def test_a_sweep_is_its_poses(kind: str) -> None:
    rng = np.random.default_rng(2)
    row, a, b = scene([kind], rng)
    pos, quat = np.tile(row[0].pos, (POSES, 1, 1)), np.tile(row[0].quat, (POSES, 1, 1))
    swept = mw.solve_sweep(a, b, row, pos, quat)
    for k in range(POSES):
        path = mw.solve_path(a[k], b[k], row)
        assert swept.status[k] == path.status
        if path.converged:
            assert swept.length[k] == pytest.approx(path.length, abs=1e-9)


@pytest.mark.parametrize(
    "kinds",
    [["cylinder"], ["elliptic cylinder"], ["cone"], ["ellipsoid"], ["capsule"], *ROWS[:2]],
    ids=" ".join,
)
def test_the_reversed_route_is_the_same_path(kinds: list[str]) -> None:
    rng, seen = np.random.default_rng(3), 0
    for _ in range(4):
        row, a, b = scene(kinds, rng)
        for here, there in zip(a[::3], b[::3], strict=True):
            path, back = mw.solve_path(here, there, row), mw.solve_path(there, here, row[::-1])
            if path.converged and back.converged:
                seen += 1
                assert back.length == pytest.approx(path.length, abs=1e-9)
    assert seen > 40


@pytest.mark.parametrize("kind", KINDS)
def test_a_mirrored_scene_has_the_mirrored_path(kind: str) -> None:
    """Everything mirrored at the plane y = 0; the surfaces are their own mirror images in their frames."""
    rng, seen = np.random.default_rng(4), 0
    flip = np.array([1.0, -1.0, 1.0])
    for _ in range(4):
        row, a, b = scene([kind], rng)
        one = row[0]
        assert one.side is not None
        w, x, y, z = one.quat
        other = mw.Obstacle(
            one.surface, pos=tuple(flip * one.pos), quat=(w, -x, y, -z), side=tuple(flip * one.side)
        )
        for here, there in zip(a, b, strict=True):
            path, image = mw.solve_path(here, there, row), mw.solve_path(flip * here, flip * there, [other])
            assert path.status == image.status
            if path.converged:
                seen += path.contacts[0].active
                assert image.length == pytest.approx(path.length, abs=1e-9)
    assert seen > 20


@pytest.mark.parametrize("kind", ["cylinder", "elliptic cylinder", "cone"])
def test_the_length_jumps_only_where_an_end_crosses_the_half_plane(kind: str) -> None:
    """Length changes by no more than the ends move, except there, where it must jump for a string that touches."""
    rng, jumps = np.random.default_rng(5), 0
    for _ in range(24):
        row, a, b = scene([kind], rng)
        one, before = row[0], None
        for k in range(POSES):
            path = mw.solve_path(a[k], b[k], row)
            angles = [_azimuth(one, point) for point in (a[k], b[k])]
            if before is not None and path.converged and before[0].converged:
                step = np.linalg.norm(a[k] - a[k - 1]) + np.linalg.norm(b[k] - b[k - 1])
                crossed = any(abs(x - y) > math.pi for x, y in zip(angles, before[1], strict=True))
                jumped = abs(path.length - before[0].length) > step + 1e-9
                assert crossed or not jumped
                jumps += jumped
            before = path, angles
    assert jumps >= 2


def _azimuth(obstacle: mw.Obstacle, point: Vector) -> float:
    """Return the angle about the obstacle's axis from its side to a point of the world, within half a turn [rad]."""
    w, *v = obstacle.quat
    out = point - np.array(obstacle.pos)
    # turned back by the conjugate quaternion
    out = out + 2.0 * np.cross(-np.array(v), np.cross(-np.array(v), out) + w * out)
    assert obstacle.side is not None
    ux, uy, _ = obstacle.side
    a, b = getattr(obstacle.surface, "radii", (1.0, 1.0))
    return math.atan2((ux * out[1] - uy * out[0]) / (a * b), ux * out[0] / a**2 + uy * out[1] / b**2)


def test_a_hint_between_sides_is_followed_and_the_sides_are_held() -> None:
    """A string sinks below a row of drums: two hold it from above, the one with a hint below is passed there."""
    drum = mw.Cylinder(0.02)
    row = [
        mw.Obstacle(drum, pos=(-0.15, 0.0, 0.0), side=(0.0, 1.0, 0.0)),
        mw.Obstacle(drum, pos=(0.0, 0.0, 0.0), hint=(0.0, -0.02, 0.0)),
        mw.ViaPoint((0.08, 0.0, 0.0)),
        mw.Obstacle(drum, pos=(0.15, 0.0, 0.0), side=(0.0, 1.0, 0.0)),
    ]
    start = None
    for k in range(41):
        y = 0.03 - 0.004 * k
        a, b = np.array([-0.3, y, 0.01]), np.array([0.3, y, -0.02])
        path = mw.solve_path(a, b, row, start=start)
        assert path.converged
        assert path.hints_met[0]
        assert path.hints_met[3]
        part = over_cylinder(np.array([-0.07, 0.0, 0.0]), b - [0.15, 0.0, 0.0], 0.02, math.pi / 2)
        front = mw.solve_path(a, (0.08, 0.0, 0.0), row[:2])
        assert path.length == pytest.approx(front.length + part, abs=1e-9)
        start = path
    assert [contact.active for contact in path.contacts] == [True, True, True, True]


def test_differences_give_the_speed() -> None:
    """Moving ends: the lengthening speed is the derivative of the length, on every side."""
    rng, seen = np.random.default_rng(6), 0
    for kind in KINDS:
        row, a, b = scene([kind], rng)
        for k in range(0, POSES, 6):
            u, v = rng.normal(size=3), rng.normal(size=3)
            path, h = mw.solve_path(a[k], b[k], row), 1e-6
            ahead, behind = (mw.solve_path(a[k] + s * h * u, b[k] + s * h * v, row) for s in (1.0, -1.0))
            if path.converged and path.contacts[0].active:
                seen += 1
                assert path.speed(u, v) == pytest.approx((ahead.length - behind.length) / (2.0 * h), abs=1e-6)
    assert seen > 25


def test_a_string_that_no_side_can_hold_says_so() -> None:
    """A sphere is passed the short way, a mild ellipsoid where a string can lie; the path is converged all the same."""
    for shape in (mw.Sphere(0.03), mw.Ellipsoid((0.03, 0.031, 0.03))):
        for x, met in ((-0.02, False), (0.02, True)):
            path = mw.solve_path(
                (x, -0.08, 0.004), (x, 0.075, 0.0), [mw.Obstacle(shape, side=(1.0, 0.0, 0.0))]
            )
            assert path.converged
            assert path.contacts[0].active
            assert path.hints_met == [met]


def _surface_of(row: dict[str, Any]) -> Surface:
    sizes = row["sizes"]
    made = {"WrapCylinder": lambda: mw.Cylinder(*sizes), "WrapSphere": lambda: mw.Sphere(*sizes)}
    return made.get(row["kind"], lambda: mw.Ellipsoid(tuple(sizes)))()


@pytest.mark.parametrize(
    "row", OSIM["strings"], ids=lambda row: f"{row['kind']} {row['sizes']} {row['side']}"
)
def test_strings_pass_where_opensim_holds_them(row: dict[str, Any]) -> None:
    """Where a geodesic exists on the allowed half it has OpenSim's length, within the 0.5 mm at which OpenSim stops.

    Where the straight line misses a sphere or an ellipsoid OpenSim lets it go; mjwrap holds it where a string can lie.
    """
    obstacle, held = mw.Obstacle(_surface_of(row), side=tuple(row["side"])), 0
    for pose in row["poses"]:
        path = mw.solve_path(pose["a"], pose["b"], [obstacle])
        straight = math.dist(pose["a"], pose["b"])
        let_go = row["kind"] != "WrapCylinder" and pose["length"] == pytest.approx(straight, abs=1e-12)
        assert path.converged
        if path.hints_met[0] and not (let_go and path.contacts[0].active):
            assert path.length == pytest.approx(
                pose["length"], abs=5e-4 if "Ellipsoid" in row["kind"] else 1e-6
            )
            held += path.contacts[0].active
    assert held >= 6


@pytest.mark.parametrize("muscle", ["BIClong", "TRIlong"])
def test_muscles_of_arm26_pass_where_opensim_holds_them(muscle: str) -> None:
    """Over the ranges of both coordinates, between the points that OpenSim's path has next to the wrap.

    One pose is left out: at the end of the shoulder's range the middle of the biceps's contact has left the half.
    """
    seen = 0
    for row in (row for row in OSIM["muscles"] if row["muscle"] == muscle and row["wrap"] != "TRIlonghh"):
        obstacle = mw.Obstacle(_surface_of(row), side=tuple(row["side"]))
        for pose in row["poses"]:
            if muscle == "BIClong" and pose["value"] < -1.5:
                continue
            path = mw.solve_path(pose["a"], pose["b"], [obstacle])
            assert path.converged
            assert path.hints_met == [True]
            assert path.contacts[0].active
            assert path.length == pytest.approx(pose["length"], abs=1e-5 if muscle == "BIClong" else 1e-3)
            seen += 1
    assert seen >= 6


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"side": (0.0, 0.0, 1.0)}, "on the axis"),
        ({"side": (0.1, 0.0, 0.0), "hint": (0.1, 0.0, 0.0)}, "a side or a hint"),
        ({"side": (0.1, 0.0, 0.0), "inside": True}, "a side or inside"),
        ({"side": (0.1, 0.0)}, "side must have shape"),
        ({"side": (0.1, 0.0, math.nan)}, "side must be finite"),
    ],
)
def test_wrong_sides(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(mw.GeometryError, match=words):
        mw.Obstacle(mw.Cylinder(0.02), **arguments)
    with pytest.raises(mw.GeometryError, match="in the middle"):
        mw.Obstacle(mw.Sphere(0.02), side=(0.0, 0.0, 0.0))
