"""Check a surface r(u, v) before it is compiled, and find the constants of its module."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from mjwrap.errors import GeometryError
from mjwrap.surfaces.codegen.differences import Array, check
from mjwrap.surfaces.codegen.generate import Core, module_text, plain, without_imports
from mjwrap.surfaces.codegen.source import call

_GRID = 33  # points along each range at which the surface is checked
_CHECKED = 16  # places at which derivatives are checked
_CLOSED = 1e-9  # a range is periodic if its ends differ by less than this share of the surface's extent
_NEARLY = 1e-2  # ... and was probably meant to be periodic if they differ by less than this share
_SINGULAR = 1e-4  # smallest |r_u x r_v|, relative to the median
_UNCLEAR = 0.05  # if a larger share faces towards the surface's middle, the outer side is not known
_RESOLUTIONS = (8, 12, 16, 24, 32, 48)  # numbers of samples from which a search starts
_TRIALS = 40


class Chart(NamedTuple):
    """The bounds of a chart."""

    low: tuple[float, float]
    high: tuple[float, float]
    periodic: tuple[bool | None, bool | None]  # None: to be found
    outward: int | None  # sign of the outward normal along r_u x r_v; None: to be found


def constants(core: Core, r: Callable[..., Any], chart: Chart, size: float | None) -> dict[str, Any]:
    """Check a surface over its ranges; return the constants of its module.

    r: the user's function; size [m]: None to find it. Raises `GeometryError` if the surface is not smooth.
    """
    places = np.array([[_between(chart, i, j) for j in _shares()] for i in _shares()])  # (n, n, 2)
    points = np.array([[_point(r, place) for place in row] for row in places])
    values = np.array(
        [[np.array(core.python.chart(*p), dtype=float).reshape(6, 3) for p in row] for row in places]
    )
    _check_derivatives(core, r, chart)
    normals = np.cross(values[..., 1, :], values[..., 2, :])
    area = np.linalg.norm(normals, axis=-1)
    if not area.min() > _SINGULAR * np.median(area):
        u, v = places[np.unravel_index(np.argmin(area), area.shape)]
        raise GeometryError(
            f"r: r_u x r_v vanishes or is not finite at u = {u:.6g}, v = {v:.6g} (a pole of the chart?): choose a "
            "range without this point, or give the surface as an ImplicitSurface"
        )
    extent = float(np.ptp(points.reshape(-1, 3), axis=0).max())
    periodic = tuple(_closes(points, values, axis, chart.periodic[axis], extent) for axis in (0, 1))
    radius = _smallest_radius(values, normals / area[..., None])
    found = {
        "U_LOW": chart.low[0],
        "U_HIGH": chart.high[0],
        "V_LOW": chart.low[1],
        "V_HIGH": chart.high[1],
        "PERIODIC_U": periodic[0],
        "PERIODIC_V": periodic[1],
        "REACH": _reach(points) if all(periodic) else math.inf,
        "SIGN": float(chart.outward or _outward(points, normals)),
        "SIZE": min(radius, extent) if size is None else size,
    }
    lengths = [
        float(np.linalg.norm(values[..., 1 + axis, :], axis=-1).mean()) * _width(chart, axis)
        for axis in (0, 1)
    ]
    return found | _samples(core, r, chart, found, lengths)


def _shares() -> Array:
    return np.linspace(0.0, 1.0, _GRID)


def _width(chart: Chart, axis: int) -> float:
    return chart.high[axis] - chart.low[axis]


def _between(chart: Chart, i: float, j: float) -> tuple[float, float]:
    """Return u and v at shares of their ranges; the ends are exact."""
    u, v = (
        (1.0 - share) * low + share * high
        for share, low, high in zip((i, j), chart.low, chart.high, strict=True)
    )
    return float(u), float(v)


def _point(r: Callable[..., Any], place: Array) -> list[float]:
    value = call(r, *map(float, place))
    at = f"u = {place[0]:.6g}, v = {place[1]:.6g}"
    if not isinstance(value, tuple) or len(value) != 3:
        if isinstance(value, float) and math.isnan(value):
            raise GeometryError(f"r is not finite at {at}")
        raise GeometryError(f"r must return a tuple (x, y, z), not {value!r} at {at}")
    if any(isinstance(x, complex) or not isinstance(x, int | float | np.number) for x in value):
        raise GeometryError(f"r must return three real numbers, not {value!r} at {at}")
    if not all(math.isfinite(x) for x in value):
        raise GeometryError(f"r is not finite at {at}: {value!r}")
    return [float(x) for x in value]


def _check_derivatives(core: Core, r: Callable[..., Any], chart: Chart) -> None:
    """Raise `GeometryError` if a derivative differs from differences."""

    def part(first: int, last: int) -> Callable[[Array], Array]:
        return lambda p: np.array(core.python.chart(*p.tolist()), dtype=float).reshape(6, 3)[first:last]

    places = [np.array(place) for place in scattered(chart, _CHECKED)]
    steps = [min(1.0, _width(chart, 0)), min(1.0, _width(chart, 1))]
    names = [f"{axis} of r_{by}" for by in "uv" for axis in "xyz"]
    check(lambda p: np.array(_point(r, p)), part(1, 3), places, steps, names)
    for letter, first in (("u", 0), ("v", 1)):
        names = [
            f"{axis} of r_{by}" for by in (("uu", "uv") if letter == "u" else ("uv", "vv")) for axis in "xyz"
        ]
        value, derivative = part(1 + first, 2 + first), part(3 + first, 5 + first)
        check(lambda p, f=value: f(p)[0], derivative, places, steps, names)


def scattered(chart: Chart, count: int) -> list[tuple[float, float]]:
    """Return points that fill the ranges evenly without a grid (additive recurrence of the plastic number)."""
    root = 1.32471795724474602596
    return [_between(chart, (0.5 + k / root) % 1.0, (0.5 + k / root**2) % 1.0) for k in range(1, count + 1)]


def _closes(points: Array, values: Array, axis: int, wanted: bool | None, extent: float) -> bool:
    """Return whether a range is smoothly periodic; `GeometryError` if it is only nearly so, or not as `wanted`."""
    first, last = (np.take(points, i, axis) for i in (0, -1))
    gap = float(np.linalg.norm(first - last, axis=-1).max()) / extent
    rate = np.abs(np.take(values, 0, axis) - np.take(values, -1, axis)).max(axis=(0, 2))
    smooth = (rate <= 1e-6 * np.abs(values).max(axis=(0, 1, 3))).all()
    name = "uv"[axis]
    if wanted is None and _CLOSED < gap <= _NEARLY:
        raise GeometryError(
            f"r: the ends of {name}_range are nearly the same points ({gap:.2g} of the surface's extent apart). "
            "Give the exact period, as in (0, math.tau), or declare the range open with periodic=..."
        )
    closed = gap <= _CLOSED and bool(smooth)
    if wanted and not closed:
        raise GeometryError(
            f"r is not periodic in {name}: both ends of {name}_range must be the same points, smoothly"
        )
    return closed if wanted is None else wanted


def _reach(points: Array) -> float:
    """Return the radius of a sphere about the origin that contains a closed surface [m]."""
    apart = max(float(np.linalg.norm(np.diff(points, axis=axis), axis=-1).max()) for axis in (0, 1))
    return float(np.linalg.norm(points, axis=-1).max()) + 0.5 * apart


def _outward(points: Array, normals: Array) -> int:
    """Return the sign of r_u x r_v that points away from the surface's middle."""
    middle = points.reshape(-1, 3).mean(axis=0)
    facing = ((points - middle) * normals).sum(axis=-1)
    share = float(facing.sum() / max(np.abs(facing).sum(), 1e-300))
    if abs(share) < _UNCLEAR:
        raise GeometryError(
            "r: the outer side cannot be found from the shape; give outward=1 if r_u x r_v points outward, else "
            "outward=-1"
        )
    return 1 if share > 0.0 else -1


def _smallest_radius(values: Array, normals: Array) -> float:
    """Return the smallest radius of curvature on the grid [m]."""
    ru, rv, ruu, ruv, rvv = (values[..., i, :] for i in range(1, 6))
    e, f, g = ((a * b).sum(axis=-1) for a, b in ((ru, ru), (ru, rv), (rv, rv)))
    l, m, n = ((a * normals).sum(axis=-1) for a in (ruu, ruv, rvv))
    square = e * g - f * f
    mean, gauss = 0.5 * (e * n - 2.0 * f * m + g * l) / square, (l * n - m * m) / square
    largest = np.abs(mean) + np.sqrt(np.maximum(mean * mean - gauss, 0.0))
    return 1.0 / max(float(largest.max()), 1e-300)


def _samples(
    core: Core, r: Callable[..., Any], chart: Chart, found: dict[str, Any], lengths: list[float]
) -> dict[str, Any]:
    """Return points from which the search of the nearest point starts, as few as are sufficient near the surface."""
    made: dict[str, Any] = {}
    for resolution in _RESOLUTIONS:
        ratio = min(max(math.sqrt(lengths[0] / lengths[1]), 0.25), 4.0)
        counts = max(4, round(resolution * ratio)), max(4, round(resolution / ratio))
        rows = []
        for i in range(counts[0]):
            for j in range(counts[1]):
                place = _between(chart, (i + 0.5) / counts[0], (j + 0.5) / counts[1])
                rows.append([*place, *_point(r, np.array(place))])
        made = {
            "STRIDE_U": 2.0 * _width(chart, 0) / counts[0],
            "STRIDE_V": 2.0 * _width(chart, 1) / counts[1],
            "SAMPLES": np.array(rows),
        }
        module = plain(without_imports(module_text("parametric", core, found | made)))
        if _finds_all(module, chart, found["SIZE"]):
            break
    return made


def _finds_all(module: SimpleNamespace, chart: Chart, size: float) -> bool:
    """Return whether the search finds the nearest points of points near the surface."""
    out = [0.0] * 6
    for k, place in enumerate(scattered(chart, _TRIALS)):
        x, y, z, xu, yu, zu, xv, yv, zv, *_ = module.chart(*place)
        nx, ny, nz = module.normal(xu, yu, zu, xv, yv, zv)
        off = (0.0, 0.45, -0.45)[k % 3] * size
        x, y, z = x + off * nx, y + off * ny, z + off * nz
        module.project(x, y, z, out)
        if not math.dist((x, y, z), out[:3]) <= abs(off) + 1e-9 * size:
            return False
    return True
