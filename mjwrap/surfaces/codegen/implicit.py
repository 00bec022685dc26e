"""Check a surface phi(x, y, z) = 0 before it is compiled, and find the constants of its module."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from mjwrap.errors import GeometryError
from mjwrap.surfaces.codegen.differences import Array, check
from mjwrap.surfaces.codegen.generate import Core
from mjwrap.surfaces.codegen.source import call

_GRID = 24  # points along each edge of the box
_SAMPLES = 120  # number of points of the surface that are kept
_CHECKED = 12  # number of these points at which derivatives are checked
_FLATTEST = 1e-9  # smallest gradient, relative to the largest


def constants(
    core: Core, phi: Callable[..., Any], extent: tuple[float, ...], size: float | None
) -> dict[str, Any]:
    """Check a surface within a box about the origin; return the constants of its module.

    phi: the user's function; extent (3,): half widths of the box [m]; size [m]: None to find it.
    Raises `GeometryError` if the surface is not smooth.
    """
    box = np.array(extent)
    grid, values = _grid_values(phi, box)
    points = _sign_changes(grid, values, box)
    samples = _on_surface(core, _spread(points, _SAMPLES), box)
    gradients = np.array([core.python.value(*p)[1:] for p in samples])
    steepness = np.linalg.norm(gradients, axis=1)
    if not steepness.min() > _FLATTEST * steepness.max():
        where = _words(samples[np.argmin(steepness)])
        raise GeometryError(
            f"phi: its gradient vanishes on the surface at {where}: the surface is not smooth there"
        )
    radii = np.array(
        [_smallest_radius(core, p, g / np.linalg.norm(g)) for p, g in zip(samples, gradients, strict=True)]
    )
    if not (radii > 0.0).all():
        raise GeometryError(
            f"phi: its second derivatives are not finite at {_words(samples[np.argmin(radii)])}"
        )
    found = min(float(radii.min()), float(box.min()))
    _check_derivatives(core, phi, samples[:: max(1, len(samples) // _CHECKED)], found)
    return {
        "SIZE": found if size is None else size,
        "BOX_X": extent[0],
        "BOX_Y": extent[1],
        "BOX_Z": extent[2],
        "REACH": _reach(grid, values),
        "FLOOR": 0.1 * float(steepness.min()),
        "SAMPLES": samples,
    }


def _grid_values(phi: Callable[..., Any], box: Array) -> tuple[Array, Array]:
    """Return the points of a grid over the box (n, n, n, 3) and phi there (n, n, n)."""
    axis = np.linspace(-1.0, 1.0, _GRID)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1) * box
    values = np.empty((_GRID, _GRID, _GRID))
    for place in np.ndindex(values.shape):
        value = call(phi, *grid[place].tolist())
        if isinstance(value, complex) or not isinstance(value, int | float | np.number):
            hint = "; a power of a negative number? use abs" if isinstance(value, complex) else ""
            raise GeometryError(f"phi must return one number, not {value!r} at {_words(grid[place])}{hint}")
        values[place] = value
    if not np.isfinite(values).all():
        where = grid[tuple(np.argwhere(~np.isfinite(values))[0])]
        raise GeometryError(
            f"phi is not finite at {_words(where)}; it must be in the whole box of half widths {_words(box)}"
        )
    return grid, values


def _reach(grid: Array, values: Array) -> float:
    """Return the radius of a sphere about the origin that contains the surface; infinite if it leaves the box."""
    inside = values < 0.0
    if any(np.take(inside, end, axis).any() for axis in range(3) for end in (0, -1)):
        return math.inf
    for axis in range(
        3
    ):  # neighbours of the inside points, so that bulges between points of the grid are contained too
        inside = inside | np.roll(inside, 1, axis) | np.roll(inside, -1, axis)
    return float(np.linalg.norm(grid[inside], axis=-1).max())


def _sign_changes(grid: Array, values: Array, box: Array) -> Array:
    """Return points (n, 3) near the surface, between neighbouring grid points at which phi has different signs."""
    found = []
    for direction in range(3):
        low, high = (np.take(values, range(i, _GRID - 1 + i), direction) for i in (0, 1))
        start, end = (np.take(grid, range(i, _GRID - 1 + i), direction) for i in (0, 1))
        changes = (low < 0.0) != (high < 0.0)
        share = (low[changes] / (low[changes] - high[changes]))[:, None]
        found.append(start[changes] + share * (end[changes] - start[changes]))
    points = np.concatenate(found)
    if len(points) == 0:
        sign = "negative" if values[0, 0, 0] < 0.0 else "positive"
        raise GeometryError(
            f"phi is {sign} in the whole box of half widths {_words(box)} [m]: it contains no surface. phi must be "
            "negative inside and positive outside; choose `extent` so that the box just contains the surface"
        )
    return points


def _spread(points: Array, count: int) -> Array:
    """Return `count` of the points (n, 3), as far from each other as possible."""
    chosen = [0]
    distance = np.linalg.norm(points - points[0], axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return points[chosen]


def _on_surface(core: Core, points: Array, box: Array) -> Array:
    """Return the points of the surface (n, 3) that Newton's method along the gradient finds from the given points."""
    found = []
    for point in points:
        p = point
        for _ in range(30):
            phi, *slope = np.array(call(core.python.value, *p.tolist()), ndmin=1)
            gradient = np.array(slope)
            if len(slope) != 3 or not np.isfinite([phi, *slope]).all() or not gradient.any():
                break
            step = phi / (gradient @ gradient) * gradient
            p = p - step
            if np.abs(step).max() < 1e-12 * box.max():
                found.append(p)
                break
    if len(found) < 0.5 * len(points):
        raise GeometryError(
            "phi: from most points near the surface, steps along the gradient do not reach it; phi must be smooth, "
            "with a gradient that does not vanish there"
        )
    return np.array(found)


def _smallest_radius(core: Core, p: Array, normal: Array) -> float:
    """Return the smallest radius of curvature at a point of the surface; 0 if it is not finite."""
    tangent = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    tangent /= np.linalg.norm(tangent)
    gx, gy, gz, xx, yy, zz, xy, xz, yz = _second(core, p)
    hessian = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    frame = np.array([tangent, np.cross(normal, tangent)])
    curvatures = frame @ hessian @ frame.T / np.linalg.norm([gx, gy, gz])
    if not np.isfinite(curvatures).all():
        return 0.0
    return 1.0 / max(float(np.abs(np.linalg.eigvalsh(curvatures)).max()), 1e-300)


def _second(core: Core, p: Array) -> Array:
    value = call(core.python.second, *p.tolist())
    return np.full(9, np.nan) if isinstance(value, float) else np.array(value)


def _check_derivatives(core: Core, phi: Callable[..., Any], places: Array, size: float) -> None:
    """Raise `GeometryError` if gradient or Hessian differ from differences of phi and of the gradient."""

    def gradient(p: Array) -> Array:
        return np.array(core.python.value(*p.tolist())[1:])

    def hessian(p: Array) -> Array:
        xx, yy, zz, xy, xz, yz = core.python.second(*p.tolist())[3:]
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    steps = [size] * 3
    names = [f"d phi/d{a}" for a in "xyz"]
    check(
        lambda p: np.array([call(phi, *p.tolist())]),
        lambda p: gradient(p)[:, None],
        list(places),
        steps,
        names,
    )
    names = [f"d2 phi/d{a}d{b}" for a in "xyz" for b in "xyz"]
    check(gradient, hessian, list(places), steps, names)


def _words(point: Array) -> str:
    return "(" + ", ".join(f"{number:.6g}" for number in point) + ")"
