"""Derivatives over time by splines of degree 5, and angular rates from quaternions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
DEGREE = 5
ENDS = ("not-a-knot", "natural")


def derivatives(time: Array, values: Array, ends: str) -> tuple[Array, Array]:
    """Return first and second derivative (T, m) of columns (T, m) at their own times (T,), by interpolating splines.

    ends: "not-a-knot": the first and the last pieces go on into their neighbours; with fewer than seven times, one
    polynomial. "natural": third and fourth derivative are zero at both ends, as of OpenSim's GCVSpline. At a single
    time, both derivatives are zero.
    """
    if len(time) < 2 or not values.shape[1]:
        return np.zeros_like(values), np.zeros_like(values)
    from scipy.interpolate import make_interp_spline

    if ends == "natural":
        none = np.zeros(values.shape[1])
        end = [(3, none), (4, none)]
        curve = make_interp_spline(time, values, k=DEGREE, bc_type=(end, end))
    elif len(time) > DEGREE + 1:
        curve = make_interp_spline(time, values, k=DEGREE)
    else:
        degree = len(time) - 1
        knots = np.repeat(time[[0, -1]], degree + 1)
        curve = make_interp_spline(time, values, k=degree, t=knots)
    rates: list[Array] = [
        curve.derivative(order)(time) if order <= curve.k else np.zeros_like(values) for order in (1, 2)
    ]
    return rates[0], rates[1]


def continuous(quaternion: Array) -> Array:
    """Return unit quaternions (T, 4) with the signs at which each is nearest to the one before."""
    unit = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
    turned = np.einsum("ti,ti->t", unit[1:], unit[:-1]) < 0.0
    signs = np.cumprod(np.concatenate([[1.0], np.where(turned, -1.0, 1.0)]))
    return unit * signs[:, None]


def angular_rates(unit: Array, rate: Array, second: Array) -> tuple[Array, Array]:
    """Return angular velocity and acceleration (T, 3) in the body's frame from quaternions (T, 4) and their rates.

    unit: of length 1 at these times; between them a spline's may have another, so only the direction counts:
    ω = 2 vec(q* q̇), α = 2 vec(q* q̈) − 2 (q · q̇) ω.
    """
    velocity = 2.0 * _vector(unit, rate)
    along = np.einsum("ti,ti->t", unit, rate)
    return velocity, 2.0 * _vector(unit, second) - 2.0 * along[:, None] * velocity


def _vector(unit: Array, other: Array) -> Array:
    """Return the vector part of q* p."""
    w, v, s, u = unit[:, :1], unit[:, 1:], other[:, :1], other[:, 1:]
    return w * u - s * v - np.cross(v, u)
