"""Curves of muscles in memory, which the kernels read by their address; muscles with equal curves share them.

A model's parameters are numbers in arrays that are copied, also by MuJoCo. So an address must stay right as long as the
process lives, and what is made here is kept until its end: about 15 kB for each different curve.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np

from mjwrap.errors import ModelError
from mjwrap.kernels.musculotendon import bezier_shapes, bezier_tables, ligament, own_curves, thelen
from mjwrap.kernels.musculotendon.curve_memory import LARGEST_ADDRESS

_kept: dict[Any, np.ndarray[Any, np.dtype[np.float64]]] = {}


def _address(key: Any, make: Callable[[], Any]) -> float:
    """Return the address of an array for a key, made once."""
    if key not in _kept:
        _kept[key] = np.ascontiguousarray(make(), dtype=np.float64)
    address = int(_kept[key].ctypes.data)
    if not 0 < address < LARGEST_ADDRESS:
        raise ModelError(f"curves lie at address {address} in memory, which mjwrap cannot keep exactly")
    return float(address)


def millard(
    active: tuple[float, ...],
    velocity: tuple[float, ...],
    passive: tuple[float, ...],
    tendon: tuple[float, ...],
) -> float:
    """Return the address of a set of Millard's curves from all their parameters, in OpenSim's order."""
    shapes = bezier_shapes.active, bezier_shapes.velocity, bezier_shapes.passive, bezier_shapes.tendon
    tables = [
        _address((shape.__name__, values), lambda s=shape, v=values: bezier_tables.table(s(*v)))
        for shape, values in zip(shapes, (active, velocity, passive, tendon), strict=True)
    ]
    longest_start = 1.0 + 1.6 * tendon[0]
    return _address(("millard", *tables), lambda: [own_curves.BEZIER, longest_start, *tables])


def thelen_2003(
    tendon_strain: float,
    fiber_strain: float,
    active_shape: float,
    passive_shape: float,
    velocity_shape: float,
    most: float,
    threshold: float,
) -> float:
    """Return the address of Thelen's constants, in the order of OpenSim's properties."""
    shapes = active_shape, passive_shape, fiber_strain, velocity_shape, most, threshold
    constants = (
        own_curves.THELEN,
        1.0 + 1.6 * tendon_strain,
        *shapes,
        *thelen.tendon_constants(tendon_strain),
    )
    return _address(("thelen", *constants), lambda: constants)


def ligament_curve(breaks: list[float], origins: list[float], coefficients: list[list[float]]) -> float:
    """Return the address of a ligament's curve of cubic pieces, its negative parts replaced by zero.

    breaks (P - 1,) between pieces; origins (P,) and coefficients (P, 4), the constant first, of polynomials in x -
    origin; the first and the last piece have no ends.
    """
    ends = [-np.inf, *breaks, np.inf]
    pieces: list[list[float]] = []
    for k, (origin, row) in enumerate(zip(origins, coefficients, strict=True)):
        pieces += _rectified(ends[k], ends[k + 1], origin, row)
    # constants that make the curve's integral continuous, and zero at one
    constants = [0.0]
    for piece, following in itertools.pairwise(pieces):
        start = following[0]
        constants.append(constants[-1] + _primitive(piece, start) - _primitive(following, start))
    starts = [piece[0] for piece in pieces]
    k = sum(start <= 1.0 for start in starts) - 1
    at_one = _primitive(pieces[k], 1.0) + constants[k]
    numbers = [float(len(pieces)), 0.0]
    for piece, end, constant in zip(pieces, [*starts[1:], np.inf], constants, strict=True):
        numbers += [end, *piece[1:], constant - at_one]
    return _address(("ligament", *numbers), lambda: numbers)


def _rectified(start: float, end: float, origin: float, row: list[float]) -> list[list[float]]:
    """Return the parts of a piece [start, origin, four coefficients]; where it is negative it becomes zero."""
    polynomial = np.polynomial.Polynomial(row).trim()
    roots = polynomial.roots() if polynomial.degree() > 0 else np.zeros(0)
    real = sorted(float(r.real) + origin for r in np.atleast_1d(roots) if abs(complex(r).imag) < 1e-12)
    cuts = [start, *(x for x in real if start < x < end), end]
    parts: list[list[float]] = []
    for low, high in itertools.pairwise(cuts):
        if not low < high:
            continue
        middle = (
            0.5 * (low + high)
            if np.isfinite(low + high)
            else (high - 1.0 if np.isfinite(high) else (low + 1.0 if np.isfinite(low) else origin))
        )
        positive = float(polynomial(middle - origin)) > 0.0
        parts.append([low, origin, *([float(c) for c in row] if positive else [0.0] * 4)])
    return parts


def _primitive(piece: list[float], x: float) -> float:
    """Return an integral of a piece at x, zero at its origin."""
    s = x - piece[1]
    return sum(c * s ** (i + 1) / (i + 1) for i, c in enumerate(piece[2:]))


assert thelen.SIZE == 10
assert own_curves.BEZIER_SIZE == 6
assert ligament.WIDTH == 7
