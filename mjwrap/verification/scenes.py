"""Scenes for the path tests, and geometry written without the package's kernels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import mjwrap as mw
from mjwrap.surfaces import Surface
from mjwrap.verification.certificate import Case, findings, rotation
from mjwrap.verification.shapes import SHAPES, Array, sizes

SURFACES = {"cylinder": mw.Cylinder, "sphere": mw.Sphere, "ellipsoid": mw.Ellipsoid, "torus": mw.Torus}
# cylinder, sphere, ellipsoid, elliptic cylinder, cone, torus, capsule; L: elliptic cylinder of aspect 5 to 100
LETTERS = "cselktp"
REACH = 0.25  # length of a surface of a row, from its centre along its axis, that is considered [m]
MARGIN = 2e-3  # distance between surfaces of a row: more than the error of `gap` [m]


def radius_of(obstacle: mw.Obstacle) -> float:
    """Return the radius of a cylinder or sphere [m]."""
    assert isinstance(obstacle.surface, mw.Cylinder | mw.Sphere)
    return obstacle.surface.dims[0]


def local(obstacle: mw.Obstacle, points: Array) -> Array:
    """Return world points (m, 3) in an obstacle's frame."""
    return (np.atleast_2d(points) - obstacle.pos) @ rotation(obstacle.quat)


def height(obstacle: mw.Obstacle, points: Array) -> Array:
    """Return the distance of points (m, 3) from an obstacle's surface, positive outside [m]."""
    return SHAPES[type(obstacle.surface)].height(sizes(obstacle.surface), local(obstacle, points))


def nearest(obstacle: mw.Obstacle, points: Array) -> Array:
    """Return the points (m, 3) of an obstacle's surface nearest to points (m, 3)."""
    found = SHAPES[type(obstacle.surface)].nearest(sizes(obstacle.surface), local(obstacle, points))
    return found @ rotation(obstacle.quat).T + obstacle.pos


def outward(obstacle: mw.Obstacle, points: Array) -> Array:
    """Return the outward normals (m, 3) of an obstacle at, or nearest to, points (m, 3)."""
    shape, d = SHAPES[type(obstacle.surface)], sizes(obstacle.surface)
    return shape.normal(d, shape.nearest(d, local(obstacle, points))) @ rotation(obstacle.quat).T


def _axes_apart(a: mw.Obstacle, b: mw.Obstacle) -> float:
    """Return the distance between two centres or axes of cylinders and spheres [m]."""
    offset = np.subtract(b.pos, a.pos)
    axes = [rotation(o.quat)[:, 2] for o in (a, b) if isinstance(o.surface, mw.Cylinder)]
    if len(axes) == 2:
        normal = np.cross(axes[0], axes[1])
        size = float(np.linalg.norm(normal))
        if size > 1e-9:
            return abs(float(offset @ normal)) / size
    for axis in axes[:1]:
        offset = offset - (offset @ axis) * axis
    return float(np.linalg.norm(offset))


def balls(obstacle: mw.Obstacle) -> tuple[Array, Array]:
    """Return centres (m, 3) and radii (m) of balls that together fill a surface, within REACH of its centre [m]."""
    surface, z = obstacle.surface, np.linspace(-REACH, REACH, 61)
    axis = np.stack([0.0 * z, 0.0 * z, z], 1)
    match surface:
        case mw.Sphere():
            centres, radii = np.zeros((1, 3)), np.array([surface.radius])
        case mw.Cylinder():
            centres, radii = axis, np.full(len(z), surface.radius)
        case mw.Cone():
            d = sizes(surface)
            centres, radii = axis, np.maximum(d[0] + d[1] * z, 0.0) / np.hypot(1.0, d[1])
        case mw.Capsule():
            centres = axis * surface.half_length / REACH
            radii = np.full(len(z), surface.radius)
        case mw.Torus():
            angle = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
            centres = surface.major_radius * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], 1)
            radii = np.full(64, surface.minor_radius)
        case mw.EllipticCylinder():
            section, radii = _filled(np.array(surface.radii), _spread_circle())
            centres = (np.pad(section, ((0, 0), (0, 1)))[:, None] + axis).reshape(-1, 3)
            radii = np.repeat(radii, len(z))
        case mw.Ellipsoid():
            centres, radii = _filled(np.array(surface.radii), _spread_ball())
        case _:
            raise TypeError(f"no balls are known for {surface!r}")
    return centres @ rotation(obstacle.quat).T + obstacle.pos, radii


def _spread_circle() -> Array:
    """Return 16 unit vectors in a plane."""
    angle = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    return np.stack([np.cos(angle), np.sin(angle)], 1)


def _spread_ball() -> Array:
    """Return 144 unit vectors, evenly spread."""
    k = np.arange(144) + 0.5
    z, angle = 1.0 - 2.0 * k / 144, k * np.pi * (3.0 - np.sqrt(5.0))
    return np.stack([np.cos(angle) * np.sqrt(1 - z * z), np.sin(angle) * np.sqrt(1 - z * z), z], 1)


def _filled(axes: Array, directions: Array) -> tuple[Array, Array]:
    """Return the balls that touch an ellipsoid (or ellipse) from inside, centred in its middle plane."""
    touch = axes * directions
    centres = touch * (1.0 - axes.min() ** 2 / axes**2)
    return centres, np.linalg.norm(touch - centres, axis=1)


def gap(a: mw.Obstacle, b: mw.Obstacle) -> float:
    """Return the distance between two surfaces within REACH of their centres, to about a millimetre [m]."""
    if isinstance(b.surface, mw.Ellipsoid | mw.EllipticCylinder):
        a, b = b, a  # heights of the other shapes are cheaper
    centres, radii = balls(a)
    return float((height(b, centres) - radii).min())


def _clear(a: mw.Obstacle, b: mw.Obstacle) -> bool:
    """Return whether two surfaces of a row leave a gap."""
    if isinstance(a.surface, mw.Cylinder | mw.Sphere) and isinstance(b.surface, mw.Cylinder | mw.Sphere):
        return _axes_apart(a, b) > 1.05 * (radius_of(a) + radius_of(b))
    return a.pos[0] - b.pos[0] > 2.0 * REACH or gap(a, b) > MARGIN


def random_surface(rng: np.random.Generator, letter: str, largest: float = 1.0) -> Surface:
    """Return a surface at muscle scale, radii 1 to 5 cm: a letter of LETTERS; largest (0 to 1) limits its size."""

    def size(low: float, high: float) -> float:
        return float(rng.uniform(low, low + largest * (high - low)))

    match letter:
        case "c":
            return mw.Cylinder(size(0.01, 0.045))
        case "s":
            return mw.Sphere(size(0.01, 0.045))
        case "e":
            return mw.Ellipsoid((size(0.01, 0.05), size(0.01, 0.05), size(0.01, 0.05)))
        case "l":
            return mw.EllipticCylinder((size(0.01, 0.05), size(0.01, 0.05)))
        case "t":
            major = size(0.018, 0.05)
            return mw.Torus(major, rng.uniform(0.006, 0.6 * major))
        case "k":
            bottom = size(0.015, 0.045)
            return mw.Cone(bottom, rng.uniform(0.2, 0.8) * bottom, rng.uniform(0.08, 0.2))
        case "L":
            long = size(0.01, 0.05)
            short = long / float(np.exp(rng.uniform(np.log(5.0), np.log(100.0))))
            return mw.EllipticCylinder((long, short) if rng.random() < 0.5 else (short, long))
        case "p":
            return mw.Capsule(size(0.01, 0.04), size(0.01, 0.05))
    raise ValueError(f"surface letter must be one of {LETTERS}, not {letter!r}")


def point_towards(surface: Surface, direction: Array) -> Array:
    """Return a point (3,) of a surface, in its frame, on the side of a unit vector [m]."""
    if isinstance(surface, mw.Cylinder | mw.Sphere):
        return direction * surface.radius  # on the sphere; for a cylinder inside it, on that side
    return SHAPES[type(surface)].nearest(sizes(surface), 0.05 * direction[None])[0]


def random_scene(rng: np.random.Generator, kinds: str, hints: bool) -> tuple[Array, Array, list[mw.Obstacle]]:
    """Return origin, insertion and obstacles in a row at muscle scale, none overlapping.

    kinds: one letter of LETTERS per obstacle. Axes are tilted by about 0.4 rad; ellipsoids, tori and capsules are
    turned any way. Hints are random points of the surfaces.
    """
    while True:
        spacing = rng.uniform(0.06, 0.12)
        row: list[mw.Obstacle] = []
        for k, letter in enumerate(kinds):
            for attempt in range(100):
                surface = random_surface(rng, letter, 1.0 if letter in "cs" else 1.0 - 0.01 * attempt)
                pos = [(k + rng.uniform(0.9, 1.1)) * spacing, *rng.uniform(-0.03, 0.03, 2)]
                hint = None
                if hints:
                    direction = rng.normal(size=3)
                    hint = tuple(point_towards(surface, direction / np.linalg.norm(direction)))
                quat = (1.0, *(0.2 * rng.normal(size=3))) if letter in "cslk" else tuple(rng.normal(size=4))
                obstacle = mw.Obstacle(surface, tuple(pos), quat, hint)
                if all(_clear(obstacle, other) for other in reversed(row)):
                    row.append(obstacle)
                    break
            if len(row) == k:
                break
        ends = np.array(
            [[0.0, *rng.uniform(-0.03, 0.03, 2)], [(len(kinds) + 1) * spacing, *rng.uniform(-0.03, 0.03, 2)]]
        )
        if len(row) == len(kinds) and all((height(o, ends) > 1e-3).all() for o in row):
            return ends[0], ends[1], row


def check_path(
    origin: Array, insertion: Array, obstacles: Sequence[mw.Obstacle | mw.ViaPoint], sol: mw.PathSolution
) -> None:
    """Assert from the solution alone that it is a tangent, geodesic path above all surfaces and a local minimum."""
    reason = findings([Case.of(origin, insertion, obstacles, sol)])[0]
    assert not reason, reason
